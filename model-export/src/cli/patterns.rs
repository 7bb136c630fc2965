//! `model-export patterns`.

use super::{load_card, print_json};
use anyhow::bail;
use papilla_engine::card::Index;
use papilla_engine::{MAP_LEN, ladder::Kind};
use papilla_model_export::dataset::Dataset;
use papilla_model_export::{read_text, write};
use papilla_progress::Progress;
use papilla_proto::{InputStatistics, peak};
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
    response_max_per_mpa: Option<f32>,
}

/// What all indentations of a dataset, or of several, come to at most.
#[derive(Clone, Copy, Default)]
struct Greatest {
    input: InputStatistics,
    /// SED over pressure squared, each of them the greatest of its map, 1/MPa.
    response_per_mpa: f32,
}

impl Greatest {
    fn max(self, other: Self) -> Self {
        Self {
            input: self.input.max(other.input),
            response_per_mpa: self.response_per_mpa.max(other.response_per_mpa),
        }
    }
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
        let greatest = if Kind::of_network(&card.network).is_network() {
            card.datasets().into_iter().map(of).reduce(|a, b| Some(a?.max(b?))).flatten()
        } else {
            None
        };
        let input_statistics_max = greatest.map(|found| found.input);
        let response_max_per_mpa = greatest.map(|found| found.response_per_mpa);
        if greatest.is_some() {
            card.input_statistics_max = input_statistics_max;
            card.response_max_per_mpa = response_max_per_mpa;
            write(&path, card.to_json()?.as_bytes())?;
        }
        rows.push(Row { model: name.clone(), input_statistics_max, response_max_per_mpa });
    }
    if rows.iter().all(|row| row.input_statistics_max.is_none()) {
        bail!("no model of {} was trained on these datasets alone", options.folder.display());
    }
    if json {
        return print_json(&rows);
    }
    for Row { model, input_statistics_max, response_max_per_mpa } in &rows {
        match input_statistics_max {
            None => println!("{model}: left as it is"),
            Some(found) => {
                let InputStatistics { roughness, load_mpa_px, rough_load_mpa_px, .. } = found;
                let InputStatistics { area_px, contrast_px, cells, .. } = found;
                println!(
                    "{model}: roughness up to {roughness:.4}, load up to {load_mpa_px:.1} MPa px, \
                     their product up to {rough_load_mpa_px:.2}, area up to {area_px:.0} px, \
                     contrast up to {contrast_px:.1} px, pressed in {} cells; SED over pressure \
                     squared up to {:.2} /MPa",
                    cells.count(),
                    response_max_per_mpa.unwrap_or(f32::NAN)
                );
            }
        }
    }
    Ok(())
}

/// Hash of a dataset, and what its indentations come to at most.
fn look(folder: &Path, hidden: bool) -> anyhow::Result<(String, Greatest)> {
    let dataset = Dataset::open(folder)?;
    let indentations = dataset.every_indentation();
    let progress = Progress::new("presses", indentations.len(), 0, hidden);
    let [mut pressure_pa, mut sed_j_per_m3] = [(); 2].map(|()| vec![0.0; MAP_LEN]);
    let mut greatest = Greatest::default();
    for indentation in indentations {
        let shard = dataset.shard(indentation)?;
        for index in 0..indentation.samples {
            dataset.draw_pressure(indentation, &shard, index, &mut pressure_pa)?;
            dataset.draw_sed(indentation, &shard, index, &mut sed_j_per_m3)?;
            // J/m3 over Pa squared is 1/Pa.
            let response_per_mpa = match peak(&pressure_pa) {
                peak_pa if peak_pa > 0.0 => 1e6 * (peak(&sed_j_per_m3) / peak_pa) / peak_pa,
                _ => 0.0,
            };
            let input = InputStatistics::of(&pressure_pa);
            greatest = greatest.max(Greatest { input, response_per_mpa });
        }
        progress.inc();
    }
    Ok((dataset.sha256().to_owned(), greatest))
}
