//! `fe-datagen` command line.

use papilla_fe_datagen::cli;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::start_log() {
        Ok(()) => cli::run(),
        Err(code) => code,
    }
}
