//! Even strain of a block whose cells are halved: nodes between sizes must not disturb it.

use super::ours::{Cards, laws, sed_mpa};
use super::{Check, Context};
use crate::calculix::deck::{BODY, ELEMENTS};
use crate::calculix::{Deck, ElementTypes, MaterialCard, Quantity, StepControl};
use crate::verify::CaseError;
use papilla_fem::element::ElementKind;
use papilla_fem::element::reference::HEX27_LATTICE;
use papilla_fem::mesh::lattice::REGION;
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::mesh::{Block, HangingNode, Mesh};
use papilla_fem::solve::{Loading, Options, Problem, Solver};
use papilla_fingertip::simulation::record::relative_l2;
use papilla_fingertip::tissue::Tissue;
use papilla_solid::tensor::Kinematics;
use std::collections::{BTreeMap, HashSet};

type Address = [u32; 3];

/// Cells in the plane: first corner and size, in quarters of a mm. One of 8, beside it one of 4 and
/// one of 4 that is halved along its own border with the other: three sizes meet.
const CELLS: [[u32; 4]; 4] = [[0, 0, 8, 8], [8, 0, 4, 4], [8, 4, 2, 4], [10, 4, 2, 4]];
/// Layers of elements across, and their height, quarters of a mm.
const LAYERS: [u32; 2] = [2, 4];
const SIZE: [u32; 3] = [12, 8, 8];
/// Set of the nodes whose displacement is prescribed.
const OUTSIDE: &str = "outside";
const EXACT: &str = "exact";

/// The displacement gradient: all components of strain, and rotation.
const GRADIENT: [[f64; 3]; 3] = [[0.08, 0.03, -0.02], [0.01, -0.05, 0.04], [0.02, 0.01, 0.06]];
/// The precision of CalculiX' printed values.
const TOLERANCE: f64 = 1e-5;

/// A block of parallelepipeds of three sizes.
pub(in crate::calculix) fn graded_block() -> Mesh {
    let mut number: BTreeMap<Address, u32> = BTreeMap::new();
    let mut block = Block { kind: ElementKind::Hex27, connectivity: vec![], region: vec![] };
    let mut edges: HashSet<[Address; 2]> = HashSet::new();
    for layer in 0..LAYERS[0] {
        for [x, y, width, length] in CELLS {
            let (first, size) = ([x, y, layer * LAYERS[1]], [width, length, LAYERS[1]]);
            let at = |l: [i8; 3]| -> Address {
                std::array::from_fn(|i| first[i] + size[i] * (l[i] + 1) as u32 / 2)
            };
            for l in HEX27_LATTICE {
                let next = number.len() as u32;
                block.connectivity.push(*number.entry(at(l)).or_insert(next));
            }
            for l in HEX27_LATTICE {
                // Lines of three nodes along x and y at every height.
                for i in (0..2).filter(|&i| l[i] == 0 && l[1 - i] != 0) {
                    let [mut from, mut to] = [l; 2];
                    (from[i], to[i]) = (-1, 1);
                    edges.insert([at(from), at(to)]);
                }
            }
            block.region.push(REGION);
        }
    }
    let middle = |a: Address, b: Address| std::array::from_fn(|i| u32::midpoint(a[i], b[i]));
    let mut hanging = BTreeMap::new();
    for &[a, b] in &edges {
        let m = middle(a, b);
        if m != a && edges.contains(&[a, m]) {
            hanging.insert(number[&middle(a, m)], [a, m, b].map(|at| number[&at]));
            hanging.insert(number[&middle(m, b)], [b, m, a].map(|at| number[&at]));
        }
    }
    let mut nodes = vec![[0.0; 3]; number.len()];
    let mut outside = Vec::new();
    for (at, n) in number {
        let [x, y, z] = at.map(|v| 0.25 * f64::from(v));
        nodes[n as usize] = [x + 0.2 * y, y - 0.1 * z, z + 0.15 * x];
        if !hanging.contains_key(&n) && (0..3).any(|i| at[i] == 0 || at[i] == SIZE[i]) {
            outside.push(n);
        }
    }
    outside.sort_unstable();
    let hanging = hanging.into_iter().map(|(node, masters)| HangingNode { node, masters });
    Mesh {
        nodes,
        blocks: vec![block],
        hanging: hanging.collect(),
        node_sets: [(OUTSIDE.into(), outside)].into(),
        ..Mesh::default()
    }
}

