//! `model-export shear`.

use super::{load_model, print_json};
use papilla_engine::Backend;
use papilla_model_export::ExportError;
use papilla_model_export::contact::Models;
use papilla_model_export::dataset::Dataset;
use papilla_model_export::shear::{Row, measure};
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
    let failed = |source| ExportError::Engine { path: options.network.clone(), source };
    let mut session = network.session().map_err(failed)?;
    let mut rows = Vec::new();
    for folder in &options.datasets {
        let dataset = Dataset::open(folder)?;
        models.require_atlas(&dataset, folder)?;
        rows.push(measure(&models, &dataset, session.as_mut())?);
    }
    if json {
        return print_json(&rows);
    }
    println!("| set | states | SED, pressure alone, % | with traction, % | traction, us |");
    println!("|---|---|---|---|---|");
    for Row { set, alone, felt, us, states } in &rows {
        let percent =
            |[median, p95]: [f64; 2]| format!("{:.1} / {:.1}", 100.0 * median, 100.0 * p95);
        let [alone, felt] = [alone, felt].map(|pair| percent(*pair));
        println!("| {set} | {states} | {alone} | {felt} | {:.0} / {:.0} |", us[0], us[1]);
    }
    println!("\nRelative L2 against FE and processor time, median / 95 %.");
    Ok(())
}
