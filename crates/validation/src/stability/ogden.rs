//! Hard cases of Ogden's law: exponents `alpha` up to 25, and negative moduli `mu`.

use super::lab::{press, scene, solve, tight};
use super::{Hardness, Line, Suite};
use crate::verify::bodies::{everywhere, internal_force};
use crate::verify::{CaseError, Check};
use papilla_fem::element::{Elastic, ElementKind};
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::lattice;
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::solve::{Loading, Options, Problem};
use papilla_fingertip::materials::OgdenSpec;
use papilla_solid::tensor::Kinematics;
use papilla_solid::{Isochoric, Ogden};

pub(super) fn run(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let single = |mu_mpa: &[f64], alpha: &[f64]| OgdenSpec {
        mu_mpa: mu_mpa.to_vec(),
        alpha: alpha.to_vec(),
        poissons_ratio: 0.48,
        calibrated_stretch: [0.67, 1.5],
    };
    let mut lines = Vec::new();
    for (name, spec) in [
        ("published skin", OgdenSpec::skin()),
        ("published fat, mu3 < 0", OgdenSpec::subcutaneous()),
        ("alpha 25", single(&[0.01], &[25.0])),
        ("alpha -25", single(&[0.01], &[-25.0])),
        ("mu < 0, all but unstable at rest", single(&[0.02, -0.0199], &[2.0, -8.0])),
        ("alpha 1000", single(&[0.01], &[1000.0])),
    ] {
        lines.push(anywhere(name, &spec)?);
    }
    lines.extend(strips()?);
    lines.extend(blocks(suite)?);
    lines.extend(people(suite)?);
    let unstable = single(&[0.02, -0.021], &[2.0, -8.0]).law().map(drop);
    lines.push(Line::refused(
        "unstable at rest",
        unstable,
        &["must be positive", "mu0 = sum mu_i"],
    ));
    let endless = single(&[0.02], &[f64::INFINITY]).law().map(drop);
    lines.push(Line::refused("alpha infinite", endless, &["must be finite"]));
    Ok(lines)
}

/// Energy, stress and tangent from 1e-6 to 1e6, uniaxial, planar and equibiaxial.
fn anywhere(name: &str, spec: &OgdenSpec) -> Result<Line, CaseError> {
    let (law, _) = spec.law()?;
    let [low, high] = spec.calibrated_stretch;
    let (mut infinite, mut wrong_flags, mut points) = (0u32, 0u32, 0u32);
    for i in -240..=240 {
        let a = 10f64.powf(f64::from(i) / 40.0);
        for stretches in [[a, a.powf(-0.5), a.powf(-0.5)], [a, 1.0, 1.0 / a], [a, a, a.powi(-2)]] {
            let mut h = [[0.0; 3]; 3];
            for k in 0..3 {
                h[k][k] = stretches[k] - 1.0;
            }
            let k = Kinematics::new(h);
            // Products of stretches round: J of 1e-12 x 1e6 x 1e6 need not be above 0.
            if !(k.j() > 0.5) {
                continue;
            }
            points += 1;
            let stress = law.first_piola(&k);
            let tangent = law.tangent(&k);
            let all = tangent.as_flattened().as_flattened().as_flattened();
            let finite = law.energy(&k).is_finite()
                && stress.as_flattened().iter().all(|v| v.is_finite())
                && all.iter().all(|v| v.is_finite());
            infinite += u32::from(!finite);
            // Within rounding of a bound either answer is right.
            let margin = 1e-9;
            let beyond =
                stretches.iter().any(|l| *l < low * (1.0 - margin) || *l > high * (1.0 + margin));
            let within =
                stretches.iter().all(|l| *l > low * (1.0 + margin) && *l < high * (1.0 - margin));
            let flagged = law.outside_calibration(&k);
            wrong_flags += u32::from((beyond && !flagged) || (within && flagged));
        }
    }
    let count = |what: &str, n: u32, source| Check::vanishes(what, f64::from(n), 0.5, source);
    let checks = vec![
        count("points that overflow", infinite, "stretches 1e-6 to 1e6, three modes"),
        count("points flagged wrongly", wrong_flags, "calibrated stretches"),
        Check::within("points", f64::from(points), [1000.0, 2000.0], "the scan"),
    ];
    Ok(Line::evaluated(format!("law: {name}"), checks))
}

