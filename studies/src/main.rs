//! `papilla-studies`: one subcommand a study.

mod cli;

use papilla_fe_datagen::cli::start_log;
use std::process::ExitCode;

fn main() -> ExitCode {
    match start_log() {
        Ok(()) => cli::run(),
        Err(code) => code,
    }
}
