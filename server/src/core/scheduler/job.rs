//! One map to render, and what became of it.

use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use bytes::{Bytes, BytesMut};
use papilla_proto::{FrameHeader, FrameKind, Problem, Window};

use crate::{
    codec::{Input, Output},
    core::effects::Effects,
};

/// One pressure map on its way to a thread.
#[derive(Debug)]
pub(crate) struct Job {
    /// Index of the tier in the catalogue.
    pub(crate) tier: usize,
    /// The undecoded map: the payload alone, without a frame header.
    pub(crate) payload: Bytes,
    /// How to decode it.
    pub(crate) input: Input,
    /// How to encode the answer.
    pub(crate) output: Output,
    /// What a session adds; None over HTTP.
    pub(crate) frame: Option<Frame>,
    /// When the server had read the map.
    pub(crate) received: Instant,
    /// When the answer is worthless.
    pub(crate) deadline: Option<Instant>,
}

/// What a session adds to a job.
#[derive(Debug)]
pub(crate) struct Frame {
    /// The request's header; its window is where the payload belongs.
    pub(crate) header: FrameHeader,
    /// Whether pressure above what the tier was trained on is taken and flagged.
    pub(crate) takes_more: bool,
    /// The session's effects. Only the thread that renders the frame locks them, and a session
    /// has one frame with a thread at a time.
    pub(crate) effects: Option<Arc<Mutex<Effects>>>,
}

impl Frame {
    /// A frame that asks for the bare map.
    #[cfg(test)]
    pub(crate) fn of(header: FrameHeader) -> Self {
        Self { header, takes_more: false, effects: None }
    }
}

impl Job {
    /// Whether the deadline has passed.
    pub(crate) fn is_late(&self) -> bool {
        is_past(self.deadline)
    }
}

/// Whether `deadline` has passed.
pub(crate) fn is_past(deadline: Option<Instant>) -> bool {
    deadline.is_some_and(|deadline| Instant::now() >= deadline)
}

/// Where a deadline was found to have passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Stage {
    /// Before the map entered the slot.
    Admission,
    /// When a thread took it from the slot.
    Dequeue,
    /// Decoded, but what is left of the time is less than any inference takes.
    Inference,
    /// Rendered, but not yet sent.
    Sending,
}

/// Time spent in each stage.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Times {
    /// Waiting for a thread.
    pub(crate) queue: Duration,
    /// Decoding and checking.
    pub(crate) decode: Duration,
    /// In the network; zero for a zero map.
    pub(crate) infer: Duration,
    /// Encoding the answer.
    pub(crate) encode: Duration,
}

/// Room before the header of an answer for the framing of a session, bytes. A multiple of 16:
/// sections begin at such.
pub(crate) const FRONT: usize = 16;

/// What became of a job.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// The map, encoded. Over a session [`FRONT`] bytes and those of the header are left free
    /// before it.
    Map {
        /// The encoded answer.
        bytes: BytesMut,
        /// J/m3 per unit (u16, u8), J/m3 of full white (PNG), else 1.
        scale: f32,
    },
    /// The deadline had passed.
    Late(Stage),
    /// Something was wrong with the map, or with us.
    Failed(Problem),
    /// Nobody is there for an answer; nothing was rendered.
    Gone,
}

/// What the payload of an answer holds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Drawn {
    /// What the samples show.
    pub(crate) kind: FrameKind,
    /// The pixels that are sent.
    pub(crate) window: Window,
    /// Bits of [`papilla_proto::flags`].
    pub(crate) flags: u8,
}

impl Default for Drawn {
    fn default() -> Self {
        Self { kind: FrameKind::Sed, window: Window::WHOLE, flags: 0 }
    }
}

/// A finished job.
#[derive(Debug)]
pub(crate) struct Done {
    /// Index of the tier.
    pub(crate) tier: usize,
    /// The frame's header; None over HTTP.
    pub(crate) header: Option<FrameHeader>,
    /// When the server had read the map.
    pub(crate) received: Instant,
    /// When the answer is worthless.
    pub(crate) deadline: Option<Instant>,
    /// Time by stage.
    pub(crate) times: Times,
    /// What was drawn.
    pub(crate) drawn: Drawn,
    /// How it was encoded.
    pub(crate) output: Output,
    /// What became of it.
    pub(crate) outcome: Outcome,
}