/// A strip in plane strain pulled or squeezed to a stretch, inside and beyond the range.
fn strips() -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    for (name, spec) in [("skin", OgdenSpec::skin()), ("fat", OgdenSpec::subcutaneous())] {
        for stretch in [0.3, 0.6, 0.68, 1.49, 2.0, 5.0] {
            let (law, bulk) = spec.law()?;
            let (problem, loading) = strip(law, bulk, stretch)?;
            let (solver, report) = solve(&problem, loading, tight(), 1)?;
            let force = internal_force(&problem, solver.displacement_mm())?;
            let end = &problem.mesh.node_sets["x_max"];
            let pull: f64 = end.iter().map(|&n| force[3 * n as usize]).sum();
            let corner = problem.mesh.node_sets["z_max"][0] as usize;
            let lateral = 1.0 + solver.displacement_mm()[corner][2];
            let [exact, side] = planar_forces(&law, bulk, stretch, lateral);
            let beyond = !(0.67..=1.5).contains(&stretch);
            let flagged = outside(&problem, solver.displacement_mm());
            let flags = Check::absolute(
                "share flagged",
                flagged,
                f64::from(u8::from(beyond)),
                1e-9,
                "calibrated .67 to 1.5",
            );
            let source = "difference quotient of the energy";
            let mut checks = vec![flags];
            if beyond && spread_mm(&problem, solver.displacement_mm()) > 1e-6 {
                // Far beyond its range the law has several equilibria, and a strip may neck.
                let source = "equilibrium; it necks";
                checks.push(Check::vanishes("residual", report.residual_relative, 1e-9, source));
            } else {
                checks.push(Check::relative("force", pull, exact, 1e-7, source));
                checks.push(Check::vanishes(
                    "free side's force / force",
                    side / exact,
                    1e-7,
                    source,
                ));
            }
            let hard = Hardness { outside_calibration: flagged, ..(&report).into() };
            lines.push(Line::converged(format!("strip of {name} to {stretch}"), hard, checks));
        }
    }
    Ok(lines)
}

/// How unevenly the free side moves, mm.
fn spread_mm(problem: &Problem, u: &[[f64; 3]]) -> f64 {
    let side = || problem.mesh.node_sets["z_max"].iter().map(|&n| u[n as usize][2]);
    side().fold(f64::NEG_INFINITY, f64::max) - side().fold(f64::INFINITY, f64::min)
}

/// A 1 mm cube whose y is held, z free, x prescribed.
fn strip(law: Ogden, bulk: f64, stretch: f64) -> Result<(Problem, Loading), CaseError> {
    let axis = even(1.0, 2);
    let mesh = lattice(ElementKind::Hex8, [axis.clone(), axis.clone(), axis], |p| p);
    let along = [true, false, false];
    let across = [false, true, false];
    let sets = [
        ("x_min", along),
        ("x_max", along),
        ("y_min", across),
        ("y_max", across),
        ("z_min", [false, false, true]),
    ];
    let fixed = hold(&mesh, &sets);
    let prescribed_mm = prescribe(&mesh, &fixed, |x| [(stretch - 1.0) * x[0], 0.0, 0.0]);
    let solid = Elastic::shared(law, bulk);
    let problem = Problem::new(mesh, everywhere(solid.clone()), fixed, None)?;
    Ok((problem, Loading { prescribed_mm, ..Loading::default() }))
}

/// Share of the volume outside the calibrated range.
fn outside(problem: &Problem, u: &[[f64; 3]]) -> f64 {
    let (mut out, mut all) = (0.0, 0.0);
    for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
        for e in 0..block.len() {
            let local: Vec<_> = block.element(e).iter().map(|&n| u[n as usize]).collect();
            let g = geometry.element(e);
            for (gradients, w) in g.gradients.chunks_exact(block.kind.nodes()).zip(g.weights) {
                let h = papilla_fem::element::geometry::displacement_gradient(&local, gradients);
                let solid = &problem.materials[block.region[e]];
                all += w;
                out += if solid.outside_calibration(&Kinematics::new(h)) { *w } else { 0.0 };
            }
        }
    }
    out / all
}

