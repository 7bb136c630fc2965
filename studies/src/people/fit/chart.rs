//! Plots of a fit.

use super::Fit;
use papilla_output::OutputError;
use papilla_output::plot::{Axis, Chart, Mark, Series, write_svg};
use std::path::Path;

/// Rise above which a profile is cut off, so that what lies below is seen.
const RISE_MAX: f64 = 4.0;

impl Fit {
    /// `profiles.svg`: how far each constant can be moved.
    pub(super) fn write_charts(&self, folder: &Path) -> Result<(), OutputError> {
        let profile = |c: &super::Identified| {
            let last = (c.told.rise.len() - 1) as f64;
            let place = |(i, r): (usize, &f64)| (i as f64 / last, r.min(RISE_MAX));
            Series {
                name: c.parameter.name.into(),
                points: c.told.rise.iter().enumerate().map(place).collect(),
                mark: Mark::Line,
            }
        };
        let mut series: Vec<Series> = self.constants.iter().map(profile).collect();
        series.push(Series {
            name: "end of the interval".into(),
            points: vec![(0.0, 0.5), (1.0, 0.5)],
            mark: Mark::Line,
        });
        let chart = Chart {
            title: "Rise of the cost where one constant is held".into(),
            x: Axis::linear("place of the constant, from its lower to its upper bound"),
            y: Axis::linear("rise of half the sum of squares"),
            series,
        };
        write_svg(&folder.join("profiles.svg"), &chart)
    }
}
