//! A client's clock that may tick coarsely: browsers round theirs down to 1, 16.7 or 100 ms.
//!
//! Two frames of the same tick have the same stamp, and the next tick seems to hold all the motion of
//! both. Where stamps come twice, frames are taken to come evenly: each is the mean time between
//! frames after the one before, but never outside the tick that its stamp names. A clock whose stamps
//! all differ is taken at its word, to the microsecond.

use crate::{Reader, StateError, Writer};

/// Frames by which the mean time between two is known.
const FRAMES: usize = 32;
/// Longer pauses are no time between frames, us.
const PAUSE_US: u64 = 200_000;
/// Ticks up to this length leave rates within a tenth, us.
const FINE_TICK_US: u64 = 20_000;
/// Frames with one stamp after which a clock is said to stand.
const STANDS: usize = 8;

/// What the stamps of the last frames tell.
#[derive(Debug, Clone, Default)]
pub struct Clock {
    /// Stamps of the last frames, us, the oldest first.
    stamps: Vec<u64>,
    /// Whether the first of them may have had others of its tick before it.
    is_cut: bool,
    last_us: u64,
}

impl Clock {
    /// A clock that nothing is known of; it allocates nothing later.
    #[must_use]
    pub fn new() -> Self {
        Self { stamps: Vec::with_capacity(FRAMES + 1), is_cut: false, last_us: 0 }
    }

    /// The time of the next frame, whose stamp is `stamp_us`. It never goes back, unless the stamp
    /// does.
    pub fn time_us(&mut self, stamp_us: u64) -> u64 {
        let before_us = self.stamps.last().copied();
        let is_new = before_us
            .is_none_or(|before_us| stamp_us < before_us || stamp_us - before_us > PAUSE_US);
        if is_new {
            let goes_on = before_us.is_some_and(|before_us| stamp_us >= before_us);
            self.stamps.clear();
            self.stamps.push(stamp_us);
            self.is_cut = false;
            self.last_us = if goes_on { self.last_us.max(stamp_us) } else { stamp_us };
            return self.last_us;
        }
        self.stamps.push(stamp_us);
        if self.stamps.len() > FRAMES {
            self.is_cut = self.stamps[0] == self.stamps[1];
            self.stamps.remove(0);
        }
        self.last_us = match self.tick_us() {
            Some(tick_us) => {
                let due_us = self.last_us.saturating_add(self.mean_us().unwrap_or(0));
                let end_us = stamp_us.saturating_add(tick_us - 1);
                due_us.clamp(stamp_us, end_us).max(self.last_us)
            }
            None => stamp_us.max(self.last_us),
        };
        self.last_us
    }

    /// Whether ticks are so long, or the clock stands, that what depends on time may be far off.
    #[must_use]
    pub fn is_coarse(&self) -> bool {
        let stands = || {
            let last = self.stamps.last();
            let alike = self.stamps.iter().rev().take_while(|stamp| Some(*stamp) == last);
            alike.count() >= STANDS
        };
        self.tick_us().is_some_and(|tick_us| tick_us > FINE_TICK_US) || stands()
    }

    /// The next frame is the first, as far as this clock is concerned.
    pub fn forget(&mut self) {
        self.stamps.clear();
        self.is_cut = false;
    }

    /// The shortest step of the stamps, if some came twice: what the clock ticks by.
    fn tick_us(&self) -> Option<u64> {
        let steps = || self.stamps.windows(2).map(|pair| pair[1] - pair[0]);
        if !steps().any(|step| step == 0) {
            return None;
        }
        steps().filter(|step| *step > 0).min()
    }

    /// Mean time between two frames, from the first frame of a tick to the first of another.
    fn mean_us(&self) -> Option<u64> {
        let is_first = |at: &usize| match at.checked_sub(1) {
            None => !self.is_cut,
            Some(before) => self.stamps[before] != self.stamps[*at],
        };
        let mut firsts = (0..self.stamps.len()).filter(is_first);
        let from = firsts.next()?;
        let to = firsts.next_back()?;
        Some((self.stamps[to] - self.stamps[from]) / (to - from) as u64)
    }

