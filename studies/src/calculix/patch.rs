//! Even strain of a block whose cells are halved: nodes between sizes must not disturb it.

use super::ours::{Cards, laws, sed_mpa};
use super::{Check, Context};
use crate::calculix::Quantity;
use papilla_calculix::deck::{BODY, ELEMENTS};
use papilla_calculix::{Deck, ElementTypes, MaterialCard, StepControl};
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::graded_block::{OUTSIDE, graded_block};
use papilla_fem::mesh::lattice::REGION;
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::solve::{Loading, Options, Problem, Solver};
use papilla_fingertip::simulation::record::relative_l2;
use papilla_fingertip::tissue::Tissue;
use papilla_solid::tensor::Kinematics;
use papilla_validation::verify::CaseError;

const EXACT: &str = "exact";

/// The displacement gradient: all components of strain, and rotation.
const GRADIENT: [[f64; 3]; 3] = [[0.08, 0.03, -0.02], [0.01, -0.05, 0.04], [0.02, 0.01, 0.06]];
/// The precision of CalculiX' printed values.
const TOLERANCE: f64 = 1e-5;

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
