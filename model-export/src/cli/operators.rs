//! `model-export operators`.

use papilla_model_export::operators::{Profile, markdown, rates::Rates};
use papilla_model_export::{ExportError, read, write};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Models, `.onnx` files.
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    /// The page.
    #[arg(long, default_value = "studies/reports/operators.md", value_name = "FILE")]
    markdown: PathBuf,
}

pub(crate) fn run(options: &Options) -> anyhow::Result<()> {
    let mut profiles = Vec::with_capacity(options.models.len());
    for path in &options.models {
        let refused = |source| ExportError::Engine { path: path.clone(), source };
        profiles.push(Profile::measure(&read(path)?).map_err(refused)?);
    }
    let page = markdown(&profiles, &Rates::measure());
    write(&options.markdown, page.as_bytes())?;
    print!("{page}");
    Ok(())
}
