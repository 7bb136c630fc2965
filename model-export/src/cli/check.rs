//! `model-export check`.

use super::options::RunModel;
use super::{load_card, load_model, print_json};
use papilla_engine::ModelInfo;
use papilla_model_export::evaluate::require_atlas;
use papilla_model_export::read_atlas;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    run: RunModel,
    /// The atlas that the model must belong to.
    #[arg(long, value_name = "FILE")]
    atlas: Option<PathBuf>,
    /// The card that must belong to the model.
    #[arg(long, value_name = "FILE")]
    card: Option<PathBuf>,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let card = options.card.as_deref().map(load_card).transpose()?;
    let model = load_model(&options.run.model, options.run.backend, card.as_ref())?;
    let info = model.info();
    if let Some(path) = &options.atlas {
        require_atlas(&path.display().to_string(), read_atlas(path)?.hash(), info)?;
    }
    if json {
        return print_json(info);
    }
    print!("{}", describe(info));
    for (what, path) in [("atlas", &options.atlas), ("card", &options.card)] {
        if let Some(path) = path {
            println!("{what:<13}{} belongs to it", path.display());
        }
    }
    println!("ok           the model keeps the contract");
    Ok(())
}

fn describe(info: &ModelInfo) -> String {
    [
        ("name", info.name.clone()),
        ("network", info.network.to_string()),
        ("weights", info.weights.to_string()),
        ("file", format!("{} bytes, sha256 {}", info.bytes, info.onnx_sha256)),
        ("atlas", info.atlas_hash.clone()),
        ("effects", info.effects.join(", ")),
        ("pressure", format!("0 to {:.0} Pa", info.pressure_max_pa)),
        ("SED", format!("0 to {:.0} J/m3", info.sed_max_j_per_m3)),
        ("dataset", info.dataset_sha256.clone()),
        ("training", info.training.to_string()),
        ("engine", info.backend.clone()),
    ]
    .map(|(key, value)| format!("{key:<13}{value}\n"))
    .concat()
}
