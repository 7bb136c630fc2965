//! `model-export patterns`.

use super::{load_card, print_json};
use anyhow::bail;
use papilla_engine::card::Index;
use papilla_engine::{MAP_LEN, ladder::Kind};
use papilla_model_export::dataset::Dataset;
use papilla_model_export::{read_text, write};
use papilla_progress::Progress;
use papilla_proto::InputStatistics;
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
    #[serde(rename = "pattern_max")]
    input_statistics_max: Option<InputStatistics>,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let index = options.folder.join("index.json");
    if !index.exists() {
        let folder = options.folder.display();
        bail!(
            "{} is not there: `model-export index {folder} --default NAME` writes it",
            index.display()
        );
    }
    let index = Index::from_json(&read_text(&index)?)?;
    let seen =
        options.datasets.iter().map(|path| look(path, json)).collect::<Result<Vec<_>, _>>()?;
    let mut rows = Vec::new();
    for name in &index.models {
        let path = options.folder.join(format!("{name}.json"));
        let mut card = load_card(&path)?;
        let of =
            |hash: &str| seen.iter().find(|(own, _)| own == hash).map(|(_, greatest)| *greatest);
        let input_statistics_max = if Kind::of_network(&card.network).is_network() {
            card.datasets().into_iter().map(of).reduce(|a, b| Some(a?.max(b?))).flatten()
        } else {
            None
        };
        if input_statistics_max.is_some() {
            card.input_statistics_max = input_statistics_max;
            write(&path, card.to_json()?.as_bytes())?;
        }
        rows.push(Row { model: name.clone(), input_statistics_max });
    }
    if rows.iter().all(|row| row.input_statistics_max.is_none()) {
        bail!("no model of {} was trained on these datasets alone", options.folder.display());
    }
    if json {
        return print_json(&rows);
    }
    for Row { model, input_statistics_max } in &rows {
        match input_statistics_max {
            None => println!("{model}: left as it is"),
            Some(InputStatistics { roughness, load_mpa_px, rough_load_mpa_px, area_px }) => {
                println!(
                    "{model}: roughness up to {roughness:.4}, load up to {load_mpa_px:.1} MPa px, \
                     their product up to {rough_load_mpa_px:.2}, area up to {area_px:.0} px"
                );
            }
        }
    }
    Ok(())
}

/// Hash and greatest input statistics of a dataset.
fn look(folder: &Path, hidden: bool) -> anyhow::Result<(String, InputStatistics)> {
    let dataset = Dataset::open(folder)?;
    let indentations = dataset.every_indentation();
    let progress = Progress::new("presses", indentations.len(), 0, hidden);
    let mut pressure_pa = vec![0.0; MAP_LEN];
    let mut greatest = InputStatistics::default();
    for indentation in indentations {
        let shard = dataset.shard(indentation)?;
        for index in 0..indentation.samples {
            dataset.draw_pressure(indentation, &shard, index, &mut pressure_pa)?;
            greatest = greatest.max(InputStatistics::of(&pressure_pa));
        }
        progress.inc();
    }
    Ok((dataset.sha256().to_owned(), greatest))
}
