//! What happened to the frames.

use std::{collections::BTreeMap, time::Duration};

use hdrhistogram::Histogram;

use super::steal::Ticks;

/// Longest time told apart, us; longer ones count as this.
const LONGEST_US: u64 = 3_600_000_000;

/// A histogram of times, us, good to three digits.
#[derive(Clone, Debug)]
pub(super) struct Times(pub(super) Histogram<u64>);

impl Default for Times {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_US, 3);
        Self(histogram.unwrap_or_else(|_| unreachable!("1 us to an hour, to three digits")))
    }
}

impl Times {
    pub(super) fn record(&mut self, time: Duration) {
        let us = u64::try_from(time.as_micros()).unwrap_or(LONGEST_US).min(LONGEST_US);
        self.0.saturating_record(us);
    }

    pub(super) fn add(&mut self, other: &Self) {
        // Both have the same bounds: there is nothing that does not fit.
        let _ = self.0.add(&other.0);
    }
}

/// Counts and times of the counted frames; one a session, then the sum.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    /// Frames that were to be sent.
    pub(super) frames: u64,
    pub(super) ok: u64,
    pub(super) superseded: u64,
    pub(super) late: u64,
    pub(super) stale: u64,
    /// Refusals by code.
    pub(super) errors: BTreeMap<String, u64>,
    /// Frames that nobody answered.
    pub(super) lost: u64,
    /// Maps that came after the map of a later frame.
    pub(super) out_of_order: u64,
    /// Answers to no frame, or to one that had been answered.
    pub(super) unexpected: u64,
    /// Maps that came within the deadline.
    pub(super) in_time: u64,
    /// From the intended instant to the map.
    pub(super) round_trip: Times,
    /// Time in the server, as it says.
    pub(super) server: Times,
    /// Of that, waiting for a thread.
    pub(super) queue: Times,
    /// Of that, in the network.
    pub(super) infer: Times,
    /// Of that, solving the contact.
    pub(super) solve: Times,
    /// Of that, none of the three.
    pub(super) rest: Times,
    /// From the sending to the map, but for the network.
    pub(super) overhead: Times,
    /// Age of the newest map, every millisecond: since the instant its frame was meant to leave.
    pub(super) age: Times,
    /// From one map of a session to the next.
    pub(super) gap: Times,
    /// For how long frames were held back, once a move.
    pub(super) held: Times,
    /// Times that a session was opened anew after its connection broke.
    pub(super) reopened: u64,
    /// From the intended instant to the sending.
    pub(super) send_delay: Times,
    /// Maps compared, those not equal, and the greatest difference.
    pub(super) verified: u64,
    pub(super) wrong: u64,
    pub(super) difference_max: f64,
    /// Bytes of a frame's message, and of the last answer's.
    pub(super) bytes: [usize; 2],
    /// Processor time of the machine meanwhile.
    pub(super) processor: Ticks,
    /// Why sessions ended before their time.
    pub(super) ended: Vec<String>,
}

impl Tally {
    pub(super) fn add(&mut self, other: &Self) {
        for (sum, part) in [
            (&mut self.frames, other.frames),
            (&mut self.ok, other.ok),
            (&mut self.superseded, other.superseded),
            (&mut self.late, other.late),
            (&mut self.stale, other.stale),
            (&mut self.lost, other.lost),
            (&mut self.out_of_order, other.out_of_order),
            (&mut self.unexpected, other.unexpected),
            (&mut self.in_time, other.in_time),
            (&mut self.verified, other.verified),
            (&mut self.processor.all, other.processor.all),
            (&mut self.processor.stolen, other.processor.stolen),
            (&mut self.wrong, other.wrong),
            (&mut self.reopened, other.reopened),
        ] {
            *sum += part;
        }
        for (code, count) in &other.errors {
            *self.errors.entry(code.clone()).or_default() += count;
        }
        for (sum, part) in [
            (&mut self.round_trip, &other.round_trip),
            (&mut self.server, &other.server),
            (&mut self.queue, &other.queue),
            (&mut self.infer, &other.infer),
            (&mut self.solve, &other.solve),
            (&mut self.rest, &other.rest),
            (&mut self.overhead, &other.overhead),
            (&mut self.age, &other.age),
            (&mut self.gap, &other.gap),
            (&mut self.held, &other.held),
            (&mut self.send_delay, &other.send_delay),
        ] {
            sum.add(part);
        }
        self.difference_max = self.difference_max.max(other.difference_max);
        self.bytes = [0, 1].map(|way| self.bytes[way].max(other.bytes[way]));
        self.ended.extend_from_slice(&other.ended);
    }

    /// Takes note of a comparison; none: the answer could not be read.
    pub(super) fn compare(&mut self, difference: Option<f64>, tolerance: f64) {
        self.verified += 1;
        match difference {
            Some(difference) => {
                self.difference_max = self.difference_max.max(difference);
                self.wrong += u64::from(difference > tolerance);
            }
            None => self.wrong += 1,
        }
    }

    /// Frames without a map in time.
    pub(super) fn missed(&self) -> u64 {
        self.frames.saturating_sub(self.in_time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tallies_add_up() {
        let mut one = Tally { frames: 10, ok: 6, in_time: 5, ..Tally::default() };
        one.round_trip.record(Duration::from_micros(1500));
        one.errors.insert("late".to_owned(), 2);
        one.compare(Some(1e-9), 1e-6);
        one.compare(None, 1e-6);
        let mut total = Tally::default();
        total.add(&one);
        total.add(&one);
        assert_eq!((total.frames, total.ok, total.missed()), (20, 12, 10));
        assert_eq!((total.errors["late"], total.round_trip.0.len()), (4, 2));
        assert_eq!((total.verified, total.wrong), (4, 2));
        assert!((1500..=1501).contains(&total.round_trip.0.max()));
    }

    #[test]
    fn no_time_is_too_long() {
        let mut times = Times::default();
        times.record(Duration::MAX);
        assert!(times.0.max() >= LONGEST_US);
    }
}
