//! Prony series over times far from their own.

use super::lab::solve;
use super::{Line, Suite};
use crate::verify::relaxation::{BULK_MPA, HEIGHT_MM, MU_MPA, column};
use crate::verify::{CaseError, Check};
use papilla_fem::solve::{Loading, MovingIndenter, Options};
use papilla_fingertip::materials::{Moduli, PronySpec};
use papilla_sdf::{Placement, RoundedPlate};
use papilla_solid::{Prony, PronyTerm};
use std::sync::Arc;

const DEPTH_MM: f64 = 0.01;

/// A confined column pressed by a plate within `duration_s`: force over that of the
/// instantaneous modulus' part, `G(T) / G(0)` as the plate sees it.
fn ramp(variant: String, prony: Prony, duration_s: f64, share: f64) -> Result<Line, CaseError> {
    let problem = column(prony)?;
    let plate = RoundedPlate { half_mm: [4.0, 4.0, 1.0], edge_radius_mm: 0.5 };
    let rotation = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let start = Placement { rotation, origin_mm: [0.5, 0.5, HEIGHT_MM + plate.half_mm[2]] };
    let indenter = MovingIndenter::straight(Arc::new(plate), start, [0.0, 0.0, -DEPTH_MM]);
    let loading = Loading { indenter: Some(indenter), duration_s, ..Loading::default() };
    let options = Options {
        gap_tolerance_mm: 1e-9 * DEPTH_MM,
        residual_tolerance: 1e-10,
        ..Options::default()
    };
    let (solver, report) = solve(&problem, loading, options, 1)?;
    let force = solver.balance().contact_force_n[2].abs();
    let exact = DEPTH_MM / HEIGHT_MM * (BULK_MPA + 4.0 / 3.0 * MU_MPA * share);
    let checks = vec![
        Check::relative("force", force, exact, 1e-5, "the limit's modulus"),
        Check::within("load steps", f64::from(report.effort.steps), [1.0, 500.0], "bounded"),
    ];
    Ok(Line::converged(variant, (&report).into(), checks))
}

pub(super) fn durations(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    for (name, spec) in [("skin", PronySpec::skin()), ("fat", PronySpec::subcutaneous())] {
        let (prony, _) = spec.series()?;
        lines.push(ramp(format!("{name}, ramp of 1e-6 s"), prony, 1e-6, 1.0)?);
        lines.push(ramp(format!("{name}, ramp of 1e6 s"), prony, 1e6, prony.long_term_share())?);
    }
    Ok(lines)
}

pub(super) fn relaxation_times(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let term = |time_s| Prony::new(&[PronyTerm { share: 0.4, time_s }]);
    let mut lines = Vec::new();
    for time_s in [1e-300, 1e-12, 1e-7] {
        lines.push(ramp(format!("tau {time_s:e} s, ramp of 1 s"), term(time_s), 1.0, 0.6)?);
    }
    for time_s in [1e7, 1e12, 1e300] {
        lines.push(ramp(format!("tau {time_s:e} s, ramp of 1 s"), term(time_s), 1.0, 1.0)?);
    }
    let both = Prony::new(&[
        PronyTerm { share: 0.3, time_s: 1e-12 },
        PronyTerm { share: 0.2, time_s: 1e12 },
    ]);
    lines.push(ramp("tau 1e-12 and 1e12 s at once".into(), both, 1.0, 0.7)?);
    let all = PronySpec { share: vec![0.999_999], time_s: vec![1e-6], moduli: Moduli::default() };
    let (prony, _) = all.series()?;
    lines.push(ramp("share .999999".into(), prony, 1.0, 1e-6)?);
    for (name, share, time_s, word) in [
        ("tau 0", 0.3, 0.0, "must be positive and finite"),
        ("tau -1 s", 0.3, -1.0, "must be positive and finite"),
        ("tau NaN", 0.3, f64::NAN, "must be positive and finite"),
        ("tau infinite", 0.3, f64::INFINITY, "must be positive and finite"),
        ("share 1", 1.0, 1.0, "add up to less than 1"),
        ("share NaN", f64::NAN, 1.0, "add up to less than 1"),
    ] {
        let spec =
            PronySpec { share: vec![share], time_s: vec![time_s], moduli: Moduli::default() };
        lines.push(Line::refused(name, spec.series().map(drop), &[word]));
    }
    Ok(lines)
}
