//! Runs a model over a split of a dataset in the engine that will serve it.

mod by_indenter;

pub use by_indenter::ByIndenter;

use crate::ExportError;
use crate::dataset::Dataset;
use crate::metrics::{SampleMetrics, quantile, summarise};
use crate::reference::relative_difference;
use crate::split::SplitOrAll;
use papilla_dataset::{IndentationEntry, Shard};
use papilla_engine::card::{Card, Latency, Metrics};
use papilla_engine::{MAP_LEN, Model, ModelInfo, Session};
use serde::Serialize;
use std::path::Path;
use std::time::{Duration, Instant};

/// Inferences before the clock counts: caches fill, pages are touched.
const WARM_UP: usize = 3;

/// One sample of the split and how well the model met it.
#[derive(Clone, Debug, Serialize)]
pub struct Sample {
    /// Id of the indentation.
    #[serde(rename = "press")]
    pub indentation: usize,
    /// Index within the indentation.
    pub index: usize,
    /// Name of the indenter in the campaign.
    pub indenter: String,
    /// Depth, mm.
    pub depth_mm: f32,
    /// Pitch of the indenter, degrees.
    pub pitch_deg: f64,
    /// Roll of the indenter, degrees.
    pub roll_deg: f64,
    /// Yaw of the indenter, degrees.
    pub yaw_deg: f64,
    /// The figures.
    #[serde(flatten)]
    pub metrics: SampleMetrics,
    /// Time of the inference, ms.
    pub infer_ms: f64,
}

/// The three maps of one sample, 224 x 224 each.
#[derive(Clone, Debug)]
pub struct Maps {
    /// Pressure on the skin, Pa.
    pub pressure_pa: Vec<f32>,
    /// SED by finite elements, J/m3.
    pub truth_j_per_m3: Vec<f32>,
    /// SED by the model, J/m3.
    pub predicted_j_per_m3: Vec<f32>,
}

impl Default for Maps {
    fn default() -> Self {
        let [pressure_pa, truth_j_per_m3, predicted_j_per_m3] =
            std::array::from_fn(|_| vec![0.0; MAP_LEN]);
        Self { pressure_pa, truth_j_per_m3, predicted_j_per_m3 }
    }
}

impl Maps {
    /// Takes pressure and truth of a sample.
    fn draw(
        &mut self,
        dataset: &Dataset,
        indentation: &IndentationEntry,
        shard: &Shard,
        index: usize,
    ) -> Result<(), ExportError> {
        dataset.draw_pressure(indentation, shard, index, &mut self.pressure_pa)?;
        dataset.draw_sed(indentation, shard, index, &mut self.truth_j_per_m3)
    }
}

/// A model measured on a split.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    /// Median and spread of the figures.
    pub metrics: Metrics,
    /// Time of one inference on one thread.
    pub latency_ms: Latency,
    /// Greatest difference from the second engine, if one was given.
    pub other_engine_difference_max: Option<f64>,
    /// Time of one inference in the second engine, if one was given.
    pub other_engine_latency_ms: Option<Latency>,
    /// Every sample, in the order of the split.
    pub samples: Vec<Sample>,
}

impl Evaluation {
    /// The samples of least, median and greatest relative L2 error.
    #[must_use]
    pub fn landmarks(&self) -> [(&'static str, &Sample); 3] {
        let mut order: Vec<&Sample> = self.samples.iter().collect();
        order.sort_by(|a, b| a.metrics.relative_l2.total_cmp(&b.metrics.relative_l2));
        // `run` refuses empty parts, so there is a first sample.
        let last = order.len() - 1;
        [("best", order[0]), ("median", order[last / 2]), ("worst", order[last])]
    }

    /// The card of the model.
    #[must_use]
    pub fn card(&self, info: &ModelInfo, onnxruntime_difference_max: Option<f64>) -> Card {
        let card = Card::of(info, self.metrics.clone(), self.latency_ms.clone());
        Card { onnxruntime_difference_max, ..card }
    }
}

/// A model and the file it came from, for messages.
pub struct Subject<'a> {
    /// The file.
    pub path: &'a Path,
    /// The model.
    pub model: &'a dyn Model,
    /// It may be of another atlas: that of the finger that it was trained on.
    pub similarity: bool,
}

