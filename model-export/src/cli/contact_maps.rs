//! `model-export contact-maps`.

use super::options::ContactOf;
use super::print_json;
use papilla_model_export::contact::{ContactMaps, Models};
use papilla_model_export::write;
use papilla_progress::Progress;
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    of: ContactOf,
    /// Folder to write a file to for each dataset, NAME.npz; the trainer reads them (`--contact`).
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let models = Models::read(&options.of.model)?;
    let progress = Progress::new("datasets", options.of.datasets.len(), 0, json);
    let mut written = Vec::new();
    for folder in &options.of.datasets {
        let dataset = options.of.open(folder)?;
        models.require_atlas(&dataset, folder)?;
        let maps = ContactMaps::of(&models, &dataset)?;
        let name = folder.canonicalize()?;
        let name = name.file_name().unwrap_or_default().to_string_lossy();
        let path = options.out.join(format!("{name}.npz"));
        write(&path, &maps.npz(&dataset)?)?;
        written.push((path, maps.press.len(), maps.left_out));
        progress.inc();
    }
    drop(progress);
    if json {
        let line = |(out, maps, left_out): &(PathBuf, usize, usize)| json!({"out": out, "maps": maps, "left_out": left_out});
        return print_json(&written.iter().map(line).collect::<Vec<_>>());
    }
    for (path, maps, left_out) in written {
        println!("{}: {maps} maps; {left_out} states unsettled or out of range", path.display());
    }
    Ok(())
}
