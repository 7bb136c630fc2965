//! The rung of one model: errors, refusals, times and memory.

use super::readings::Pairs;
use super::sets::draw;
use super::{Canvas, Progress, SampleSet, Timing};
use crate::evaluate::require_same_atlas;
use crate::metrics::{SampleMetrics, quantile, summarise};
use crate::{ExportError, read, read_text};
use papilla_engine::ladder::{Kind, LatencyByEngine, Percentiles, Rung};
use papilla_engine::{Backend, Card, EngineError, MAP_LEN, MAP_SIDE_PX, Model, ModelInfo, Session};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// Different maps that the clock runs over, so that no cache holds one answer.
const TIMED_MAPS: usize = 16;

/// What a model takes before its first answer.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Footprint {
    /// Time from the file's bytes to the first answer, ms.
    pub load_ms: f64,
    /// Growth of resident memory at its peak, MiB; none where the system does not tell.
    pub memory_mib: Option<f64>,
}

/// Measures the model at `path` on all sets.
pub(super) fn measure(
    path: &Path,
    canvas: &Canvas,
    sets: &[SampleSet],
    pairs: &mut Pairs,
    timing: Timing,
    progress: &dyn Progress,
    footprint: &dyn Fn(&Path) -> Option<Footprint>,
) -> Result<Rung, ExportError> {
    let onnx = read(path)?;
    let card = path.with_extension("json");
    let card = card.is_file().then(|| read_card(&card)).transpose()?;
    let model = papilla_engine::load(&onnx, card.as_ref()).map_err(ExportError::engine(path))?;
    let info = model.info();
    require_same_atlas(&path.display().to_string(), &info.atlas_hash, &canvas.atlas_hash)?;
    let mut judge = Judge { canvas, path, session: session(model.as_ref(), path)?, refused: 0 };
    let mut errors = std::collections::BTreeMap::new();
    for set in sets {
        let samples = judge.set(set, progress)?;
        if let Some(metrics) = summarise(set.name, &samples) {
            errors.insert(set.name.to_owned(), metrics.into());
        }
    }
    pairs.ask(&info.name, |pressure_pa, sed| judge.infer(pressure_pa, sed))?;
    let zero_answer = judge.zero_answer(info)?;
    judge.hostile(info)?;
    let refused = judge.refused;
    let maps = timed_maps(canvas, sets, info);
    let tract = time(model.as_ref(), path, &maps, timing)?;
    let footprint = footprint(path);
    Ok(Rung {
        name: info.name.clone(),
        kind: Kind::of_network(&info.network),
        model: Some(info.name.clone()),
        onnx_sha256: Some(info.onnx_sha256.clone()),
        bytes: Some(info.bytes),
        load_ms: footprint.map(|f| f.load_ms),
        memory_mib: footprint.and_then(|f| f.memory_mib),
        latency_ms: Some(LatencyByEngine { tract, ort: time_ort(&onnx, path, &maps, timing)? }),
        seconds: None,
        reference: false,
        errors,
        refused,
        zero_answer: Some(zero_answer),
        pareto: false,
    })
}

fn read_card(path: &Path) -> Result<Card, ExportError> {
    Card::from_json(&read_text(path)?).map_err(ExportError::engine(path))
}

pub(super) fn session(model: &dyn Model, path: &Path) -> Result<Box<dyn Session>, ExportError> {
    model.session().map_err(ExportError::engine(path))
}

struct Judge<'a> {
    canvas: &'a Canvas,
    path: &'a Path,
    session: Box<dyn Session>,
    /// Answers that the engine refused as no energy density.
    refused: usize,
}

impl Judge<'_> {
    /// Infers one map; false if the answer was refused.
    fn infer(&mut self, pressure_pa: &[f32], sed: &mut [f32]) -> Result<bool, ExportError> {
        match self.session.infer(pressure_pa, sed) {
            Ok(()) => Ok(true),
            Err(EngineError::NegativeOutput { .. } | EngineError::NonFiniteOutput { .. }) => {
                self.refused += 1;
                Ok(false)
            }
            Err(error) => Err(ExportError::engine(self.path)(error)),
        }
    }

    fn set(
        &mut self,
        set: &SampleSet,
        progress: &dyn Progress,
    ) -> Result<Vec<SampleMetrics>, ExportError> {
        let mut samples = Vec::with_capacity(set.states.len());
        let [mut pressure, mut truth, mut answer] = std::array::from_fn(|_| vec![0.0; MAP_LEN]);
        for (index, state) in set.states.iter().enumerate() {
            draw(&self.canvas.skin, &state.pressure_pa, &mut pressure);
            draw(&self.canvas.interface, &state.sed_j_per_m3, &mut truth);
            if self.infer(&pressure, &mut answer)? {
                let metrics = SampleMetrics::measure(&answer, &truth, &self.canvas.ground);
                samples.push(metrics.ok_or_else(|| state.without_sed(index))?);
            }
            progress.step();
        }
        Ok(samples)
    }

    /// Greatest answer to no pressure, over the greatest SED of the training data.
    fn zero_answer(&mut self, info: &ModelInfo) -> Result<f64, ExportError> {
        let mut answer = vec![0.0; MAP_LEN];
        if !self.infer(&vec![0.0; MAP_LEN], &mut answer)? {
            return Ok(f64::MAX);
        }
        let greatest = answer.iter().copied().fold(0.0f32, f32::max);
        Ok(f64::from(greatest) / f64::from(info.sed_max_j_per_m3))
    }

    /// Maps that no finger makes but a client may send.
    fn hostile(&mut self, info: &ModelInfo) -> Result<(), ExportError> {
        let mut answer = vec![0.0; MAP_LEN];
        for map in hostile_maps(info.pressure_max_pa) {
            self.infer(&map, &mut answer)?;
        }
        Ok(())
    }
}

