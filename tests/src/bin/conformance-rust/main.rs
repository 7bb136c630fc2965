//! Runs the conformance script with the Rust client (docs/reference/conformance.md).

mod burst;
mod checks;
mod run;

use std::{env, fs, process::ExitCode};

use anyhow::Context;
use serde_json::Value;

#[tokio::main]
async fn main() -> anyhow::Result<ExitCode> {
    let path = env::var("PAPILLA_CONFORMANCE").context("PAPILLA_CONFORMANCE")?;
    let script: Value = serde_json::from_str(&fs::read_to_string(&path).context(path)?)?;
    let mut failed = false;
    for case in script["cases"].as_array().into_iter().flatten() {
        let name = case["name"].as_str().unwrap_or_default();
        let mut run = run::Run::new(script["timeout_s"].as_f64().unwrap_or(60.0))?;
        let mut result = Ok(());
        for (number, step) in case["steps"].as_array().into_iter().flatten().enumerate() {
            result = run.step(step).await.with_context(|| format!("step {number}"));
            if result.is_err() {
                break;
            }
        }
        match result {
            Ok(()) => println!("ok {name}{}", run.note),
            Err(error) => {
                failed = true;
                println!("FAIL {name}: {error:#}");
            }
        }
    }
    Ok(ExitCode::from(u8::from(failed)))
}
