//! Floors: ways that answer with the same map whatever the pressure is. A model that is no better
//! has learnt nothing from the pressure.

use super::sets::TRAINING;
use super::sets::draw;
use super::{Canvas, SampleSet};
use crate::ExportError;
use crate::metrics::{SampleMetrics, summarise};
use papilla_engine::MAP_LEN;
use papilla_engine::ladder::{Kind, Rung};
use std::path::Path;

/// No SED at all, and each pixel's mean over the training's samples, if those are in `data`.
pub(super) fn rungs(
    data: &Path,
    sets: &[SampleSet],
    canvas: &Canvas,
) -> Result<Vec<Rung>, ExportError> {
    let mut rungs = vec![rung("zero", &vec![0.0; MAP_LEN], sets, canvas)?];
    let training = TRAINING.iter().map(|source| source.load(data, canvas));
    let training = training.collect::<Result<Vec<_>, _>>()?;
    if let Some(mean) = mean(&training, canvas) {
        rungs.push(rung("mean", &mean, sets, canvas)?);
    }
    Ok(rungs)
}

/// None without samples.
fn mean(training: &[SampleSet], canvas: &Canvas) -> Option<Vec<f32>> {
    let states: Vec<_> = training.iter().flat_map(|set| &set.states).collect();
    let mut sum = vec![0.0; states.first()?.sed_j_per_m3.len()];
    for state in &states {
        for (sum, sed) in sum.iter_mut().zip(&state.sed_j_per_m3) {
            *sum += f64::from(*sed);
        }
    }
    let mean: Vec<_> = sum.iter().map(|sum| (sum / states.len() as f64) as f32).collect();
    let mut map = vec![0.0; MAP_LEN];
    draw(&canvas.interface, &mean, &mut map);
    Some(map)
}

fn rung(
    name: &str,
    answer: &[f32],
    sets: &[SampleSet],
    canvas: &Canvas,
) -> Result<Rung, ExportError> {
    let mut rung = Rung::unserved(name.to_owned(), Kind::Floor);
    let mut truth = vec![0.0; MAP_LEN];
    for set in sets {
        let mut samples = Vec::with_capacity(set.states.len());
        for (index, state) in set.states.iter().enumerate() {
            draw(&canvas.interface, &state.sed_j_per_m3, &mut truth);
            let metrics = SampleMetrics::measure(answer, &truth, &canvas.ground);
            samples.push(metrics.ok_or_else(|| state.without_sed(index))?);
        }
        let errors = summarise(set.name, &samples);
        rung.errors.extend(errors.map(|errors| (set.name.to_owned(), errors.into())));
    }
    Ok(rung)
}
