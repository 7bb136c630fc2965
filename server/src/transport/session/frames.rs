//! Frames of an open session: each is checked and put into its slot, or refused.

use std::{
    fmt::Display,
    sync::Arc,
    time::{Duration, Instant},
};

use bytes::Bytes;
use papilla_codec::{Input, Output};
use papilla_metrics::{Stage, Transport};
use papilla_proto::{
    ClientMessage, ErrorCode, FrameHeader, FrameStatus, HEADER_LEN, Problem, Reconnect,
    ReconnectReason, ServerMessage, contact::FINGERS_MAX,
};
use tokio::{task::spawn_blocking, time::timeout};

use super::{
    End,
    connection::{Connection, Event, Wait},
    drained,
    fresh::Freshness,
    hello,
    reply::Reply,
    terms::Terms,
};
use crate::{
    core::{
        buffers::HEADROOM,
        catalogue::places,
        scheduler::{Account, Job, JobOptions, Slot},
    },
    problem,
    transport::app::App,
};

/// An open session.
pub(super) struct Session {
    pub(super) number: u64,
    pub(super) terms: Terms,
    lanes: Vec<Lane>,
    /// The account that its frames are charged to. All its fingers share the turns of one session.
    account: Arc<Account>,
}

/// The slot of one finger, and what tells its stale frames.
struct Lane {
    fresh: Freshness,
    slot: Arc<Slot>,
}

/// How far an open session is from its end.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Open,
    /// The server drains, and the client was asked to go on elsewhere.
    Leaving,
    /// The server drains: accepted frames are answered, and no more are taken.
    Draining,
}

/// Serves the session until one side ends it. Before a drain ends it, every accepted frame is
/// answered.
pub(super) async fn serve(connection: &mut Connection, mut session: Session) -> End {
    // Requests for a sealed state that are not answered. Each has an answer of its own, since clients
    // count them; the rate of text messages bounds them.
    let (mut phase, mut seals_due) = (Phase::Open, 0_u32);
    session.set_stay(connection);
    loop {
        let draining = phase == Phase::Draining;
        if (draining || seals_due > 0) && connection.reply.is_settled() {
            if draining {
                return drained();
            }
            session.seal(Arc::clone(&connection.reply), Arc::clone(&connection.app)).await;
            seals_due -= 1;
            continue;
        }
        let wait = Wait { drain: phase == Phase::Open, settled: draining || seals_due > 0 };
        match connection.next(wait).await {
            Err(end) => return end,
            Ok(Event::Draining) if session.terms.follows.is_some() => {
                phase = Phase::Leaving;
                let grace = connection.app.moves.grace;
                ask_to_move(connection, ReconnectReason::Drain, Some(grace));
                connection.call_after(Some(grace));
            }
            Ok(Event::Draining) => phase = Phase::Draining,
            Ok(Event::Due) if phase == Phase::Open => {
                ask_to_move(connection, ReconnectReason::Age, None);
                session.set_stay(connection);
            }
            Ok(Event::Due) => phase = Phase::Draining,
            Ok(Event::Settled) => {}
            Ok(Event::Binary(frame, received)) => {
                session.take(connection, &frame, received, draining);
            }
            Ok(Event::Text(_)) if draining => {
                connection.reply.send_error(problem::shutting_down(), None);
            }
            Ok(Event::Text(text)) => match hello::parse(connection, &text).await {
                Ok(Ok(Ok(ClientMessage::Seal))) if session.terms.follows.is_some() => {
                    seals_due = seals_due.saturating_add(1);
                }
                Ok(Ok(said)) => {
                    if let Err(end) = session.renew(connection, said).await {
                        return end;
                    }
                }
                Ok(Err(problem)) => connection.reply.send_error(problem, None),
                Err(end) => return end,
            },
        }
    }
}

/// Asks the client to go on over another connection.
fn ask_to_move(connection: &Connection, reason: ReconnectReason, within: Option<Duration>) {
    let within_ms = within.map(|time| u64::try_from(time.as_millis()).unwrap_or(u64::MAX));
    let ask = Reconnect { reason, within_ms };
    connection.reply.send_message(&ServerMessage::Reconnect(ask));
}

impl Session {
    /// A session on these terms.
    pub(super) fn new(number: u64, terms: Terms, connection: &Connection) -> Self {
        let account = Account::new(FINGERS_MAX);
        let mut session = Self { number, terms, lanes: Vec::new(), account };
        session.open_lanes(connection);
        session
    }

    /// Applies the terms. Slots that exist are kept, so that answers stay in order.
    fn open_lanes(&mut self, connection: &Connection) {
        let fresh = || Freshness::new(self.terms.stale_after_us);
        for lane in &mut self.lanes {
            lane.fresh = fresh();
        }
        let fingers = self.terms.hand.fingers().len();
        for _ in self.lanes.len()..fingers {
            let answers = connection.app.store.answers(self.terms.answer_len_max());
            let sink = Arc::clone(&connection.reply) as Arc<_>;
            let slot = Slot::new(answers, sink, Arc::clone(&self.account));
            self.lanes.push(Lane { fresh: fresh(), slot: Arc::new(slot) });
        }
    }

    /// Handles a hello for new terms, such as another tier. If it cannot be met, the old terms
    /// stand.
    async fn renew(&mut self, connection: &mut Connection, said: hello::Said) -> Result<(), End> {
        match hello::renew(connection, said, self.number).await? {
            Ok((terms, ready)) => {
                self.terms = terms;
                self.open_lanes(connection);
                connection.inbound.expect_fingers(self.lanes.len(), &connection.app.store);
                if !*connection.app.drain.borrow() {
                    self.set_stay(connection);
                }
                connection.reply.send_message(&ServerMessage::Ready(Box::new(ready)));
            }
            Err(problem) => connection.reply.send_error(problem, None),
        }
        Ok(())
    }

