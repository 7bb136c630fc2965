//! `operators`: the operators of models against their bound.

use papilla_model_export::{ExportError, read, write};
use papilla_studies::operators::{Profile, markdown, rates::Rates};
use std::path::PathBuf;
use std::process::ExitCode;

/// Hold the operators of models against what one core of this machine can do.
///
/// For each operator, as tract runs it: bytes of weights and maps, operations, its time, and the
/// least time in which this core reads the bytes and does the operations.
#[derive(clap::Args)]
#[command(after_help = "Example: papilla-studies operators models/small.onnx")]
pub(super) struct Args {
    /// Models, `.onnx` files.
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    /// The page.
    #[arg(long, default_value = "studies/reports/operators.md", value_name = "FILE")]
    markdown: PathBuf,
}

pub(super) fn run(options: &Args) -> anyhow::Result<ExitCode> {
    let mut profiles = Vec::with_capacity(options.models.len());
    for path in &options.models {
        let refused = |source| ExportError::Engine { path: path.clone(), source };
        profiles.push(Profile::measure(&read(path)?).map_err(refused)?);
    }
    let page = markdown(&profiles, &Rates::measure());
    write(&options.markdown, page.as_bytes())?;
    print!("{page}");
    Ok(ExitCode::SUCCESS)
}
