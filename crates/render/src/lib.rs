//! What is done with one frame around the network. Before it, pressure is checked, compared with the
//! training and limited to its range. After it, SED is scaled to the person's finger.
//!
//! To *render* is to compute the answer of a frame. Whoever renders owns [`Maps`] and an engine session: a thread of the service, or a program that
//! links the native library. Nothing here allocates after [`Maps::default`].
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))?;
//! use papilla_proto::{PressureRange, atlas::{Atlas, Patch, Raster}, effects::OutOfRange, flags};
//! use papilla_render::{Known, Maps, Read, Rendering, SkinPixels, Source};
//!
//! let atlas = Atlas::from_json(&std::fs::read_to_string("models/atlas.json")?)?;
//! let skin = SkinPixels::from(&Raster::new(&atlas, Patch::Skin));
//! let model = papilla_engine::load(&std::fs::read("models/nano.onnx")?, None)?;
//! let mut session = model.session()?;
//! let trained_max_pa = model.info().pressure_max_pa;
//! let range = PressureRange { trained_max_pa, beyond: OutOfRange::Clamp };
//!
//! let mut maps = Maps::default();
//! (95..115).for_each(|row| maps.pressure_pa[row * 224 + 105..][..25].fill(8e3));
//! let summary = maps.check(range, &skin)?;
//! let known = Known { skin: &skin, input_max: None, response_max_per_mpa: None, errors: None };
//! let source = Source::Map;
//! let read = Read { summary, range, time_us: 0, is_tracked: true, shows_sed: true, source };
//! let mut rendering = Rendering::begin(&mut maps, None, None, known, read);
//! assert_eq!(rendering.flags() & flags::OUT_OF_RANGE, 0);
//! rendering.infer(session.as_mut())?;
//! rendering.end(session.as_mut())?;
//! assert!(maps.sed_j_per_m3.iter().any(|sed| *sed > 0.0));
//! # Ok(())
//! # }
//! ```

mod frame;
mod skin;

use papilla_engine::{EngineError, Session, error_law::Facts};
use papilla_proto::{
    ErrorCode, InputStatistics, Look, MAP_LEN, MapSummary, PressureRange, Problem,
    finite::first_not_finite_in, flags, keep_inside, map::PeakAndSum,
};
use papilla_session_contact::{Finger, Frame, Taken};

pub use frame::{Known, KnownErrors, Read, Rendering, Source, facts_of_force, lose, source_of};
pub use skin::SkinPixels;

/// Factor above the greatest response of the training beyond which a map is flagged: about the worst
/// error of networks on pressure like that of the training.
const RESPONSE_HEADROOM: f32 = 1.5;

/// The last check of what a [finger wrote](Finger::write): every number that is sent is finite.
///
/// # Errors
/// A number is not finite. This is a fault of the solver, which no client should get as an answer.
pub fn require_finite(written: &[u8]) -> Result<(), Problem> {
    match first_not_finite_in(written) {
        None => Ok(()),
        Some(_) => {
            let message =
                "a number of touch, pressure or shear is not finite; nothing is sent of it";
            Err(Problem::new(ErrorCode::Internal, message).at("touch"))
        }
    }
}

/// The maps of one frame.
#[derive(Debug)]
pub struct Maps {
    /// 224 x 224, Pa.
    pub pressure_pa: Vec<f32>,
    /// 224 x 224, J/m3.
    pub sed_j_per_m3: Vec<f32>,
    /// The pressure that the network gets in place of one beyond its range.
    clamped_pa: Vec<f32>,
    is_clamped: bool,
    /// Greatest pressure that the network sees, Pa.
    seen_peak_pa: f32,
    /// The statistics of that pressure, if the training is known.
    look: Look,
    /// Greatest pressure as the client sent it, Pa; none if the service found the pressure itself.
    sent: Option<MapSummary>,
}

/// What [`Maps::judge`] found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Judged {
    /// Bits of [`papilla_proto::flags`].
    pub(crate) flags: u8,
    /// Nothing touches the finger: SED is zero, and no network is to be asked.
    pub(crate) is_zero: bool,
}

impl Default for Maps {
    fn default() -> Self {
        let [pressure_pa, sed_j_per_m3, clamped_pa] = [(); 3].map(|()| vec![0.0; MAP_LEN]);
        let (seen_peak_pa, look, sent) = (0.0, Look::default(), None);
        Self { pressure_pa, sed_j_per_m3, clamped_pa, is_clamped: false, seen_peak_pa, look, sent }
    }
}