/// Everywhere the greatest pressure; single pixels; a chessboard; noise; next to nothing.
fn hostile_maps(most_pa: f32) -> Vec<Vec<f32>> {
    let map = |value: &dyn Fn(usize) -> f32| (0..MAP_LEN).map(value).collect::<Vec<f32>>();
    let middle = MAP_LEN / 2 + MAP_SIDE_PX / 2;
    // Numerical Recipes' linear congruential generator: the same noise every time.
    let noise = |i: usize| {
        let bits = (i as u32).wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        most_pa * (bits.wrapping_mul(1_664_525) >> 8) as f32 / (1 << 24) as f32
    };
    vec![
        map(&|_| most_pa),
        map(&|i| if i == middle { most_pa } else { 0.0 }),
        map(&|i| if (i + i / MAP_SIDE_PX).is_multiple_of(2) { most_pa } else { 0.0 }),
        map(&noise),
        map(&|i| if i % MAP_SIDE_PX < MAP_SIDE_PX / 2 { most_pa } else { 0.0 }),
        map(&|_| 1e-3),
        map(&|_| 1e-30),
    ]
}

/// Maps for the clock: of the first set there is, or else hostile ones.
fn timed_maps(canvas: &Canvas, sets: &[SampleSet], info: &ModelInfo) -> Vec<Vec<f32>> {
    let Some(set) = sets.iter().find(|set| !set.states.is_empty()) else {
        return hostile_maps(info.pressure_max_pa);
    };
    let step = set.states.len().div_ceil(TIMED_MAPS);
    let states = set.states.iter().step_by(step);
    states
        .map(|state| {
            let mut map = vec![0.0; MAP_LEN];
            draw(&canvas.skin, &state.pressure_pa, &mut map);
            map
        })
        .collect()
}

/// Percentiles of the quietest of several rounds, ms: another program at work in a round
/// says nothing about the model.
pub(super) fn time(
    model: &dyn Model,
    path: &Path,
    maps: &[Vec<f32>],
    timing: Timing,
) -> Result<Percentiles, ExportError> {
    let mut session = session(model, path)?;
    let mut answer = vec![0.0; MAP_LEN];
    let mut next = maps.iter().cycle();
    let mut best: Option<Percentiles> = None;
    for _ in 0..timing.rounds {
        let (start, mut times_ms) = (Instant::now(), Vec::new());
        // The first run of a round finds cold caches and is not counted.
        for run in 0.. {
            if run > timing.runs_min && start.elapsed() > timing.round {
                break;
            }
            let Some(map) = next.next() else { break };
            let begun = Instant::now();
            match session.infer(map, &mut answer) {
                Ok(()) | Err(EngineError::NegativeOutput { .. }) => {}
                Err(EngineError::NonFiniteOutput { .. }) => {}
                Err(error) => return Err(ExportError::engine(path)(error)),
            }
            if run > 0 {
                times_ms.push(begun.elapsed().as_secs_f64() * 1e3);
            }
        }
        let at = |q| quantile(&times_ms, q).unwrap_or(f64::NAN);
        let round = Percentiles { p50: at(0.5), p99: at(0.99) };
        if best.is_none_or(|best| round.p50 < best.p50) {
            best = Some(round);
        }
    }
    Ok(best.unwrap_or(Percentiles { p50: f64::NAN, p99: f64::NAN }))
}

/// Time in ONNX Runtime; none where the program was built without it or it is not installed.
pub(super) fn time_ort(
    onnx: &[u8],
    path: &Path,
    maps: &[Vec<f32>],
    timing: Timing,
) -> Result<Option<Percentiles>, ExportError> {
    match papilla_engine::load_with(Backend::Ort, onnx, None) {
        Ok(model) => time(model.as_ref(), path, maps, timing).map(Some),
        Err(EngineError::BackendMissing { .. }) => Ok(None),
        Err(error) => Err(ExportError::engine(path)(error)),
    }
}
