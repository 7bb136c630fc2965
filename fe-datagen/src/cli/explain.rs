//! `explain`: what a scene is going to simulate and cost, before it runs.

use super::print;
use papilla_campaign::CampaignCost;
use papilla_fingertip::campaign::CampaignSpec;
use papilla_fingertip::run::Explanation;
use papilla_fingertip::scene::Scene;
use std::path::{Path, PathBuf};
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
    if is_campaign(&args.scene) {
        let cost = CampaignCost::of(&CampaignSpec::read(&args.scene)?)?;
        print(&cost, args.json, || cost.human())?;
        return Ok(ExitCode::SUCCESS);
    }
    let explanation = Explanation::of(&Scene::read(&args.scene)?)?;
    print(&explanation, args.json, || explanation.human())?;
    Ok(ExitCode::SUCCESS)
}

/// Whether a file is a campaign's rather than a scene's.
fn is_campaign(file: &Path) -> bool {
    let table = papilla_json::read_text(file).ok().and_then(|t| t.parse::<toml::Table>().ok());
    table.is_some_and(|table| table.contains_key("presses"))
}
