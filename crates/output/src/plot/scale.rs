//! An axis with its ticks.

use super::ticks;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use std::ops::Range;

/// From a value to a place.
pub(super) struct Scale {
    ends: (f64, f64),
    log: bool,
    ticks: Vec<f64>,
}

impl Scale {
    /// From one end to the other, both positive on a logarithmic axis.
    pub(super) fn new(ends: (f64, f64), log: bool) -> Self {
        Self { ends, log, ticks: ticks::round(ends, log) }
    }
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let along = |v: f64| if self.log { v.ln() } else { v };
        let (low, high) = (along(self.ends.0), along(self.ends.1));
        let share = (along(*value) - low) / (high - low);
        first + (share * f64::from(last - first)).round() as i32
    }

    fn key_points<H: KeyPointHint>(&self, hint: H) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.ends.0..self.ends.1
    }
}
