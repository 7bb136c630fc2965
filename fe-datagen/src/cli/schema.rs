//! `schema`: JSON schemas of the files that this program reads.

use papilla_fingertip::scene::schema;
use std::process::ExitCode;

/// Print the JSON schema of a file that this program reads, for editors and other
/// programs. docs/scene.schema.json is its output.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen schema scene > docs/scene.schema.json")]
pub(super) struct Args {
    /// Kind of file.
    #[arg(value_enum)]
    kind: Kind,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    /// A scene in TOML.
    Scene,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let Kind::Scene = args.kind;
    println!("{}", serde_json::to_string_pretty(&schema())?);
    Ok(ExitCode::SUCCESS)
}
