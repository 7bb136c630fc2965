//! The steps of a frame, from pressure to SED, written once for the service and the native library.

use papilla_engine::error_law::{ErrorLaws, Facts, Way};
use papilla_engine::{EngineError, Session};
use papilla_proto::{
    ErrorEstimate, InputStatistics, LikelyError, MapSummary, PressureRange, flags, map::PeakAndSum,
};
use papilla_session_contact::{Felt, Finger, Taken};
use papilla_session_effects::Effects;

use crate::{Maps, SkinPixels};

/// What a frame is judged by: the skin, and what the network's training had at most.
#[derive(Debug, Clone, Copy)]
pub struct Known<'a> {
    /// The skin of the atlas.
    pub skin: &'a SkinPixels,
    /// Of pressure; none: the network was fitted to no maps.
    pub input_max: Option<InputStatistics>,
    /// Of SED over squared pressure, 1/MPa; none likewise.
    pub response_max_per_mpa: Option<f32>,
    /// By what the errors of answers are told; none: they are not.
    pub errors: Option<KnownErrors<'a>>,
}

/// The laws of errors, and which of them are the network's.
#[derive(Debug, Clone, Copy)]
pub struct KnownErrors<'a> {
    /// All of them.
    pub laws: &'a ErrorLaws,
    /// SHA-256 of the network's file; none: it knows another finger, and nothing is told of its SED.
    pub onnx_sha256: Option<&'a str>,
}

/// Where the pressure of a frame is from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The client sent it as a map.
    Map,
    /// Contact found it of rigid objects without friction, and settled within its range.
    Contact(Felt),
    /// Any other way: nothing was calibrated of it.
    Other,
}

/// A frame as it was read: its pressure lies in [`Maps`].
#[derive(Debug, Clone, Copy)]
pub struct Read {
    /// Of the pressure.
    pub summary: MapSummary,
    /// What is taken of pressure.
    pub range: PressureRange,
    /// The client's clock, microseconds.
    pub time_us: u64,
    /// The client knows where things are.
    pub is_tracked: bool,
    /// SED is to be found; without it poses go in and forces come out.
    pub shows_sed: bool,
    /// Where the pressure is from.
    pub source: Source,
}

/// A frame on its way to SED: [`begin`](Self::begin); [`infer`](Self::infer) if it
/// [touches](Self::touches); [`end`](Self::end). Between them whoever renders looks at clocks and
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
    /// Greatest SED and its sum, once there is an answer.
    sed: Option<PeakAndSum>,
    /// Whether an effect changes the tissue, which no law knows.
    is_changed: bool,
}

impl<'a> Rendering<'a> {
    /// Lets the effects that come before the network change the pressure, and judges it.
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
        }
        let is_changed = effects.as_ref().is_some_and(|effects| effects.changes_tissue());
        Self { maps, finger, effects, known, read, touches, flags, sed: None, is_changed }
    }

    /// Whether the network is to be asked: SED is to be shown, and something presses.
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

    /// Asks the network, and judges its answer.
    ///
    /// # Errors
    /// As [`Session::infer`].
    pub fn infer(&mut self, session: &mut dyn Session) -> Result<(), EngineError> {
        self.maps.infer(session)?;
        let sed = self.maps.tell_sed();
        self.flags |= self.maps.judge_answer(sed, self.known.response_max_per_mpa);
        self.sed = Some(sed);
        Ok(())
    }

    /// What the answer of the network shows of its error; unknown before there is one, and of a
    /// network whose training is not known.
    #[must_use]
    pub fn facts(&self) -> Facts {
        let Some((sed, trained)) = self.sed.zip(self.known.input_max) else {
            return Facts::default();
        };
        self.maps.facts(sed, trained)
    }

    /// How wrong the answer is likely to be, by what it shows. To be asked before
    /// [`end`](Self::end).
    #[must_use]
    pub fn error_estimate(&self) -> ErrorEstimate {
        let Some(KnownErrors { laws, onnx_sha256 }) = self.known.errors else {
            return ErrorEstimate::default();
        };
        let model = self.finger.as_ref().and_then(|finger| finger.model_sha256());
        let way = match (self.read.source, model) {
            _ if self.is_changed || !self.read.is_tracked => None,
            (Source::Map, _) => Some(Way::Given),
            (Source::Contact(felt), Some(model)) => Some(Way::Contact(felt.method, model)),
            (Source::Contact(_), None) | (Source::Other, _) => None,
        };
        let sed = onnx_sha256.zip(way).and_then(|(network, way)| laws.sed(network, way));
        let unlike = flags::UNFAMILIAR | flags::CUT_OFF | flags::UNSETTLED;
        let is_like = self.flags & unlike == 0 && !self.read.range.is_left_by(self.read.summary);
        let sed = sed.filter(|_| is_like && self.sed.is_some()).map(|law| law.at(&self.facts()));
        let force = match (self.read.source, way.and_then(|way| laws.force(way))) {
            (Source::Contact(felt), Some(law)) if self.flags & flags::CUT_OFF == 0 => {
                Some(law.at(&facts_of_force(felt)))
            }
            _ => None,
        };
        let [sed, force] = [sed, force].map(|of| of.unwrap_or(LikelyError::UNKNOWN));
        ErrorEstimate { sed, force }
    }

    /// Adds what traction along the skin changes, fits the drive of actuators, which may ask the
    /// network again, and turns all of it into this person's.
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

/// Where the pressure is from of a frame that is no window.
#[must_use]
pub fn source_of(taken: &Taken) -> Source {
    taken.felt.map_or(Source::Other, Source::Contact)
}

/// What a force that contact found shows of its error.
#[must_use]
pub fn facts_of_force(felt: Felt) -> Facts {
    Facts::of_force(felt.force_n, felt.centre_mm)
}

/// Takes a frame of a client that does not know where things are, or what presses: nothing is shown,
/// and what finger and effects remember waits for the next frame. Returns what is read of it, and
/// its flags.
pub fn lose(
    maps: &mut Maps,
    finger: Option<&mut Finger>,
    effects: Option<&mut Effects>,
) -> (MapSummary, u8) {
    maps.pressure_pa.fill(0.0);
    if let Some(finger) = finger {
        finger.lose();
    }
    if let Some(effects) = effects {
        effects.lose();
    }
    (MapSummary { peak_pa: 0.0 }, flags::NOT_TRACKED | flags::NO_CONTACT)
}
