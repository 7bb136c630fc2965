//! When each frame is meant to leave, and the thread that says so.

use std::{
    thread,
    time::{Duration, Instant},
};

use tokio::sync::mpsc::UnboundedSender;

use super::{Options, options::Arrivals};

/// The intended instant of every frame.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) start: Instant,
    rate_hz: f64,
    sessions: usize,
    arrivals: Arrivals,
    burst: u32,
    /// Seconds after the start, by session and frame; only where no formula gives them.
    drawn_s: Vec<Vec<f64>>,
    /// Frames that leave at one instant, one a finger.
    pub(super) fingers: u32,
    /// Frames of each session that come before the counted ones.
    pub(super) warmup: u32,
    /// Frames of each session in all.
    pub(super) frames: u32,
}

impl Plan {
    pub(super) fn new(options: &Options, start: Instant) -> Self {
        let (warmup, counted) = options.frames();
        let (sessions, instants) = (options.sessions.get(), warmup + counted);
        let fingers = u32::from(options.fingers);
        let drawn_s = match options.arrivals {
            Arrivals::Steady | Arrivals::Burst => Vec::new(),
            Arrivals::Poisson => {
                let mut random = fastrand::Rng::with_seed(options.seed);
                (0..sessions).map(|_| poisson(&mut random, instants, options.rate_hz)).collect()
            }
        };
        Self {
            start,
            rate_hz: options.rate_hz,
            sessions,
            arrivals: options.arrivals,
            burst: options.burst.get(),
            drawn_s,
            fingers,
            warmup: warmup * fingers,
            frames: instants * fingers,
        }
    }

    /// When `frame` of `session` is meant to leave.
    pub(super) fn intended(&self, session: usize, frame: u32) -> Instant {
        let frame = frame / self.fingers;
        let stagger = session as f64 / self.sessions as f64;
        let seconds = match self.arrivals {
            Arrivals::Steady => (f64::from(frame) + stagger) / self.rate_hz,
            Arrivals::Burst => {
                f64::from(self.burst) * (f64::from(frame / self.burst) + stagger) / self.rate_hz
            }
            Arrivals::Poisson => self.drawn_s[session][frame as usize],
        };
        self.start + Duration::from_secs_f64(seconds)
    }

    /// Tells every session when to send which frame; returns after the last.
    ///
    /// A thread of its own: the timers of an async runtime are good to a millisecond only.
    pub(super) fn keep(&self, beats: &[UnboundedSender<u32>]) {
        let mut next: Vec<u32> = vec![0; beats.len()];
        let due = |next: &[u32]| {
            let waiting = next.iter().enumerate().filter(|(_, frame)| **frame < self.frames);
            waiting.map(|(session, &frame)| (self.intended(session, frame), session)).min()
        };
        while let Some((instant, session)) = due(&next) {
            let wait = instant.saturating_duration_since(Instant::now());
            if !wait.is_zero() {
                thread::sleep(wait);
            }
            // Err: that session is over; the others go on.
            let _ = beats[session].send(next[session]);
            next[session] += 1;
        }
    }
}

/// Instants of a Poisson process, s.
fn poisson(random: &mut fastrand::Rng, frames: u32, rate_hz: f64) -> Vec<f64> {
    let mut now_s = 0.0;
    let instant = |_| {
        // 1 - u lies in (0, 1]: its logarithm is finite.
        now_s -= (1.0 - random.f64()).ln() / rate_hz;
        now_s
    };
    (0..frames).map(instant).collect()
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    fn plan(more: &[&str]) -> Plan {
        let arguments =
            ["papilla-load", "--sessions", "4", "--rate-hz", "100", "--duration-s", "2"];
        Plan::new(&Options::parse_from([&arguments[..], more].concat()), Instant::now())
    }

    fn at_us(plan: &Plan, session: usize, frame: u32) -> u128 {
        (plan.intended(session, frame) - plan.start).as_micros()
    }

    #[test]
    fn frames_are_a_period_apart_and_sessions_staggered() {
        let plan = plan(&[]);
        assert_eq!((plan.warmup, plan.frames), (100, 300));
        let found = [0, 1, 200].map(|frame| at_us(&plan, 0, frame));
        assert_eq!(found, [0, 10_000, 2_000_000]);
        assert_eq!([at_us(&plan, 1, 0), at_us(&plan, 3, 7)], [2_500, 77_500]);
    }

    #[test]
    fn bursts_come_at_once_and_keep_the_rate() {
        let plan = plan(&["--arrivals", "burst", "--burst", "5"]);
        let found = [0, 4, 5, 9, 10].map(|frame| at_us(&plan, 0, frame));
        assert_eq!(found, [0, 0, 50_000, 50_000, 100_000]);
        assert_eq!(at_us(&plan, 2, 0), 25_000);
    }

    #[test]
    fn random_arrivals_repeat_and_have_exponential_gaps() {
        let more = ["--arrivals", "poisson", "--seed", "3", "--duration-s", "200"];
        let (one, two) = (plan(&more), plan(&more));
        let instants: Vec<u128> = (0..one.frames).map(|frame| at_us(&one, 1, frame)).collect();
        assert!(instants.is_sorted());
        assert!((0..one.frames).all(|frame| at_us(&two, 1, frame) == instants[frame as usize]));
        assert_ne!(at_us(&one, 0, 7), at_us(&one, 1, 7), "sessions are independent");
        let gaps: Vec<f64> = instants.windows(2).map(|w| (w[1] - w[0]) as f64).collect();
        let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
        let longer = gaps.iter().filter(|gap| **gap > 10_000.0).count() as f64;
        // 20 000 gaps: the mean is good to 0.7 %, the share beyond it, 1/e, to 0.9 %.
        assert!((mean / 10_000.0 - 1.0).abs() < 0.03, "{mean} us");
        assert!((longer / gaps.len() as f64 - (-1.0_f64).exp()).abs() < 0.015);
    }

    #[test]
    fn frames_leave_in_the_order_of_their_instants() {
        let arguments = ["--arrivals", "poisson", "--duration-s", "0.05", "--warmup-s", "0"];
        let plan = plan(&arguments);
        let (beats, mut beaten): (Vec<_>, Vec<_>) =
            (0..4).map(|_| tokio::sync::mpsc::unbounded_channel()).unzip();
        plan.keep(&beats);
        drop(beats);
        for beaten in &mut beaten {
            let frames: Vec<u32> = std::iter::from_fn(|| beaten.blocking_recv()).collect();
            assert_eq!(frames, [0, 1, 2, 3, 4]);
        }
    }
}
