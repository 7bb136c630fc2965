//! Two layers under a rigid sphere: contact, and SED where the layers meet.

use super::indentation::{CPU_SHARE, Pressing, Tolerance};
use super::ours::Cards;
use super::{Check, Context};
use papilla_calculix::{
    ElementTypes, LinearHex, MaterialCard, RigidIndenter, RigidShape, StepControl,
};
use papilla_fem::contact::ContactRule;
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::{BlockLattice, build, even};
use papilla_fem::mesh::lattice::tetrahedra;
use papilla_fem::mesh::supports::hold;
use papilla_fem::mesh::{FaceKind, Mesh, Surface};
use papilla_fingertip::tissue::Tissue;
use papilla_sdf::{Placement, Sphere};
use papilla_validation::verify::CaseError;
use std::sync::Arc;

/// Side of the quarter block, mm.
const SIDE_MM: f64 = 6.0;
/// Thickness of the upper layer (dermis) and of the lower (fat), mm.
const LAYERS_MM: [f64; 2] = [1.0, 2.0];
const RADIUS_MM: f64 = 4.0;
const DEPTH_MM: f64 = 0.5;

/// Element of ours and of theirs, Poisson's ratio, and on small and on full meshes
/// the elements a mm (`None`: not run) and the tolerance.
struct Pair {
    kind: ElementKind,
    linear: LinearHex,
    nu: f64,
    per_mm: [Option<f64>; 2],
    name: &'static str,
    job: &'static str,
    tolerance: [Tolerance; 2],
}

/// Equal elements.
const EQUAL: Tolerance = Tolerance { force: 1e-3, displacement: 1e-3, sed: 2e-3, limit: None };
/// Elements that differ but do not lock.
const EXPECTED: Tolerance = Tolerance { force: 5e-3, displacement: 5e-3, sed: 2e-2, limit: None };
/// Linear elements that treat volume and bending differently.
const UNLIKE: Tolerance = Tolerance { force: 1e-2, displacement: 1e-2, sed: 6e-2, limit: None };
/// One of the two locks: the rows show how much.
const LOCKED: Tolerance = Tolerance { force: 6e-2, displacement: 5e-2, sed: 1e-1, limit: None };
/// Meshes too small for any of these.
const SMALL: Tolerance = Tolerance { force: 3e-2, displacement: 4e-2, sed: 8e-2, limit: None };

pub(super) fn run(context: &Context<'_>) -> Result<Vec<Check>, CaseError> {
    let pairs = [
        Pair {
            kind: ElementKind::Tet4,
            linear: LinearHex::C3d8,
            nu: 0.48,
            per_mm: [Some(1.0), Some(3.0)],
            name: "Tet4 = C3D4",
            job: "sphere-tet4",
            tolerance: [EQUAL; 2],
        },
        Pair {
            kind: ElementKind::Hex27,
            linear: LinearHex::C3d8,
            nu: 0.48,
            per_mm: [Some(1.0), Some(2.0)],
            name: "Hex27, C3D20R",
            job: "sphere-hex27",
            tolerance: [SMALL, EXPECTED],
        },
        Pair {
            kind: ElementKind::Hex8,
            linear: LinearHex::C3d8,
            nu: 0.3,
            per_mm: [Some(2.0), Some(3.0)],
            name: "Hex8, C3D8, nu 0.3",
            job: "sphere-hex8-soft",
            tolerance: [SMALL, UNLIKE],
        },
        Pair {
            kind: ElementKind::Hex8,
            linear: LinearHex::C3d8,
            nu: 0.48,
            per_mm: [None, Some(3.0)],
            name: "Hex8, C3D8",
            job: "sphere-hex8",
            tolerance: [SMALL, LOCKED],
        },
        Pair {
            kind: ElementKind::Hex8,
            linear: LinearHex::C3d8i,
            nu: 0.48,
            per_mm: [None, Some(3.0)],
            name: "Hex8, C3D8I",
            job: "sphere-hex8-modes",
            tolerance: [SMALL, UNLIKE],
        },
    ];
    let mut rows = Vec::new();
    for pair in pairs {
        let size = usize::from(!context.quick);
        if let Some(per_mm) = pair.per_mm[size] {
            rows.extend(pressing(&pair, per_mm, pair.tolerance[size]).rows(context));
        }
    }
    Ok(rows)
}

fn pressing<'a>(pair: &Pair, per_mm: f64, tolerance: Tolerance) -> Pressing<'a> {
    let (mesh, fixed) = block(pair.kind, per_mm);
    // Its own +z presses down.
    let start = Placement {
        rotation: [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
        origin_mm: [0.0, 0.0, RADIUS_MM],
    };
    let path = vec![(1.0, [0.0, 0.0, -DEPTH_MM])];
    Pressing {
        job: pair.job,
        name: pair.name,
        mesh,
        cards: cards(pair.nu),
        fixed,
        contact: "z_max",
        indenter: RigidIndenter { shape: RigidShape::Sphere { radius_mm: RADIUS_MM }, start, path },
        shape: Arc::new(Sphere { radius_mm: RADIUS_MM }),
        rule: ContactRule::Nodal,
        types: ElementTypes { linear: pair.linear, ..ElementTypes::default() },
        interface: [Tissue::Dermis, Tissue::Subcutaneous],
        steps: 1,
        first: StepControl::default().first,
        tolerance,
        cpu_share: CPU_SHARE,
    }
}

fn cards(nu: f64) -> Cards {
    let card = |e: f64| MaterialCard::NeoHookean {
        mu_mpa: e / (2.0 * (1.0 + nu)),
        bulk_mpa: e / (3.0 * (1.0 - 2.0 * nu)),
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
    let mut layers = vec![Tissue::Subcutaneous.region(); n_fat];
    layers.extend(vec![Tissue::Dermis.region(); n_skin]);
    let side = even(SIDE_MM, count(SIDE_MM) * step);
    let hexes = if step == 2 { ElementKind::Hex27 } else { ElementKind::Hex8 };
    let lattice = BlockLattice { axes: [side.clone(), side, z], layers, kind: hexes };
    let mut mesh = build(&lattice, |p| p);
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
            for side in block.kind.sides() {
                let corners = side.iter().map(|&c| n[c]);
                if corners.clone().all(|c| set.binary_search(&c).is_ok()) {
                    connectivity.extend(corners);
                }
            }
        }
    }
    Surface { kind: FaceKind::Tri3, connectivity }
}
