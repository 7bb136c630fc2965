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
    /// The payload as it came in, not decoded and without the header of its frame.
    pub(crate) payload: Bytes,
    /// How to decode it.
    pub(crate) input: Input,
    /// How to encode the answer.
    pub(crate) output: Output,
    /// When the server had read the map.
    pub(crate) received: Instant,
    /// After this the answer is worthless to the client. None: there is no deadline.
    pub(crate) deadline: Option<Instant>,
    /// What the client asked for beside the bare map.
    pub(crate) options: JobOptions,
}

/// What a job may ask for beside the bare map.
#[derive(Debug, Default)]
pub(crate) struct JobOptions {
    /// Free bytes that the answer's buffer begins with.
    pub(crate) headroom: usize,
    /// What is done with pressure above that of the tier's training.
    pub(crate) out_of_range: OutOfRange,
    /// The client's time of this frame, us. Effects that change with time use it.
    pub(crate) time_us: u64,
    /// The effects of the frame's finger. Only the thread that renders the frame locks them, and at
    /// most one frame of a finger is being rendered.
    pub(crate) effects: Option<Arc<Mutex<Effects>>>,
    /// The finger that the frame belongs to. It is locked as the effects are.
    pub(crate) finger: Option<Arc<Mutex<Finger>>>,
    /// Expected time of the contact solver, us; None if no contact is to be solved.
    pub(crate) contact_us: Option<u64>,
    /// Whether the contact is all that is asked for, so that no network runs.
    pub(crate) is_contact_alone: bool,
    /// The frame's header, which the sink needs to answer it. The thread hands it back unchanged.
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
    /// Running the network; zero if it was not run, as for a map of zeros.
    pub(crate) infer: Duration,
    /// The same in processor time.
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
        /// J/m3 of one unit of the samples (u16, u8), J/m3 of full white (PNG), otherwise 1.
        scale: f32,
    },
    /// The deadline had passed, or would have been missed, at this stage.
    Late(Stage),
    /// The frame was invalid, or the service failed.
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
    /// How wrong the answer is likely to be.
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
    /// As in the [`JobOptions`].
    pub(crate) header: Option<FrameHeader>,
    /// When the server had read the map.
    pub(crate) received: Instant,
    /// As in the [`Job`].
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
