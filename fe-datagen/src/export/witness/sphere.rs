//! Two layers under a rigid sphere: contact, and SED where the layers meet.

use super::ours::{laws, sed_mpa};
use super::{Check, Context, SOURCE};
use crate::element::ElementKind;
use crate::export::Quantity;
use crate::export::deck::{BODY, ELEMENTS, INDENTER};
use crate::export::{
    CpuClock, Deck, ElementTypes, LinearHex, MaterialCard, Press, RigidIndenter, RigidShape,
    StepControl,
};
use crate::indenter::{Placement, Sphere};
use crate::mesh::block::{BlockLattice, build, even};
use crate::mesh::surface::norm;
use crate::mesh::{FaceKind, Mesh, Surface, Tissue};
use crate::solve::{Loading, MovingIndenter, Options, Problem, Solver};
use crate::verify::CaseError;
use crate::verify::bodies::{hold, tetrahedra};
use std::sync::Arc;

/// Side of the quarter block, mm.
const SIDE_MM: f64 = 6.0;
/// Thickness of the upper layer (dermis) and of the lower (fat), mm.
const LAYERS_MM: [f64; 2] = [1.0, 2.0];
const RADIUS_MM: f64 = 4.0;
const DEPTH_MM: f64 = 0.5;

/// A block, both codes' answers on it.
struct Answer {
    /// Force along z on the quarter, N.
    force_n: f64,
    displacement_mm: Vec<[f64; 3]>,
    /// By element of the mesh and printed point, MPa.
    sed_mpa: Vec<Vec<f64>>,
    cpu_s: Option<f64>,
}

/// Element of ours, of theirs, and what may differ: force, displacement, SED.
struct Pair {
    kind: ElementKind,
    linear: LinearHex,
    name: &'static str,
    job: &'static str,
    tolerance: [f64; 3],
}

pub(super) fn run(context: &Context<'_>) -> Result<Vec<Check>, CaseError> {
    let pairs = [
        Pair {
            kind: ElementKind::Tet4,
            linear: LinearHex::C3d8,
            name: "Tet4 = C3D4",
            job: "sphere-tet4",
            tolerance: [1e-3, 1e-3, 2e-3],
        },
        Pair {
            kind: ElementKind::Hex27,
            linear: LinearHex::C3d8,
            name: "Hex27, C3D20R",
            job: "sphere-hex27",
            tolerance: [5e-3, 5e-3, 2e-2],
        },
        Pair {
            kind: ElementKind::Hex8,
            linear: LinearHex::C3d8i,
            name: "Hex8, C3D8I",
            job: "sphere-hex8",
            tolerance: [5e-3, 5e-3, 2e-2],
        },
        Pair {
            kind: ElementKind::Hex8,
            linear: LinearHex::C3d8,
            name: "Hex8, C3D8",
            job: "sphere-hex8-full",
            tolerance: [5e-3, 5e-3, 2e-2],
        },
    ];
    let mut rows = Vec::new();
    for pair in pairs {
        rows.extend(compare(context, &pair)?);
    }
    Ok(rows)
}

