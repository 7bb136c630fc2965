//! `model-export evaluate`.

use super::options::RunModel;
use super::{load_card, load_model, print_json};
use papilla_dataset::Split;
use papilla_engine::card::{Card, Latency, Spread};
use papilla_engine::ladder::Kind;
use papilla_engine::{Backend, Model, ModelInfo};
use papilla_model_export::dataset::Dataset;
use papilla_model_export::evaluate::{self, ByIndenter, Evaluation, Subject};
use papilla_model_export::reference::{Recorded, TOLERANCE};
use papilla_model_export::split::SplitOrAll;
use papilla_model_export::{ExportError, picture, write};
use papilla_progress::Progress;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    run: RunModel,
    /// Folder of the dataset, as `fe-datagen generate` writes it.
    dataset: PathBuf,
    /// The model was trained on another finger: measure what it is worth on this one by similarity
    /// alone, which is what a service answers that serves it so.
    #[arg(long, conflicts_with = "card")]
    similarity: bool,
    /// Which indentations: `test` (held out), `train` or `all`.
    #[arg(long, default_value_t = SplitOrAll::Split(Split::Test), value_name = "SPLIT")]
    split: SplitOrAll,
    /// Write the card here, such as models/NAME.json. Needs the dataset that the model was
    /// trained on (of several, one of them; any, for a model that learnt nothing) and the split `test`.
    #[arg(long, value_name = "FILE")]
    card: Option<PathBuf>,
    /// Write NAME-best.png, NAME-median.png and NAME-worst.png into this folder: pressure,
    /// truth, prediction and error of those samples.
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// Hold the engine against another: an `.npz` that the trainer's `check --reference` wrote
    /// with ONNX Runtime, or the word `ort` to run ONNX Runtime here on every sample
    /// (programs built with `--features ort`, ORT_DYLIB_PATH set).
    #[arg(long, value_name = "FILE|ort")]
    reference: Option<PathBuf>,
    /// Difference from the reference, relative to the maximum, beyond which it fails.
    #[arg(long, default_value_t = TOLERANCE, value_name = "PART")]
    tolerance: f64,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let model = load_model(&options.run.model, options.run.backend, None)?;
    let info = model.info();
    let dataset = Dataset::open(&options.dataset)?;
    if options.card.is_some() {
        require_held_out(options, info, &dataset)?;
    }
    let subject =
        Subject { path: &options.run.model, model: model.as_ref(), similarity: options.similarity };
    let other = second_engine(options)?;
    let mut difference = recorded_difference(options, model.as_ref())?;
    let evaluation = measure(options, &subject, other.as_deref(), &dataset, json)?;
    if let Some(other) = &other {
        difference = evaluation.other_engine_difference_max;
        agree(difference, info, &other.info().backend, options.tolerance)?;
    }
    let mut card = evaluation.card(info, difference);
    if let Some(path) = &options.card {
        // Input statistics are the data's, not the model's: those noted for them still hold.
        let noted = load_card(path).ok().filter(|old| old.dataset_sha256 == card.dataset_sha256);
        card.input_statistics_max = noted.as_ref().and_then(|old| old.input_statistics_max);
        card.response_max_per_mpa = noted.and_then(|old| old.response_max_per_mpa);
        write(path, card.to_json()?.as_bytes())?;
    }
    let pictures = draw_pictures(options, &subject, &dataset, &evaluation)?;
    if json {
        return print_json(&json!({
            "card": card,
            "other_engine_latency_ms": evaluation.other_engine_latency_ms,
            "pictures": pictures,
            "by_indenter": evaluation.by_indenter(),
            "samples": evaluation.samples,
        }));
    }
    print!("{}", describe(&card, &evaluation));
    for path in options.card.iter().chain(&pictures) {
        println!("wrote {}", path.display());
    }
    Ok(())
}

/// A card tells of indentations that the training never saw.
fn require_held_out(options: &Options, info: &ModelInfo, dataset: &Dataset) -> anyhow::Result<()> {
    if options.split != SplitOrAll::Split(Split::Test) {
        anyhow::bail!("a card tells of held-out presses: --card needs --split test");
    }
    let trained = info.datasets();
    // A closed form has learnt from no simulation, so that all are held out.
    let learnt = Kind::of_network(&info.network).is_network();
    if learnt && !trained.contains(&dataset.sha256()) {
        let (trained, found) = (trained.join(", "), dataset.sha256().to_owned());
        return Err(ExportError::OtherDataset { trained, found }.into());
    }
    Ok(())
}

