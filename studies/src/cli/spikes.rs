//! `spikes`: touch units against TouchSim, and driven by SED.

use papilla_model_export::write;
use papilla_studies::spikes;
use std::path::PathBuf;
use std::process::ExitCode;

/// Hold touch units against TouchSim under the same pins, and drive them by SED.
#[derive(clap::Args)]
pub(super) struct Args {
    /// The page.
    #[arg(long, default_value = "studies/reports/spikes.md", value_name = "FILE")]
    markdown: PathBuf,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let page = spikes::markdown()?;
    write(&args.markdown, page.as_bytes())?;
    print!("{page}");
    Ok(ExitCode::SUCCESS)
}