impl Maps {
    /// Checks the pressure, and sets it to zero on pixels without skin.
    ///
    /// # Errors
    /// The first sample at fault.
    pub fn check(
        &mut self,
        range: PressureRange,
        skin: &SkinPixels,
    ) -> Result<MapSummary, Problem> {
        range.check(&self.pressure_pa)?;
        let summary = keep_inside(&mut self.pressure_pa, &skin.mask);
        self.sent = Some(summary);
        Ok(summary)
    }

    /// The same for a finger whose pressure was sent as a map; the map is scaled to the reference
    /// stiffness.
    ///
    /// # Errors
    /// The first sample at fault.
    pub fn check_of(
        &mut self,
        finger: &Finger,
        range: PressureRange,
        skin: &SkinPixels,
    ) -> Result<MapSummary, Problem> {
        let summary = self.check(range.times(finger.stiffness()), skin)?;
        let part = finger.to_reference(&mut self.pressure_pa);
        Ok(MapSummary { peak_pa: summary.peak_pa * part })
    }

    /// Reads a frame that is no window into a finger; its pressure is drawn if SED is to be shown.
    ///
    /// # Errors
    /// As [`Finger::take`], and pressure or traction that is out of range.
    pub fn take(
        &mut self,
        finger: &mut Finger,
        frame: Frame<'_>,
        range: PressureRange,
        shows_sed: bool,
    ) -> Result<Taken, Problem> {
        let map_pa = shows_sed.then_some(&mut self.pressure_pa[..]);
        let mut taken = finger.take(frame, map_pa)?;
        self.sent = None;
        if finger.takes_pressure() {
            finger.require_within(range)?;
            self.sent = Some(MapSummary { peak_pa: taken.peak_pa * finger.stiffness() });
        }
        if range.is_left_by(MapSummary { peak_pa: finger.traction_peak_pa() }) {
            taken.flags |= flags::OUT_OF_RANGE;
        }
        Ok(taken)
    }

    /// Compares the pressure with that of the training, and limits it if `range` says so.
    pub(crate) fn judge(
        &mut self,
        summary: MapSummary,
        range: PressureRange,
        skin: &SkinPixels,
        trained_max: Option<InputStatistics>,
    ) -> Judged {
        let is_zero = summary.is_zero();
        let is_cut_off = skin.are_cut_off(&self.pressure_pa, summary.peak_pa);
        self.is_clamped = range.clamp(&self.pressure_pa, summary, &mut self.clamped_pa);
        self.seen_peak_pa = if self.is_clamped { range.trained_max_pa } else { summary.peak_pa };
        let seen_pa = if self.is_clamped { &self.clamped_pa } else { &self.pressure_pa };
        let is_outside = |trained| {
            self.look = Look::of(seen_pa);
            self.look.statistics.is_out_of_distribution(trained)
        };
        let is_unfamiliar = !is_zero && trained_max.is_some_and(is_outside);
        let sent = self.sent.filter(|_| !is_zero);
        let is_doubtful = trained_max.is_some() && sent.is_some_and(|sent| sent.is_doubtful());
        let is_full_scale = self.is_full_scale();
        let flags = [
            (range.is_left_by(summary) || is_full_scale, flags::OUT_OF_RANGE),
            (is_cut_off, flags::CUT_OFF),
            (is_unfamiliar || is_doubtful, flags::UNFAMILIAR),
            (is_zero, flags::NO_CONTACT),
        ];
        let flags = flags.into_iter().map(|(on, flag)| if on { flag } else { 0 }).sum();
        if is_zero {
            self.sed_j_per_m3.fill(0.0);
        }
        Judged { flags, is_zero }
    }

    /// Whether the client may have sent less pressure than there is, since its numbers end there.
    pub(crate) fn is_full_scale(&self) -> bool {
        self.sent.is_some_and(|sent| sent.is_full_scale())
    }

    /// Runs the network on the pressure as [`judge`](Self::judge) left it.
    ///
    /// # Errors
    /// As [`Session::infer`].
    pub fn infer(&mut self, session: &mut dyn Session) -> Result<(), EngineError> {
        let seen_pa = if self.is_clamped { &self.clamped_pa } else { &self.pressure_pa };
        session.infer(seen_pa, &mut self.sed_j_per_m3)
    }

