//! The steps of a frame, from pressure to SED, written once for the service and the native library.

use papilla_engine::error_law::{ErrorLaws, Facts, Way};
use papilla_engine::{EngineError, Session};
use papilla_proto::{
    ErrorEstimate, InputStatistics, LikelyError, MapSummary, PressureRange, flags,
};
use papilla_session_contact::{Felt, Finger, Taken};
use papilla_session_effects::Effects;

use crate::{Maps, SkinPixels};

/// What a frame is compared with: the skin, and the greatest values in the training of the network.
#[derive(Debug, Clone, Copy)]
pub struct Known<'a> {
    /// The skin of the atlas.
    pub skin: &'a SkinPixels,
    /// Greatest statistics of the pressure maps; none if the network was not trained on maps.
    pub input_max: Option<InputStatistics>,
    /// Greatest SED over squared pressure, 1/MPa; none if the network was not trained on maps.
    pub response_max_per_mpa: Option<f32>,
    /// The laws by which errors of answers are estimated; none if there are no estimates.
    pub errors: Option<KnownErrors<'a>>,
}

/// The laws of errors, and which of them belong to the network.
#[derive(Debug, Clone, Copy)]
pub struct KnownErrors<'a> {
    /// The laws of all networks and methods.
    pub laws: &'a ErrorLaws,
    /// SHA-256 of the network's file; none if the network belongs to another finger, for whose SED
    /// no error is estimated.
    pub onnx_sha256: Option<&'a str>,
    /// Whether the client asked for the error of its answers. The laws flag what lies beyond their
    /// calibration in any case.
    pub is_asked: bool,
}

/// Where the pressure of a frame comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The client sent it as a map.
    Map,
    /// The contact solver found it, for rigid objects without friction; it converged and was within
    /// its range.
    Contact(Felt),
    /// Any other way, for which no errors were calibrated.
    Other,
}

/// A frame that was read; its pressure is in [`Maps`].
#[derive(Debug, Clone, Copy)]
pub struct Read {
    /// Summary of the pressure.
    pub summary: MapSummary,
    /// The range of pressure, and what happens beyond it.
    pub range: PressureRange,
    /// The client's clock, microseconds.
    pub time_us: u64,
    /// Whether the client knows where things are.
    pub is_tracked: bool,
    /// Whether SED is computed; if not, only forces are.
    pub shows_sed: bool,
    /// Where the pressure comes from.
    pub source: Source,
}

/// A frame on its way to SED: call [`begin`](Self::begin), then [`infer`](Self::infer) if it
/// [touches](Self::touches), and [`end`](Self::end). Between them the caller looks at clocks and
/// deadlines. Nothing here allocates.
#[derive(Debug)]
pub struct Rendering<'a> {
    maps: &'a mut Maps,
    finger: Option<&'a mut Finger>,
    effects: Option<&'a mut Effects>,
    known: Known<'a>,
    read: Read,
    touches: bool,
    flags: u8,
    /// What the answer shows, once the network has answered; unknown if its training is not known.
    facts: Option<Facts>,
    /// Whether an effect changes the tissue; no law of errors was calibrated for that.
    is_changed: bool,
}

impl<'a> Rendering<'a> {
    /// Lets the effects that come before the network change the pressure, and compares the result with
    /// the training.
    pub fn begin(
        maps: &'a mut Maps,
        finger: Option<&'a mut Finger>,
        mut effects: Option<&'a mut Effects>,
        known: Known<'a>,
        mut read: Read,
    ) -> Self {
        let mut flags = 0;
        if let Some(effects) = effects.as_mut().filter(|_| read.is_tracked) {
            read.time_us = effects.time_us(read.time_us);
            flags |= effects.clock_flags();
            let peak_pa = effects.before(&mut maps.pressure_pa, read.time_us);
            read.summary.peak_pa = peak_pa.unwrap_or(read.summary.peak_pa);
        }
        let mut touches = false;
        if read.shows_sed {
            let judged = maps.judge(read.summary, read.range, known.skin, known.input_max);
            flags |= judged.flags;
            touches = !judged.is_zero;
            if finger.as_ref().is_some_and(|finger| finger.holds_a_body()) {
                flags &= !flags::NO_CONTACT;
            }
        } else if finger.as_ref().is_some_and(|finger| known.skin.are_cut_off_in(finger)) {
            // The force lacks what presses beyond the atlas, also where nobody looks at SED.
            flags |= flags::CUT_OFF;
        }
        let is_changed = effects.as_ref().is_some_and(|effects| effects.changes_tissue());
        Self { maps, finger, effects, known, read, touches, flags, facts: None, is_changed }
    }

    /// Whether the network is to run: SED is wanted, and something presses.
    #[must_use]
    pub fn touches(&self) -> bool {
        self.touches
    }

    /// Bits of [`papilla_proto::flags`] so far.
    #[must_use]
    pub fn flags(&self) -> u8 {
        self.flags
    }

    /// The time of the frame as the effects take it, microseconds.
    #[must_use]
    pub fn time_us(&self) -> u64 {
        self.read.time_us
    }

