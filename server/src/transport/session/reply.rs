//! The answers of a session. The inference thread makes and sends an answer; if there was nothing
//! to compute, the task of the connection does.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use bytes::BytesMut;
use papilla_codec::Output;
use papilla_metrics::{Stage, Transport};
use papilla_proto::{
    FrameHeader, FrameStatus, HEADER_LEN, Problem, ServerMessage, SessionError,
    contact::FINGERS_MAX,
};

use super::{
    budget::FrameCounts,
    outbox::Outbox,
    wire::{self, OUT_HEAD_MAX, opcode},
};
use crate::{
    core::{
        buffers::{HEADROOM, Recycler},
        scheduler::{Done, Outcome, Sink, is_past},
    },
    problem,
    transport::app::App,
};

/// What a session sends: answers, messages and errors, in the order in which they are ready.
pub(super) struct Reply {
    pub(super) out: Outbox,
    /// Number of frames that were accepted and are not answered yet: of each finger at most one
    /// with a thread and one in its slot.
    outstanding: AtomicUsize,
    /// Whether the task waits until all of them are answered.
    is_awaited: AtomicBool,
    is_over: AtomicBool,
    /// Counts of late frames and of frames in time: one for each part of the session's terms, in
    /// their order.
    pub(super) counts: [FrameCounts; FINGERS_MAX],
    app: Arc<App>,
}

impl Reply {
    pub(super) fn new(out: Outbox, app: Arc<App>) -> Self {
        Self {
            out,
            outstanding: AtomicUsize::new(0),
            is_awaited: AtomicBool::new(false),
            is_over: AtomicBool::new(false),
            counts: Default::default(),
            app,
        }
    }

    /// Counts an accepted frame. Called before a thread can get it.
    pub(super) fn begin(&self) {
        self.outstanding.fetch_add(1, Ordering::SeqCst);
    }

    /// Counts an accepted frame as answered.
    pub(super) fn finish(&self) {
        self.outstanding.fetch_sub(1, Ordering::SeqCst);
        if self.is_awaited.load(Ordering::SeqCst) {
            self.out.call.notify_one();
        }
    }

    /// Whether every accepted frame is answered. From then on the task is notified at each answer.
    pub(super) fn is_settled(&self) -> bool {
        self.is_awaited.store(true, Ordering::SeqCst);
        self.outstanding.load(Ordering::SeqCst) == 0
    }

    /// Marks the session as over: frames that wait need not be rendered any more.
    pub(super) fn end(&self) {
        self.is_over.store(true, Ordering::Release);
    }

    /// Sends a JSON message.
    pub(super) fn send_message(&self, message: &ServerMessage) {
        match serde_json::to_string(message) {
            Ok(text) => self.out.send(&wire::frame(opcode::TEXT, text.as_bytes())),
            Err(error) => tracing::error!(%error, "a message cannot be encoded"),
        }
    }

    /// Sends a binary message that is no frame.
    pub(super) fn send_binary(&self, payload: &[u8]) {
        self.out.send(&wire::frame(opcode::BINARY, payload));
    }

    /// Tells the client of an error after which the session goes on.
    pub(super) fn send_error(&self, problem: Problem, sequence: Option<u32>) {
        self.app.metrics.error(problem.code);
        let problem = problem::bounded(problem);
        self.send_message(&ServerMessage::Error(SessionError::new(problem, sequence, false)));
    }

    /// Answers a frame with an error.
    pub(super) fn refuse(&self, problem: Problem, sequence: Option<u32>) {
        self.app.metrics.of(Transport::Session).error.inc();
        self.send_error(problem, sequence);
    }

    /// Answers a frame with a header and no payload.
    pub(super) fn send_status(
        &self,
        header: &FrameHeader,
        tier: usize,
        status: FrameStatus,
        received: Instant,
    ) {
        if status == FrameStatus::Late {
            self.counts.iter().for_each(|counts| counts.late(tier));
        }
        let total_us = us(received.elapsed());
        let answer = header.answer(status, total_us, 1.0);
        let head = FrameHeader { tier: tier_number(tier), ..answer }.encode();
        let mut message = [0; OUT_HEAD_MAX + HEADER_LEN];
        let (frame, len) = wire::out_head(opcode::BINARY, head.len());
        message[..len].copy_from_slice(&frame[OUT_HEAD_MAX - len..]);
        message[len..len + head.len()].copy_from_slice(&head);
        self.out.send_copy(&message[..len + head.len()]);
    }

    /// Sends the answer that a thread has made.
    fn answer(&self, done: Done) {
        let Some(mut header) = done.header else { return };
        header.queue_us = us(done.times.queue);
        header.infer_us = us(done.times.infer);
        header.flags = done.meta.flags;
        let (bytes, scale) = match done.outcome {
            Outcome::Map { bytes, scale } if !is_past(done.deadline) => (bytes, scale),
            outcome @ (Outcome::Map { .. } | Outcome::Late(_)) => {
                let stage = if let Outcome::Late(stage) = outcome { stage } else { Stage::Sending };
                self.app.metrics.late(Transport::Session, stage);
                return self.send_status(&header, done.tier, FrameStatus::Late, done.received);
            }
            Outcome::Failed(problem) => return self.refuse(problem, Some(header.sequence)),
            Outcome::Gone => {
                self.app.metrics.of(Transport::Session).gone.inc();
                return;
            }
        };
        let total_us = us(done.received.elapsed());
        let mut head = header.answer(FrameStatus::Ok, total_us, scale).windowed(done.meta.window);
        head.tier = tier_number(done.tier);
        if let Output::Samples(sample_type) = done.output {
            head.sample_type = sample_type;
        }
        // Counted before it is sent, so that a client which has the answer finds it in the metrics.
        self.app.metrics.of(Transport::Session).ok.inc();
        self.counts.iter().for_each(|counts| counts.good(done.tier));
        let timers = self.app.metrics.tier(done.tier);
        let start = Instant::now();
        self.send(bytes, &head);
        timers.send.observe(start.elapsed());
        timers.total.observe(done.received.elapsed());
    }

    /// Writes both headers into the free bytes before the payload, and sends it all.
    fn send(&self, mut bytes: BytesMut, head: &FrameHeader) {
        let (frame, len) = wire::out_head(opcode::BINARY, bytes.len() - HEADROOM);
        bytes[HEADROOM - len..HEADROOM].copy_from_slice(&frame[OUT_HEAD_MAX - len..]);
        let head = head.encode();
        bytes[HEADROOM..HEADROOM + head.len()].copy_from_slice(&head);
        self.out.send(&bytes.freeze().slice(HEADROOM - len..));
    }
}

impl Sink for Reply {
    fn deliver(&self, done: Done) {
        self.answer(done);
        self.finish();
    }

    fn is_gone(&self) -> bool {
        self.is_over.load(Ordering::Acquire)
    }

    fn take_back(&self, recycler: &mut Recycler) {
        self.app.store.keep_answers(recycler);
    }
}

fn us(time: Duration) -> u32 {
    u32::try_from(time.as_micros()).unwrap_or(u32::MAX)
}

/// The number by which answers name a tier.
pub(super) fn tier_number(tier: usize) -> u16 {
    u16::try_from(tier).unwrap_or(u16::MAX)
}
