//! The assembled tangent against central differences of the assembled residual.

use super::bodies::{largest, noise, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::contact::ContactRule;
use papilla_fem::element::{ElementKind, HistoryVariables};
use papilla_fem::linear::DofMap;
use papilla_fem::mesh::FaceKind;
use papilla_fem::mesh::lattice::cube;
use papilla_fem::solve::evaluate::{Evaluation, Trial, evaluate_body};
use papilla_fem::solve::{Loading, MovingIndenter, Problem, StepError};
use papilla_sdf::{Placement, Sphere};
use std::sync::Arc;

const SOURCE: &str = "central difference of the residual, step 1e-6 mm";
const STEP_MM: f64 = 1e-6;

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let kinds = [
        (ElementKind::Hex8, "Hex8", 2),
        (ElementKind::Hex20, "Hex20", 1),
        (ElementKind::Hex27, "Hex27", 1),
        (ElementKind::Tet10, "Tet10", 1),
        (ElementKind::Tet4, "Tet4", 2),
        (ElementKind::Quad4, "Quad4", 3),
        (ElementKind::Quad8, "Quad8", 2),
        (ElementKind::Quad9, "Quad9", 2),
    ];
    let mut rows = Vec::new();
    for (kind, name, cells) in kinds {
        let carries = FaceKind::of(kind).carries_contact();
        for (rule, points) in [(ContactRule::Nodal, "nodes"), (ContactRule::Gauss, "face points")] {
            if rule == ContactRule::Gauss && !carries {
                continue;
            }
            let (error, touching) = error(kind, cells, rule)?;
            let quantity =
                format!("{name}, {touching} {points} in contact: largest relative error");
            // Without contact the row would not show what it says, but where it is refused.
            let error = if carries && touching == 0 { f64::NAN } else { error };
            rows.push(Check::vanishes(quantity, error, 1e-7, SOURCE));
        }
    }
    Ok(rows)
}

/// A sphere that dents the top of the cube near its middle; the top of a
/// square, where it is a disc of the same radius.
fn loading(kind: ElementKind, contact: ContactRule) -> Loading {
    let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (origin_mm, travel_mm) = if kind.is_planar() {
        ([0.55, 2.4, 0.0], [0.0, -0.1, 0.0])
    } else {
        ([0.55, 0.45, 2.4], [0.0, 0.0, -0.1])
    };
    let start = Placement { rotation, origin_mm };
    let shape = Arc::new(Sphere { radius_mm: 1.6 });
    let indenter = MovingIndenter { contact, ..MovingIndenter::straight(shape, start, travel_mm) };
    Loading { indenter: Some(indenter), ..Loading::default() }
}

/// Largest error over the largest entry, and the number of points in contact.
fn error(kind: ElementKind, cells: usize, rule: ContactRule) -> Result<(f64, usize), CaseError> {
    let mesh = cube(kind, cells, |p| p);
    let mut fixed = vec![false; 3 * mesh.nodes.len()];
    let (bottom, top) = if kind.is_planar() { ("y_min", "y_max") } else { ("z_min", "z_max") };
    for &n in &mesh.node_sets[bottom] {
        fixed[3 * n as usize..3 * n as usize + 3].fill(true);
    }
    let touched = FaceKind::of(kind).carries_contact().then_some(top);
    let problem = Problem::new(mesh, uniform(1.0, 0.4)?, fixed, touched)?;
    let contact = problem.contact.as_ref().map_or(0, |c| c.points(rule).len());
    let multipliers: Vec<f64> = (0..contact as u64).map(|i| 0.05 + 0.02 * noise(900 + i)).collect();
    let size = 0.06 / cells as f64;
    let mut u: Vec<[f64; 3]> = (0..problem.mesh.nodes.len() as u64)
        .map(|n| {
            let moves = |i: usize| if i < kind.dimension() { size } else { 0.0 };
            std::array::from_fn(|i| moves(i) * noise(3 * n + i as u64))
        })
        .collect();
    let loading = loading(kind, rule);
    let system = &problem.system;
    let equations = &system.dofs;
    let mut tangent = system.zeros();
    let mut at = |u: &[[f64; 3]], with_tangent: bool| -> Result<Evaluation, StepError> {
        let trial = Trial {
            u,
            independent: &[],
            multipliers_mpa: &multipliers,
            penalty: 3.0,
            load_fraction: 1.0,
            variables: HistoryVariables::default(),
            friction: None,
            fluid: None,
        };
        let mut out = Evaluation::default();
        evaluate_body(&problem, &loading, &trial, with_tangent.then_some(&mut tangent), &mut out)?;
        Ok(out)
    };
    let touching = at(&u, true)?.traction_mpa.iter().filter(|t| **t > 0.0).count();
    let dofs: Vec<usize> =
        (0..3 * u.len()).filter(|&d| equations.of_dof[d] != DofMap::FIXED).collect();
    let mut difference = Vec::new();
    for &dof in &dofs {
        let (node, i) = (dof / 3, dof % 3);
        let middle = u[node][i];
        u[node][i] = middle + STEP_MM;
        let plus = at(&u, false)?.residual_n;
        u[node][i] = middle - STEP_MM;
        let minus = at(&u, false)?.residual_n;
        u[node][i] = middle;
        difference
            .push(dofs.iter().map(|&d| (plus[d] - minus[d]) / (2.0 * STEP_MM)).collect::<Vec<_>>());
    }
    let (mut unit, mut column) = (vec![0.0; equations.count], vec![0.0; equations.count]);
    let (mut worst, mut scale) = (0.0f64, 0.0f64);
    for (&dof, expected) in dofs.iter().zip(&difference) {
        let e = equations.of_dof[dof] as usize;
        unit[e] = 1.0;
        system.multiply(&tangent, &unit, &mut column);
        unit[e] = 0.0;
        for (&d, expected) in dofs.iter().zip(expected) {
            worst = worst.max((column[equations.of_dof[d] as usize] - expected).abs());
        }
        scale = scale.max(largest(&column));
    }
    Ok((worst / scale, touching))
}
