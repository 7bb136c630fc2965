//! One element of each material, stretched and sheared by prescribed displacements.

use super::ours::{laws, sed_mpa};
use super::{Check, Context, SOURCE};
use crate::calculix::Quantity;
use papilla_calculix::deck::{ELEMENTS, HELD};
use papilla_calculix::{Deck, ElementTypes, MaterialCard, StepControl};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::lattice::{REGION, cube};
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::solve::{Loading, Options, Problem, Solver};
use papilla_fingertip::tissue::Tissue;
use papilla_validation::verify::CaseError;
use papilla_validation::verify::internal_force;

/// How the unit cube is deformed.
#[derive(Clone, Copy)]
enum Motion {
    /// Stretched along x to this length, sides free.
    Uniaxial(f64),
    /// `u_x = g y` on all sides, free to change its height.
    Shear(f64),
}

/// Force (N) on the moved face and energy density (MPa).
type Answer = [f64; 2];

pub(super) fn run(context: &Context<'_>) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for (material, card) in materials() {
        let motions = if card.is_hyperelastic() {
            [Motion::Uniaxial(0.85), Motion::Uniaxial(1.4), Motion::Shear(0.5)]
        } else {
            [Motion::Uniaxial(0.99), Motion::Uniaxial(1.01), Motion::Shear(0.02)]
        };
        let hexes = [(ElementKind::Hex8, "Hex8 = C3D8"), (ElementKind::Hex27, "Hex27 = C3D20R")];
        let tets = [(ElementKind::Tet4, "Tet4 = C3D4"), (ElementKind::Tet10, "Tet10 = C3D10")];
        for motion in motions {
            for (kind, name) in hexes.into_iter().chain(tets) {
                let job = format!("one-{}", rows.len());
                let theirs = calculix(context, &job, &card, kind, motion)?;
                let ours = solver(&card, kind, motion)?;
                let how = match motion {
                    Motion::Uniaxial(stretch) => format!("stretch {stretch}"),
                    Motion::Shear(g) => format!("shear {g}"),
                };
                for (i, what) in ["force, N", "SED, MPa"].into_iter().enumerate() {
                    let quantity = format!("{material}, {name}, {how}: {what}");
                    rows.push(Check::relative(quantity, ours[i], theirs[i], 1e-5, SOURCE));
                }
            }
        }
    }
    Ok(rows)
}

fn materials() -> [(&'static str, MaterialCard); 3] {
    let bulk_mpa = 0.080 / (3.0 * (1.0 - 2.0 * 0.48));
    let (mu_mpa, alpha) = (vec![2.3583e-2, 4.5408e-5, 4.0878e-2], vec![-2.0623, 25.0, -3.4784]);
    [
        ("neo-Hookean", MaterialCard::NeoHookean { mu_mpa: 0.080 / 2.96, bulk_mpa }),
        ("Ogden", MaterialCard::Ogden { mu_mpa, alpha, bulk_mpa: 1.6 }),
        ("linear", MaterialCard::Linear { youngs_modulus_mpa: 0.080, poissons_ratio: 0.48 }),
    ]
}

/// A unit cube and what is held and moved of it.
fn body(kind: ElementKind, motion: Motion) -> (Mesh, Vec<bool>, Vec<(usize, f64)>) {
    let mesh = cube(kind, 1, |p| p);
    let (fixed, values) = match motion {
        Motion::Uniaxial(stretch) => {
            let (x, y, z) = ([true, false, false], [false, true, false], [false, false, true]);
            let sides = [("x_min", x), ("x_max", x), ("y_min", y), ("z_min", z)];
            let fixed = hold(&mesh, &sides);
            let values = prescribe(&mesh, &fixed, |p| [(stretch - 1.0) * p[0], 0.0, 0.0]);
            (fixed, values)
        }
        Motion::Shear(g) => {
            // Free to change its thickness, so that there is something to solve.
            let plane = [true, true, false];
            let around = ["x_min", "x_max", "y_min", "y_max", "z_max"].map(|side| (side, plane));
            let sides: Vec<_> = around.into_iter().chain([("z_min", [true; 3])]).collect();
            let fixed = hold(&mesh, &sides);
            let values = prescribe(&mesh, &fixed, |p| [g * p[1], 0.0, 0.0]);
            (fixed, values)
        }
    };
    (mesh, fixed, values)
}

/// The moved face's name: x_max pulls, y_max shears; its force is along x.
fn moved(motion: Motion) -> &'static str {
    match motion {
        Motion::Uniaxial(_) => "x_max",
        Motion::Shear(_) => "y_max",
    }
}

/// CalculiX' force and energy density.
fn calculix(
    context: &Context<'_>,
    job: &str,
    card: &MaterialCard,
    kind: ElementKind,
    motion: Motion,
) -> Result<Answer, CaseError> {
    let (mesh, fixed, values) = body(kind, motion);
    let mut materials = [const { None }; Tissue::ALL.len()];
    materials[REGION.index()] = Some(card.clone());
    let deck = Deck {
        title: job,
        mesh: &mesh,
        materials: &materials,
        fixed: &fixed,
        prescribed_mm: &values,
        press: None,
        types: ElementTypes::default(),
        step: StepControl { residual_tolerance: 1e-9, ..StepControl::default() },
    };
    let run = context.ccx.run(context.folder, job, &deck.to_text()?)?;
    let end = &mesh.node_sets[moved(motion)];
    let reactions = &run.dat.table(Quantity::Force, HELD, 1.0)?.rows;
    let at_end = |id: usize| end.binary_search(&(id as u32 - 1)).is_ok();
    let force = reactions.iter().filter(|r| at_end(r.id)).map(|r| r.values[0]).sum();
    let strain = &run.dat.table(Quantity::Strain, ELEMENTS, 1.0)?.rows;
    let sed = strain.iter().map(|r| card.energy_mpa(&r.values)).sum::<f64>();
    Ok([force, sed / strain.len() as f64])
}

/// The same of our solver.
fn solver(card: &MaterialCard, kind: ElementKind, motion: Motion) -> Result<Answer, CaseError> {
    let (mesh, fixed, prescribed_mm) = body(kind, motion);
    let mut cards = [const { None }; Tissue::ALL.len()];
    cards[REGION.index()] = Some(card.clone());
    let problem = Problem::new(mesh, laws(&cards)?, fixed, None)?;
    let options = Options { residual_tolerance: 1e-12, ..Options::default() };
    let mut solver = Solver::new(&problem, options)?;
    solver.start(Loading { prescribed_mm, ..Loading::default() });
    for quarter in 1..=4 {
        solver.advance_to(f64::from(quarter) / 4.0)?;
    }
    let u = solver.displacement_mm();
    let internal = internal_force(&problem, u)?;
    let end = &problem.mesh.node_sets[moved(motion)];
    let force = end.iter().map(|&n| internal[3 * n as usize]).sum();
    let sed: Vec<f64> =
        sed_mpa(&problem, ElementTypes::default(), u)?.into_iter().flatten().collect();
    Ok([force, sed.iter().sum::<f64>() / sed.len() as f64])
}
