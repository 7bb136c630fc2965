//! `model-export calibrate`.

use super::options::Folders;
use super::{load_card, load_model, print_json};
use anyhow::bail;
use papilla_engine::Backend;
use papilla_engine::card::Index;
use papilla_model_export::calibrate::{Cost, Outcome, SETS, States, reliability, report};
use papilla_model_export::{read, read_text, write};
use papilla_progress::Progress;
use std::path::PathBuf;

/// Page, picture and figures have this name.
const STEM: &str = "expected-error";

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    folders: Folders,
    /// Networks to calibrate; all others state no error [default: those of the index that are not
    /// loaded on demand].
    #[arg(long, num_args = 1.., value_name = "NAME")]
    network: Vec<String>,
    /// Folder for expected-error.md, .svg and .json; an older page is replaced.
    #[arg(long, default_value = "docs/reports", value_name = "FOLDER")]
    out: PathBuf,
    /// File to keep the states in, with what each answer shows and errs.
    #[arg(long, value_name = "FILE")]
    states: Option<PathBuf>,
    /// Fit to the states of this file; asks no network and no contact.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["states", "network"])]
    from: Option<PathBuf>,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let Folders { data, shipped } = &options.folders;
    let index = Index::from_json(&read_text(&shipped.models.join("index.json"))?)?;
    let states = match &options.from {
        Some(path) => serde_json::from_slice(&read(path)?)?,
        None => {
            let of_start = index.models.iter().filter(|name| !index.on_demand.contains(name));
            let names = match &options.network[..] {
                [] => of_start.cloned().collect(),
                named => named.to_vec(),
            };
            let progress = Progress::new("states", 0, 0, json);
            States::of(data, &shipped.models, &names, || progress.inc())?
        }
    };
    if let Some(path) = &options.states {
        write(path, &serde_json::to_vec(&states)?)?;
    }
    if states.is_empty() {
        let names: Vec<&str> = SETS.iter().map(|set| set.folder).collect();
        bail!("{} holds none of {}", data.display(), names.join(", "));
    }
    let progress = Progress::new("errors", 0, 0, json);
    let mut outcome = Outcome::of(&states, || progress.inc());
    drop(progress);
    outcome.cost = cost(options, &outcome)?;
    let mut laws = serde_json::to_vec_pretty(&outcome.laws)?;
    laws.push(b'\n');
    write(&shipped.models.join("errors.json"), &laws)?;
    let mut figures = serde_json::to_vec_pretty(&outcome)?;
    figures.push(b'\n');
    write(&options.out.join(format!("{STEM}.json")), &figures)?;
    let picture = reliability(&outcome.shown()).map_err(anyhow::Error::msg)?;
    write(&options.out.join(format!("{STEM}.svg")), picture.as_bytes())?;
    write(&options.out.join(format!("{STEM}.md")), report::markdown(&outcome, STEM).as_bytes())?;
    if json {
        return print_json(&outcome);
    }
    print!("{}", report::summary(&outcome));
    Ok(())
}

/// What it takes beside the first network that has a law.
fn cost(options: &Options, outcome: &Outcome) -> anyhow::Result<Option<Cost>> {
    // What is not optimised takes other times.
    if cfg!(debug_assertions) {
        return Ok(None);
    }
    let wanted = ["nano", "small"];
    let of = |name: &&str| outcome.laws.networks.iter().find(|laws| laws.name == **name);
    let Some(laws) = wanted.iter().find_map(of) else { return Ok(None) };
    let path = options.folders.shipped.models.join(format!("{}.onnx", laws.name));
    let card = load_card(&path.with_extension("json"))?;
    let model = load_model(&path, Backend::default(), Some(&card))?;
    let trained = card.input_statistics_max.map(|of| of.cells).unwrap_or_default();
    Ok(Some(Cost::of(model.as_ref(), &laws.given, trained)?))
}
