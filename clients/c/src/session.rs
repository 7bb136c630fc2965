//! One hand: frames in, answers out as lists of floats.

use std::sync::Arc;

use papilla_inside::{Frame, Model, Session as Inside};
use papilla_proto::{
    ErrorCode, FrameKind, MAP_LEN, Problem, SampleType, Window,
    contact::{ContactMethod, Pose, ROW},
};

use crate::{
    answer::{Answer, Layout},
    hello,
};

/// A net force to be met: a unit vector and the force along it, N.
pub(crate) type NetForce = [f32; 4];

/// A hand, and the memory of its frames: after [`open`](Self::open) only the network allocates.
#[derive(Debug)]
pub struct Session {
    inside: Inside,
    has_force: bool,
    layout: Layout,
    payload: Vec<u8>,
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

impl Session {
    /// Takes all memory that the frames of this hello need.
    ///
    /// # Errors
    /// A member is unusable or missing; the problem names it.
    pub fn open(model: &Arc<Model>, hello: &str) -> Result<Self, Problem> {
        let hello = hello::read(hello)?;
        let inside = Inside::open(model, &hello)?;
        // A bare map is given as the session holds it.
        let layout = if inside.has_effects() {
            Layout(inside.sections())
        } else {
            Layout(inside.hand().sections().to_vec())
        };
        let payload_len = inside.form().payload_len_max(SampleType::F32.bytes());
        Ok(Self {
            inside,
            has_force: hello.force_target == Some(true),
            payload: vec![0; payload_len],
            values: vec![0.0; layout.len()],
            last: Last { flags: 0, shows_sed: false, window: Window::EMPTY, values: 0 },
            layout,
        })
    }

    /// How pressure is found, as in a hello; empty where frames are pressure.
    #[must_use]
    pub fn method(&self) -> &'static str {
        self.inside.hand().method().map_or("", ContactMethod::as_str)
    }

    /// What the hello cannot have as one might expect, a line each.
    #[must_use]
    pub fn warnings(&self) -> String {
        let lines = self.inside.hand().warnings().iter().map(|warning| warning.question.as_str());
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
        if self.inside.form().is_window() {
            return self.render(finger, Sent::Map(pressure_pa), time_us);
        }
        write_floats(&mut self.payload, pressure_pa);
        self.render(finger, Sent::Payload, time_us)
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
        self.render(finger, Sent::Payload, time_us)
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
        self.render(finger, Sent::Payload, time_us)
    }

    /// Nobody knows where things are, or what presses: the answer is zero, and what the session
    /// remembers waits for the next frame.
    ///
    /// # Errors
    /// No such finger.
    pub fn send_not_tracked(&mut self, finger: u8, time_us: u64) -> Result<(), Problem> {
        self.require_finger(finger)?;
        self.render(finger, Sent::NotTracked, time_us)
    }

    /// The answer to the last frame that was rendered.
    #[must_use]
    pub fn answer(&self) -> Answer<'_> {
        let Last { flags, shows_sed, window, values } = self.last;
        let mut answer = Answer { flags, has_sed: shows_sed, window, ..Answer::EMPTY };
        self.layout.give(&self.values[..values], &mut answer);
        if !self.inside.has_effects() && shows_sed {
            answer.map = self.inside.sed_j_per_m3();
        }
        answer
    }

    /// Whether a frame of this kind and length is due.
    fn expect(&self, kind: FrameKind, finger: u8, samples: usize) -> Result<(), Problem> {
        let form = self.inside.form();
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
        let fingers = self.inside.hand().fingers().len();
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

    fn render(&mut self, finger: u8, sent: Sent<'_>, time_us: u64) -> Result<(), Problem> {
        self.last.shows_sed = false;
        self.last.values = 0;
        let frame = match sent {
            Sent::NotTracked => Frame::NotTracked,
            Sent::Map(pressure_pa) => Frame::Map(pressure_pa),
            Sent::Payload => {
                Frame::Rows { sample_type: SampleType::F32, scale: 1.0, payload: &self.payload }
            }
        };
        let made = self.inside.render(usize::from(finger), frame, time_us)?;
        let numbers = self.inside.bytes().as_chunks::<4>().0;
        for (value, number) in self.values.iter_mut().zip(numbers) {
            *value = f32::from_le_bytes(*number);
        }
        let values = numbers.len().min(self.values.len());
        let (flags, shows_sed, window) = (made.flags, made.shows_sed, made.window);
        self.last = Last { flags, shows_sed, window, values };
        Ok(())
    }
}

/// What came: nothing, a map, or what lies in the payload.
#[derive(Clone, Copy)]
enum Sent<'a> {
    NotTracked,
    Map(&'a [f32]),
    Payload,
}

fn write_floats(room: &mut [u8], values: &[f32]) {
    for (room, value) in room.chunks_exact_mut(4).zip(values) {
        room.copy_from_slice(&value.to_le_bytes());
    }
}
