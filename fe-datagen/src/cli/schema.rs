//! `schema`: JSON schemas of the files of this program.

use papilla_dataset as dataset;
use papilla_fingertip::scene;
use std::process::ExitCode;

/// Print the JSON schema of files of this program, for editors and other
/// programs. docs/reference/scene.schema.json and docs/reference/dataset.schema.json are its output.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen schema scene > docs/reference/scene.schema.json")]
pub(super) struct Args {
    /// Kind of file.
    #[arg(value_enum)]
    kind: Kind,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    /// A scene in TOML.
    Scene,
    /// The files of a dataset: manifest and arrays.
    Dataset,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let schema = match args.kind {
        Kind::Scene => serde_json::to_string_pretty(&scene::schema())?,
        Kind::Dataset => serde_json::to_string_pretty(&dataset::schema())?,
    };
    println!("{schema}");
    Ok(ExitCode::SUCCESS)
}
