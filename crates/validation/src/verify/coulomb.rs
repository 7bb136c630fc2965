//! A plate that presses a block and then drags it: stick, then slip.

use super::bodies::{internal_force, solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::contact::ContactRule;
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::lattice;
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem, Solver, StepReport};
use papilla_sdf::{Placement, RoundedPlate};
use std::sync::Arc;

const DEPTH_MM: f64 = 0.1;
const SIDE_MM: f64 = 4.0;
const HEIGHT_MM: f64 = 2.0;

/// Elements between the block's nodes, and where contact is found.
#[derive(Clone, Copy)]
struct Form {
    kind: ElementKind,
    rule: ContactRule,
    name: &'static str,
    /// Relative difference allowed to what is glued: by a penalty what sticks gives way a little.
    stick: f64,
}

/// Multipliers at nodes, as on even meshes, and a penalty at points of quadratic faces, as on graded
/// ones.
const FORMS: [Form; 2] = [
    Form { kind: ElementKind::Hex8, rule: ContactRule::Nodal, name: "", stick: 1e-3 },
    Form {
        kind: ElementKind::Hex27,
        rule: ContactRule::Gauss,
        name: " (quadratic faces)",
        stick: 3e-3,
    },
];

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for form in FORMS {
        rows.extend(slip(form, if context.quick { &[0.5] } else { &[0.2, 0.5, 0.8, 1.2] })?);
        rows.extend(stick(form)?);
    }
    Ok(rows)
}

pub(crate) fn block() -> (Mesh, Vec<bool>) {
    FORMS[0].block()
}

impl Form {
    fn block(self) -> (Mesh, Vec<bool>) {
        let axes = [even(SIDE_MM, 6), even(SIDE_MM, 6), even(HEIGHT_MM, 4)];
        let mesh = lattice(self.kind, axes, |p| p);
        let fixed = hold(&mesh, &[("z_min", [true; 3])]);
        (mesh, fixed)
    }

    fn dragged(
        self,
        problem: &Problem,
        friction: f64,
        drag_mm: f64,
    ) -> Result<(Solver<'_>, StepReport), CaseError> {
        let (mut loading, options) = drag(friction, drag_mm);
        if let Some(indenter) = &mut loading.indenter {
            indenter.contact = self.rule;
        }
        solve(problem, loading, options, 8)
    }
}

/// Presses the block's top and drags it by `drag_mm`; half of the load is each.
pub(crate) fn drag(friction: f64, drag_mm: f64) -> (Loading, Options) {
    let plate = RoundedPlate { half_mm: [8.0, 8.0, 1.0], edge_radius_mm: 0.5 };
    let rotation = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let middle = 0.5 * SIDE_MM;
    let start = Placement { rotation, origin_mm: [middle, middle, HEIGHT_MM + plate.half_mm[2]] };
    let path = vec![(0.5, [0.0, 0.0, -DEPTH_MM]), (1.0, [drag_mm, 0.0, -DEPTH_MM])];
    let indenter = MovingIndenter::along(Arc::new(plate), start, path);
    let loading = Loading { indenter: Some(indenter), friction, ..Loading::default() };
    let options = Options {
        gap_tolerance_mm: 1e-7,
        residual_tolerance: 1e-8,
        friction_tolerance: 1e-6,
        friction_updates_max: 400,
        ..Options::default()
    };
    (loading, options)
}

/// The drag wins: every node slips and the force is Coulomb's.
fn slip(form: Form, frictions: &[f64]) -> Result<Vec<Check>, CaseError> {
    const SOURCE: &str = "Coulomb: T = mu N";
    let mut rows = Vec::new();
    for &friction in frictions {
        let (mesh, fixed) = form.block();
        let problem = Problem::new(mesh, uniform(0.1, 0.4)?, fixed, Some("z_max"))?;
        let (solver, report) = form.dragged(&problem, friction, 3.0)?;
        let [x, y, z] = solver.balance().contact_force_n;
        let quantity = |what: &str| format!("dragged 3 mm, mu {friction}{}: {what}", form.name);
        rows.push(Check::relative(
            quantity("drag / pressing force"),
            (x / z).abs(),
            friction,
            1e-3,
            SOURCE,
        ));
        rows.push(Check::vanishes(quantity("sideways force / N"), y / z, 1e-6, "symmetry"));
        // More friction folds the block's edge under within a step: eight are too few for its work.
        if friction <= 0.5 {
            let spent = report.stored_mj + report.dissipated_mj;
            let name = quantity("stored energy and heat over work");
            let ratio = spent / solver.indenter_work_mj();
            rows.push(Check::relative(name, ratio, 1.0, 1e-3, "first law"));
        }
    }
    Ok(rows)
}

/// Friction wins from first touch on: the top moves as if glued to the plate.
fn stick(form: Form) -> Result<Vec<Check>, CaseError> {
    const SOURCE: &str = "the same block glued to the plate";
    const DRAG_MM: f64 = 0.05;
    let (mesh, fixed) = form.block();
    let problem = Problem::new(mesh, uniform(0.1, 0.4)?, fixed, Some("z_max"))?;
    let rubbed = form.dragged(&problem, 10.0, DRAG_MM)?.0.balance().contact_force_n;
    let glued = form.glued_n(DRAG_MM)?;
    Ok([(0, "along the drag"), (2, "down")]
        .map(|(i, what)| {
            let quantity = format!("dragged 0.05 mm, mu 10{}: force {what}, N", form.name);
            Check::relative(quantity, rubbed[i].abs(), glued[i].abs(), form.stick, SOURCE)
        })
        .into())
}

/// Force on the top of the block if it is glued to the plate, N.
pub(crate) fn glued_n(drag_mm: f64) -> Result<[f64; 3], CaseError> {
    FORMS[0].glued_n(drag_mm)
}

impl Form {
    fn glued_n(self, drag_mm: f64) -> Result<[f64; 3], CaseError> {
        let (mesh, mut fixed) = self.block();
        for &n in &mesh.node_sets["z_max"] {
            fixed[3 * n as usize..3 * n as usize + 3].fill(true);
        }
        let prescribed_mm =
            prescribe(&mesh, &fixed, |x| [drag_mm, 0.0, -DEPTH_MM].map(|v| v * x[2] / HEIGHT_MM));
        let problem = Problem::new(mesh, uniform(0.1, 0.4)?, fixed, None)?;
        let loading = Loading { prescribed_mm, ..Loading::default() };
        let (glued, _) = solve(&problem, loading, Options::default(), 4)?;
        let force = internal_force(&problem, glued.displacement_mm())?;
        let sum = |i: usize| -> f64 {
            problem.mesh.node_sets["z_max"].iter().map(|&n| force[3 * n as usize + i]).sum()
        };
        Ok([sum(0), sum(1), sum(2)])
    }
}
