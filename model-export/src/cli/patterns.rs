//! `model-export patterns`.

use super::{bar, load_card, print_json};
use anyhow::bail;
use papilla_engine::card::Index;
use papilla_engine::{MAP_LEN, ladder::Kind};
use papilla_model_export::dataset::Dataset;
use papilla_model_export::{read_text, write};
use papilla_proto::Pattern;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Folder with index.json and the cards.
    folder: PathBuf,
    /// A dataset that models were trained on; several times for several.
    #[arg(long = "dataset", value_name = "DIR", required = true)]
    datasets: Vec<PathBuf>,
}

/// What became of a card.
#[derive(Debug, Serialize)]
struct Row {
    model: String,
    /// None if its datasets are not all among those given, or it was fitted to no maps.
    pattern_max: Option<Pattern>,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let seen =
        options.datasets.iter().map(|path| look(path, json)).collect::<Result<Vec<_>, _>>()?;
    let index = Index::from_json(&read_text(&options.folder.join("index.json"))?)?;
    let mut rows = Vec::new();
    for name in &index.models {
        let path = options.folder.join(format!("{name}.json"));
        let mut card = load_card(&path)?;
        let of = |hash: &str| seen.iter().find(|(own, _)| own == hash).map(|(_, pattern)| *pattern);
        let pattern_max = if Kind::of_network(&card.network).is_network() {
            card.datasets().into_iter().map(of).reduce(|a, b| Some(a?.max(b?))).flatten()
        } else {
            None
        };
        if pattern_max.is_some() {
            card.pattern_max = pattern_max;
            write(&path, card.to_json()?.as_bytes())?;
        }
        rows.push(Row { model: name.clone(), pattern_max });
    }
    if rows.iter().all(|row| row.pattern_max.is_none()) {
        bail!("no model of {} was trained on these datasets alone", options.folder.display());
    }
    if json {
        return print_json(&rows);
    }
    for Row { model, pattern_max } in &rows {
        match pattern_max {
            None => println!("{model}: left as it is"),
            Some(Pattern { roughness, load_mpa_px }) => {
                println!(
                    "{model}: roughness up to {roughness:.4}, load up to {load_mpa_px:.1} MPa px"
                );
            }
        }
    }
    Ok(())
}

/// Hash and greatest pattern of a dataset.
fn look(folder: &Path, hidden: bool) -> anyhow::Result<(String, Pattern)> {
    let dataset = Dataset::open(folder)?;
    let presses = dataset.every_press();
    let bar = bar(hidden, presses.len(), "presses")?;
    let mut pressure_pa = vec![0.0; MAP_LEN];
    let mut greatest = Pattern::default();
    for press in presses {
        let shard = dataset.load(press)?;
        for index in 0..press.samples {
            dataset.draw_pressure(press, &shard, index, &mut pressure_pa)?;
            greatest = greatest.max(Pattern::of(&pressure_pa));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok((dataset.sha256().to_owned(), greatest))
}