    /// Writes what is known.
    pub fn save(&self, state: &mut Writer) {
        state.number(self.stamps.len() as u64);
        self.stamps.iter().for_each(|stamp_us| state.number(*stamp_us));
        state.number(self.is_cut.into());
        state.number(self.last_us);
    }

    /// Goes on from what another one has written.
    ///
    /// # Errors
    /// The state is of something else.
    pub fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        self.stamps.clear();
        for _ in 0..state.count(FRAMES, "stamps of a clock")? {
            let stamp_us = state.number()?;
            if self.stamps.last().is_some_and(|before_us| *before_us > stamp_us) {
                return Err(StateError::Value("a clock"));
            }
            self.stamps.push(stamp_us);
        }
        self.is_cut = state.number()? != 0;
        self.last_us = state.number()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames every `period_us`, stamped by a clock that ticks every `tick_us`.
    fn stamps(period_us: f64, tick_us: f64, frames: u32) -> Vec<(f64, u64)> {
        let frame = |n: u32| {
            let true_us = 1e6 + period_us * f64::from(n);
            (true_us, ((true_us / tick_us).floor() * tick_us) as u64)
        };
        (0..frames).map(frame).collect()
    }

    #[test]
    fn a_clock_whose_stamps_differ_is_taken_at_its_word() {
        let mut clock = Clock::new();
        for stamp_us in [5, 6, 1000, 12_111, 23_222, 900_000, 900_001, u64::MAX - 1, u64::MAX] {
            assert_eq!(clock.time_us(stamp_us), stamp_us);
            assert!(!clock.is_coarse());
        }
        assert_eq!(clock.time_us(7), 7, "set back");
    }

    #[test]
    fn frames_of_a_coarse_clock_are_spread_over_its_ticks() {
        for (period_us, tick_us) in
            [(11_111.0, 16_666.7), (4000.0, 16_666.7), (11_111.0, 100_000.0)]
        {
            let mut clock = Clock::new();
            let mut before_us = 0;
            for (n, (true_us, stamp_us)) in (0..).zip(stamps(period_us, tick_us, 400)) {
                let time_us = clock.time_us(stamp_us);
                assert!(time_us >= before_us && time_us >= stamp_us);
                assert!((time_us as f64 - true_us).abs() <= tick_us + 2.0);
                if n > 40 {
                    let step_us = (time_us - before_us) as f64;
                    let share = step_us / period_us;
                    assert!(
                        (0.55..1.3).contains(&share),
                        "{n}: {step_us} of {period_us}, {tick_us}"
                    );
                }
                assert_eq!(clock.is_coarse() && n > 40, tick_us > 2e4 && n > 40, "{n}, {tick_us}");
                before_us = time_us;
            }
        }
    }

    #[test]
    fn a_clock_that_stands_is_told() {
        let mut clock = Clock::new();
        for n in 0..20 {
            assert_eq!(clock.time_us(0), 0);
            assert_eq!(clock.is_coarse(), n >= 7, "{n}");
        }
    }

    #[test]
    fn what_is_saved_goes_on_the_same() {
        let (mut one, mut other) = (Clock::new(), Clock::new());
        let stamps = stamps(11_111.0, 16_666.7, 90);
        stamps[..50].iter().for_each(|(_, stamp_us)| _ = one.time_us(*stamp_us));
        let mut state = Writer::default();
        one.save(&mut state);
        let state = state.finish();
        let mut reader = Reader::new(&state);
        other.restore(&mut reader).unwrap();
        reader.end().unwrap();
        for (_, stamp_us) in &stamps[50..] {
            assert_eq!(one.time_us(*stamp_us), other.time_us(*stamp_us));
        }
    }
}
