//! One session under load: a thread that sends, a thread that hears.

use std::{
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use papilla_proto::{
    FrameHeader, FrameKind, FrameStatus, HEADER_LEN, SessionError,
    contact::{ROW, Touch},
};

use super::{
    TOLERANCE,
    content::Encoded,
    follow::{Follow, Move},
    pacer::Plan,
    tally::Tally,
    tally::Times,
    verify::Reference,
    wire::{Hearer, Mouth, Said},
};
use crate::socket::SocketError;

/// What all sessions share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) plan: Plan,
    pub(super) encoded: Encoded,
    pub(super) reference: Option<Arc<Reference>>,
    /// How long a map may take to be in time; none: any time will do.
    pub(super) deadline: Option<Duration>,
    /// What frames hold.
    pub(super) kind: FrameKind,
    /// How sessions go on elsewhere; none: they do not.
    pub(super) follow: Option<Follow>,
    /// How long to wait after the last frame.
    pub(super) drain: Duration,
}

/// Runs one session to its end: hears here, sends on a thread beside.
pub(super) fn run(shared: &Shared, session: usize, mouth: Mouth, mut hearer: Hearer) -> Tally {
    let mut ear = Ear::new(shared, session);
    let sent = thread::scope(|scope| {
        let sending = scope.spawn(|| send(shared, session, mouth));
        ear.listen(&mut hearer);
        if ear.outstanding > 0 {
            // The other thread may wait for a server that reads no more.
            hearer.end();
        }
        sending.join()
    });
    let mut tally = ear.tally();
    match sent {
        Ok((mut mouth, delay)) => {
            mouth.close();
            tally.send_delay = delay;
        }
        Err(_) => tally.ended.push(format!("session {session}: the sending thread panicked")),
    }
    tally
}

/// Sends each frame when its time has come; the timers of an async runtime are good to a
/// millisecond only.
fn send(shared: &Shared, session: usize, mut mouth: Mouth) -> (Mouth, Times) {
    let Shared { plan, encoded, .. } = shared;
    let mut delay = Times::default();
    for number in 0..plan.frames {
        let intended = plan.intended(session, number);
        let wait = intended.saturating_duration_since(Instant::now());
        if !wait.is_zero() {
            thread::sleep(wait);
        }
        // Comes back with the answer: the listener counts from it.
        let time_us = plan.start.elapsed().as_micros() as u64;
        let mut header =
            FrameHeader::pressure(number, time_us, 0, encoded.sample_type, encoded.scale);
        if shared.kind == FrameKind::Objects {
            header = header.of_finger(shared.kind, (number % plan.fingers) as u8, [ROW as u16, 1]);
        }
        if number >= plan.warmup {
            delay.record(intended.elapsed());
        }
        let payload = &encoded.payloads[encoded.index(session, number, plan.fingers)];
        // Err: the listener hears of it too, and says why, or opens another connection.
        if mouth.send(&header, payload).is_err() && shared.follow.is_none() {
            break;
        }
    }
    (mouth, delay)
}

/// Hears the answers of one session.
pub(super) struct Ear<'a> {
    shared: &'a Shared,
    session: usize,
    tally: Tally,
    answered: Vec<bool>,
    outstanding: u32,
    last_map: Option<Instant>,
    /// By finger.
    newest: Vec<Newest>,
    scratch: Vec<f32>,
}

/// The newest map of a finger.
#[derive(Clone, Copy, Default)]
struct Newest {
    number: Option<u32>,
    /// Up to when its age has been noted.
    aged_until: Option<Instant>,
}

/// Time between two looks at the age of the newest map.
const LOOK: Duration = Duration::from_millis(1);

impl<'a> Ear<'a> {
    pub(super) fn new(shared: &'a Shared, session: usize) -> Self {
        let frames = shared.plan.frames;
        Self {
            shared,
            session,
            tally: Tally { frames: u64::from(frames - shared.plan.warmup), ..Tally::default() },
            answered: vec![false; frames as usize],
            outstanding: frames,
            last_map: None,
            newest: vec![Newest::default(); shared.plan.fingers as usize],
            scratch: Vec::new(),
        }
    }

    /// Until every frame is answered, the session ends, or nothing comes any more.
    fn listen(&mut self, hearer: &mut Hearer) {
        let Shared { plan, drain, .. } = self.shared;
        let last = plan.intended(self.session, plan.frames - 1) + *drain;
        let (follow, hold) = (self.shared.follow.as_ref(), hearer.hold());
        let mut moving = follow.map(|follow| Move::new(follow, &hold));
        while self.outstanding > 0 {
            let said = match hearer.receive(last) {
                Ok(Some((now, Said::Frame(header, payload)))) => {
                    self.frame(now, &header, payload);
                    None
                }
                Ok(Some((_, Said::Error(error)))) => {
                    self.error(&error);
                    None
                }
                Ok(Some((_, Said::Reconnect))) => {
                    moving.iter_mut().for_each(Move::begin);
                    None
                }
                Ok(Some((_, Said::Sealed(state)))) => Some(state.to_vec()),
                Err(error) => {
                    let Some((follow, moving)) = follow.zip(moving.as_mut()) else {
                        return self.end(&error);
                    };
                    moving.give_up();
                    if !follow.reopen(hearer, last) {
                        return self.end(&error);
                    }
                    self.tally.reopened += 1;
                    None
                }
                // What is outstanding is lost.
                Ok(None) => return,
            };
            if let Some(moving) = &mut moving {
                match said {
                    Some(state) => {
                        if let Some(held) = moving.end(hearer, state) {
                            self.tally.held.record(held);
                        }
                    }
                    None => moving.go_on(hearer),
                }
            }
        }
    }

