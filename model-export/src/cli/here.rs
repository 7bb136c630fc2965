//! `model-export here`.

use super::options::ModelsFolder;
use super::{ladder::Shown, print_json};
use papilla_model_export::ladder::{here, plot};
use papilla_model_export::{ExportError, write};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    shipped: ModelsFolder,
    /// Folder for here.md, here.svg and here.json.
    #[arg(long, default_value = "out/here", value_name = "FOLDER")]
    out: PathBuf,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let shown = Shown(papilla_progress::Progress::new("models", 0, 0, json));
    let ladder = here::measure(&options.shipped.models, &shown)?;
    let chart = |reason| ExportError::Chart { what: "error against time", reason };
    let picture = plot::error_against_time(&here::by_engine(&ladder)).map_err(chart)?;
    let page = here::markdown(&ladder, "here");
    for (ending, text) in [("md", &page), ("svg", &picture), ("json", &ladder.to_json()?)] {
        write(&options.out.join(format!("here.{ending}")), text.as_bytes())?;
    }
    if json {
        return print_json(&ladder);
    }
    print!("{page}");
    Ok(())
}
