//! The body of a session: frames in, answers out.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::extract::ws::Message;
use bytes::{Bytes, BytesMut};
use papilla_proto::{
    ErrorCode, Extension, FrameHeader, FrameKind, FrameStatus, Problem, ServerMessage, Window,
};
use tokio::sync::mpsc;

use super::{
    End, Event, Line, drained,
    fresh::Freshness,
    hello::{self, Terms, tier_number},
};
use crate::{
    codec::{Input, Output},
    metrics::Transport,
    pool::{Done, Frame, Job, Outcome, Recycler, Slot, Stage, is_past},
    problem,
};

/// An open session.
pub(super) struct Session {
    pub(super) number: u64,
    pub(super) terms: Terms,
    pub(super) fresh: Freshness,
    pub(super) slot: Arc<Slot>,
    pub(super) answers: mpsc::Receiver<Done>,
    /// Frames accepted and not yet answered: none, one with a thread, one in the slot.
    pub(super) outstanding: usize,
    /// Buffers of answers that are a header alone.
    pub(super) short_answers: Recycler,
    /// Copies of frames: one with a thread, one in the slot, one to take its place.
    pub(super) waiting: Recycler,
}

/// Serves until somebody ends it; every accepted frame is answered before a drain ends it.
pub(super) async fn serve(line: &mut Line, mut session: Session) -> End {
    let mut draining = false;
    loop {
        if draining && session.outstanding == 0 {
            return drained();
        }
        let result = match line.next(Some(&mut session.answers), draining).await {
            Err(end) => Err(end),
            Ok(Event::Draining) => {
                draining = true;
                Ok(())
            }
            Ok(Event::Answer(done)) => session.answer(line, done).await,
            Ok(Event::Message(Message::Binary(frame), received)) => {
                session.take(line, frame, received, draining).await
            }
            Ok(Event::Message(Message::Text(text), _)) => session.renew(line, &text).await,
            Ok(Event::Message(..)) => Ok(()),
        };
        if let Err(end) = result {
            return end;
        }
    }
}

impl Session {
    /// Takes a hello for new terms, such as another tier.
    async fn renew(&mut self, line: &mut Line, text: &str) -> Result<(), End> {
        match hello::renew(&line.app, text, self.number).await {
            Ok((terms, ready)) => {
                self.fresh = Freshness::new(terms.stale_after_us);
                self.terms = terms;
                line.say(&ServerMessage::Ready(ready)).await
            }
            Err(problem) => line.complain(problem, None).await,
        }
    }

    /// Takes one frame: into the slot, or back with an error.
    async fn take(
        &mut self,
        line: &mut Line,
        frame: Bytes,
        received: Instant,
        draining: bool,
    ) -> Result<(), End> {
        let job = if draining { Err(problem::shutting_down()) } else { self.job(&frame, received) };
        let mut job = match job {
            Ok(job) => job,
            Err(problem) => {
                line.app.metrics.of(Transport::Session).error.inc();
                return line.complain(problem, FrameHeader::peek_sequence(&frame)).await;
            }
        };
        let Some(Frame { header, .. }) = &job.frame else { return Ok(()) };
        let header = *header;
        // In version 1 sequences mean nothing to the server.
        let is_new = header.extension.is_some();
        if is_new && self.fresh.is_stale(header.sequence, header.client_time_us, received) {
            line.app.metrics.of(Transport::Session).stale.inc();
            return self.answer_short(line, &header, job.tier, FrameStatus::Stale, received).await;
        }
        if job.is_late() {
            line.app.metrics.late(Transport::Session, Stage::Admission);
            return self.answer_short(line, &header, job.tier, FrameStatus::Late, received).await;
        }
        // Held until a thread has decoded it, the reader's own memory would have to be replaced if
        // the next frame came before that: an allocation costs more than this copy.
        let copy = self.waiting.claim(job.payload.len());
        copy.extend_from_slice(&job.payload);
        job.payload = copy.split().freeze();
        match line.app.entrance.submit(&self.slot, job) {
            Ok(None) => {
                self.outstanding += 1;
                Ok(())
            }
            Ok(Some(Job { frame: Some(Frame { header, .. }), received, tier, .. })) => {
                line.app.metrics.of(Transport::Session).superseded.inc();
                self.answer_short(line, &header, tier, FrameStatus::Superseded, received).await
            }
            Ok(Some(Job { frame: None, .. })) => Ok(()),
            Err(_) => {
                line.app.metrics.of(Transport::Session).error.inc();
                line.complain(problem::shutting_down(), Some(header.sequence)).await
            }
        }
    }

    /// The job a frame asks for.
    fn job(&self, frame: &Bytes, received: Instant) -> Result<Job, Problem> {
        let header = FrameHeader::decode(frame).map_err(problem::of_frame)?;
        self.check(&header)?;
        let payload = frame.slice(header.header_len()..);
        if payload.len() != header.payload_len() {
            let (found, due) = (payload.len(), header.payload_len());
            let message = format!("the payload has {found} bytes, {due} are due");
            return Err(Problem::new(ErrorCode::WrongLength, message).at("payload"));
        }
        let scale = match self.terms.pressure_scale_pa {
            // All bits zero, or minus zero: left to the hello.
            Some(scale) if header.scale.abs() <= 0.0 => scale,
            _ => header.scale,
        };
        let budget_us = match header.time_us {
            0 => self.terms.budget_us,
            us => Some(us),
        };
        Ok(Job {
            tier: self.terms.tier,
            payload,
            input: Input::Samples { sample_type: header.sample_type, scale },
            output: Output::Samples(self.terms.answer_sample_type),
            frame: Some(Frame {
                header,
                takes_more: self.terms.takes_more,
                effects: self.terms.effects.clone(),
            }),
            received,
            deadline: budget_us.map(|us| received + Duration::from_micros(us.into())),
        })
    }

