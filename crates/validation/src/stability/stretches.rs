//! Equal and nearly equal principal stretches.

use super::{Line, Suite};
use crate::verify::{CaseError, Check};
use papilla_fingertip::materials::OgdenSpec;
use papilla_solid::tensor::{Kinematics, Mat3, Tensor4, product};
use papilla_solid::{Isochoric, NeoHookean, Ogden, OgdenTerm};

const GAPS: [f64; 12] =
    [0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6];

pub(super) fn run(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = vec![against_neo_hookean()];
    for (name, spec) in [("skin", OgdenSpec::skin()), ("fat", OgdenSpec::subcutaneous())] {
        let (law, _) = spec.law()?;
        // Within the calibrated stretches the law is smooth: its limit is approached as the
        // gap, times what the tangent changes by.
        lines.push(against_limit(name, &law));
    }
    Ok(lines)
}

/// A stretch with the principal values `1 + s` and a rotation of the whole.
fn gradient(s: [f64; 3]) -> Mat3 {
    let (sin, cos) = 0.7f64.sin_cos();
    let axes = [[cos, sin, 0.0], [-sin * cos, cos * cos, sin], [sin * sin, -sin * cos, cos]];
    let stretch: Mat3 = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|a| s[a] * axes[a][i] * axes[a][j]).sum())
    });
    let turn = [[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]];
    // R (I + S) - I.
    let mut h = product(&turn, &stretch);
    for i in 0..3 {
        for j in 0..3 {
            h[i][j] += turn[i][j] - f64::from(u8::from(i == j));
        }
    }
    h
}

/// Two and three stretches that nearly agree, at rest and far from it.
fn states(gap: f64) -> Vec<Mat3> {
    let bases = [[0.0, 0.0], [0.2, -0.1], [-0.25, 0.3], [0.3, 0.3]];
    bases
        .iter()
        .flat_map(|&[s, t]| [[s, s + gap, t], [s, s + gap, s - gap]])
        .map(gradient)
        .collect()
}

fn stress_difference(a: &Mat3, b: &Mat3) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(x, y)| (x - y).abs()).fold(0.0, worse)
}

fn tangent_difference(a: &Tensor4, b: &Tensor4) -> f64 {
    let flat = |t: &Tensor4| t.as_flattened().as_flattened().as_flattened().to_vec();
    flat(a).iter().zip(flat(b)).map(|(x, y)| (x - y).abs()).fold(0.0, worse)
}

/// Larger, and a NaN if there is one.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}

/// One Ogden term of alpha = 2 is the neo-Hookean law, which is written without stretches.
fn against_neo_hookean() -> Line {
    let mu_mpa = 0.7;
    let ogden = Ogden::new(&[OgdenTerm { mu_mpa, alpha: 2.0 }], [0.1, 10.0]);
    let neo = NeoHookean { mu_mpa };
    let (mut stress, mut tangent) = (0.0, 0.0);
    for gap in GAPS {
        for h in states(gap) {
            let k = Kinematics::new(h);
            stress = worse(stress, stress_difference(&ogden.first_piola(&k), &neo.first_piola(&k)));
            tangent = worse(tangent, tangent_difference(&ogden.tangent(&k), &neo.tangent(&k)));
        }
    }
    let source = "neo-Hookean law, without principal stretches";
    let checks = vec![
        Check::vanishes("stress / mu", stress / mu_mpa, 1e-14, source),
        Check::vanishes("tangent / mu", tangent / mu_mpa, 1e-13, source),
    ];
    Line::evaluated("alpha = 2, gaps 0 to 1e-6", checks)
}

/// What is left of the difference to equal stretches once the gap's own effect is taken out.
fn against_limit(name: &str, law: &Ogden) -> Line {
    let mu = law.shear_modulus_mpa();
    let (mut stress, mut tangent) = (0.0, 0.0);
    let limits = states(0.0);
    for gap in GAPS {
        for (h, limit) in states(gap).into_iter().zip(&limits) {
            let (k, l) = (Kinematics::new(h), Kinematics::new(*limit));
            let rate = law
                .tangent(&l)
                .as_flattened()
                .as_flattened()
                .as_flattened()
                .iter()
                .fold(0.0f64, |m, v| m.max(v.abs()));
            let moved = stress_difference(&h, limit);
            // A change of strain changes the stress by the tangent, and the tangent by alpha
            // times itself.
            let slack = |order: f64| 10.0 * order * rate * moved;
            let p = stress_difference(&law.first_piola(&k), &law.first_piola(&l));
            let a = tangent_difference(&law.tangent(&k), &law.tangent(&l));
            stress = worse(stress, (p - slack(1.0)).max(0.0) + if p.is_nan() { p } else { 0.0 });
            tangent = worse(tangent, (a - slack(30.0)).max(0.0) + if a.is_nan() { a } else { 0.0 });
        }
    }
    let source = "the limit of equal stretches";
    let checks = vec![
        Check::vanishes("stress / mu beyond the gap's", stress / mu, 1e-12, source),
        Check::vanishes("tangent / mu beyond the gap's", tangent / mu, 1e-11, source),
    ];
    Line::evaluated(format!("published {name}, gaps 0 to 1e-6"), checks)
}
