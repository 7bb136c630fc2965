//! The command line: one file a command.

mod atlas;
mod campaign_file;
pub mod choices;
mod chosen_finger;
mod contact;
mod convergence;
mod dataset;
mod explain;
mod export;
mod finger;
mod generate;
mod influence;
mod lines;
mod schema;
mod signals;
mod slice;
mod solve;
mod stability;
mod verify;

use clap::{Parser, Subcommand};
use std::io::{IsTerminal as _, Write as _};
use std::process::ExitCode;
use tracing_subscriber::Layer as _;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

/// A finite-element fingertip: solve scenes, run campaigns, check the physics.
#[derive(Parser)]
#[command(
    name = "fe-datagen",
    version,
    about,
    after_help = "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but something did not pass its own checks;\n\
                  75 asked to leave, to be started again.\n\
                  RUST_LOG=papilla=debug tells the story of a solve."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Solve(solve::Args),
    Explain(explain::Args),
    Schema(schema::Args),
    Generate(generate::Args),
    Operator(influence::Args),
    Contact(contact::Args),
    Finger(finger::Args),
    Dataset(dataset::Args),
    Atlas(atlas::Args),
    Convergence(convergence::Args),
    Verify(verify::Args),
    Stability(stability::Args),
    Export(export::Args),
}

/// Runs the command line; the exit code is documented in `--help`.
#[must_use]
pub fn run() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Solve(args) => solve::run(&args),
        Command::Explain(args) => explain::run(&args),
        Command::Schema(args) => schema::run(&args),
        Command::Dataset(args) => dataset::run(&args),
        Command::Atlas(args) => atlas::run(&args),
        Command::Convergence(args) => convergence::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Stability(args) => stability::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Generate(args) => generate::run(&args),
        Command::Operator(args) => influence::run(&args),
        Command::Contact(args) => contact::run(&args),
        Command::Finger(args) => finger::run(&args),
    };
    finished(result)
}

/// What a program over these libraries begins with: the log that `RUST_LOG` asks for, on standard
/// error.
///
/// # Errors
/// The exit code if that is no filter, which has been said.
pub fn start_log() -> Result<(), ExitCode> {
    let filter = match std::env::var("RUST_LOG") {
        Ok(text) => text.parse().map_err(|error| {
            eprintln!("error: RUST_LOG is '{text}', which is not a filter: {error}");
            ExitCode::from(2)
        })?,
        Err(_) => Targets::new().with_default(LevelFilter::ERROR),
    };
    let log = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_filter(filter);
    tracing_subscriber::registry().with(log).init();
    Ok(())
}

/// And ends with: says what went wrong.
#[must_use]
pub fn finished(result: anyhow::Result<ExitCode>) -> ExitCode {
    result.unwrap_or_else(|error| {
        eprintln!("error: {}", papilla_output::told(error.as_ref()));
        ExitCode::FAILURE
    })
}

/// Exit code of a run that finished but did not pass its own checks.
pub const CHECKS_FAILED: u8 = 3;

/// Says what is wrong with the command line and gives its exit code.
fn wrong_usage(error: &dyn std::error::Error) -> ExitCode {
    eprintln!("error: {error}");
    ExitCode::from(2)
}

/// Prints a report as JSON or as people read it.
///
/// # Errors
/// It cannot be written.
pub fn print<T: serde::Serialize>(
    report: &T,
    json: bool,
    human: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    let text = if json { serde_json::to_string_pretty(report)? } else { human() };
    // A reader that has seen enough (`| head`) is no error.
    match writeln!(std::io::stdout(), "{}", text.trim_end()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(e.into()),
        _ => Ok(()),
    }
}

/// Refuses `--only` with a name that no case has.
///
/// # Errors
/// Names the unknown one and all that there are.
pub fn refuse_unknown(only: &[String], known: &[&str]) -> anyhow::Result<()> {
    match only.iter().find(|n| !known.contains(&n.as_str())) {
        Some(unknown) => {
            anyhow::bail!("there is no '{unknown}'; there are: {}", known.join(", "))
        }
        None => Ok(()),
    }
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
        assert!(out_is_a_folder(&Cli::command()) >= 7);
    }
}
