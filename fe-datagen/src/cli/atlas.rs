//! `atlas`: flatten the fingertip's patches and say how well it went.

use super::print;
use anyhow::Context as _;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::simulation::body::Body;
use papilla_output::atomic;
use std::path::PathBuf;
use std::process::ExitCode;

/// Flatten the fingertip's skin and interface into an atlas and report angle
/// and area errors beside those of conformal maps.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen atlas --out out/atlas")]
pub(super) struct Args {
    /// Mesh density whose surface is flattened: coarse, medium or fine.
    #[arg(long, default_value = "medium", value_parser = density)]
    density: Density,
    /// A finger of your own: its folder, or its name in `fingers/`.
    #[arg(long, value_name = "FINGER")]
    finger: Option<PathBuf>,
    /// Folder for atlas.json.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

fn density(name: &str) -> Result<Density, String> {
    match name {
        "coarse" => Ok(Density::Coarse),
        "medium" => Ok(Density::Medium),
        "fine" => Ok(Density::Fine),
        _ => Err("has to be coarse, medium or fine".into()),
    }
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let finger = super::chosen_finger::named(args.finger.as_deref())?;
    let body = Body::even(&finger.shape, &finger.tissue, args.density)?;
    let (atlas, report) = body.atlas().context("a fingertip has an atlas patch")??;
    if let Some(folder) = &args.out {
        atomic::create_folder(folder)?;
        atomic::write(&folder.join("atlas.json"), atlas.to_json()?.as_bytes())?;
    }
    print(&report, args.json, || human(&report))?;
    Ok(ExitCode::SUCCESS)
}

fn human(r: &papilla_atlas::flatten::AtlasReport) -> String {
    let mut text = format!(
        "atlas {}\n{} vertices, {} triangles, {:.4} mm per pixel\n",
        r.hash, r.vertices, r.triangles, r.mm_per_px
    );
    text +=
        "patch      method                     angle error rad: mean    RMS      max   flipped\n";
    for (name, patch) in [("skin", &r.skin), ("interface", &r.interface)] {
        for m in &patch.methods {
            let a = &m.distortion.angle_error_rad;
            text += &format!(
                "{name:10} {:30} {:13.5} {:8.5} {:8.5} {:8}\n",
                format!("{:?}", m.method),
                a.mean,
                a.rms,
                a.max,
                m.distortion.flipped
            );
        }
    }
    text
}
