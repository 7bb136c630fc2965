//! Contact that comes, goes, grazes, starts far off or too near.

use super::lab::{Pressed, press, scene, solve, tight};
use super::{Hardness, Line, Suite};
use crate::verify::{CaseError, Check};
use papilla_fem::solve::{Loading, MovingIndenter, Options, Solver, StepReport};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_sdf::{Placement, Sphere, first_touch_travel};

/// A layered block under a sphere.
fn block(motion: &str) -> String {
    format!(
        "[geometry]
        kind = \"block\"
        size_mm = [6.0, 6.0]
        elements = [8, 8]
        layers = [{{ tissue = \"dermis\", thickness_mm = 1.0, elements = 2 }},
                  {{ tissue = \"subcutaneous\", thickness_mm = 2.0, elements = 2 }}]
        [indenter]
        shape = \"sphere\"
        radius_mm = 4.0
        [motion]
        {motion}"
    )
}

/// Largest displacement of a node, mm.
fn largest_mm(solver: &Solver<'_>) -> f64 {
    solver.displacement_mm().iter().map(|u| papilla_vector::norm(*u)).fold(0.0, f64::max)
}

/// Relative L2 difference of displacements.
fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    papilla_fingertip::simulation::record::relative_l2(a.as_flattened(), b.as_flattened())
}

pub(super) fn lost_and_regained(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    let text = block(
        "path = [{ time_s = 1.0, depth_mm = 0.5 }, { time_s = 2.0, depth_mm = -0.5 },
                 { time_s = 3.0, depth_mm = 0.5 }]",
    );
    let Simulation { body, approach, .. } = Simulation::new(&scene(&text)?)?;
    lines.extend(cycle("block", &body, &approach, 0.5)?);
    if suite.quick() {
        return Ok(lines);
    }
    lines.extend(cycle("finger", suite.finger()?, &Approach::plate(Default::default()), 1.0)?);
    Ok(lines)
}

/// Down, up past first touch, down again.
fn cycle(
    name: &str,
    body: &Body,
    approach: &Approach,
    depth_mm: f64,
) -> Result<Vec<Line>, CaseError> {
    let point = |time_s, depth_mm| papilla_fingertip::simulation::drive::DrivePoint {
        time_s,
        depth_mm,
        shift_mm: [0.0; 2],
    };
    let way = [depth_mm, 0.0, -0.5, 0.0, depth_mm];
    let drive = Drive::Path(way.iter().zip(1..).map(|(&d, t)| point(f64::from(t), d)).collect());
    let mut solver = body.solver(tight())?;
    let mut states = Vec::new();
    body.press(&mut solver, approach, &drive, 1, &mut |s, record, report| {
        states.push((
            Pressed { record: record.clone(), report: *report },
            s.displacement_mm().to_vec(),
            largest_mm(s),
        ));
    })?;
    let [(first, before, deep), _, (apart, _, left), _, (again, after, _)] = &states[..] else {
        return Err("five states were due".into());
    };
    let rest = vec![
        Check::vanishes("force, N", apart.force_n(), f64::MIN_POSITIVE, "nothing touches"),
        Check::vanishes("displacement left / deepest", left / deep, 1e-9, "a body at rest"),
        Check::vanishes(
            "stored energy, mJ",
            apart.report.stored_mj / first.report.stored_mj,
            1e-12,
            "a body at rest",
        ),
        Check::vanishes("residual", apart.record.checks.residual_relative, 1e-5, "equilibrium"),
        Check::vanishes(
            "energy against work",
            apart.record.checks.energy_vs_work,
            0.1,
            "what went in came out",
        ),
    ];
    let same = vec![
        Check::vanishes(
            "displacement, L2",
            difference(after, before),
            1e-6,
            "the first indentation",
        ),
        Check::relative("force", again.force_n(), first.force_n(), 1e-6, "the first indentation"),
    ];
    Ok(vec![
        Line::converged(format!("{name}: lifted off"), apart.hardness(), rest),
        Line::converged(format!("{name}: pressed again"), again.hardness(), same),
    ])
}

pub(super) fn grazing(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    // The sphere's axis over the corner node of the block: one face and a point of it.
    let at_corner = |depth: f64| {
        block(&format!("depth_mm = {depth:?}\nincrements = 1\noffset_mm = [-3.0, -3.0]"))
    };
    let options = Options { gap_tolerance_mm: 1e-11, ..tight() };
    let slight = press(&scene(&at_corner(1e-6))?, options)?;
    let double = press(&scene(&at_corner(2e-6))?, options)?;
    let ratio = double.force_n() / slight.force_n();
    let ratio = Check::relative(
        "force of twice the graze / force",
        ratio,
        2.0,
        0.01,
        "one node: a linear spring",
    );
    lines.push(Line::converged("1e-6 mm on a corner", slight.hardness(), vec![ratio]));
    let shallow = press(&scene(&at_corner(0.05))?, tight())?;
    lines.push(shallow.line("0.05 mm on a corner", Vec::new()));
    // An edge of a plate over the last row of nodes.
    let row = block("depth_mm = 0.05\nincrements = 2\noffset_mm = [12.9, 0.0]").replace(
        "shape = \"sphere\"\n        radius_mm = 4.0",
        "shape = \"plate\"\n        size_mm = [20.0, 20.0]\n        edge_radius_mm = 0.5",
    );
    let pressed = press(&scene(&row)?, tight())?;
    let side = pressed.record.force_n[1] / pressed.force_n();
    let side = Check::vanishes("force along the edge / force", side, 1e-6, "symmetry");
    lines.push(pressed.line("a plate's edge on the last row", vec![side]));
    Ok(lines)
}

/// A sphere that starts `gap_mm` off the block (inside, if below 0) and ends 0.5 mm deep.
fn from_gap(
    body: &Body,
    approach: &Approach,
    gap_mm: f64,
) -> Result<(Vec<[f64; 3]>, StepReport, f64), CaseError> {
    const DEPTH_MM: f64 = 0.5;
    let at_touch = body.indenter(approach, &Drive::Depths(vec![DEPTH_MM]))?;
    let [_, _, along] = at_touch.offset_mm(1.0);
    let mut start = at_touch.start;
    start.origin_mm[2] -= gap_mm * along.signum();
    let travel = [0.0, 0.0, (DEPTH_MM + gap_mm) * along.signum()];
    let indenter = MovingIndenter::straight(at_touch.shape, start, travel);
    let loading = Loading { indenter: Some(indenter), ..Loading::default() };
    let (solver, report) = solve(&body.problem, loading, tight(), 1)?;
    let force = solver.balance().contact_force_n;
    Ok((solver.displacement_mm().to_vec(), report, papilla_vector::norm(force)))
}

pub(super) fn gaps(_: &Suite) -> Result<Vec<Line>, CaseError> {
    against_touch(&[("1e-9 mm", 1e-9), ("5 mm", 5.0), ("100 mm", 100.0)])
}

fn against_touch(gaps: &[(&str, f64)]) -> Result<Vec<Line>, CaseError> {
    let Simulation { body, approach, .. } = Simulation::new(&scene(&block("depth_mm = 0.5"))?)?;
    let (due, _, due_n) = from_gap(&body, &approach, 0.0)?;
    let mut lines = Vec::new();
    for &(name, gap) in gaps {
        let (found, report, force) = from_gap(&body, &approach, gap)?;
        let source = "the indentation from first touch";
        let checks = vec![
            Check::vanishes("displacement, L2", difference(&found, &due), 1e-6, source),
            Check::relative("force", force, due_n, 1e-6, source),
        ];
        lines.push(Line::converged(name, Hardness::from(&report), checks));
    }
    Ok(lines)
}

pub(super) fn penetration(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines =
        against_touch(&[("starts .1 mm inside", -0.1), ("starts .45 mm inside", -0.45)])?;
    let inside =
        block("path = [{ time_s = 0.0, depth_mm = 0.3 }, { time_s = 1.0, depth_mm = 0.5 }]");
    let words = &["motion.path[0].depth_mm", "inside the finger"];
    lines.push(Line::refused("a scene's path from inside", scene(&inside).map(drop), words));
    let sphere = Sphere { radius_mm: 4.0 };
    let start = Placement::turned(0.0, 0.0, 0.0, [0.0; 3]);
    let along = [0.0, 0.0, 1.0];
    let found = first_touch_travel(&sphere, &start, along, &[[0.0, 0.0, 3.5], [0.0, 0.0, 5.0]])
        .map_err(IndenterError::from);
    let words = &["starts 5.000e-1 mm inside the body", "move it back"];
    lines.push(Line::refused("looking for first touch from inside", found, words));
    Ok(lines)
}
