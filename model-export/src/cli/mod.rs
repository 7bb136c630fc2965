//! The command line.

mod calibrate;
mod check;
mod contact;
mod contact_maps;
mod evaluate;
mod friction;
mod here;
mod index;
mod ladder;
mod options;
mod patterns;
mod pseudo_labels;

use clap::{Parser, Subcommand};
use papilla_engine::{Backend, Card, Model};
use papilla_model_export::{ExportError, read, read_text, table};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const EXIT_CODES: &str = "\
Exit status:
  0  done
  1  refused: the model, card, dataset or reference is not what it must be
  2  wrong usage
  3  a file could not be read or written";

const ABOUT: &str = "\
Checks, evaluates and describes exported Papilla models.

A model maps the pressure on a fingertip (Pa) to the strain energy density (SED, J/m3) under
its skin; the trainer writes it as ONNX. This program measures it in the engine that
will serve it, on indentations that no training saw, and writes its card.";

const EXAMPLES: &str = "\
A new model, from the trainer's file to the service:
  model-export check    models/small.onnx --atlas models/atlas.json
  model-export evaluate models/small.onnx data/broad-graded --card out/models/small.json --pictures docs/reports/pictures/small
  model-export index    models --default small
  model-export patterns models --dataset data/more-graded --dataset data/pressed-graded \
      --dataset data/hard-graded --dataset data/proximal-graded --dataset data/broad-graded
  model-export table    models/*.json
All models and the solver itself, error against time:
  model-export ladder   --data data --models models --fe out/rungs --out docs/reports
  model-export here     --out out/here
How wrong each answer is likely to be:
  model-export calibrate --network nano-maps nano small-maps small large large-maps";

/// Parsed command line.
#[derive(Debug, Parser)]
#[command(version, about = "Checks, evaluates and describes exported Papilla models", long_about = ABOUT, after_long_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Print one JSON document instead of text; errors too.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Load a model, check it against the contract and say what it is.
    ///
    /// Checked: the file is whole; one input `pressure_pa` and one output `sed_j_per_m3`, float32
    /// [1, 1, 224, 224]; every weight is finite and inside the file; metadata; a trial map is
    /// answered with finite, non-negative values; with --atlas and --card, that they belong to it.
    #[command(after_long_help = EXIT_CODES)]
    Check(check::Options),
    /// Measure a model on the held-out indentations of a dataset and write its card.
    ///
    /// Every sample of the split is drawn from the shards, inferred in the serving engine on one
    /// thread and compared with the finite-element truth over the interface's pixels: relative
    /// L2, the same where the truth is below 10 % of its maximum (far field), peak, total
    /// energy, SSIM; and the time of each inference.
    #[command(after_long_help = EXIT_CODES)]
    Evaluate(evaluate::Options),
    /// Fit by what answers show how wrong they are likely to be, and check it.
    ///
    /// Networks and contact are asked about simulations that no training saw. Laws of their errors are
    /// fitted to them and written as MODELS/errors.json, by which the service states the error of each
    /// answer. Each simulation is checked by laws of others; two sets are set aside for the check
    /// alone. Written besides: a page with tables, the reliability diagram, the figures as JSON.
    #[command(after_long_help = EXIT_CODES)]
    Calibrate(calibrate::Options),
    /// Print a Markdown table of accuracy against time for several cards.
    #[command(after_long_help = EXIT_CODES)]
    Table {
        /// Cards written by `evaluate`, in the order of the rows; other JSON files beside
        /// them (atlas.json, index.json, ladder.json, replay.json, errors.json) are passed over.
        #[arg(required = true, value_name = "CARD")]
        cards: Vec<PathBuf>,
    },
    /// Write index.json for a folder of models: which there are, which one is the default.
    ///
    /// Every NAME.onnx there must have its card NAME.json and the atlas of atlas.json.
    #[command(after_long_help = EXIT_CODES)]
    Index(index::Options),
    /// Note in the cards how rough and how heavy the maps of the training were.
    ///
    /// The server flags maps beyond that as `unfamiliar`: no indentation makes them, and what a model
    /// answers then may mean nothing. Cards of models that were not trained on the datasets given,
    /// or on others beside them, are left as they are; so are those of physics, fitted to no maps.
    #[command(after_long_help = EXIT_CODES)]
    Patterns(patterns::Options),
    /// Measure the ladder: error against time of every model and of FE itself.
    ///
    /// Every model of the index is run on all held-out sets (held-out indentations, held-out
    /// shapes, pressed hard, the published campaign, the states of the FE reference); FE rungs are
    /// held against the reference. The sets are the datasets `broad-graded`, `heldout-graded`,
    /// `pressed-graded`, `final`, `final-anew`, `final-shapes` and `s1-graded` in DATA; `friction-
    /// graded` and `sliding-graded` there say what traction is worth. Written: a page with tables
    /// and pictures, the figures as JSON, and the same as MODELS/ladder.json, by which the server
    /// chooses.
    #[command(after_long_help = EXIT_CODES)]
    Ladder(ladder::Options),
    /// Measure the shipped models on this machine, in each engine.
    ///
    /// Errors are the shipped ladder's. ONNX Runtime takes part in programs built with
    /// `--features ort`, if ORT_DYLIB_PATH names its library.
    #[command(after_long_help = EXIT_CODES)]
    Here(here::Options),
    /// Measure the contact ladder: from where an indenter is to pressure, force and SED.
    ///
    /// Springs, a half-space, the finger's compliance, and its second order, from gaps or from the
    /// object, each against the held-out FE states of the datasets, with the processor time of a frame.
    #[command(after_long_help = EXIT_CODES)]
    Contact(contact::Options),
    /// Measure friction: from an indenter's way to force, traction along the skin and SED.
    ///
    /// Contact at vertices, on coarse pixels and on pixels, each along the ways of simulations with friction,
    /// in steps of .05 mm at most, against all FE states of the datasets, which have to be solved with
    /// friction.
    #[command(after_long_help = EXIT_CODES)]
    Friction(friction::Options),
    /// Write the pressure that contact on pixels makes of a dataset's indentations.
    ///
    /// A network that learns them beside FE's pressure (`papilla_trainer train --contact`) answers
    /// with the same SED where contact's pressure is a little off.
    #[command(name = "contact-maps", after_long_help = EXIT_CODES)]
    ContactMaps(contact_maps::Options),
    /// Write what a network answers to pressures that no simulation has solved.
    ///
    /// Indentations are drawn as a campaign draws them, with other seeds. Contact on pixels finds
    /// their pressure, the network answers with SED. Another network learns these pairs beside
    /// simulated ones (`papilla_trainer train --pseudo-labels`).
    #[command(name = "pseudo-labels", after_long_help = EXIT_CODES)]
    PseudoLabels(pseudo_labels::Options),
    /// Load one model and say what that took, as JSON; the ladder runs it in a fresh process.
    #[command(hide = true)]
    Footprint {
        /// The model, an `.onnx` file.
        model: PathBuf,
    },
}

/// Does what the command line asks for.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let json = arguments.json;
    match &arguments.command {
        Command::Check(options) => check::run(options, json),
        Command::Evaluate(options) => evaluate::run(options, json),
        Command::Calibrate(options) => calibrate::run(options, json),
        Command::Table { cards } => print_table(cards, json),
        Command::Index(options) => index::run(options, json),
        Command::Patterns(options) => patterns::run(options, json),
        Command::Ladder(options) => ladder::run(options, json),
        Command::Here(options) => here::run(options, json),
        Command::Contact(options) => contact::run(options, json),
        Command::Friction(options) => friction::run(options, json),
        Command::ContactMaps(options) => contact_maps::run(options, json),
        Command::PseudoLabels(options) => pseudo_labels::run(options, json),
        Command::Footprint { model } => ladder::weigh(model),
    }
}

fn print_table(paths: &[PathBuf], json: bool) -> anyhow::Result<()> {
    let passed_over = |path: &&PathBuf| {
        let others = [
            "atlas.json",
            "contact.json",
            "errors.json",
            "index.json",
            "ladder.json",
            "replay.json",
        ];
        !path.file_name().is_some_and(|name| others.iter().any(|other| name == *other))
    };
    let cards = paths
        .iter()
        .filter(passed_over)
        .map(|path| load_card(path))
        .collect::<Result<Vec<_>, _>>()?;
    if json {
        return print_json(&cards);
    }
    print!("{}", table::markdown(&cards));
    Ok(())
}

/// Reads a card.
fn load_card(path: &Path) -> Result<Card, ExportError> {
    let refused = |source| ExportError::Engine { path: path.to_owned(), source };
    Card::from_json(&read_text(path)?).map_err(refused)
}

/// Loads a model, checked against its card if there is one.
fn load_model(
    path: &Path,
    backend: Backend,
    card: Option<&Card>,
) -> Result<Arc<dyn Model>, ExportError> {
    let refused = |source| ExportError::Engine { path: path.to_owned(), source };
    papilla_engine::load_with(backend, &read(path)?, card).map_err(refused)
}

fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    /// Files have flags of their own, so that nobody has to look up which it is.
    fn out_is_a_folder(command: &clap::Command) -> usize {
        let mut found = 0;
        for argument in command.get_arguments().filter(|a| a.get_long() == Some("out")) {
            let (name, help) = (command.get_name(), argument.get_help().unwrap().to_string());
            assert!(help.contains("older"), "{name} --out: {help}");
            found += 1;
        }
        found + command.get_subcommands().map(out_is_a_folder).sum::<usize>()
    }

    #[test]
    fn out_is_a_folder_everywhere() {
        assert!(out_is_a_folder(&Arguments::command()) >= 2);
    }
}
