//! The ladder: every way to a map of SED, measured on the same held-out sets.
//!
//! The rungs that can be served are the models of `models/index.json`, run in the engine of the
//! service on one thread. FE rungs are the simulations of the reference, solved on other meshes.
//! What is missing is reported as not measured. The result is a [`Ladder`], from which [`report`]
//! makes the page and [`plot`] the pictures.

mod fe;
mod floor;
pub mod here;
mod model;
pub mod plot;
mod readings;
pub mod report;
mod sets;
mod traction;

use crate::metrics::Ground;
use crate::{ExportError, read_atlas, read_text};
use papilla_engine::MODEL_FORMAT;
use papilla_engine::card::Index;
use papilla_engine::ladder::{Ladder, REFERENCE_SET, SET_NAMES};
use papilla_proto::atlas::{Patch, Raster};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use model::Footprint;
pub use sets::{SampleSet, State};

/// Samples of each set that `--quick` takes, evenly spread.
pub const QUICK_SAMPLES: usize = 16;

/// What to measure.
#[derive(Clone, Debug)]
pub struct Task {
    /// Folder that holds the datasets `broad-graded`, `heldout-graded`, `pressed-graded`, `final`,
    /// `final-anew`, `final-shapes`, `s1-graded`, and of presses with friction `friction-graded` and
    /// `sliding-graded`.
    pub data: PathBuf,
    /// Folder of the models, their index and atlas, and the contact model, whose layers feel traction.
    pub models: PathBuf,
    /// Datasets of the reference's campaign on other meshes.
    pub fe: Vec<PathBuf>,
    /// Whether to take a part of each set and shorter timings.
    pub quick: bool,
}

/// What is drawn and where it is judged.
pub struct Canvas {
    /// Hash of the atlas.
    pub atlas_hash: String,
    /// Number of vertices of the atlas.
    pub vertex_count: usize,
    /// Draws pressure.
    pub skin: Raster,
    /// Draws SED.
    pub interface: Raster,
    /// Where errors are taken.
    pub ground: Ground,
}

impl Canvas {
    /// Reads the atlas of a folder of models.
    ///
    /// # Errors
    /// [`ExportError::Io`], [`ExportError::Atlas`].
    pub fn read(models: &Path) -> Result<Self, ExportError> {
        let atlas = read_atlas(&models.join("atlas.json"))?;
        let [skin, interface] = Patch::ALL.map(|patch| Raster::new(&atlas, patch));
        let ground = Ground::new(&atlas, &interface);
        Ok(Self {
            atlas_hash: atlas.hash().to_owned(),
            vertex_count: atlas.vertex_count(),
            skin,
            interface,
            ground,
        })
    }
}

/// How long the clock runs for each model and engine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timing {
    rounds: usize,
    round: Duration,
    runs_min: usize,
}

impl Timing {
    fn of(quick: bool) -> Self {
        if quick {
            Self { rounds: 3, round: Duration::from_millis(200), runs_min: 2 }
        } else {
            Self { rounds: 5, round: Duration::from_millis(600), runs_min: 5 }
        }
    }
}

/// Hears how far the measurement is.
pub trait Progress {
    /// There will be this many steps.
    fn total(&self, steps: u64);
    /// What is under way.
    fn stage(&self, what: &str);
    /// One step is done.
    fn step(&self);
}

/// Measures the ladder.
///
/// `footprint` measures load time and memory of one model file, in a process of its own so
/// that nothing else is counted; none where that cannot be had.
///
/// # Errors
/// What models, datasets or FE folders have wrong. A dataset that is not there is no error.
pub fn measure(
    task: &Task,
    progress: &dyn Progress,
    footprint: &dyn Fn(&Path) -> Option<Footprint>,
) -> Result<Ladder, ExportError> {
    let canvas = Canvas::read(&task.models)?;
    let mut sets = sets::load(&task.data, &canvas)?;
    sets.push(sets::from_poses(&task.data, &task.models, &canvas)?);
    sets.sort_by_key(|set| SET_NAMES.iter().position(|name| *name == set.name));
    if task.quick {
        for set in &mut sets {
            set.thin(QUICK_SAMPLES);
        }
    }
    let index_path = task.models.join("index.json");
    let index = Index::from_json(&read_text(&index_path)?)
        .map_err(|source| ExportError::Engine { path: index_path, source })?;
    let samples: usize = sets.iter().map(|set| set.states.len()).sum();
    progress.total((index.models.len() * samples) as u64);
    let reference = sets.iter().find(|set| set.name == REFERENCE_SET && !set.states.is_empty());
    let mut pairs = readings::Pairs::read(fe::NEXT_FINEST, &task.fe, reference, &canvas)?;
    let mut models = Vec::with_capacity(index.models.len());
    for name in &index.models {
        progress.stage(name);
        let path = task.models.join(format!("{name}.onnx"));
        models.push(model::measure(
            &path,
            &canvas,
            &sets,
            &mut pairs,
            Timing::of(task.quick),
            progress,
            footprint,
        )?);
    }
    progress.stage("traction");
    let traction = traction::measure(task, &index.models)?;
    models.extend(floor::rungs(&task.data, &sets, &canvas)?);
    progress.stage("finite elements");
    let mut ladder = Ladder {
        format: MODEL_FORMAT,
        atlas_hash: canvas.atlas_hash.clone(),
        machine: machine(),
        quick: task.quick,
        sets: sets.iter().map(SampleSet::described).collect(),
        pareto_set: None,
        discretisation_error: None,
        readings: pairs.found(),
        traction,
        rungs: models,
    };
    if let Some(reference) = reference {
        for folder in &task.fe {
            ladder.rungs.push(fe::rung(folder, reference, &canvas)?);
        }
        ladder.discretisation_error = fe::reference_error(&ladder.rungs, reference.name);
    }
    // FE can only be held against the reference, so the reference comes first here.
    let order = [REFERENCE_SET, "heldout-presses", "heldout-shapes", "pressed", "s1"];
    let measured =
        |name: &&str| ladder.sets.iter().any(|set| set.name == **name && set.samples > 0);
    ladder.pareto_set = order.iter().find(|name| measured(name)).map(|name| (*name).to_owned());
    ladder.mark_front();
    Ok(ladder)
}

/// Processor and system, for a reader who compares times.
#[must_use]
pub fn machine() -> String {
    let processor = papilla_processor::described();
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    format!(
        "{processor}, {cores} cores, {} {}; one thread",
        std::env::consts::OS,
        std::env::consts::ARCH
    )
}