    fn end(&mut self, error: &SocketError) {
        self.tally.ended.push(format!("session {}: {error}", self.session));
    }

    fn error(&mut self, error: &SessionError) {
        if error.sequence.is_none_or(|number| self.settle(number)) {
            *self.tally.errors.entry(error.code.to_string()).or_default() += 1;
        }
        if error.closes && self.shared.follow.is_none() {
            self.tally.ended.push(format!("session {}: {}", self.session, error.message));
        }
    }

    /// Takes an answer.
    pub(super) fn frame(&mut self, now: Instant, header: &FrameHeader, payload: &[u8]) {
        let number = header.sequence;
        let counts = self.settle(number);
        if header.status == FrameStatus::Ok {
            self.age(now, number);
            self.order(number);
            self.verify(header, payload);
        }
        if !counts {
            return;
        }
        match header.status {
            FrameStatus::Ok => {
                let intended = self.shared.plan.intended(self.session, number);
                let time = now.saturating_duration_since(intended);
                self.tally.ok += 1;
                self.tally.in_time += u64::from(self.shared.deadline.is_none_or(|d| time <= d));
                self.tally.round_trip.record(time);
                if let Some(before) = self.last_map.replace(now) {
                    self.tally.gap.record(now.saturating_duration_since(before));
                }
                self.tally.server.record(Duration::from_micros(header.time_us.into()));
                self.parts(now, header, payload);
                let sent = &self.shared.encoded.payloads[0][..];
                self.tally.bytes = [sent, payload].map(|part| HEADER_LEN + part.len());
            }
            FrameStatus::Stale => self.tally.stale += 1,
            FrameStatus::Superseded => self.tally.superseded += 1,
            FrameStatus::Late => self.tally.late += 1,
            FrameStatus::Error => {
                *self.tally.errors.entry("status error".to_owned()).or_default() += 1;
            }
        }
    }

    /// Takes note that a frame is answered; false if its answer is not to be counted.
    fn settle(&mut self, number: u32) -> bool {
        match self.answered.get_mut(number as usize) {
            Some(answered) if !*answered => {
                *answered = true;
                self.outstanding -= 1;
                number >= self.shared.plan.warmup
            }
            _ => {
                self.tally.unexpected += 1;
                false
            }
        }
    }

    /// Where the time went, as the answer tells.
    fn parts(&mut self, now: Instant, header: &FrameHeader, payload: &[u8]) {
        let infer = Duration::from_micros(header.infer_us.into());
        let sent = self.shared.plan.start + Duration::from_micros(header.client_time_us);
        let queue = Duration::from_micros(header.queue_us.into());
        self.tally.queue.record(queue);
        self.tally.infer.record(infer);
        let mut known = queue + infer;
        let solves = self.shared.kind == FrameKind::Objects;
        if let Some(touch) = Touch::decode(payload).filter(|_| solves) {
            let solve = Duration::try_from_secs_f32(touch.solve_us * 1e-6).unwrap_or_default();
            self.tally.solve.record(solve);
            known += solve;
        }
        let server = Duration::from_micros(header.time_us.into());
        self.tally.rest.record(server.saturating_sub(known));
        let overhead = now.saturating_duration_since(sent).saturating_sub(infer);
        self.tally.overhead.record(overhead);
    }

    /// Takes note of how old the newest map was, each millisecond until this one came.
    fn age(&mut self, now: Instant, number: u32) {
        let plan = &self.shared.plan;
        let of_finger = &mut self.newest[(number % plan.fingers) as usize];
        let Some(last) = of_finger.number.filter(|&last| last < number) else { return };
        if number < plan.warmup {
            return;
        }
        let intended = plan.intended(self.session, last);
        let mut look = of_finger.aged_until.unwrap_or(now);
        while look < now {
            self.tally.age.record(look.saturating_duration_since(intended));
            look += LOOK;
        }
        of_finger.aged_until = Some(look);
    }

    fn order(&mut self, number: u32) {
        let fingers = self.shared.plan.fingers;
        let newest = &mut self.newest[(number % fingers) as usize].number;
        if newest.is_some_and(|last| number < last) {
            self.tally.out_of_order += 1;
        }
        *newest = (*newest).max(Some(number));
    }

    fn verify(&mut self, header: &FrameHeader, payload: &[u8]) {
        let Some(reference) = &self.shared.reference else { return };
        let index =
            self.shared.encoded.index(self.session, header.sequence, self.shared.plan.fingers);
        let difference = reference.difference(index, header, payload, &mut self.scratch);
        self.tally.compare(difference, TOLERANCE);
    }

    /// Takes note that a frame was refused, and why.
    pub(super) fn refused(&mut self, number: u32, reason: &str) {
        if self.settle(number) {
            *self.tally.errors.entry(reason.to_owned()).or_default() += 1;
        }
    }

    pub(super) fn tally(mut self) -> Tally {
        let counted = self.answered.iter().skip(self.shared.plan.warmup as usize);
        self.tally.lost = counted.filter(|answered| !**answered).count() as u64;
        self.tally
    }
}
