//! `explain`: what a scene is going to simulate and cost, before it runs.

use super::{explain_campaign, print};
use papilla_fingertip::run::Explanation;
use papilla_fingertip::scene::Scene;
use std::path::PathBuf;
use std::process::ExitCode;

/// Say what a scene is going to simulate, what it leaves out and why, and what it
/// will cost: unknowns, memory, seconds. Nothing is solved and nothing written.
///
/// Of a campaign: what its indentations cost, by indenter.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen explain scenes/flat-press.toml")]
pub(super) struct Args {
    /// Scene file (see scenes/ and docs/reference/scenes.md), or campaign file.
    scene: PathBuf,
    /// Print as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if explain_campaign::is_campaign(&args.scene) {
        explain_campaign::run(&args.scene, args.json)?;
        return Ok(ExitCode::SUCCESS);
    }
    let explanation = Explanation::of(&Scene::read(&args.scene)?)?;
    print(&explanation, args.json, || explanation.human())?;
    Ok(ExitCode::SUCCESS)
}
