//! The body of a session: frames in, answers out.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::extract::ws::Message;
use bytes::{Bytes, BytesMut};
use papilla_proto::{
    ErrorCode, FrameHeader, FrameKind, FrameStatus, HEADER_LEN, MAP_SIDE_PX, Problem, ServerMessage,
};
use tokio::sync::mpsc;

use super::{
    End, Event, Line, drained,
    hello::{self, Terms},
};
use crate::{
    codec::{Input, Output},
    metrics::Transport,
    pool::{Done, Job, Outcome, Recycler, Slot, Stage, is_past},
    problem,
};

/// An open session.
pub(super) struct Session {
    pub(super) number: u64,
    pub(super) terms: Terms,
    pub(super) slot: Arc<Slot>,
    pub(super) answers: mpsc::Receiver<Done>,
    /// Frames accepted and not yet answered: none, one with a thread, one in the slot.
    pub(super) outstanding: usize,
    /// Buffers of answers that are a header alone.
    pub(super) short_answers: Recycler,
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
        match hello::renew(&line.app, text, self.number) {
            Ok((terms, ready)) => {
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
        let job = match job {
            Ok(job) => job,
            Err(problem) => {
                line.app.metrics.of(Transport::Session).error.inc();
                return line.complain(problem, FrameHeader::peek_sequence(&frame)).await;
            }
        };
        if let (true, Some(header)) = (job.is_late(), job.header) {
            line.app.metrics.late(Transport::Session, Stage::Admission);
            return self.answer_short(line, &header, FrameStatus::Late, received).await;
        }
        match line.app.entrance.submit(&self.slot, job) {
            Ok(None) => {
                self.outstanding += 1;
                Ok(())
            }
            Ok(Some(Job { header: Some(header), received, .. })) => {
                line.app.metrics.of(Transport::Session).superseded.inc();
                self.answer_short(line, &header, FrameStatus::Superseded, received).await
            }
            Ok(Some(Job { header: None, .. })) => Ok(()),
            Err(job) => {
                line.app.metrics.of(Transport::Session).error.inc();
                let sequence = job.header.map(|header| header.sequence);
                line.complain(problem::shutting_down(), sequence).await
            }
        }
    }

    /// The job a frame asks for.
    fn job(&self, frame: &Bytes, received: Instant) -> Result<Job, Problem> {
        let header = FrameHeader::decode(frame).map_err(problem::of_frame)?;
        let wrong_type = |field, message| Problem::new(ErrorCode::WrongType, message).at(field);
        if header.kind != FrameKind::Pressure {
            return Err(wrong_type("kind", "clients send pressure, kind 1".to_owned()));
        }
        if header.status != FrameStatus::Ok {
            return Err(wrong_type("status", "the status of a request is 0".to_owned()));
        }
        let sample_type = self.terms.sample_type;
        if header.sample_type != sample_type {
            let message =
                format!("the hello announced {sample_type:?}, not {:?}", header.sample_type);
            return Err(wrong_type("sample_type", message));
        }
        let (width, height) = (usize::from(header.width), usize::from(header.height));
        if (width, height) != (MAP_SIDE_PX, MAP_SIDE_PX) {
            let message = format!("the frame is {width} x {height}, 224 x 224 is due");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("width"));
        }
        let payload = frame.slice(HEADER_LEN..);
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
            input: Input::Samples { sample_type, scale },
            output: Output::Samples(sample_type),
            header: Some(header),
            received,
            deadline: budget_us.map(|us| received + Duration::from_micros(us.into())),
        })
    }

    /// Sends what a thread made of a frame.
    async fn answer(&mut self, line: &mut Line, done: Done) -> Result<(), End> {
        self.outstanding = self.outstanding.saturating_sub(1);
        let Some(header) = done.header else { return Ok(()) };
        let metrics = Arc::clone(&line.app.metrics);
        let counts = metrics.of(Transport::Session);
        let (mut bytes, scale) = match done.outcome {
            Outcome::Map { bytes, scale } if !is_past(done.deadline) => (bytes, scale),
            Outcome::Map { .. } => {
                metrics.late(Transport::Session, Stage::Sending);
                return self.answer_short(line, &header, FrameStatus::Late, done.received).await;
            }
            Outcome::Late(stage) => {
                metrics.late(Transport::Session, stage);
                return self.answer_short(line, &header, FrameStatus::Late, done.received).await;
            }
            Outcome::Failed(problem) => {
                counts.error.inc();
                return line.complain(problem, Some(header.sequence)).await;
            }
        };
        let head = header.answer(FrameStatus::Ok, elapsed_us(done.received), scale);
        put_header(&mut bytes, &head);
        // Counted before it is sent: whoever has the answer finds it in the metrics.
        counts.ok.inc();
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
        status: FrameStatus,
        received: Instant,
    ) -> Result<(), End> {
        let buffer = self.short_answers.claim(HEADER_LEN);
        buffer.resize(HEADER_LEN, 0);
        let mut bytes = buffer.split();
        put_header(&mut bytes, &header.answer(status, elapsed_us(received), 1.0));
        line.send(Message::Binary(bytes.freeze())).await
    }
}

/// Writes the header over the first 32 bytes.
fn put_header(bytes: &mut BytesMut, header: &FrameHeader) {
    if let Some(room) = bytes.first_chunk_mut() {
        *room = header.encode();
    }
}

fn elapsed_us(since: Instant) -> u32 {
    u32::try_from(since.elapsed().as_micros()).unwrap_or(u32::MAX)
}