    /// Judges the answer by how much SED the training had of such a pressure, `response_max_per_mpa`:
    /// no indentation makes tissue store more energy than the square of the pressure allows. To be
    /// asked after [`infer`](Self::infer), before anything is added to SED.
    #[must_use]
    pub(crate) fn judge_answer(&self, sed: PeakAndSum, response_max_per_mpa: Option<f32>) -> u8 {
        let top = sed.peak;
        let is_beyond = |most: f32| {
            let peak_mpa = 1e-6 * self.seen_peak_pa;
            // SED in MPa: 1 J/m3 is 1 Pa.
            1e-6 * top > RESPONSE_HEADROOM * most * peak_mpa * peak_mpa
        };
        if response_max_per_mpa.is_some_and(is_beyond) { flags::UNFAMILIAR } else { 0 }
    }

    /// Greatest SED and the sum of it.
    pub(crate) fn tell_sed(&self) -> PeakAndSum {
        PeakAndSum::of(&self.sed_j_per_m3)
    }

    /// The facts of pressure and answer by which the error of the answer is estimated.
    pub(crate) fn facts(&self, sed: PeakAndSum, trained: InputStatistics) -> Facts {
        Facts::of_sed(&self.look, self.seen_peak_pa, sed.sum, trained.cells)
    }

    /// Adds the part of SED that traction along the skin makes, if the session asks for it.
    pub(crate) fn feel_shear(&mut self, finger: &mut Finger, range: PressureRange) {
        let seen_pa = if self.is_clamped { &self.clamped_pa } else { &self.pressure_pa };
        finger.feel_shear(seen_pa, range, &mut self.sed_j_per_m3);
    }

    /// Scales pressure and SED from the finger of reference stiffness to this person's.
    pub(crate) fn turn_to_person(&mut self, finger: &Finger) {
        finger.to_person(&mut self.pressure_pa);
        finger.to_person(&mut self.sed_j_per_m3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_proto::{
        atlas::{Atlas, Patch, Raster},
        effects::OutOfRange,
    };

    /// A press of 8 kPa sent in kPa, as it is, and beyond what 16 bits hold.
    #[test]
    fn a_unit_in_doubt_and_a_number_at_its_end_are_told() -> Result<(), Box<dyn std::error::Error>>
    {
        std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))?;
        let atlas = Atlas::from_json(&std::fs::read_to_string("models/atlas.json")?)?;
        let skin = SkinPixels::from(&Raster::new(&atlas, Patch::Skin));
        let range = PressureRange { trained_max_pa: 9e4, beyond: OutOfRange::Clamp };
        let all = boundless();
        let mut maps = Maps::default();
        for (peak_pa, knows, due) in [
            (8.0, true, flags::UNFAMILIAR),
            (8.0, false, 0),
            (8e3, true, 0),
            (65_504.0, true, flags::OUT_OF_RANGE),
            (0.0, true, flags::NO_CONTACT),
        ] {
            (95..115).for_each(|row| maps.pressure_pa[row * 224 + 105..][..25].fill(peak_pa));
            let summary = maps.check(range, &skin)?;
            let found = maps.judge(summary, range, &skin, knows.then_some(all)).flags;
            assert_eq!(found, due, "{peak_pa} Pa");
            // Of a frame without tracking nothing of the last one is told.
            let (summary, _) = lose(&mut maps, None, None);
            let found = maps.judge(summary, range, &skin, knows.then_some(all)).flags;
            assert_eq!(found, flags::NO_CONTACT, "after {peak_pa} Pa");
        }
        Ok(())
    }

    /// Of a training that knows every place, and any roughness, load and area.
    fn boundless() -> InputStatistics {
        let of = InputStatistics::of(&vec![1e3; MAP_LEN]);
        InputStatistics {
            roughness: f32::MAX,
            load_mpa_px: f32::MAX,
            rough_load_mpa_px: f32::MAX,
            area_px: f32::MAX,
            contrast_px: f32::MAX,
            ..of
        }
    }

    /// 20 kPa has made at most 6 /MPa of it, as SED: 2400 J/m3.
    #[test]
    fn more_energy_than_any_simulation_had_is_told() {
        let mut maps = Maps { seen_peak_pa: 2e4, ..Maps::default() };
        for (sed_j_per_m3, flag) in
            [(0.0, 0), (2400.0, 0), (3500.0, 0), (3700.0, flags::UNFAMILIAR)]
        {
            maps.sed_j_per_m3[7] = sed_j_per_m3;
            let sed = maps.tell_sed();
            assert_eq!(maps.judge_answer(sed, Some(6.0)), flag, "{sed_j_per_m3} J/m3");
            assert_eq!(maps.judge_answer(sed, None), 0, "nothing is known of the training");
        }
    }
}