    /// Sets when the client is asked to reconnect, if its hello said that it follows such a
    /// request.
    fn set_stay(&self, connection: &mut Connection) {
        let stay = self.terms.follows.and_then(|_| connection.app.moves.stay());
        connection.call_after(stay);
    }

    /// Sends the sealed state of the session. Called only when every accepted frame is answered.
    async fn seal(&self, reply: Arc<Reply>, app: Arc<App>) {
        let Some(shape) = self.terms.follows else { return };
        let terms = self.terms.sealed_for(&app, &shape);
        let (memory, wait_max) = (self.terms.memory(), app.timeouts.io);
        // Copying and encrypting up to a MiB takes too long for a worker thread of tokio.
        let sealing = spawn_blocking(move || memory.seal(&app, &terms));
        let failed = |error: &dyn Display| {
            reply.send_error(problem::internal("the state cannot be sealed", error), None);
        };
        match timeout(wait_max, sealing).await {
            Ok(Ok(Ok(sealed))) => reply.send_binary(&sealed),
            Ok(Ok(Err(error))) => failed(&error),
            Ok(Err(error)) => failed(&error),
            Err(error) => failed(&error),
        }
    }

    /// Puts one frame into its slot, or answers it at once if it is invalid, stale or late.
    fn take(&mut self, connection: &Connection, frame: &Bytes, received: Instant, draining: bool) {
        self.keep_budget(connection, received);
        let (reply, metrics) = (&connection.reply, &connection.app.metrics);
        let job = if draining { Err(problem::shutting_down()) } else { self.job(frame, received) };
        let job = match job {
            Ok(job) => job,
            Err(problem) => return reply.refuse(problem, FrameHeader::peek_sequence(frame)),
        };
        let Some(header) = job.options.header else { return };
        let Some(lane) = self.lanes.get_mut(usize::from(header.finger)) else { return };
        if lane.fresh.is_stale(header.sequence, header.client_time_us, received) {
            metrics.of(Transport::Session).stale.inc();
            return reply.send_status(&header, job.tier, FrameStatus::Stale, received);
        }
        if job.is_late() {
            metrics.late(Transport::Session, Stage::Admission);
            return reply.send_status(&header, job.tier, FrameStatus::Late, received);
        }
        reply.begin();
        match connection.app.pool.submit(&lane.slot, job) {
            Ok(None) => {}
            Ok(Some(Job { tier, received, options: JobOptions { header, .. }, .. })) => {
                if let Some(header) = header {
                    metrics.of(Transport::Session).superseded.inc();
                    reply.send_status(&header, tier, FrameStatus::Superseded, received);
                }
                reply.finish();
            }
            Err(_) => {
                reply.refuse(problem::shutting_down(), Some(header.sequence));
                reply.finish();
            }
        }
    }

    /// Changes the tier of each finger whose budget calls for another one.
    fn keep_budget(&mut self, connection: &Connection, now: Instant) {
        let counts = &connection.reply.counts;
        for (part, counts) in self.terms.parts_mut().iter_mut().zip(counts) {
            let Some(budget) = &mut part.budget else { continue };
            let catalogue = connection.app.reloader.catalogue_at(part.finger);
            let Some(catalogue) = catalogue else { continue };
            let old = places(part.tier).1;
            if let Some(place) = budget.next(&catalogue, old, counts, now) {
                let (from, to) = (&catalogue.tiers[old], &catalogue.tiers[place]);
                let (session, from, to) = (self.number, &from.name, &to.name);
                tracing::debug!(session, from, to, "another tier");
                part.move_to(&catalogue, place);
            }
        }
    }

    /// The job a frame asks for.
    fn job(&self, frame: &Bytes, received: Instant) -> Result<Job, Problem> {
        let header = FrameHeader::decode(frame).map_err(problem::of_frame)?;
        let finger = self.terms.hand.form().accept(&header, self.terms.sample_type)?;
        let payload = frame.slice(HEADER_LEN..);
        let hand = &self.terms.hand;
        let due = hand.form().payload_len(&header);
        if payload.len() != due {
            let found = payload.len();
            let message = format!("the payload has {found} bytes, {due} are due");
            return Err(Problem::new(ErrorCode::WrongLength, message).at("payload"));
        }
        let scale = match self.terms.pressure_scale_pa {
            // A scale of 0 or -0 in the header means the scale of the hello.
            Some(scale) if header.scale.abs() <= 0.0 => scale,
            _ => header.scale,
        };
        let budget_us = match header.time_us {
            0 => self.terms.budget_us,
            us => Some(us),
        };
        let part = self.terms.part(finger);
        Ok(Job {
            tier: part.tier,
            payload,
            input: Input::Window {
                window: header.window(),
                sample_type: header.sample_type,
                scale,
            },
            output: Output::Samples(self.terms.answer_sample_type),
            received,
            deadline: budget_us.map(|us| received + Duration::from_micros(us.into())),
            options: JobOptions {
                headroom: HEADROOM + HEADER_LEN,
                out_of_range: self.terms.out_of_range,
                time_us: header.client_time_us,
                effects: self.terms.effects.get(finger).cloned(),
                finger: hand.fingers().get(finger).cloned(),
                contact_us: part.contact_us,
                is_contact_alone: !self.terms.shows_sed(),
                header: Some(header),
            },
        })
    }
}