    /// Whether a header is that of a frame this session takes.
    fn check(&self, header: &FrameHeader) -> Result<(), Problem> {
        let wrong_type =
            |field, message| Err(Problem::new(ErrorCode::WrongType, message).at(field));
        let version = if header.extension.is_some() { 2 } else { 1 };
        if version != self.terms.version {
            let agreed = self.terms.version;
            let message = format!("the hello had version {agreed}, the frame has {version}");
            return Err(Problem::new(ErrorCode::UnknownVersion, message).at("version"));
        }
        if header.kind != FrameKind::Pressure {
            return wrong_type("kind", "clients send pressure, kind 1".to_owned());
        }
        if header.status != FrameStatus::Ok {
            return wrong_type("status", "the status of a request is 0".to_owned());
        }
        let sample_type = self.terms.sample_type;
        if header.sample_type != sample_type {
            let message =
                format!("the hello announced {sample_type:?}, not {:?}", header.sample_type);
            return wrong_type("sample_type", message);
        }
        let window = header.window();
        if header.extension.is_some() && !window.is_inside() {
            let Window { x, y, width, height } = window;
            let message =
                format!("the window of {width} x {height} at column {x}, row {y} leaves the map");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("x"));
        }
        if header.extension.is_none() && window != Window::WHOLE {
            let Window { width, height, .. } = window;
            let message = format!("the frame is {width} x {height}, 224 x 224 is due");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("width"));
        }
        Ok(())
    }

    /// Sends what a thread made of a frame.
    async fn answer(&mut self, line: &mut Line, done: Done) -> Result<(), End> {
        self.outstanding = self.outstanding.saturating_sub(1);
        let Some(mut header) = done.header else { return Ok(()) };
        if let Some(extension) = &mut header.extension {
            extension.queue_us = us(done.times.queue);
            extension.infer_us = us(done.times.infer);
            extension.flags = done.drawn.flags;
        }
        let metrics = Arc::clone(&line.app.metrics);
        let (mut bytes, scale) = match done.outcome {
            Outcome::Map { bytes, scale } if !is_past(done.deadline) => (bytes, scale),
            outcome @ (Outcome::Map { .. } | Outcome::Late(_)) => {
                let stage = if let Outcome::Late(stage) = outcome { stage } else { Stage::Sending };
                metrics.late(Transport::Session, stage);
                let late = FrameStatus::Late;
                return self.answer_short(line, &header, done.tier, late, done.received).await;
            }
            Outcome::Failed(problem) => {
                metrics.of(Transport::Session).error.inc();
                return line.complain(problem, Some(header.sequence)).await;
            }
        };
        let total_us = us(done.received.elapsed());
        let mut head = header.answer(FrameStatus::Ok, total_us, scale);
        if header.extension.is_some() {
            head = numbered(head.windowed(done.drawn.window), done.tier);
            head.kind = done.drawn.kind;
        }
        if let Output::Samples(sample_type) = done.output {
            head.sample_type = sample_type;
        }
        put_header(&mut bytes, &head);
        // Counted before it is sent: whoever has the answer finds it in the metrics.
        metrics.of(Transport::Session).ok.inc();
        let timers = metrics.tier(done.tier);
        let start = Instant::now();
        line.send(Message::Binary(bytes.freeze())).await?;
        timers.send.observe(start.elapsed());
        timers.total.observe(done.received.elapsed());
        Ok(())
    }

    /// Answers with a header alone.
    async fn answer_short(
        &mut self,
        line: &mut Line,
        header: &FrameHeader,
        tier: usize,
        status: FrameStatus,
        received: Instant,
    ) -> Result<(), End> {
        let total_us = us(received.elapsed());
        let head = numbered(header.answer(status, total_us, 1.0), tier);
        let buffer = self.short_answers.claim(head.header_len());
        buffer.resize(head.header_len(), 0);
        let mut bytes = buffer.split();
        put_header(&mut bytes, &head);
        line.send(Message::Binary(bytes.freeze())).await
    }
}

/// The header with the tier's number, where there is room for it.
fn numbered(header: FrameHeader, tier: usize) -> FrameHeader {
    let number = |extension| Extension { tier: tier_number(tier), ..extension };
    FrameHeader { extension: header.extension.map(number), ..header }
}

/// Writes the header over the first bytes.
fn put_header(bytes: &mut BytesMut, header: &FrameHeader) {
    let head = header.encode();
    if let Some(room) = bytes.get_mut(..head.len()) {
        room.copy_from_slice(&head);
    }
}

fn us(time: Duration) -> u32 {
    u32::try_from(time.as_micros()).unwrap_or(u32::MAX)
}
