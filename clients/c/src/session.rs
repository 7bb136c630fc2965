//! One hand: frames in, answers out.

use std::sync::{Arc, MutexGuard, PoisonError};

use bytes::BytesMut;
use papilla_engine::EngineError;
use papilla_proto::{
    ErrorCode, FrameKind, MAP_LEN, MapSummary, PressureRange, Problem, SampleType, Window,
    contact::{ContactMethod, Pose, ROW},
    effects::OutOfRange,
    flags,
};
use papilla_render::{Known, Maps, Read, Rendering};
use papilla_session_contact::{Finger, Frame, Hand, Skin};
use papilla_session_effects as effects;
use papilla_session_effects::Effects;

use crate::{
    Model,
    answer::{Answer, Layout},
    hello,
};

/// A net force to be met: a unit vector and the force along it, N.
pub(crate) type NetForce = [f32; 4];

/// A hand, and the memory of its frames: after [`open`](Self::open) only the network allocates.
pub struct Session {
    model: Arc<Model>,
    network: Box<dyn papilla_engine::Session>,
    hand: Hand,
    /// Of each finger; none if the bare map is asked for.
    effects: Vec<Effects>,
    range: PressureRange,
    has_force: bool,
    layout: Layout,
    maps: Maps,
    payload: Vec<u8>,
    bytes: BytesMut,
    /// Numbers of the last answer's sections.
    values: Vec<f32>,
    last: Last,
}

/// What is not a number of the last answer.
#[derive(Debug, Clone, Copy)]
struct Last {
    flags: u8,
    shows_sed: bool,
    window: Window,
    values: usize,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("model", &self.model).finish_non_exhaustive()
    }
}

fn of_engine(error: &EngineError) -> Problem {
    Problem::new(ErrorCode::Internal, format!("the inference failed: {error}"))
}

impl Session {
    /// Takes all memory that the frames of this hello need.
    ///
    /// # Errors
    /// A member is unusable or missing; the problem names it.
    pub fn open(model: &Arc<Model>, hello: &str) -> Result<Self, Problem> {
        let hello = hello::read(hello, model)?;
        let Model { atlas, skin, interface, shared, contact, pixel_skin, .. } = &**model;
        let of_hand = Skin {
            atlas,
            raster: skin,
            model: contact.as_ref(),
            pixels: pixel_skin.as_ref(),
            interface: model.interface_skin.as_ref(),
            errors: model.contact_errors.as_ref(),
        };
        let hand = Hand::of(&hello, of_hand)?;
        let finger = effects::Finger { atlas, skin, interface, shared };
        let mut effects = Vec::with_capacity(hand.fingers().len());
        for _ in hand.fingers() {
            effects.extend(Effects::of(&hello, finger)?);
        }
        let rest = effects.first().map_or(&[][..], Effects::sections);
        let layout = Layout::of(hand.sections(), hand.sections_len(), rest);
        let mut network = model.network.session().map_err(|error| of_engine(&error))?;
        let mut maps = Maps::default();
        if effects.first().is_none_or(Effects::shows_sed) {
            // The network's memory is touched before the first frame.
            maps.infer(network.as_mut()).map_err(|error| of_engine(&error))?;
        }
        let range = PressureRange {
            trained_max_pa: model.network.info().pressure_max_pa,
            beyond: hello.out_of_range.unwrap_or(OutOfRange::Clamp),
        };
        let payload_len = hand.form().payload_len_max(SampleType::F32.bytes());
        Ok(Self {
            model: Arc::clone(model),
            network,
            effects,
            range,
            has_force: hello.force_target == Some(true),
            maps,
            payload: vec![0; payload_len],
            bytes: BytesMut::with_capacity(4 * layout.len()),
            values: vec![0.0; layout.len()],
            last: Last { flags: 0, shows_sed: false, window: Window::EMPTY, values: 0 },
            layout,
            hand,
        })
    }

