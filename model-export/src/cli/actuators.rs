//! `model-export actuators`.

use super::{load_model, print_json};
use papilla_engine::Backend;
use papilla_model_export::actuators::{Networks, markdown, measure};
use papilla_model_export::dataset::Dataset;
use papilla_model_export::{picture, write};
use papilla_progress::Progress;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
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
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let served = load_model(&options.network, Backend::default(), None)?;
    let judge = load_model(&options.judge, Backend::default(), None)?;
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
    if json {
        let tables: Vec<_> = tables.iter().map(|(table, _)| table).collect();
        return print_json(&tables);
    }
    print!("{page}");
    Ok(())
}
