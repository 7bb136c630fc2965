//! `model-export shear`.

use super::{load_model, print_json};
use papilla_engine::Backend;
use papilla_engine::ladder::Traction;
use papilla_model_export::contact::Models;
use papilla_model_export::dataset::Dataset;
use papilla_model_export::shear::measure;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The contact model, a file of `fe-datagen contact`; its layers are what feels traction.
    model: PathBuf,
    /// Datasets of the same finger, solved with friction.
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// The network, `.onnx`, that makes SED of the pressure.
    #[arg(long, value_name = "FILE")]
    network: PathBuf,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let models = Models::read(&options.model)?;
    let network = load_model(&options.network, Backend::default(), None)?;
    let mut rows = Vec::new();
    for folder in &options.datasets {
        let dataset = Dataset::open(folder)?;
        models.require_atlas(&dataset, folder)?;
        rows.push(measure(&models, &dataset, network.as_ref())?);
    }
    if json {
        return print_json(&rows);
    }
    println!("| set | states | SED, pressure alone, % | with traction, % | traction, ms |");
    println!("|---|---|---|---|---|");
    for Traction { set, alone, felt, added_ms, samples, .. } in &rows {
        let [alone, felt] =
            [alone, felt].map(|of| format!("{:.1} / {:.1}", 100.0 * of.median, 100.0 * of.p95));
        let ms = format!("{:.2} / {:.2}", added_ms.median, added_ms.p95);
        println!("| {set} | {samples} | {alone} | {felt} | {ms} |");
    }
    println!("\nRelative L2 against FE and processor time, median / 95 %.");
    Ok(())
}