fn compare(context: &Context<'_>, pair: &Pair) -> Result<Vec<Check>, CaseError> {
    let per_mm = if context.quick { 1.0 } else { 2.0 };
    let (mesh, fixed) = block(pair.kind, per_mm);
    let types = ElementTypes { linear: pair.linear, ..ElementTypes::default() };
    let theirs = calculix(context, pair.job, &mesh, &fixed, types)?;
    let below = beside_interface(&mesh);
    let ours = solver(mesh, fixed, types)?;
    let quantity = |what: &str| format!("{}: {what}", pair.name);
    let [force, displacement, sed] = pair.tolerance;
    let u = relative_l2(ours.displacement_mm.as_flattened(), theirs.displacement_mm.as_flattened());
    let of = |a: &Answer| -> Vec<f64> {
        below.iter().flat_map(|&e| a.sed_mpa[e].iter().copied()).collect()
    };
    let (ours_sed, theirs_sed) = (of(&ours), of(&theirs));
    let peak = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    let mut rows = vec![
        Check::relative(quantity("force, N"), ours.force_n, theirs.force_n, force, SOURCE),
        Check::vanishes(quantity("displacement, relative L2 difference"), u, displacement, SOURCE),
        Check::relative(
            quantity("SED of the dermis at the interface, peak, MPa"),
            peak(&ours_sed),
            peak(&theirs_sed),
            sed,
            SOURCE,
        ),
        Check::vanishes(
            quantity("SED of the dermis at the interface, relative L2 difference"),
            relative_l2(&ours_sed, &theirs_sed),
            sed,
            SOURCE,
        ),
    ];
    if let (Some(a), Some(b)) = (ours.cpu_s, theirs.cpu_s) {
        rows.push(Check::relative(quantity("CPU s per press"), a, b, 1.0, SOURCE));
    }
    Ok(rows)
}

/// `|a - b| / |b|`.
fn relative_l2(a: &[f64], b: &[f64]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum();
    (square / b.iter().map(|y| y * y).sum::<f64>()).sqrt()
}

fn cards() -> [Option<MaterialCard>; Tissue::ALL.len()] {
    let card = |e: f64| MaterialCard::NeoHookean {
        mu_mpa: e / 2.96,
        bulk_mpa: e / (3.0 * (1.0 - 2.0 * 0.48)),
    };
    let mut cards = [const { None }; Tissue::ALL.len()];
    cards[Tissue::Dermis.index()] = Some(card(0.080));
    cards[Tissue::Subcutaneous.index()] = Some(card(0.034));
    cards
}

/// A quarter of the block, its upper side at z = 0, symmetric about x = 0 and
/// y = 0, held below.
fn block(kind: ElementKind, per_mm: f64) -> (Mesh, Vec<bool>) {
    let step = if kind == ElementKind::Hex27 { 2 } else { 1 };
    let count = |length: f64| ((length * per_mm).round() as usize).max(1);
    let [skin, fat] = LAYERS_MM;
    let [n_skin, n_fat] = [2 * count(skin), count(fat)];
    let z: Vec<f64> = even(fat, n_fat * step)
        .into_iter()
        .map(|z| z - fat - skin)
        .chain(even(skin, n_skin * step).into_iter().skip(1).map(|z| z - skin))
        .collect();
    let mut layers = vec![Tissue::Subcutaneous; n_fat];
    layers.extend(vec![Tissue::Dermis; n_skin]);
    let side = even(SIDE_MM, count(SIDE_MM) * step);
    let hexes = if step == 2 { ElementKind::Hex27 } else { ElementKind::Hex8 };
    let mut mesh = build(&BlockLattice { axes: [side.clone(), side, z], layers, kind: hexes }, |p| p);
    if kind == ElementKind::Tet4 {
        mesh = tetrahedra(mesh, kind);
        let top = triangles(&mesh, "z_max");
        mesh.surfaces.insert("z_max".into(), top);
    }
    let (x, y) = ([true, false, false], [false, true, false]);
    let fixed = hold(&mesh, &[("x_min", x), ("y_min", y), ("z_min", [true; 3])]);
    (mesh, fixed)
}

/// Faces of tetrahedra of which all corners lie in a node set.
fn triangles(mesh: &Mesh, set: &str) -> Surface {
    let set = &mesh.node_sets[set];
    let mut connectivity = Vec::new();
    for block in &mesh.blocks {
        for e in 0..block.len() {
            let n = block.element(e);
            for face in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]] {
                let corners = face.map(|c: usize| n[c]);
                if corners.iter().all(|c| set.binary_search(c).is_ok()) {
                    connectivity.extend(corners);
                }
            }
        }
    }
    Surface { kind: FaceKind::Tri3, connectivity }
}

