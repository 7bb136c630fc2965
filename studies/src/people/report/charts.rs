//! Plots of the comparison.

use super::Report;
use crate::people::afferents::Predicted;
use papilla_output::OutputError;
use papilla_output::plot::{Axis, Chart, Mark, Series, write_svg};
use std::path::Path;

impl Report {
    /// `rates.svg`, `profiles.svg` and `force.svg`, of what was compared.
    pub(super) fn write_charts(&self, folder: &Path) -> Result<(), OutputError> {
        if let Some(found) = &self.afferents {
            let best = &found.fits[found.best];
            let title = format!("SA1 rates; best: {}", best.name());
            let of = |profile: bool| {
                let pick = move |p: &&Predicted| (p.distance_mm.last() > Some(&0.0)) == profile;
                [&found.of_sed, &found.of_best]
                    .map(|all| all.iter().filter(pick).collect::<Vec<_>>())
            };
            let [sed, top] = of(false);
            let rates = rates_chart(title.clone(), "curvature, 1/m", [&sed, &top], |p| {
                (format!("{} N", p.force_n), &p.curvature_per_m)
            });
            write_svg(&folder.join("rates.svg"), &rates)?;
            let [sed, top] = of(true);
            let distance = "distance from the middle, mm";
            let profiles = rates_chart(title, distance, [&sed, &top], |p| {
                let curvature = p.curvature_per_m.first().copied().unwrap_or(0.0);
                (format!("{curvature} 1/m"), &p.distance_mm)
            });
            write_svg(&folder.join("profiles.svg"), &profiles)?;
        }
        if self.plates.is_empty() {
            return Ok(());
        }
        let line = |p: &super::Plate| Series {
            name: format!("plate at {} degrees", p.pitch_deg),
            points: p.path.depth_mm.iter().copied().zip(p.path.force_n.iter().copied()).collect(),
            mark: Mark::Line,
        };
        let chart = Chart {
            title: "Force under a plate".into(),
            x: Axis::linear("depth, mm"),
            y: Axis::linear("force, N"),
            series: self.plates.iter().map(line).collect(),
        };
        write_svg(&folder.join("force.svg"), &chart)
    }
}

/// Measured rates, those of SED and those of the best fit, against `x`.
fn rates_chart<'a>(
    title: String,
    x: &str,
    [sed, best]: [&[&'a Predicted]; 2],
    along: impl Fn(&'a Predicted) -> (String, &'a Vec<f64>),
) -> Chart {
    let line = |p: &'a Predicted, rates: &[f64], what: &str| {
        let (name, x) = along(p);
        let points = x.iter().copied().zip(rates.iter().copied()).collect();
        Series { name: format!("{name}, {what}"), points, mark: Mark::Line }
    };
    let mut series: Vec<Series> =
        sed.iter().map(|p| line(p, &p.measured_per_s, "measured")).collect();
    // The first and the last of each: more lines would not be told apart.
    for (all, what) in [(sed, "SED"), (best, "best")] {
        let ends = all.first().into_iter().chain(all.last().filter(|_| all.len() > 1));
        series.extend(ends.map(|p| line(p, &p.here_per_s, what)));
    }
    Chart { title, x: Axis::linear(x), y: Axis::linear("impulses/s"), series }
}
