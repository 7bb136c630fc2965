//! Friction of 0, 1e-9, 1 and 10.

use super::lab::solve;
use super::{Line, Suite};
use crate::verify::bodies::uniform;
use crate::verify::coulomb::{block, drag, glued_n};
use crate::verify::{CaseError, Check};
use papilla_fem::solve::{Problem, SolveError, StepReport};

/// Force of the plate on a block that it presses and drags, N.
fn dragged(
    friction: f64,
    drag_mm: f64,
) -> Result<Result<([f64; 3], StepReport), SolveError>, CaseError> {
    let (mesh, fixed) = block();
    let problem = Problem::new(mesh, uniform(0.1, 0.4)?, fixed, Some("z_max"))?;
    let (loading, options) = drag(friction, drag_mm);
    Ok(solve(&problem, loading, options, 8)
        .map(|(solver, report)| (solver.balance().contact_force_n, report)))
}

pub(super) fn run(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    let (free, report) = dragged(0.0, 3.0)??;
    let none = Check::vanishes("drag / pressing force", free[0] / free[2], 1e-9, "no friction");
    lines.push(Line::converged("mu 0, dragged 3 mm", (&report).into(), vec![none]));
    for (mu, tolerance) in [(1e-9, 1e-3), (1.0, 1e-3)] {
        let ([x, y, z], report) = dragged(mu, 3.0)??;
        let mut checks = vec![
            Check::relative(
                "drag / pressing force",
                (x / z).abs(),
                mu,
                tolerance,
                "Coulomb: T = mu N",
            ),
            Check::vanishes("sideways force / pressing force", y / z, 1e-6, "symmetry"),
        ];
        if mu < 1e-6 {
            checks.push(Check::relative("pressing force", z, free[2], 1e-6, "mu = 0"));
        }
        lines.push(Line::converged(format!("mu {mu:e}, dragged 3 mm"), (&report).into(), checks));
    }
    let (found, report) = dragged(10.0, 0.05)??;
    let glued = glued_n(0.05)?;
    let source = "the same block glued to the plate";
    let row = |what, i: usize| Check::relative(what, found[i].abs(), glued[i].abs(), 1e-3, source);
    let checks = vec![row("drag", 0), row("pressing force", 2)];
    lines.push(Line::converged("mu 10, dragged .05 mm", (&report).into(), checks));
    if suite.quick() {
        return Ok(lines);
    }
    // Nothing promises that a block can follow 3 mm of drag; if it does, it keeps Coulomb's law.
    let variant = "mu 10, dragged 3 mm";
    lines.push(match dragged(10.0, 3.0)? {
        Ok(([x, _, z], report)) => {
            let ratio =
                Check::within("drag / pressing force", (x / z).abs(), [0.1, 10.01], "T <= mu N");
            Line::converged(variant, (&report).into(), vec![ratio])
        }
        refused => {
            Line::refused(variant, refused.map(drop), &["no equilibrium beyond load fraction"])
        }
    });
    Ok(lines)
}