fn field(p: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|j| GRADIENT[i][j] * p[j]).sum())
}

pub(super) fn run(context: &Context<'_>) -> Result<Vec<Check>, CaseError> {
    let mesh = graded_block();
    let card = MaterialCard::NeoHookean { mu_mpa: 0.080 / 2.96, bulk_mpa: 0.080 / 0.12 };
    let k = Kinematics::new(GRADIENT);
    let sed = card.solid().stored_mpa(&k, k.j_minus_1, &[]);
    let mut cards = [const { None }; Tissue::ALL.len()];
    cards[REGION.index()] = Some(card);
    let fixed = hold(&mesh, &[(OUTSIDE, [true; 3])]);
    let moved = prescribe(&mesh, &fixed, field);
    let mut rows = Vec::new();
    let theirs = calculix(context, &mesh, &cards, &fixed, &moved)?;
    let ours = solver(mesh, &cards, fixed, moved)?;
    for (code, found) in [("here", ours), ("in CalculiX", theirs)] {
        let due: Vec<_> = found.at_mm.iter().map(|p| field(*p)).collect();
        let u = relative_l2(found.displacement_mm.as_flattened(), due.as_flattened());
        let energy = relative_l2(&found.sed_mpa, &vec![sed; found.sed_mpa.len()]);
        rows.push(Check::vanishes(format!("displacement {code}, L2"), u, TOLERANCE, EXACT));
        rows.push(Check::vanishes(format!("SED {code}, L2"), energy, TOLERANCE, EXACT));
    }
    Ok(rows)
}

/// What a code found.
struct Answer {
    /// Nodes, and their displacement.
    at_mm: Vec<[f64; 3]>,
    displacement_mm: Vec<[f64; 3]>,
    sed_mpa: Vec<f64>,
}

fn calculix(
    context: &Context<'_>,
    mesh: &Mesh,
    cards: &Cards,
    fixed: &[bool],
    prescribed_mm: &[(usize, f64)],
) -> Result<Answer, CaseError> {
    let deck = Deck {
        title: "patch",
        mesh,
        materials: cards,
        fixed,
        prescribed_mm,
        press: None,
        types: ElementTypes::default(),
        step: StepControl { residual_tolerance: 1e-9, ..StepControl::default() },
    };
    let run = context.ccx.run(context.folder, "patch", &deck.to_text()?)?;
    let displacement = &run.dat.table(Quantity::Displacement, BODY, 1.0)?.rows;
    let strain = &run.dat.table(Quantity::Strain, ELEMENTS, 1.0)?.rows;
    let card = cards[REGION.index()].as_ref().ok_or("no material")?;
    Ok(Answer {
        at_mm: displacement.iter().map(|r| mesh.nodes[r.id - 1]).collect(),
        displacement_mm: displacement.iter().map(|r| [0, 1, 2].map(|i| r.values[i])).collect(),
        sed_mpa: strain.iter().map(|r| card.energy_mpa(&r.values)).collect(),
    })
}

fn solver(
    mesh: Mesh,
    cards: &Cards,
    fixed: Vec<bool>,
    prescribed_mm: Vec<(usize, f64)>,
) -> Result<Answer, CaseError> {
    let problem = Problem::new(mesh, laws(cards)?, fixed, None)?;
    let options = Options { residual_tolerance: 1e-12, ..Options::default() };
    let mut solver = Solver::new(&problem, options)?;
    solver.start(Loading { prescribed_mm, ..Loading::default() });
    solver.advance_to(1.0)?;
    let u = solver.displacement_mm();
    let sed = sed_mpa(&problem, ElementTypes::default(), u)?;
    Ok(Answer {
        at_mm: problem.mesh.nodes.clone(),
        displacement_mm: u.to_vec(),
        sed_mpa: sed.into_iter().flatten().collect(),
    })
}
