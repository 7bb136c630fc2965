//! One map to render, and what became of it.

use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use bytes::{Bytes, BytesMut};
use papilla_codec::{Input, Output};
use papilla_metrics::Stage;
use papilla_proto::{ErrorEstimate, FrameHeader, Problem, Window, effects::OutOfRange};
use papilla_session_contact::Finger;
use papilla_session_effects::Effects;

/// One pressure map on its way to a thread.
#[derive(Debug)]
pub(crate) struct Job {
    /// Number of the tier.
    pub(crate) tier: usize,
    /// The undecoded map: the payload alone, without a head of its transport.
    pub(crate) payload: Bytes,
    /// How to decode it.
    pub(crate) input: Input,
    /// How to encode the answer.
    pub(crate) output: Output,
    /// When the server had read the map.
    pub(crate) received: Instant,
    /// When the answer is worthless.
    pub(crate) deadline: Option<Instant>,
    /// What is asked for beside the bare map.
    pub(crate) options: JobOptions,
}

/// What a job may ask for beside the bare map.
#[derive(Debug, Default)]
pub(crate) struct JobOptions {
    /// Bytes to be left free before the answer.
    pub(crate) headroom: usize,
    /// What becomes of pressure above what the tier was trained on.
    pub(crate) out_of_range: OutOfRange,
    /// The client's clock, us: effects that change with time go by it.
    pub(crate) time_us: u64,
    /// The session's effects. Only the thread that renders the frame locks them, and a session
    /// has one frame with a thread at a time.
    pub(crate) effects: Option<Arc<Mutex<Effects>>>,
    /// The session's finger that the frame is of; locked as the effects are.
    pub(crate) finger: Option<Arc<Mutex<Finger>>>,
    /// Time that the contact is expected to take, us, if one is to be solved.
    pub(crate) contact_us: Option<u64>,
    /// Whether that is all: no network is asked.
    pub(crate) is_contact_alone: bool,
    /// How the sink tells one answer from another; handed back as it is.
    pub(crate) header: Option<FrameHeader>,
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

/// Time spent in each stage.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Times {
    /// Waiting for a thread.
    pub(crate) queue: Duration,
    /// Decoding and checking.
    pub(crate) decode: Duration,
    /// In the network; zero for a zero map.
    pub(crate) infer: Duration,
    /// The same by the processor's time.
    pub(crate) network: Duration,
    /// Encoding the answer.
    pub(crate) encode: Duration,
}

/// What became of a job.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// The map, encoded, behind [`JobOptions::headroom`] free bytes.
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
    /// The client was gone; nothing was rendered.
    Gone,
}

/// What the payload of an answer holds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputMeta {
    /// The pixels that are sent.
    pub(crate) window: Window,
    /// Bits of [`papilla_proto::flags`].
    pub(crate) flags: u8,
    /// How wrong it is likely to be.
    pub(crate) errors: ErrorEstimate,
}

impl Default for OutputMeta {
    fn default() -> Self {
        Self { window: Window::WHOLE, flags: 0, errors: ErrorEstimate::default() }
    }
}

/// A finished job.
#[derive(Debug)]
pub(crate) struct Done {
    /// Number of the tier.
    pub(crate) tier: usize,
    /// That of [`JobOptions`].
    pub(crate) header: Option<FrameHeader>,
    /// When the server had read the map.
    pub(crate) received: Instant,
    /// When the answer is worthless.
    pub(crate) deadline: Option<Instant>,
    /// Time by stage.
    pub(crate) times: Times,
    /// What the payload holds.
    pub(crate) meta: OutputMeta,
    /// How it was encoded.
    pub(crate) output: Output,
    /// What became of it.
    pub(crate) outcome: Outcome,
}
