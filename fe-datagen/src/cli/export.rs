//! `export`: writes a scene as an input deck of CalculiX.

use super::choices::{LinearHex, QuadraticHex};
use anyhow::Context as _;
use papilla_calculix::{ElementTypes, SceneDeck};
use papilla_fingertip::scene::Scene;
use papilla_output::atomic;
use std::path::PathBuf;
use std::process::ExitCode;

/// Write a scene as an input deck of CalculiX 2.20.
///
/// Mesh, materials, supports, rigid indenter, contact and one static step that
/// prints displacement, reactions, strain, stress and contact at the stored
/// states. What CalculiX cannot express is an error.
#[derive(clap::Args)]
#[command(after_help = "Run it with `ccx -i DIR/SCENE`.\n\
                  Example: fe-datagen export scenes/layered-block.toml --format inp --out out/deck")]
pub(super) struct Args {
    /// Scene file (see scenes/ and docs/reference/scenes.md).
    scene: PathBuf,
    /// Format of the deck.
    #[arg(long, value_enum)]
    format: Format,
    /// Folder for the deck, which has the scene's name.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Type that stands for Hex8.
    #[arg(long, value_enum, default_value_t = LinearHex::C3d8)]
    linear: LinearHex,
    /// Type that stands for Hex20, Hex27, Quad8 and Quad9.
    #[arg(long, value_enum, default_value_t = QuadraticHex::C3d20r)]
    quadratic: QuadraticHex,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Format {
    /// Abaqus keywords as CalculiX reads them.
    Inp,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let Format::Inp = args.format;
    let exported = SceneDeck::new(&Scene::read(&args.scene)?)?;
    let types = ElementTypes { linear: args.linear.into(), quadratic: args.quadratic.into() };
    let title = args.scene.display().to_string();
    let deck = exported.deck(&title, types);
    let stem = args.scene.file_stem().context("a scene file has a name")?;
    let path = args.out.join(stem).with_added_extension("inp");
    atomic::create_folder(&args.out)?;
    atomic::write(&path, deck.to_text()?.as_bytes())?;
    println!(
        "{} nodes, {} elements: {}",
        deck.nodes().len(),
        deck.mesh.element_count(),
        path.display()
    );
    Ok(ExitCode::SUCCESS)
}
