//! Writes what `proto/conformance.json` expects anew, from the engine and the documentation's
//! formulas. Inputs, and which numbers are asked for, are written by hand and stay.
//!
//! `cargo run --release -p papilla-tests --bin conformance-record [FILE [MODELS]]`

use std::{env, fs, path::PathBuf};

use anyhow::Context;
use papilla_tests::conformance::{Recorder, print};

fn main() -> anyhow::Result<()> {
    let mut arguments = env::args_os().skip(1).map(PathBuf::from);
    let path = arguments.next().unwrap_or_else(|| "proto/conformance.json".into());
    let models = arguments.next().unwrap_or_else(|| "models".into());
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let mut file = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    Recorder::new(&models)?.fill(&mut file)?;
    fs::write(&path, print(&file)).with_context(|| path.display().to_string())?;
    println!("{} is up to date", path.display());
    Ok(())
}