/// ONNX Runtime on the same model, if `--reference ort` asks for it.
fn second_engine(options: &Options) -> Result<Option<Arc<dyn Model>>, ExportError> {
    if options.reference.as_deref().is_some_and(|reference| reference.as_os_str() == "ort") {
        return load_model(&options.run.model, Backend::Ort, None).map(Some);
    }
    Ok(None)
}

/// Difference from a recorded reference, if `--reference FILE` names one.
fn recorded_difference(options: &Options, model: &dyn Model) -> Result<Option<f64>, ExportError> {
    let recorded = options.reference.as_deref().filter(|path| path.as_os_str() != "ort");
    let Some(path) = recorded else { return Ok(None) };
    let failed = |source| ExportError::Engine { path: options.run.model.clone(), source };
    let mut session = model.session().map_err(failed)?;
    let difference = Recorded::read(path)?.difference(session.as_mut(), &options.run.model)?;
    let other = path.display().to_string();
    agree(Some(difference), model.info(), &other, options.tolerance)?;
    Ok(Some(difference))
}

fn agree(
    difference: Option<f64>,
    info: &ModelInfo,
    other: &str,
    tolerance: f64,
) -> Result<(), ExportError> {
    match difference {
        None => Ok(()),
        Some(difference) if difference <= tolerance => Ok(()),
        Some(difference) => Err(ExportError::Disagreement {
            backend: info.backend.clone(),
            other: other.to_owned(),
            difference,
            tolerance,
        }),
    }
}

fn measure(
    options: &Options,
    subject: &Subject<'_>,
    other: Option<&dyn Model>,
    dataset: &Dataset,
    json: bool,
) -> anyhow::Result<Evaluation> {
    let count: usize =
        dataset.indentations(options.split)?.iter().map(|indentation| indentation.samples).sum();
    let progress = Progress::new("samples", count, 0, json);
    Ok(evaluate::run(subject, other, dataset, options.split, || progress.inc())?)
}

fn draw_pictures(
    options: &Options,
    subject: &Subject<'_>,
    dataset: &Dataset,
    evaluation: &Evaluation,
) -> Result<Vec<PathBuf>, ExportError> {
    let Some(folder) = &options.pictures else { return Ok(Vec::new()) };
    let mut paths = Vec::new();
    for (word, sample) in evaluation.landmarks() {
        let maps = evaluate::maps_of(subject, dataset, sample)?;
        let name = &subject.model.info().name;
        let heading = format!("{name}, {word} of {}", evaluation.samples.len());
        let path = folder.join(format!("{name}-{word}.png"));
        picture::write_png(&picture::draw(&heading, sample, &maps, dataset), &path)?;
        paths.push(path);
    }
    Ok(paths)
}

fn describe(card: &Card, evaluation: &Evaluation) -> String {
    let m = &card.metrics;
    let mut lines = vec![
        format!("{} on {} samples of the split '{}'", card.name, m.samples, m.split),
        format!("{:<24}{:>10}{:>10}", "", "median", "p95"),
    ];
    let errors = [
        ("relative L2", Some(m.relative_l2)),
        ("far field relative L2", m.far_field_relative_l2),
        ("peak error", Some(m.peak_error)),
        ("total-energy error", Some(m.total_energy_error)),
    ];
    for (name, spread) in errors {
        lines.push(spread.map_or_else(
            || format!("{name:<24}{:>10}{:>10}", "-", "-"),
            |Spread { median, p95 }| {
                format!("{name:<24}{:>8.2} %{:>8.2} %", 100.0 * median, 100.0 * p95)
            },
        ));
    }
    lines.push(format!("{:<24}{:>10.4}{:>10.4} (p5)", "SSIM", m.ssim.median, m.ssim.p5));
    let latency = |l: &Latency| {
        format!(
            "{:<24}{:>10.2}{:>10.2} (p50, p99; {} thread, {})",
            "ms per map", l.p50, l.p99, l.threads, l.backend
        )
    };
    lines.push(latency(&card.latency_ms));
    lines.extend(evaluation.other_engine_latency_ms.as_ref().map(latency));
    if let Some(difference) = card.onnxruntime_difference_max {
        lines.push(format!("{:<24}{difference:>10.1e} of the maximum", "from ONNX Runtime"));
    }
    let by_indenter = evaluation.by_indenter();
    if by_indenter.len() > 1 {
        lines.extend([String::new(), ByIndenter::HEAD.to_owned()]);
        lines.extend(by_indenter.iter().map(ByIndenter::to_string));
    }
    lines.push(String::new());
    lines.join("\n")
}
