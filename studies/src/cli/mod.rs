//! The command line: one file a study, and what two of them share.

mod actuators;
mod calculix;
mod effects;
mod fit;
mod human;
mod operators;
mod people;
mod spikes;
mod wedge;

use clap::{Parser, Subcommand};
use papilla_fe_datagen::cli::finished;
use std::process::ExitCode;

/// Questions that were asked once: each subcommand is a study, its report is
/// studies/reports/NAME.md.
#[derive(Parser)]
#[command(
    name = "papilla-studies",
    version,
    about,
    after_help = "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but something is past its tolerance.\n\
                  RUST_LOG=papilla=debug tells the story of a solve."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Human(human::Args),
    Fit(fit::Args),
    Wedge(wedge::Args),
    Calculix(calculix::Args),
    Effects(effects::Args),
    Spikes(spikes::Args),
    Actuators(actuators::Args),
    Operators(operators::Args),
}

/// Runs the command line; the exit code is documented in `--help`.
pub(crate) fn run() -> ExitCode {
    finished(match Cli::parse().command {
        Command::Human(args) => human::run(&args),
        Command::Fit(args) => fit::run(&args),
        Command::Wedge(args) => wedge::run(&args),
        Command::Calculix(args) => calculix::run(&args),
        Command::Effects(args) => effects::run(&args),
        Command::Spikes(args) => spikes::run(&args),
        Command::Actuators(args) => actuators::run(&args),
        Command::Operators(args) => operators::run(&args),
    })
}
