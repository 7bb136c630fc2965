//! `operator`: computes the influence operator of the finger, strain as a linear map of pressure.

use super::choices::Density;
use super::print;
use crate::influence_file::{self, Card};
use papilla_fingertip::influence;
use papilla_fingertip::mesh::fingertip::Order;
use papilla_processor::thread_s;
use papilla_progress::Progress;
use std::path::PathBuf;
use std::process::ExitCode;

/// Solve this finger at small strain for unit pressure at every skin vertex.
///
/// To first order a finger is linear: strain at the interface is a linear map of
/// pressure on the skin, and SED is a sum of six squares of strain. This writes the map
/// (operator.npz: face_g [F, 6, V] on the faces of the interface, vertex_face and
/// vertex_weight [V, M], which average them to the vertices, g [V, 6, V] and
/// area_mm2 [V]) and a card (operator.json: atlas hash,
/// materials, checks, seconds). One factorization, V right-hand sides; layers on, rigid
/// bone and nail. See docs/reference/operator.md.
#[derive(clap::Args)]
#[command(
    after_help = "SED of face f, J/m3: sum_k (sum_j face_g[f, k, j] p_j)^2 with p in Pa; a vertex has its faces' mean.\n\
                        Takes some 12 s and 0.6 GiB at density medium, a second at coarse.\n\
                        Example: fe-datagen operator --density coarse --out out/operator"
)]
pub(super) struct Args {
    /// Mesh density; its skin gives the vertices (a dataset's atlas is of medium).
    #[arg(long, value_enum, default_value = "medium")]
    density: Density,
    /// A finger of your own: its folder, or its name in `fingers/`.
    #[arg(long, value_name = "FINGER")]
    finger: Option<PathBuf>,
    /// Folder for operator.npz and operator.json.
    #[arg(long)]
    out: PathBuf,
    /// Print the card as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    // Before minutes of work: can it be written?
    papilla_output::atomic::create_folder(&args.out)?;
    let begun_s = thread_s();
    let finger = super::chosen_finger::named(args.finger.as_deref())?;
    let (order, materials) = (Order::Linear, finger.tissue);
    let density = args.density.into();
    let body = influence::body(&finger.shape, density, order, &materials)?;
    let vertices = body.patch.as_ref().map_or(0, |p| p.patch.skin.len());
    let progress = Progress::new("vertices", vertices, 0, args.json);
    let operator = influence::build(&body, &mut |done| progress.set_position(done))?;
    drop(progress);
    let seconds = thread_s() - begun_s;
    let card = Card::new(&operator, density, order, &materials, seconds);
    influence_file::write(&args.out, &operator, &card)?;
    print(&card, args.json, || {
        let q = &card.quality;
        format!(
            "influence operator of {} vertices ({} unknowns) in {seconds:.1} s of processor time: \
             residual at most {:.1e}, \
             reciprocity to {:.1e}\natlas {}\nwrote {}",
            card.vertices,
            q.unknowns,
            q.residual_relative,
            q.reciprocity_relative,
            card.atlas_hash,
            args.out.display()
        )
    })?;
    Ok(ExitCode::SUCCESS)
}
