//! A confined column that relaxes under a held plate and creeps under a rising load.

use super::bodies::solve;
use super::{CaseError, Check, Context};
use crate::verify::bodies::everywhere;
use papilla_fem::element::{ElementKind, Viscoelastic};
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::lattice;
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem, Solver};
use papilla_fingertip::materials::PronySpec;
use papilla_sdf::{Placement, RoundedPlate};
use papilla_solid::{LinearElastic, Prony, PronyTerm};
use std::sync::Arc;

const RELAXATION: &str = "closed form: K + 4/3 mu G(t), convolved with the ramp";
const CREEP: &str = "closed form: creep compliance of one Prony term";
pub(crate) const MU_MPA: f64 = 0.03;
pub(crate) const BULK_MPA: f64 = 0.2;
pub(crate) const HEIGHT_MM: f64 = 2.0;

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = relaxation()?;
    rows.extend(creep()?);
    Ok(rows)
}

/// A column of 1 mm2 that can only change its height.
pub(crate) fn column(prony: Prony) -> Result<Problem, CaseError> {
    let axes = [even(1.0, 2), even(1.0, 2), even(HEIGHT_MM, 4)];
    let mesh: Mesh = lattice(ElementKind::Hex8, axes, |p| p);
    let sides = [true, true, false];
    let fixed = hold(
        &mesh,
        &[
            ("x_min", sides),
            ("x_max", sides),
            ("y_min", sides),
            ("y_max", sides),
            ("z_min", [true; 3]),
        ],
    );
    let solid = Viscoelastic::shared(LinearElastic { mu_mpa: MU_MPA }, BULK_MPA, prony);
    Ok(Problem::new(mesh, everywhere(solid.clone()), fixed, Some("z_max"))?)
}

/// A plate goes down within `RAMP_S` and stays.
fn relaxation() -> Result<Vec<Check>, CaseError> {
    const RAMP_S: f64 = 1.0;
    const END_S: f64 = 11.0;
    const DEPTH_MM: f64 = 0.01;
    let (prony, _) = PronySpec::skin().series()?;
    let problem = column(prony)?;
    let plate = RoundedPlate { half_mm: [4.0, 4.0, 1.0], edge_radius_mm: 0.5 };
    let rotation = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let start = Placement { rotation, origin_mm: [0.5, 0.5, HEIGHT_MM + plate.half_mm[2]] };
    let down = [0.0, 0.0, -DEPTH_MM];
    let path = vec![(RAMP_S / END_S, down), (1.0, down)];
    let indenter = MovingIndenter::along(Arc::new(plate), start, path);
    let options = Options {
        gap_tolerance_mm: 1e-9 * DEPTH_MM,
        residual_tolerance: 1e-10,
        ..Options::default()
    };
    let mut solver = Solver::new(&problem, options)?;
    let loading = Loading { indenter: Some(indenter), duration_s: END_S, ..Loading::default() };
    solver.start(loading);
    let mut rows = Vec::new();
    let mut energy = 0.0;
    for time in [0.5 * RAMP_S, RAMP_S, 2.0, 4.0, END_S] {
        let report = solver.advance_to(time / END_S)?;
        let force = -solver.balance().contact_force_n[2];
        let share: f64 = prony
            .terms()
            .iter()
            .map(|t| {
                let since = |s: f64| (-(s.max(0.0)) / t.time_s).exp();
                t.share * t.time_s * (since(time - RAMP_S) - since(time))
            })
            .sum();
        let elapsed = time.min(RAMP_S);
        let strain_rate = DEPTH_MM / HEIGHT_MM / RAMP_S;
        let relaxing = prony.long_term_share() * elapsed + share;
        let exact = strain_rate * (BULK_MPA * elapsed + 4.0 / 3.0 * MU_MPA * relaxing);
        rows.push(Check::relative(
            format!("ramp 1 s and hold, force at {time} s, N"),
            force.abs(),
            exact,
            1e-6,
            RELAXATION,
        ));
        let work = solver.indenter_work_mj();
        energy = (report.stored_mj + report.dissipated_mj - work) / work;
    }
    let quantity = "ramp 1 s and hold: stored + dissipated energy against work at 11 s";
    rows.push(Check::vanishes(quantity, energy, 5e-3, "first law"));
    Ok(rows)
}

/// A pressure that rises in proportion to time.
fn creep() -> Result<Vec<Check>, CaseError> {
    const END_S: f64 = 4.0;
    const END_MPA: f64 = 1e-4;
    let term = PronyTerm { share: 0.4, time_s: 0.7 };
    let problem = column(Prony::new(&[term]))?;
    let mesh = &problem.mesh;
    let top = &mesh.surfaces["z_max"];
    let mut dead_n = vec![[0.0; 3]; mesh.nodes.len()];
    let at = |n: u32| mesh.nodes[n as usize];
    top.integrate(&top.kind.quadrature(), &at, &mut |face, value, normal| {
        for (&n, v) in face.iter().zip(value) {
            dead_n[n as usize][2] -= v * END_MPA * normal[2];
        }
    });
    let loading = Loading { dead_n, duration_s: END_S, ..Loading::default() };
    let options = Options { residual_tolerance: 1e-10, time_error: 1e-4, ..Options::default() };
    let (solver, _) = solve(&problem, loading, options, 40)?;
    let tip = mesh.node_sets["z_max"][0] as usize;
    let found = -solver.displacement_mm()[tip][2] / HEIGHT_MM;
    let sudden = BULK_MPA + 4.0 / 3.0 * MU_MPA;
    let late = BULK_MPA + 4.0 / 3.0 * MU_MPA * (1.0 - term.share);
    let slow_s = term.time_s * sudden / late;
    let lag = (1.0 / late - 1.0 / sudden) * slow_s * -(-END_S / slow_s).exp_m1();
    let exact = END_MPA / END_S * (END_S / late - lag);
    Ok(vec![Check::relative("rising load, strain at 4 s", found, exact, 1e-5, CREEP)])
}
