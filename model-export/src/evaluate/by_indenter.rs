//! The errors of a model by indenter.

use super::Evaluation;
use crate::metrics::{SampleMetrics, quantile};
use serde::Serialize;
use std::fmt;

/// How a model met one indenter's samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByIndenter {
    /// Its name in the campaign.
    pub indenter: String,
    /// Samples.
    pub samples: usize,
    /// Median of their relative L2 errors.
    pub relative_l2_median: f64,
    /// Greatest of them.
    pub relative_l2_max: f64,
    /// Median of [`SampleMetrics::closest_factor`]; none if the model answers zero.
    pub closest_factor: Option<f64>,
}

impl Evaluation {
    /// The figures by indenter, in the order in which they first come.
    #[must_use]
    pub fn by_indenter(&self) -> Vec<ByIndenter> {
        let mut names: Vec<&str> = Vec::new();
        for sample in &self.samples {
            if !names.contains(&sample.indenter.as_str()) {
                names.push(&sample.indenter);
            }
        }
        let of = |name: &str| {
            let own = self.samples.iter().filter(|sample| sample.indenter == name);
            summed(name, &own.map(|sample| sample.metrics).collect::<Vec<_>>())
        };
        names.into_iter().filter_map(of).collect()
    }
}

fn summed(name: &str, samples: &[SampleMetrics]) -> Option<ByIndenter> {
    let errors: Vec<f64> = samples.iter().map(|sample| sample.relative_l2).collect();
    let factors: Vec<f64> = samples.iter().filter_map(|sample| sample.closest_factor).collect();
    Some(ByIndenter {
        indenter: name.to_owned(),
        samples: samples.len(),
        relative_l2_median: quantile(&errors, 0.5)?,
        relative_l2_max: quantile(&errors, 1.0)?,
        closest_factor: quantile(&factors, 0.5),
    })
}

impl fmt::Display for ByIndenter {
    /// A row under [`ByIndenter::HEAD`].
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, max] = [self.relative_l2_median, self.relative_l2_max].map(|e| 100.0 * e);
        let factor = self.closest_factor.map_or_else(|| "-".to_owned(), |f| format!("{f:.3}"));
        let (name, samples) = (&self.indenter, self.samples);
        write!(f, "{name:<24}{samples:>8}{median:>8.2} %{max:>8.2} %{factor:>10}")
    }
}

impl ByIndenter {
    /// The head of a table of rows. The last column: what the model's SED would have to be
    /// multiplied by to come closest.
    pub const HEAD: &str = "relative L2 by indenter  samples    median       max    factor";
}
