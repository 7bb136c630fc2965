//! Writes what the files `proto/conformance*.json` expect anew, from the
//! engine, the contact solver and the documentation's formulas. Inputs, and which numbers are asked
//! for, are written by hand and stay.
//!
//! ```text
//! conformance-record                                    all files, with models/
//! conformance-record --contact-model FILE               the model that contact is tested with
//! ```

use std::{env, fs, path::Path};

use anyhow::{Context, bail};
use papilla_output::atomic;
use papilla_tests::conformance::{ContactRecorder, Recorder, print};
use serde_json::Value;

const MODELS: &str = "models";

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let models = Path::new(MODELS);
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => {
            rewrite("proto/conformance.json", |file| Ok(Recorder::new(models)?.fill(file)?))?;
            for path in ["proto/conformance-moving.json", "proto/conformance-fingers.json"] {
                rewrite(path, |file| Ok(Recorder::new(models)?.fill(file)?))?;
            }
            rewrite("proto/conformance-contact.json", |file| {
                Ok(ContactRecorder::new(models)?.fill(file)?)
            })
        }
        ["--contact-model", path] => {
            // Several clients are tested at once, and each has it written anew.
            atomic::write_changed(Path::new(path), ContactRecorder::new(models)?.file())?;
            println!("wrote {path}");
            Ok(())
        }
        _ => bail!("conformance-record [--contact-model FILE]"),
    }
}

fn rewrite(path: &str, fill: impl FnOnce(&mut Value) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let text = fs::read_to_string(path).with_context(|| path.to_owned())?;
    let mut file = serde_json::from_str(&text).with_context(|| path.to_owned())?;
    fill(&mut file)?;
    atomic::write(Path::new(path), print(&file).as_bytes())?;
    println!("{path} is up to date");
    Ok(())
}
