//! `model-export friction`.

use super::options::ContactOf;
use super::{load_model, print_json};
use papilla_engine::Backend;
use papilla_model_export::ExportError;
use papilla_model_export::contact::Models;
use papilla_model_export::friction::{RUBBING, Rubbed, measure};
use papilla_progress::Progress;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    of: ContactOf,
    /// A network, `.onnx`, that makes SED of the pressure.
    #[arg(long, value_name = "FILE")]
    network: PathBuf,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let models = Models::read(&options.of.model)?;
    let network = load_model(&options.network, Backend::default(), None)?;
    let failed = |source| ExportError::Engine { path: options.network.clone(), source };
    let mut session = network.session().map_err(failed)?;
    let mut rows = Vec::new();
    let progress = Progress::new("rungs", options.of.datasets.len() * RUBBING.len(), 0, json);
    for folder in &options.of.datasets {
        let dataset = options.of.open(folder)?;
        models.require_atlas(&dataset, folder)?;
        for rung in RUBBING {
            rows.push(measure(&models, rung, &dataset, session.as_mut())?);
            progress.inc();
        }
    }
    drop(progress);
    if json {
        return print_json(&rows);
    }
    println!(
        "| method | set | pressure, % | force, % | pull, % | traction, % | SED, % | SED with `shear_energy`, % | unsettled |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    rows.iter().for_each(print_row);
    println!(
        "\nErrors against FE with friction, median / 95th percentile. Pressure, traction along the skin and SED: relative \
         L2. Force: size of the difference over the size of the force. Pull: size of the difference across the \
         indenter's way in, over the greatest pull (coefficient of friction times force along the way in)."
    );
    Ok(())
}

fn print_row(row: &Rubbed) {
    let percent = |[median, p95]: [f64; 2]| format!("{:.1} / {:.1}", 100.0 * median, 100.0 * p95);
    let Rubbed { rung, set, states, unsettled, pressure, force, pull, traction, sed } = row;
    let [pressure, force, pull, traction] =
        [pressure, force, pull, traction].map(|pair| percent(*pair));
    let [alone, felt] = sed.map(percent);
    println!(
        "| {rung} | {set} | {pressure} | {force} | {pull} | {traction} | {alone} | {felt} | {unsettled} of {states} |"
    );
}
