//! The order of a frame, from pressure to SED, written once for the service and the native library.

use papilla_engine::{EngineError, Session};
use papilla_proto::{InputStatistics, MapSummary, PressureRange, flags};
use papilla_session_contact::Finger;
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
        Self { maps, finger, effects, known, read, touches, flags }
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
        self.flags |= self.maps.judge_answer(self.known.response_max_per_mpa);
        Ok(())
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