/// Elements of the upper layer with a corner on the interface.
fn beside_interface(mesh: &Mesh) -> Vec<usize> {
    let on_interface = |&n: &u32| (mesh.nodes[n as usize][2] + LAYERS_MM[0]).abs() < 1e-9;
    let mut found = Vec::new();
    let mut number = 0;
    for block in &mesh.blocks {
        for e in 0..block.len() {
            if block.tissue[e] == Tissue::Dermis && block.element(e).iter().any(on_interface) {
                found.push(number + e);
            }
        }
        number += block.len();
    }
    found
}

const AT_REST: Placement = Placement {
    rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    origin_mm: [0.0, 0.0, RADIUS_MM],
};
const TRAVEL_MM: [f64; 3] = [0.0, 0.0, -DEPTH_MM];

fn calculix(
    context: &Context<'_>,
    job: &str,
    mesh: &Mesh,
    fixed: &[bool],
    types: ElementTypes,
) -> Result<Answer, CaseError> {
    let materials = cards();
    let shape = RigidShape::Sphere { radius_mm: RADIUS_MM };
    let indenter = RigidIndenter { shape, start: AT_REST, travel_mm: TRAVEL_MM };
    let deck = Deck {
        title: job,
        mesh,
        materials: &materials,
        fixed,
        prescribed_mm: &[],
        press: Some(Press { contact: "z_max", indenter, stiffness_mpa_per_mm: None }),
        types,
        step: StepControl::default(),
    };
    let run = context.ccx.run(context.folder, job, &deck.to_text()?)?;
    let total = &run.dat.table(Quantity::TotalForce, INDENTER, 1.0)?.rows;
    let mut displacement_mm = vec![[0.0; 3]; mesh.nodes.len()];
    for row in &run.dat.table(Quantity::Displacement, BODY, 1.0)?.rows {
        displacement_mm[row.id - 1].copy_from_slice(&row.values[..3]);
    }
    let tissue: Vec<Tissue> = mesh.blocks.iter().flat_map(|b| b.tissue.iter().copied()).collect();
    let mut sed_mpa = vec![Vec::new(); tissue.len()];
    for row in &run.dat.table(Quantity::Strain, ELEMENTS, 1.0)?.rows {
        if let Some(card) = &materials[tissue[row.id - 1].index()] {
            sed_mpa[row.id - 1].push(card.energy_mpa(&row.values));
        }
    }
    let force_n = total.first().map_or(f64::NAN, |r| r.values[2].abs());
    Ok(Answer { force_n, displacement_mm, sed_mpa, cpu_s: run.cpu_s })
}

fn solver(mesh: Mesh, fixed: Vec<bool>, types: ElementTypes) -> Result<Answer, CaseError> {
    let clock = CpuClock::thread();
    let used = ElementTypes { ..types };
    let laws = laws(&cards()).ok_or("our solver has no such law")?;
    let problem = Problem::new(mesh, laws, fixed, Some("z_max"))?;
    let indenter = MovingIndenter {
        shape: Arc::new(Sphere { radius_mm: RADIUS_MM }),
        start: AT_REST,
        travel_mm: TRAVEL_MM,
    };
    let mut solver = Solver::new(&problem, Options::default())?;
    solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
    solver.advance_to(1.0)?;
    let u = solver.displacement_mm();
    let sed_mpa = sed_mpa(&problem, used, u)?;
    let cpu_s = clock.and_then(CpuClock::elapsed_s);
    let force_n = norm(solver.balance().contact_force_n);
    // Nodes that CalculiX lacks are left out of the comparison.
    let mut displacement_mm = vec![[0.0; 3]; u.len()];
    for block in &problem.mesh.blocks {
        for e in 0..block.len() {
            for &n in &block.element(e)[..used.of(block.kind).nodes] {
                displacement_mm[n as usize] = u[n as usize];
            }
        }
    }
    Ok(Answer { force_n, displacement_mm, sed_mpa, cpu_s })
}
