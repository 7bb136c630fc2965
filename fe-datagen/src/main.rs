//! `fe-datagen` command line.

use std::io::IsTerminal as _;
use std::process::ExitCode;
use tracing_subscriber::Layer as _;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

fn main() -> ExitCode {
    let filter = match std::env::var("RUST_LOG") {
        Ok(text) => match text.parse() {
            Ok(filter) => filter,
            Err(error) => {
                eprintln!("error: RUST_LOG is '{text}', which is not a filter: {error}");
                return ExitCode::from(2);
            }
        },
        Err(_) => Targets::new().with_default(LevelFilter::ERROR),
    };
    let log = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_filter(filter);
    tracing_subscriber::registry().with(log).init();
    papilla_fe_datagen::cli::run()
}
