//! `model-export contact`.

use super::options::ContactOf;
use super::{load_model, print_json};
use papilla_dataset::Split;
use papilla_engine::Backend;
use papilla_model_export::contact::{Models, Row, Rung, errors_of, measure};
use papilla_model_export::split::SplitOrAll;
use papilla_model_export::{ExportError, evaluate};
use papilla_progress::Progress;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    of: ContactOf,
    /// A network, `.onnx`, that makes SED of the pressure.
    #[arg(long, value_name = "FILE")]
    network: Option<PathBuf>,
    /// The network was trained on another finger: measure what it is worth on this one by
    /// similarity alone.
    #[arg(long, requires = "network")]
    similarity: bool,
    /// Measure this method alone, such as "second order, pixels"; may be given several times.
    #[arg(long = "method", value_name = "NAME", value_parser = rung)]
    methods: Vec<Rung>,
    /// Which indentations are taken: 'test', 'train' (to choose by) or 'all'.
    #[arg(long, default_value_t = SplitOrAll::Split(Split::Test), value_name = "PART")]
    split: SplitOrAll,
    /// Take one state of so many.
    #[arg(long, default_value_t = 1, value_name = "N")]
    every: usize,
    /// File to write what the methods err to, which the service tells its clients: contact.json
    /// beside the contact model. The first dataset is the one of which `ready` tells.
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
}

fn rung(name: &str) -> Result<Rung, String> {
    let all = || Rung::ALL.map(|rung| format!("'{}'", rung.name())).join(", ");
    Rung::ALL
        .into_iter()
        .find(|rung| rung.name() == name)
        .ok_or_else(|| format!("there are: {}", all()))
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let models = Models::read(&options.of.model)?;
    let network = options.network.as_deref();
    let network = network.map(|path| load_model(path, Backend::default(), None)).transpose()?;
    let mut session = None;
    if let (Some(network), Some(path)) = (&network, &options.network) {
        let failed = |source| ExportError::Engine { path: path.clone(), source };
        session = Some(network.session().map_err(failed)?);
    }
    let mut rows = Vec::new();
    let rungs = if options.methods.is_empty() { &Rung::ALL[..] } else { &options.methods };
    let progress = Progress::new("rungs", options.of.datasets.len() * rungs.len(), 0, json);
    for folder in &options.of.datasets {
        let dataset = options.of.open(folder)?;
        models.require_atlas(&dataset, folder)?;
        if let Some(network) = network.as_ref().filter(|_| !options.similarity) {
            let what = folder.display().to_string();
            evaluate::require_atlas(&what, dataset.atlas().hash(), network.info())?;
        }
        for &rung in rungs {
            let session = session.as_deref_mut();
            rows.push(measure(&models, rung, &dataset, session, (options.split, options.every))?);
            progress.inc();
        }
    }
    drop(progress);
    if let Some(path) = &options.write {
        let network = network.as_ref().map(|network| network.info().name.clone());
        let errors = errors_of(&papilla_model_export::read(&options.of.model)?, network, &rows);
        let mut text = serde_json::to_vec_pretty(&errors)?;
        text.push(b'\n');
        papilla_model_export::write(path, &text)?;
    }
    if json {
        return print_json(&rows);
    }
    println!(
        "| method | set | pressure, % | force, % | force across, % | SED, % | first frame, us | next frame, us | 1 um aside, % | flagged |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    rows.iter().for_each(print_row);
    println!(
        "\nRelative L2 against FE and processor time, median / 95th percentile; by how much 1 um sideways changes \
         the pressure, median / greatest; unsettled + out of range, of all states."
    );
    Ok(())
}

fn print_row(row: &Row) {
    let percent = |[median, p95]: [f64; 2]| format!("{:.1} / {:.1}", 100.0 * median, 100.0 * p95);
    let us = |[median, p95]: [f64; 2]| format!("{median:.0} / {p95:.0}");
    let [unsettled, outside, all] = row.told;
    println!(
        "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {unsettled} + {outside} of {all} |",
        row.rung,
        row.set,
        percent(row.pressure),
        percent(row.force),
        percent(row.across),
        row.sed.map_or_else(|| "-".to_owned(), percent),
        us(row.cold_us),
        us(row.warm_us),
        percent(row.side_step),
    );
}
