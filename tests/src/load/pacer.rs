//! When each frame is meant to leave, and the thread that says so.

use std::{
    thread,
    time::{Duration, Instant},
};

use tokio::sync::mpsc::UnboundedSender;

use super::Options;

/// The intended instant of every frame.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    start: Instant,
    rate_hz: f64,
    sessions: usize,
    /// Frames of each session that come before the counted ones.
    pub(super) warmup: u32,
    /// Frames of each session in all.
    pub(super) frames: u32,
}

impl Plan {
    pub(super) fn new(options: &Options, start: Instant) -> Self {
        let (warmup, counted) = options.frames();
        let sessions = options.sessions.get();
        Self { start, rate_hz: options.rate_hz, sessions, warmup, frames: warmup + counted }
    }

    /// When `frame` of `session` is meant to leave; sessions are evenly staggered.
    pub(super) fn intended(&self, session: usize, frame: u32) -> Instant {
        let periods = f64::from(frame) + session as f64 / self.sessions as f64;
        self.start + Duration::from_secs_f64(periods / self.rate_hz)
    }

    /// Tells every session when to send which frame; returns after the last.
    ///
    /// A thread of its own: the timers of an async runtime are good to a millisecond only.
    pub(super) fn keep(&self, beats: &[UnboundedSender<u32>]) {
        for frame in 0..self.frames {
            for (session, beat) in beats.iter().enumerate() {
                let wait = self.intended(session, frame).saturating_duration_since(Instant::now());
                if !wait.is_zero() {
                    thread::sleep(wait);
                }
                // Err: that session is over; the others go on.
                let _ = beat.send(frame);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[test]
    fn frames_are_a_period_apart_and_sessions_staggered() {
        let arguments =
            ["papilla-load", "--sessions", "4", "--rate-hz", "100", "--duration-s", "2"];
        let start = Instant::now();
        let plan = Plan::new(&Options::parse_from(arguments), start);
        assert_eq!((plan.warmup, plan.frames), (100, 300));
        let at_us = |session, frame| (plan.intended(session, frame) - start).as_micros();
        assert_eq!([at_us(0, 0), at_us(0, 1), at_us(0, 200)], [0, 10_000, 2_000_000]);
        assert_eq!([at_us(1, 0), at_us(3, 7)], [2_500, 77_500]);
    }
}
