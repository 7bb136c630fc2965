//! Solves the problems and scenes of the hard cases, and says how each ended.

use super::{Hardness, Line};
use crate::verify::Check;
use papilla_dataset::{BALANCE_RELATIVE_MAX, PENETRATION_MM_MAX, RESIDUAL_RELATIVE_MAX};
use papilla_fem::solve::{Effort, Loading, Options, Problem, SolveError, Solver, StepReport};
use papilla_fingertip::scene::{Scene, SceneError};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::balanced::Balanced;
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::{IncrementRecord, relative_l2};
use std::path::Path;

/// The deepest state of an indentation, and what all of it took.
#[derive(Clone)]
pub(super) struct Pressed {
    pub(super) record: IncrementRecord,
    pub(super) report: StepReport,
}

impl Pressed {
    /// What the solver holds, as a state of `body`.
    pub(super) fn of(
        body: &Body,
        solver: &Solver<'_>,
        depth_mm: f64,
        report: StepReport,
    ) -> Result<Self, SimulationError> {
        Ok(Self { record: body.record(solver, depth_mm, &report)?, report })
    }

    /// How hard it was.
    pub(super) fn hardness(&self) -> Hardness {
        Hardness::of_press(&self.record, &self.report)
    }

    /// A line with the balances that a dataset asks for beside `checks`.
    pub(super) fn line(&self, variant: impl Into<String>, mut checks: Vec<Check>) -> Line {
        checks.extend(self.balances());
        Line::converged(variant, self.hardness(), checks)
    }

    /// What every state of a dataset has to keep.
    pub(super) fn balances(&self) -> Vec<Check> {
        let c = &self.record.checks;
        let row = |what: &str, value, most| Check::vanishes(what, value, most, "equilibrium");
        vec![
            row(
                "contact beyond the recorded skin",
                c.contact_force_vs_pressure_integral,
                BALANCE_RELATIVE_MAX,
            ),
            row("plate against supports", c.plate_vs_support_reaction, BALANCE_RELATIVE_MAX),
            row("energy against work", c.energy_vs_work, BALANCE_RELATIVE_MAX),
            row("residual", c.residual_relative, RESIDUAL_RELATIVE_MAX),
            row("penetration, mm", c.penetration_mm_max, PENETRATION_MM_MAX),
            Check::within("J min", c.j_min, [1e-6, 10.0], "no element inverts"),
        ]
    }

    pub(super) fn force_n(&self) -> f64 {
        papilla_vector::norm(self.record.force_n)
    }

    /// Pressure and SED against those of another indentation of the same body.
    pub(super) fn same_as(&self, other: &Self, tolerance: f64, source: &'static str) -> Vec<Check> {
        let (a, b) = (&self.record, &other.record);
        let force = papilla_vector::norm(std::array::from_fn(|i| a.force_n[i] - b.force_n[i]));
        let row = |what: &str, value| Check::vanishes(what, value, tolerance, source);
        let mut rows = vec![row("force", force / other.force_n())];
        if !a.pressure_mpa.is_empty() {
            rows.push(row("pressure, L2", relative_l2(&a.pressure_mpa, &b.pressure_mpa)));
            rows.push(row("SED, L2", relative_l2(&a.sed_dermis_mpa, &b.sed_dermis_mpa)));
        }
        rows
    }
}

/// A scene as its file would be.
pub(super) fn scene(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(Path::new("case.toml"), text.into())
}

/// Presses what a scene describes and gives its last state.
pub(super) fn press(scene: &Scene, options: Options) -> Result<Pressed, SimulationError> {
    let Simulation { body, approach, drive, .. } = Simulation::new(scene)?;
    press_body(&body, &approach, &drive, options)
}

/// Presses a body and gives the last state.
pub(super) fn press_body(
    body: &Body,
    approach: &Approach,
    drive: &Drive,
    options: Options,
) -> Result<Pressed, SimulationError> {
    let mut solver = body.solver(options)?;
    let keep = &mut |_: usize, _: &Solver<'_>, r: &IncrementRecord, s: &StepReport| (r.clone(), *s);
    let Balanced { kept, pressed, .. } =
        body.press_balanced(&mut solver, approach, drive, BALANCE_RELATIVE_MAX, keep);
    pressed?;
    let effort = kept.iter().fold(Effort::default(), |sum, (_, r)| sum.plus(&r.effort));
    let (record, report) = kept.into_iter().next_back().ok_or(SimulationError::Empty)?;
    Ok(Pressed { record, report: StepReport { effort, ..report } })
}

/// Options that leave little to tolerances.
pub(super) fn tight() -> Options {
    Options {
        residual_tolerance: 1e-10,
        gap_tolerance_mm: 1e-7,
        augmentations_max: 40,
        ..Options::default()
    }
}

/// Solves `loading` in `steps` equal increments; the report is of the last, its effort of
/// all.
pub(super) fn solve(
    problem: &Problem,
    loading: Loading,
    options: Options,
    steps: u32,
) -> Result<(Solver<'_>, StepReport), SolveError> {
    let mut solver = Solver::new(problem, options)?;
    solver.start(loading);
    let (mut report, mut effort) = (StepReport::default(), Effort::default());
    for s in 1..=steps {
        report = solver.advance_to(f64::from(s) / f64::from(steps))?;
        effort = effort.plus(&report.effort);
    }
    Ok((solver, StepReport { effort, ..report }))
}