/// Measures `subject` on every sample of `split`.
///
/// With `other`, the same model in a second engine, both answer every sample and the
/// greatest difference is kept. `step` is called after each sample.
///
/// # Errors
/// [`ExportError::AtlasMismatch`] if the dataset has another atlas; what the dataset, a
/// truth or an engine has wrong.
pub fn run(
    subject: &Subject<'_>,
    other: Option<&dyn Model>,
    dataset: &Dataset,
    split: SplitOrAll,
    mut step: impl FnMut(),
) -> Result<Evaluation, ExportError> {
    let info = subject.model.info();
    if !subject.similarity {
        require_atlas("the dataset", dataset.atlas().hash(), info)?;
    }
    let mut bench = Bench::new(subject.model, subject.path)?;
    let mut second = other.map(|model| Bench::new(model, subject.path)).transpose()?;
    let mut difference = None;
    let mut samples = Vec::new();
    let mut maps = Maps::default();
    for indentation in dataset.indentations(split)? {
        let path = dataset.shard_path(indentation);
        let shard = dataset.shard(indentation)?;
        for index in 0..indentation.samples {
            maps.draw(dataset, indentation, &shard, index)?;
            let infer_ms = bench.infer(&maps.pressure_pa, &mut maps.predicted_j_per_m3)?;
            if let Some(second) = &mut second {
                let mut answer = vec![0.0; MAP_LEN];
                second.infer(&maps.pressure_pa, &mut answer)?;
                let apart = relative_difference(&maps.predicted_j_per_m3, &answer);
                difference = Some(apart.max(difference.unwrap_or(0.0)));
            }
            let metrics = SampleMetrics::measure(
                &maps.predicted_j_per_m3,
                &maps.truth_j_per_m3,
                &dataset.ground,
            )
            .ok_or(ExportError::Truth {
                path: path.clone(),
                sample: index,
                reason: "it is zero",
            })?;
            samples.push(Sample {
                indentation: indentation.id,
                index,
                indenter: indentation.indenter.clone(),
                depth_mm: shard.depth_mm[index],
                pitch_deg: indentation.pose.pitch_deg,
                roll_deg: indentation.pose.roll_deg,
                yaw_deg: indentation.pose.yaw_deg,
                metrics,
                infer_ms,
            });
            step();
        }
    }
    let figures: Vec<SampleMetrics> = samples.iter().map(|sample| sample.metrics).collect();
    let empty = || ExportError::EmptySplit { path: dataset.folder().into(), split };
    let metrics = summarise(&split.to_string(), &figures).ok_or_else(empty)?;
    Ok(Evaluation {
        metrics: Metrics { dataset_sha256: Some(dataset.sha256().to_owned()), ..metrics },
        latency_ms: bench.latency(info),
        other_engine_difference_max: difference,
        other_engine_latency_ms: other
            .zip(second)
            .map(|(model, bench)| bench.latency(model.info())),
        samples,
    })
}

/// Draws a sample and infers it again, for its pictures.
///
/// # Errors
/// As [`run`].
pub fn maps_of(
    subject: &Subject<'_>,
    dataset: &Dataset,
    sample: &Sample,
) -> Result<Maps, ExportError> {
    let mut maps = Maps::default();
    for indentation in dataset
        .indentations(SplitOrAll::All)?
        .into_iter()
        .filter(|indentation| indentation.id == sample.indentation)
    {
        let shard = dataset.shard(indentation)?;
        maps.draw(dataset, indentation, &shard, sample.index)?;
        Bench::new(subject.model, subject.path)?
            .infer(&maps.pressure_pa, &mut maps.predicted_j_per_m3)?;
    }
    Ok(maps)
}

/// Refuses what belongs to another atlas than the model's.
///
/// # Errors
/// [`ExportError::AtlasMismatch`].
pub fn require_atlas(what: &str, found: &str, info: &ModelInfo) -> Result<(), ExportError> {
    require_same_atlas(what, found, &info.atlas_hash)
}

/// Refuses what belongs to another atlas than `expected`.
///
/// # Errors
/// [`ExportError::AtlasMismatch`].
pub fn require_same_atlas(what: &str, found: &str, expected: &str) -> Result<(), ExportError> {
    if found == expected {
        return Ok(());
    }
    Err(ExportError::AtlasMismatch {
        what: what.to_owned(),
        expected: expected.to_owned(),
        found: found.to_owned(),
    })
}

/// One engine with its clock.
struct Bench<'a> {
    session: Box<dyn Session>,
    path: &'a Path,
    times_ms: Vec<f64>,
    warm: bool,
}

impl<'a> Bench<'a> {
    fn new(model: &dyn Model, path: &'a Path) -> Result<Self, ExportError> {
        let session = model.session().map_err(ExportError::engine(path))?;
        Ok(Self { session, path, times_ms: Vec::new(), warm: false })
    }

    /// Infers one map; its time, ms.
    fn infer(&mut self, pressure_pa: &[f32], sed: &mut [f32]) -> Result<f64, ExportError> {
        if !self.warm {
            for _ in 0..WARM_UP {
                self.time(pressure_pa, sed)?;
            }
            self.warm = true;
        }
        let time_ms = self.time(pressure_pa, sed)?.as_secs_f64() * 1e3;
        self.times_ms.push(time_ms);
        Ok(time_ms)
    }

    fn time(&mut self, pressure_pa: &[f32], sed: &mut [f32]) -> Result<Duration, ExportError> {
        let start = Instant::now();
        self.session.infer(pressure_pa, sed).map_err(ExportError::engine(self.path))?;
        Ok(start.elapsed())
    }

    fn latency(&self, info: &ModelInfo) -> Latency {
        let at = |q| quantile(&self.times_ms, q).unwrap_or(f64::NAN);
        Latency { backend: info.backend.clone(), threads: 1, p50: at(0.5), p99: at(0.99) }
    }
}
