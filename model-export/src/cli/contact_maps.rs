//! `model-export contact-maps`.

use super::print_json;
use papilla_model_export::contact::{ContactMaps, Models};
use papilla_model_export::dataset::Dataset;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The contact model, a file of `fe-datagen contact`.
    model: PathBuf,
    /// A dataset of the same finger.
    dataset: PathBuf,
    /// The file to write, `.npz`; the trainer reads it (`--contact`).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let Options { model, dataset: folder, out } = options;
    let models = Models::read(model)?;
    let dataset = Dataset::open(folder)?;
    models.require_atlas(&dataset, folder)?;
    let maps = ContactMaps::of(&models, &dataset)?;
    maps.write(&dataset, out)?;
    let (count, left_out) = (maps.press.len(), maps.left_out);
    if json {
        return print_json(&serde_json::json!({ "maps": count, "left_out": left_out, "out": out }));
    }
    println!(
        "{}: {count} maps; {left_out} states did not settle or lie out of range",
        out.display()
    );
    Ok(())
}
