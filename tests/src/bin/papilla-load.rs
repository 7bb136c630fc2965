//! Load generator of the Papilla service; see `--help`.

use std::{
    fmt::Display,
    io::{self, Write},
    process::ExitCode,
};

use clap::Parser;
use papilla_tests::load::{self, Options};
use serde::Serialize;

/// Threads for what else may wait.
const MORE_THREADS: usize = 64;

fn main() -> ExitCode {
    let options = Options::parse();
    match run(&options) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            eprintln!("papilla-load: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> anyhow::Result<u8> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        // A session hears on one of them for as long as it lasts.
        .max_blocking_threads(MORE_THREADS + options.sessions.get())
        .build()?;
    if options.floor {
        let floor = runtime.block_on(load::floor(options.duration_s))?;
        return print(options, &floor, 0);
    }
    match &options.against {
        Some(against) => {
            let comparison = runtime.block_on(load::compare(options, against))?;
            print(options, &comparison, comparison.exit_code())
        }
        None => {
            let report = runtime.block_on(load::run(options))?;
            print(options, &report, report.exit_code())
        }
    }
}

fn print(options: &Options, result: &(impl Serialize + Display), code: u8) -> anyhow::Result<u8> {
    let mut out = io::stdout().lock();
    if options.json {
        serde_json::to_writer_pretty(&mut out, result)?;
        writeln!(out)?;
    } else {
        write!(out, "{result}")?;
    }
    out.flush()?;
    Ok(code)
}
