//! `export`: a scene as an input deck of another solver.

use crate::export::{
    Deck, ElementTypes, LinearHex, MaterialCard, Press, QuadraticHex, RigidIndenter, RigidShape,
    StepControl, refuse_inexpressible,
};
use crate::mesh::Tissue;
use crate::output::atomic;
use crate::press::body::Body;
use crate::scene::Scene;
use std::path::PathBuf;
use std::process::ExitCode;

/// Write a scene as an input deck of CalculiX 2.20.
///
/// Mesh, materials, supports, rigid indenter, contact and one static step that
/// prints displacement, reactions, strain, stress and contact at the stored
/// depths. An effect that CalculiX cannot express is an error.
#[derive(clap::Args)]
#[command(
    after_help = "Run it with `ccx -i FILE` without the ending.\n\
                  Example: fe-datagen export scenes/layered-block.toml --format inp --out block.inp"
)]
pub(super) struct Args {
    /// Scene file (see scenes/ and docs/scenes.md).
    scene: PathBuf,
    /// Format of the deck.
    #[arg(long, value_enum)]
    format: Format,
    /// File to write.
    #[arg(long)]
    out: PathBuf,
    /// Type that stands for Hex8.
    #[arg(long, value_enum, default_value_t)]
    linear: LinearHex,
    /// Type that stands for Hex27.
    #[arg(long, value_enum, default_value_t)]
    quadratic: QuadraticHex,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Format {
    /// Abaqus keywords as CalculiX reads them.
    Inp,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let Format::Inp = args.format;
    let scene = Scene::read(&args.scene)?;
    let names = serde_json::to_value(&scene.effects)?;
    let names = names.as_array().into_iter().flatten().filter_map(|n| n.as_str());
    refuse_inexpressible(names)?;
    let body = super::solve::body(&scene)?;
    let depth_mm = scene.motion.depth_mm;
    let problem = &body.problem;
    let deck = Deck {
        title: &format!("{}", args.scene.display()),
        mesh: &problem.mesh,
        materials: &materials(&body),
        fixed: &problem.fixed,
        prescribed_mm: &[],
        press: Some(Press {
            contact: &body.contact,
            indenter: indenter(&scene, &body),
            stiffness_mpa_per_mm: None,
        }),
        types: ElementTypes { linear: args.linear, quadratic: args.quadratic },
        step: StepControl {
            outputs: scene.depths_mm().iter().map(|d| d / depth_mm).collect(),
            ..StepControl::default()
        },
    };
    let text = deck.to_text()?;
    atomic::write(&args.out, text.as_bytes())?;
    println!(
        "{} nodes, {} elements: {}",
        deck.nodes().len(),
        problem.mesh.element_count(),
        args.out.display()
    );
    Ok(ExitCode::SUCCESS)
}

/// Cards of the body's laws.
fn materials(body: &Body) -> [Option<MaterialCard>; Tissue::ALL.len()] {
    Tissue::ALL.map(|tissue| {
        let law = body.problem.materials[tissue.index()];
        Some(MaterialCard::NeoHookean { mu_mpa: law.isochoric.mu_mpa, bulk_mpa: law.bulk_mpa })
    })
}

/// The scene's plate at first touch.
fn indenter(scene: &Scene, body: &Body) -> RigidIndenter {
    let moving = body.plate(scene.pose(), scene.plate, scene.motion.depth_mm);
    let plate = scene.plate;
    // Its distance function knows how thick the body made it.
    let far = 1e3;
    let thick = far - moving.shape.distance([0.0, 0.0, far]).gap_mm;
    RigidIndenter {
        shape: RigidShape::Plate {
            half_mm: [0.5 * plate.size_mm[0], 0.5 * plate.size_mm[1], thick],
            edge_radius_mm: plate.edge_radius_mm,
        },
        start: moving.start,
        travel_mm: moving.travel_mm,
    }
}
