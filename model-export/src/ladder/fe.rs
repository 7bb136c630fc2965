//! FE rungs: the simulations of the reference on other meshes.
//!
//! `fe-datagen generate CAMPAIGN --mesh NAME` makes the dataset of each mesh. Two states are the
//! same if simulation and depth are. The truth is the SED of the reference, pixel by pixel.

use super::sets::draw;
use super::{Canvas, SampleSet};
use crate::dataset::Dataset;
use crate::metrics::{SampleMetrics, quantile, summarise};
use crate::{ExportError, read_text};
use papilla_engine::MAP_LEN;
use papilla_engine::ladder::{Discretisation, Kind, Percentiles, Rung};
use serde::Deserialize;
use std::path::Path;

/// Distance of nodes across the edge of a contact on the mesh before the reference over that on
/// the reference: .2 and .12 mm (docs/concepts/accuracy.md).
const SPACING_RATIO: f64 = 0.2 / 0.12;
/// The mesh before the reference.
pub(super) const NEXT_FINEST: &str = "fe-medium-graded";

/// The reference's own error by Richardson's extrapolation, if SED errs as the square of the
/// spacing: its distance from the next finest mesh over the ratio's square less one.
pub(super) fn reference_error(rungs: &[Rung], set: &str) -> Option<Discretisation> {
    let next = rungs.iter().find(|rung| rung.name == NEXT_FINEST)?;
    let errors = next.errors.get(set)?;
    Some(Discretisation {
        sed_relative_l2: errors.relative_l2.median / (SPACING_RATIO.powi(2) - 1.0),
        how: format!(
            "Richardson's extrapolation from {NEXT_FINEST} over {} states. The two meshes are of one \
             family, and the error is taken to fall as the square of the spacing of nodes",
            errors.samples
        ),
    })
}

/// What a campaign's record of one indentation says of its time.
#[derive(Debug, Deserialize)]
struct Record {
    #[serde(default)]
    processor_s: Option<f64>,
}

/// Judges the dataset in `folder` by the reference's states.
///
/// # Errors
/// [`ExportError::Dataset`], [`ExportError::Io`]; [`ExportError::Truth`] if a state of the
/// reference has no SED.
pub(super) fn rung(
    folder: &Path,
    reference: &SampleSet,
    canvas: &Canvas,
) -> Result<Rung, ExportError> {
    let dataset = Dataset::open(folder)?;
    let solved = SampleSet::of(folder, &dataset, canvas)?;
    let is_reference = solved.dataset_sha256 == reference.dataset_sha256;
    let (mut samples, mut refused) = (Vec::new(), 0);
    let [mut own, mut truth] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
    for (index, due) in reference.states.iter().enumerate() {
        let Some(state) = solved.states.iter().find(|state| state.is_of(due)) else {
            refused += 1;
            continue;
        };
        draw(&canvas.interface, &state.sed_j_per_m3, &mut own);
        draw(&canvas.interface, &due.sed_j_per_m3, &mut truth);
        let metrics = SampleMetrics::measure(&own, &truth, &canvas.ground);
        samples.push(metrics.ok_or_else(|| due.without_sed(index))?);
    }
    let seconds = seconds(folder, &dataset)?;
    let at = |q| quantile(&seconds, q);
    let errors = summarise(reference.name, &samples);
    Ok(Rung {
        seconds: at(0.5).zip(at(0.99)).map(|(p50, p99)| Percentiles { p50, p99 }),
        reference: is_reference,
        errors: errors.into_iter().map(|e| (reference.name.to_owned(), e.into())).collect(),
        refused,
        ..Rung::unserved(format!("fe-{}", dataset.mesh()), Kind::Fe)
    })
}

/// Processor seconds of a state, those of the path to it included, for each indentation whose
/// record stands in `progress`.
fn seconds(folder: &Path, dataset: &Dataset) -> Result<Vec<f64>, ExportError> {
    let mut seconds = Vec::new();
    for indentation in dataset.every_indentation() {
        let path = folder.join(format!("progress/press-{:05}.json", indentation.id));
        if !path.is_file() {
            continue;
        }
        let record: Record = serde_json::from_str(&read_text(&path)?).map_err(|error| {
            let reason = format!("not the record of an indentation: {error}");
            ExportError::DatasetFile { path: path.clone(), reason }
        })?;
        seconds.extend(record.processor_s.map(|s| s / indentation.samples.max(1) as f64));
    }
    Ok(seconds)
}