    /// How pressure is found, as in a hello; empty where frames are pressure.
    #[must_use]
    pub fn method(&self) -> &'static str {
        self.hand.method().map_or("", ContactMethod::as_str)
    }

    /// What the hello cannot have as one might expect, a line each.
    #[must_use]
    pub fn warnings(&self) -> String {
        let lines = self.hand.warnings().iter().map(|warning| warning.question.as_str());
        lines.collect::<Vec<_>>().join("\n")
    }

    /// Renders pressure, Pa: a map of 224 x 224, or as many values as the skin has vertices if the
    /// hello's `input_layout` says so.
    ///
    /// # Errors
    /// What is not finite, below zero or too high; the session goes on.
    pub fn send_map(
        &mut self,
        finger: u8,
        pressure_pa: &[f32],
        time_us: u64,
    ) -> Result<(), Problem> {
        self.expect(FrameKind::Pressure, finger, pressure_pa.len())?;
        if self.hand.form().is_window() {
            self.maps.pressure_pa.copy_from_slice(pressure_pa);
            return self.render(finger, time_us);
        }
        write_floats(&mut self.payload, pressure_pa);
        self.render(finger, time_us)
    }

    /// Finds what presses where the objects of the hello are, and renders it.
    ///
    /// # Errors
    /// Poses that cannot be; the session goes on.
    pub fn send_poses(
        &mut self,
        finger: u8,
        poses: &[Pose],
        net: Option<NetForce>,
        time_us: u64,
    ) -> Result<(), Problem> {
        self.expect(FrameKind::Objects, finger, ROW * poses.len())?;
        let end = ROW * poses.len() * 4;
        for (room, pose) in self.payload[..end].chunks_exact_mut(4 * ROW).zip(poses) {
            room.copy_from_slice(&pose.encode());
        }
        self.write_force(end, net)?;
        self.render(finger, time_us)
    }

    /// Finds what presses from how deep the undeformed skin lies in things, mm, and renders it.
    ///
    /// # Errors
    /// Depths that cannot be; the session goes on.
    pub fn send_gaps(
        &mut self,
        finger: u8,
        depth_mm: &[f32],
        net: Option<NetForce>,
        time_us: u64,
    ) -> Result<(), Problem> {
        self.expect(FrameKind::Gaps, finger, depth_mm.len())?;
        write_floats(&mut self.payload, depth_mm);
        self.write_force(4 * depth_mm.len(), net)?;
        self.render(finger, time_us)
    }

    /// Nobody knows where things are, or what presses: the answer is zero, and what the session
    /// remembers waits for the next frame.
    ///
    /// # Errors
    /// No such finger.
    pub fn send_not_tracked(&mut self, finger: u8, time_us: u64) -> Result<(), Problem> {
        self.require_finger(finger)?;
        self.render_frame(finger, time_us, false)
    }

    /// The answer to the last frame that was rendered.
    #[must_use]
    pub fn answer(&self) -> Answer<'_> {
        let Last { flags, shows_sed, window, values } = self.last;
        let mut answer = Answer { flags, has_sed: shows_sed, window, ..Answer::EMPTY };
        self.layout.give(&self.values[..values], &mut answer);
        if self.effects.is_empty() && shows_sed {
            answer.map = &self.maps.sed_j_per_m3;
        }
        answer
    }

    /// Whether a frame of this kind and length is due.
    fn expect(&self, kind: FrameKind, finger: u8, samples: usize) -> Result<(), Problem> {
        let form = self.hand.form();
        self.require_finger(finger)?;
        if kind != form.kind() {
            let message = format!("the hello's frames are {:?}, not {kind:?}", form.kind());
            return Err(Problem::new(ErrorCode::WrongType, message).at("kind"));
        }
        let due = form.size().map_or(MAP_LEN, |[width, height]| width * height);
        let extra = if kind == FrameKind::Objects && self.has_force { ROW } else { 0 };
        if samples + extra != due {
            let due = due - extra;
            let message = format!("{samples} numbers came, {due} are due");
            return Err(Problem::new(ErrorCode::WrongLength, message).at("count"));
        }
        Ok(())
    }

    fn require_finger(&self, finger: u8) -> Result<(), Problem> {
        let fingers = self.hand.fingers().len();
        if usize::from(finger) < fingers {
            return Ok(());
        }
        let message = format!("finger {finger} was not announced; there are {fingers}");
        Err(Problem::new(ErrorCode::BadContact, message).at("finger"))
    }

    /// The row of a net force behind the samples; zeros ask for none.
    fn write_force(&mut self, at: usize, net: Option<NetForce>) -> Result<(), Problem> {
        if net.is_some() && !self.has_force {
            let message = "a net force needs a hello with 'force_target': true";
            return Err(Problem::new(ErrorCode::BadContact, message).at("force_target"));
        }
        if self.has_force {
            let [x, y, z, force_n] = net.unwrap_or_default();
            write_floats(&mut self.payload[at..], &[x, y, z, force_n, 0.0, 0.0, 0.0]);
        }
        Ok(())
    }

    /// Reads what lies in `payload` or the pressure map, and makes the answer.
    fn render(&mut self, finger: u8, time_us: u64) -> Result<(), Problem> {
        self.render_frame(finger, time_us, true)
    }

    fn render_frame(&mut self, finger: u8, time_us: u64, is_tracked: bool) -> Result<(), Problem> {
        let place = usize::from(finger);
        self.last.shows_sed = false;
        self.last.values = 0;
        let Self { model, hand, effects, maps, range, network, .. } = self;
        let mut finger = lock(&hand.fingers()[place]);
        let mut effects = effects.get_mut(place);
        let shows_sed = effects.as_ref().is_none_or(|effects| effects.shows_sed());
        let (summary, mut found) = if !is_tracked {
            papilla_render::lose(maps, Some(&mut finger), effects.as_deref_mut())
        } else if finger.reads_windows() {
            (maps.check_of(&finger, *range, &model.pixels)?, 0)
        } else {
            let frame =
                Frame { payload: &self.payload, sample_type: SampleType::F32, scale: 1.0, time_us };
            let taken = maps.take(&mut finger, frame, *range, shows_sed)?;
            (MapSummary { peak_pa: taken.peak_pa }, taken.flags)
        };
        let known = Known {
            skin: &model.pixels,
            input_max: model.card.input_statistics_max,
            response_max_per_mpa: model.card.response_max_per_mpa,
        };
        let read = Read { summary, range: *range, time_us, is_tracked, shows_sed };
        let mut rendering =
            Rendering::begin(maps, Some(&mut finger), effects.as_deref_mut(), known, read);
        if rendering.touches() {
            rendering.infer(network.as_mut()).map_err(|error| of_engine(&error))?;
        }
        found |= rendering.flags();
        let time_us = rendering.time_us();
        rendering.end(network.as_mut()).map_err(|error| of_engine(&error))?;
        self.bytes.clear();
        finger.write(&mut self.bytes);
        papilla_render::require_finite(&self.bytes)?;
        let mut window = Window::WHOLE;
        if let Some(effects) = effects {
            let written =
                effects.write(&maps.pressure_pa, &maps.sed_j_per_m3, time_us, &mut self.bytes);
            let written = written.map_err(|error| {
                Problem::new(ErrorCode::Internal, format!("the answer cannot be written: {error}"))
            })?;
            window = written.window;
            found |= if written.is_clipped { flags::OUT_OF_RANGE } else { 0 };
        }
        let numbers = self.bytes.as_chunks::<4>().0;
        for (value, number) in self.values.iter_mut().zip(numbers) {
            *value = f32::from_le_bytes(*number);
        }
        let values = numbers.len().min(self.values.len());
        self.last = Last { flags: found, shows_sed, window, values };
        Ok(())
    }
}

fn write_floats(room: &mut [u8], values: &[f32]) {
    for (room, value) in room.chunks_exact_mut(4).zip(values) {
        room.copy_from_slice(&value.to_le_bytes());
    }
}

/// A session belongs to one thread, so nobody waits here.
fn lock(finger: &std::sync::Mutex<Finger>) -> MutexGuard<'_, Finger> {
    finger.lock().unwrap_or_else(PoisonError::into_inner)
}
