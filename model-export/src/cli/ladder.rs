//! `model-export ladder`, and the hidden command that weighs one model in a fresh process.

use super::options::Folders;
use super::print_json;
use papilla_engine::{Ladder, MAP_LEN};
use papilla_model_export::ladder::{self, Canvas, Footprint, Progress, Task, plot, report};
use papilla_model_export::{ExportError, read, read_text, write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Page, pictures and figures have this name.
const STEM: &str = "accuracy-vs-time";

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    folders: Folders,
    /// Datasets of the campaign `final` on other meshes, the solver's own rungs
    /// [default: DATA/final and the folders in DATA/rungs].
    #[arg(long, num_args = 1.., value_name = "FOLDER")]
    fe: Vec<PathBuf>,
    /// Folder for accuracy-vs-time.md, .svg and .json, and accuracy-vs-time-zone.svg.
    #[arg(long, default_value = "docs/reports", value_name = "FOLDER")]
    out: PathBuf,
    /// 16 samples of each set and short timings; does not touch MODELS/ladder.json.
    #[arg(long)]
    quick: bool,
    /// Draw page and pictures anew from these figures (accuracy-vs-time.json or ladder.json); measures
    /// nothing.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["quick", "fe"])]
    from: Option<PathBuf>,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let Folders { data, shipped } = &options.folders;
    let task = Task {
        data: data.clone(),
        models: shipped.models.clone(),
        fe: if options.fe.is_empty() { fe_folders(data) } else { options.fe.clone() },
        quick: options.quick,
    };
    let ladder = match &options.from {
        Some(path) => {
            let refused = |source| ExportError::Engine { path: path.clone(), source };
            let mut ladder = Ladder::from_json(&read_text(path)?).map_err(refused)?;
            ladder.mark_front();
            ladder
        }
        None => {
            let shown = Shown(papilla_progress::Progress::new("samples", 0, 0, json));
            ladder::measure(&task, &shown, &footprint)?
        }
    };
    let written = write_all(options, &ladder)?;
    if json {
        return print_json(&ladder);
    }
    for path in written {
        println!("wrote {}", path.display());
    }
    Ok(())
}

/// The reference and the folders in `data/rungs` that hold datasets, in order.
fn fe_folders(data: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(data.join("rungs")).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    folders.sort();
    folders.insert(0, data.join("final"));
    folders.retain(|folder| folder.join("manifest.json").is_file());
    folders
}

fn write_all(options: &Options, ladder: &Ladder) -> anyhow::Result<Vec<PathBuf>> {
    let named = |ending: &str| options.out.join(format!("{STEM}{ending}"));
    let chart = |what| move |reason| ExportError::Chart { what, reason };
    let models = &options.folders.shipped.models;
    let canvas = Canvas::read(models)?;
    let json = ladder.to_json()?;
    let mut files = vec![
        (named(".md"), report::markdown(ladder, STEM)),
        (named(".svg"), plot::error_against_time(ladder).map_err(chart("error against time"))?),
        (named("-zone.svg"), plot::nail_base_zone(&canvas.ground).map_err(chart("the zone"))?),
        (named(".json"), json.clone()),
    ];
    if !ladder.quick {
        files.push((models.join("ladder.json"), json));
    }
    for (path, text) in &files {
        write(path, text.as_bytes())?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

pub(super) struct Shown(pub(super) papilla_progress::Progress);

impl Progress for Shown {
    fn total(&self, steps: u64) {
        self.0.set_length(usize::try_from(steps).unwrap_or(usize::MAX));
    }

    fn stage(&self, what: &str) {
        self.0.set_message(what);
    }

    fn step(&self) {
        self.0.inc();
    }
}

/// Weighs a model in a process of its own; none if that fails, which costs two figures only.
fn footprint(model: &Path) -> Option<Footprint> {
    let program = std::env::current_exe().ok()?;
    let output = Command::new(program).arg("footprint").arg(model).output().ok()?;
    serde_json::from_slice(&output.stdout).ok()
}

/// Loads the model, answers one map and prints what that took.
pub(crate) fn weigh(model: &Path) -> anyhow::Result<()> {
    let onnx = read(model)?;
    let mut sed_j_per_m3 = vec![1.0; MAP_LEN];
    let pressure_pa = vec![1.0; MAP_LEN];
    let before_kib = status_kib("VmRSS:");
    let start = Instant::now();
    let refused = |source| ExportError::Engine { path: model.to_owned(), source };
    let loaded = papilla_engine::load(&onnx, None).map_err(refused)?;
    let mut session = loaded.session().map_err(refused)?;
    session.infer(&pressure_pa, &mut sed_j_per_m3).map_err(refused)?;
    let load_ms = start.elapsed().as_secs_f64() * 1e3;
    let growth = status_kib("VmHWM:").zip(before_kib).map(|(peak, before)| peak - before);
    print_json(&Footprint { load_ms, memory_mib: growth.map(|kib| kib / 1024.0) })
}

/// A line of `/proc/self/status`, KiB; none on other systems.
fn status_kib(key: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    line.trim().trim_end_matches("kB").trim().parse().ok()
}
