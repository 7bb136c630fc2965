//! `actuators`: drives of arrays of pins.

use papilla_engine::Model;
use papilla_fe_datagen::cli::print;
use papilla_model_export::dataset::Dataset;
use papilla_model_export::{ExportError, picture, read, write};
use papilla_progress::Progress;
use papilla_studies::actuators::{Networks, markdown, measure};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Measure drives of arrays of pins: the formula of sessions, and its inversion.
///
/// For each held-out indentation both find the drive whose SED comes closest to it; a second
/// network tells what the drive gives.
#[derive(clap::Args)]
#[command(after_help = "Example: papilla-studies actuators data/heldout-graded data/broad-graded")]
pub(super) struct Args {
    /// Datasets; their held-out indentations are taken.
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// The network that answers the session, and corrects drives.
    #[arg(long, default_value = "models/small.onnx", value_name = "FILE")]
    network: PathBuf,
    /// The network that tells the SED of a drive.
    #[arg(long, default_value = "models/large.onnx", value_name = "FILE")]
    judge: PathBuf,
    /// Distances of the pins, mm, an array each; their reach is half of it.
    #[arg(long, num_args = 1.., default_values_t = [3.0, 2.0, 1.5], value_name = "MM")]
    pitch_mm: Vec<f32>,
    /// Take one state of so many.
    #[arg(long, default_value_t = 1, value_name = "N")]
    every: usize,
    /// The page; its pictures go into `pictures/actuators` beside it.
    #[arg(long, default_value = "studies/reports/actuators.md", value_name = "FILE")]
    markdown: PathBuf,
    /// Print the tables as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(options: &Args) -> anyhow::Result<ExitCode> {
    let json = options.json;
    let served = loaded(&options.network)?;
    let judge = loaded(&options.judge)?;
    let networks = Networks { served: served.as_ref(), judge: judge.as_ref() };
    let progress =
        Progress::new("arrays", options.datasets.len() * options.pitch_mm.len(), 0, json);
    let mut tables = Vec::new();
    for folder in &options.datasets {
        let dataset = Dataset::open(folder)?;
        for &pitch_mm in &options.pitch_mm {
            let (table, image) = measure(&dataset, networks, pitch_mm, options.every)?;
            let name = format!("pictures/actuators/{}-{pitch_mm}.png", table.set);
            picture::write_png(&image, &options.markdown.with_file_name(&name))?;
            tables.push((table, name));
            progress.inc();
        }
    }
    drop(progress);
    let page = markdown(&tables);
    write(&options.markdown, page.as_bytes())?;
    let tables: Vec<_> = tables.iter().map(|(table, _)| table).collect();
    print(&tables, json, || page)?;
    Ok(ExitCode::SUCCESS)
}

fn loaded(path: &Path) -> Result<Arc<dyn Model>, ExportError> {
    let refused = |source| ExportError::Engine { path: path.to_owned(), source };
    papilla_engine::load(&read(path)?, None).map_err(refused)
}