    /// Runs the network, and compares its answer with the training.
    ///
    /// # Errors
    /// As [`Session::infer`].
    pub fn infer(&mut self, session: &mut dyn Session) -> Result<(), EngineError> {
        self.maps.infer(session)?;
        let sed = self.maps.tell_sed();
        self.flags |= self.maps.judge_answer(sed, self.known.response_max_per_mpa);
        let trained = self.known.input_max;
        self.facts = Some(trained.map_or_else(Facts::default, |of| self.maps.facts(sed, of)));
        if self.is_beyond_calibration() {
            self.flags |= flags::UNFAMILIAR;
        }
        Ok(())
    }

    /// Whether the pressure lies where no simulation has checked the network. Where the law for this
    /// way to the pressure is missing, that for a given pressure decides.
    fn is_beyond_calibration(&self) -> bool {
        let Some(KnownErrors { laws, onnx_sha256: Some(network), .. }) = self.known.errors else {
            return false;
        };
        let way = self.way().unwrap_or(Way::Given);
        let law = laws.sed(network, way).or_else(|| laws.sed(network, Way::Given));
        law.is_some_and(|law| law.is_beyond_place(&self.facts()))
    }

    /// Where the pressure came from, if errors may be known of it.
    fn way(&self) -> Option<Way<'_>> {
        let model = self.finger.as_ref().and_then(|finger| finger.model_sha256());
        match (self.read.source, model) {
            _ if self.is_changed || !self.read.is_tracked => None,
            (Source::Map, _) => Some(Way::Given),
            (Source::Contact(felt), Some(model)) => Some(Way::Contact(felt.method, model)),
            (Source::Contact(_), None) | (Source::Other, _) => None,
        }
    }

    /// The facts of the answer by which its error is estimated. They are unknown before there is an
    /// answer, and for a network whose training is not known.
    #[must_use]
    pub fn facts(&self) -> Facts {
        self.facts.unwrap_or_default()
    }

    /// How wrong the answer is likely to be. To be called before [`end`](Self::end).
    #[must_use]
    pub fn error_estimate(&self) -> ErrorEstimate {
        let Some(KnownErrors { laws, onnx_sha256, is_asked: true }) = self.known.errors else {
            return ErrorEstimate::default();
        };
        let way = self.way();
        let sed = onnx_sha256.zip(way).and_then(|(network, way)| laws.sed(network, way));
        let unlike = flags::UNFAMILIAR | flags::CUT_OFF | flags::UNSETTLED;
        let is_within =
            !self.read.range.is_left_by(self.read.summary) && !self.maps.is_full_scale();
        let is_like = self.flags & unlike == 0 && is_within;
        let sed = sed.filter(|_| is_like && self.facts.is_some()).map(|law| law.at(&self.facts()));
        let force = match (self.read.source, way.and_then(|way| laws.force(way))) {
            (Source::Contact(felt), Some(law)) if self.flags & flags::CUT_OFF == 0 => {
                Some(law.at(&facts_of_force(felt)))
            }
            _ => None,
        };
        let [sed, force] = [sed, force].map(|of| of.unwrap_or(LikelyError::UNKNOWN));
        ErrorEstimate { sed, force }
    }

    /// Adds the part of SED that traction along the skin makes, fits the drive of actuators, which may
    /// run the network again, and scales all of it to this person's finger.
    ///
    /// # Errors
    /// As [`Session::infer`].
    pub fn end(self, session: &mut dyn Session) -> Result<(), EngineError> {
        let Self { maps, mut finger, mut effects, read, touches, .. } = self;
        if !read.shows_sed {
            return Ok(());
        }
        if let Some(finger) = finger.as_mut().filter(|_| touches) {
            maps.feel_shear(finger, read.range);
        }
        if let Some(effects) = &mut effects {
            let infer = |pressure_pa: &[f32], sed: &mut [f32]| session.infer(pressure_pa, sed);
            effects.fit(&maps.sed_j_per_m3, infer)?;
        }
        if let Some(finger) = finger {
            maps.turn_to_person(finger);
            if let Some(effects) = effects {
                finger.to_person(effects.pin_pa_mut());
            }
        }
        Ok(())
    }
}

/// Where the pressure comes from in a frame that is not a map of pressure.
#[must_use]
pub fn source_of(taken: &Taken) -> Source {
    taken.felt.map_or(Source::Other, Source::Contact)
}

/// The facts of a contact by which the error of its force is estimated.
#[must_use]
pub fn facts_of_force(felt: Felt) -> Facts {
    Facts::of_force(felt.force_n, felt.centre_mm)
}

/// Takes a frame of a client that does not know where things are. All values are zero, and what finger
/// and effects remember is kept for the next frame. Returns the frame as read, and its flags.
pub fn lose(
    maps: &mut Maps,
    finger: Option<&mut Finger>,
    effects: Option<&mut Effects>,
) -> (MapSummary, u8) {
    maps.pressure_pa.fill(0.0);
    maps.sent = None;
    if let Some(finger) = finger {
        finger.lose();
    }
    if let Some(effects) = effects {
        effects.lose();
    }
    (MapSummary { peak_pa: 0.0 }, flags::NOT_TRACKED | flags::NO_CONTACT)
}
