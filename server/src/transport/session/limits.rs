//! How much of one client's input is handled at a time, so that other sessions do not wait for it.

use std::{
    num::NonZeroU32,
    time::{Duration, Instant},
};

use governor::{
    Quota, RateLimiter,
    clock::{Clock, MonotonicClock},
    middleware::NoOpMiddleware,
    state::{InMemoryState, NotKeyed},
};
use papilla_proto::{ErrorCode, Problem};

/// Length of a turn. What a session may do in a turn takes a fraction of it. If a client sends
/// more, its bytes wait in the system's buffers until the next turn.
const TURN: Duration = Duration::from_millis(2);

/// WebSocket frames handled in a turn: 4000 a second, four times what a force loop sends. Beyond
/// that nearly all are superseded anyway. Without this limit four such clients over TLS kept two
/// threads busy.
const FRAMES_MAX: u32 = 8;

/// Bytes read in a turn: 262 MB/s, which is a third more than 1000 float32 maps a second.
const BYTES_MAX: usize = 512 << 10;

/// Reads of the socket in a turn, however few bytes each brings.
const READS_MAX: u32 = 128;

/// Pings and pongs that a session may send: how many a second, and how many at once.
const CONTROL_PER_S: NonZeroU32 = NonZeroU32::new(200).unwrap();
const CONTROL_BURST: NonZeroU32 = NonZeroU32::new(400).unwrap();

/// Text messages that a session may send: how many a second, and how many at once. A text may be a
/// hello, which places points and takes memory.
const TEXT_PER_S: NonZeroU32 = NonZeroU32::new(4).unwrap();
const TEXT_BURST: NonZeroU32 = NonZeroU32::new(8).unwrap();

type Bucket<C> = RateLimiter<NotKeyed, InMemoryState, C, NoOpMiddleware<<C as Clock>::Instant>>;

/// What a session has done in this turn, and what it may still do.
#[derive(Debug)]
pub(super) struct Limits<C: Clock = MonotonicClock> {
    begun: Instant,
    frames: u32,
    reads: u32,
    bytes: usize,
    control: Bucket<C>,
    text: Bucket<C>,
    clock: C,
    /// Nothing is read before this time. None: there is no such pause.
    paused_until: Option<Instant>,
}

impl Limits {
    pub(super) fn new(now: Instant) -> Self {
        Self::with_clock(now, MonotonicClock)
    }
}

impl<C: Clock + Clone> Limits<C> {
    fn with_clock(now: Instant, clock: C) -> Self {
        let bucket = |per_s, burst| {
            RateLimiter::direct_with_clock(
                Quota::per_second(per_s).allow_burst(burst),
                clock.clone(),
            )
        };
        let control = bucket(CONTROL_PER_S, CONTROL_BURST);
        let text = bucket(TEXT_PER_S, TEXT_BURST);
        Self { begun: now, frames: 0, reads: 0, bytes: 0, control, text, clock, paused_until: None }
    }

    /// When the session may go on. None: at once.
    pub(super) fn resume_at(&mut self, now: Instant) -> Option<Instant> {
        if let Some(until) = self.paused_until.filter(|until| *until > now) {
            return Some(until);
        }
        self.paused_until = None;
        let end = self.begun + TURN;
        if now >= end {
            // The timer may fire up to a turn late. If the next turn were counted from then, it
            // would be half as long again, and a session that once fell behind would never catch
            // up.
            let begun = if now < end + TURN { end } else { now };
            (self.begun, self.frames, self.reads, self.bytes) = (begun, 0, 0, 0);
            return None;
        }
        let is_over =
            self.frames >= FRAMES_MAX || self.reads >= READS_MAX || self.bytes >= BYTES_MAX;
        is_over.then_some(end)
    }

    pub(super) fn on_read(&mut self, bytes: usize) {
        self.reads += 1;
        self.bytes += bytes;
    }

    pub(super) fn on_frame(&mut self) {
        self.frames += 1;
    }

    /// Counts a ping or a pong.
    ///
    /// # Errors
    /// The session has sent more than it may.
    pub(super) fn on_control(&self) -> Result<(), Problem> {
        self.control.check().map_err(|_| {
            let message = format!("more than {CONTROL_PER_S} control frames a second");
            Problem::new(ErrorCode::RateLimited, message)
        })
    }

    /// Counts a text message. If there were too many, the session pauses after this one.
    pub(super) fn on_text(&mut self, now: Instant) {
        if let Err(refused) = self.text.check() {
            self.paused_until = Some(now + refused.wait_time_from(self.clock.now()));
        }
    }
}

#[cfg(test)]
mod tests {
    use governor::clock::FakeRelativeClock;

    use super::*;

    #[test]
    fn a_turn_ends_with_its_frames_and_the_next_begins_in_time() {
        let start = Instant::now();
        let mut limits = Limits::new(start);
        for _ in 0..FRAMES_MAX {
            assert_eq!(limits.resume_at(start), None);
            limits.on_frame();
        }
        assert_eq!(limits.resume_at(start), Some(start + TURN));
        assert_eq!(limits.resume_at(start + TURN), None);
        assert_eq!(limits.resume_at(start + TURN), None);
    }

    #[test]
    fn a_turn_ends_with_its_bytes_or_reads_too() {
        let start = Instant::now();
        let mut limits = Limits::new(start);
        limits.on_read(BYTES_MAX);
        assert!(limits.resume_at(start).is_some());
        let mut limits = Limits::new(start);
        (0..READS_MAX).for_each(|_| limits.on_read(1));
        assert!(limits.resume_at(start).is_some());
    }

    #[test]
    fn a_timer_that_wakes_late_takes_nothing_of_the_rate() {
        let start = Instant::now();
        let (mut limits, mut now, mut bytes) = (Limits::new(start), start, 0);
        while now < start + Duration::from_secs(1) {
            if let Some(end) = limits.resume_at(now) {
                now = end + Duration::from_micros(1400);
                continue;
            }
            limits.on_read(16 << 10);
            bytes += 16 << 10;
        }
        assert!(bytes > 1000 * 200_752, "{bytes} bytes in a second");
    }

    #[test]
    fn control_frames_beyond_their_rate_are_refused_and_texts_pause_the_session() {
        let start = Instant::now();
        let mut limits = Limits::with_clock(start, FakeRelativeClock::default());
        let taken = (0..1000).take_while(|_| limits.on_control().is_ok()).count();
        assert_eq!(taken, CONTROL_BURST.get() as usize);
        (0..TEXT_BURST.get()).for_each(|_| limits.on_text(start));
        assert_eq!(limits.resume_at(start), None);
        limits.on_text(start);
        let resume = limits.resume_at(start).unwrap();
        assert_eq!(resume - start, Duration::from_secs(1) / TEXT_PER_S.get());
        assert_eq!(limits.resume_at(resume), None);
    }
}