/// Forces on the strip along x and on its free side by differences of the energy alone, at
/// the stretches `a` along x and `b` along z. (Far out several `b` are in equilibrium.)
fn planar_forces(law: &Ogden, bulk: f64, a: f64, b: f64) -> [f64; 2] {
    let energy = |a: f64, b: f64| {
        let k = Kinematics::new([[a - 1.0, 0.0, 0.0], [0.0; 3], [0.0, 0.0, b - 1.0]]);
        law.energy(&k) + 0.5 * bulk * k.j_minus_1 * k.j_minus_1
    };
    let slope = |f: &dyn Fn(f64) -> f64, x: f64| {
        // Fifth-order central difference.
        let h = 1e-3 * x;
        (f(x - 2.0 * h) - 8.0 * f(x - h) + 8.0 * f(x + h) - f(x + 2.0 * h)) / (12.0 * h)
    };
    [slope(&|a| energy(a, b), a), slope(&|b| energy(a, b), b)]
}

/// Blocks of the published laws squeezed far beyond their range by a small ball.
fn blocks(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    let all = [("dermis", 1.0), ("subcutaneous", 1.0), ("subcutaneous", 1.4)];
    for (tissue, depth) in all.into_iter().take(if suite.quick() { 1 } else { 3 }) {
        let text = format!(
            "effects = [\"finite_strain\", \"layers\", \"hyperelastic\"]
            [geometry]
            kind = \"block\"
            size_mm = [6.0, 6.0]
            elements = [8, 8]
            layers = [{{ tissue = \"{tissue}\", thickness_mm = 2.0, elements = 3 }}]
            [indenter]
            shape = \"sphere\"
            radius_mm = 1.5
            [motion]
            depth_mm = {depth:?}
            increments = 5"
        );
        let variant = format!("block of {tissue}, {depth} mm");
        lines.push(match press(&scene(&text)?, Options::default()) {
            Ok(pressed) => {
                let share = pressed.record.outside_calibration;
                let flag = Check::within("share flagged", share, [1e-3, 0.6], "squeezed past .67");
                pressed.line(variant, vec![flag])
            }
            // Squeezed to 30 % of its height by a ball smaller than it is thick.
            refused if depth > 1.2 => {
                Line::refused(variant, refused.map(drop), &["no equilibrium beyond"])
            }
            Err(error) => return Err(error.into()),
        });
    }
    Ok(lines)
}

/// The set `people`: a block of its fat squeezed to half its height, and the finger under a plate to
/// 10 N, from below and inclined.
fn people(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let set = "effects = [\"finite_strain\", \"layers\", \"hyperelastic\"]
        [materials]
        set = \"people\"";
    let block = format!(
        "{set}
        [geometry]
        kind = \"block\"
        size_mm = [6.0, 6.0]
        elements = [8, 8]
        layers = [{{ tissue = \"subcutaneous\", thickness_mm = 2.0, elements = 3 }}]
        [indenter]
        shape = \"sphere\"
        radius_mm = 1.5
        [motion]
        depth_mm = 1.0
        increments = 5"
    );
    let pressed = press(&scene(&block)?, Options::default())?;
    let mut lines = vec![pressed.line("block of the fat of `people`, 1 mm", Vec::new())];
    for pitch in if suite.quick() { &[][..] } else { &[0.0, 30.0][..] } {
        let finger = format!(
            "{set}
            [geometry]
            kind = \"fingertip\"
            density = \"coarse\"
            order = \"linear\"
            [indenter]
            shape = \"plate\"
            size_mm = [30.0, 30.0]
            [motion]
            force_n = 10.0
            increments = 4
            pitch_deg = {pitch:?}"
        );
        let pressed = press(&scene(&finger)?, Options::default())?;
        let force =
            Check::relative("force, N", pressed.force_n(), 10.0, 1e-3, "what was asked for");
        lines.push(pressed.line(format!("`people`, plate at {pitch} deg to 10 N"), vec![force]));
    }
    Ok(lines)
}
