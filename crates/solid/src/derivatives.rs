//! Every law: stress and tangent against differences of the energy.

use super::*;
use proptest::prelude::*;

fn perturbed(h: &Mat3, k: usize, l: usize, d: f64) -> Kinematics {
    let mut q = *h;
    q[k][l] += d;
    Kinematics::new(q)
}

/// Stress against the energy's and tangent against the stress's central
/// difference, for one displacement gradient.
fn check<M: Isochoric>(m: &M, h: Mat3) {
    let k0 = Kinematics::new(h);
    if k0.j() < 0.02 {
        return;
    }
    let d = 1e-5 * k0.j().min(1.0);
    let p = m.first_piola(&k0);
    let a = m.tangent(&k0);
    let scale =
        a.as_flattened().as_flattened().as_flattened().iter().fold(0.0f64, |s, x| s.max(x.abs()));
    for k in 0..3 {
        for l in 0..3 {
            let (plus, minus) = (perturbed(&h, k, l, d), perturbed(&h, k, l, -d));
            let dp = (m.energy(&plus) - m.energy(&minus)) / (2.0 * d);
            assert!((dp - p[k][l]).abs() < 1e-6 * scale, "stress {k}{l}: {dp} {}", p[k][l]);
            let (pp, pm) = (m.first_piola(&plus), m.first_piola(&minus));
            for i in 0..3 {
                for j in 0..3 {
                    let da = (pp[i][j] - pm[i][j]) / (2.0 * d);
                    assert!(
                        (da - a[i][j][k][l]).abs() < 1e-5 * scale,
                        "tangent {i}{j}{k}{l}: {da} {} of {scale}",
                        a[i][j][k][l]
                    );
                    assert!((a[i][j][k][l] - a[k][l][i][j]).abs() <= 1e-11 * scale, "symmetry");
                }
            }
        }
    }
}

fn published(mu_mpa: [f64; 3], alpha: [f64; 3], calibrated_stretch: [f64; 2]) -> Ogden {
    let terms: Vec<_> =
        mu_mpa.into_iter().zip(alpha).map(|(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha }).collect();
    Ogden::new(&terms, calibrated_stretch)
}

/// Chen, Shuai & Zhu's skin. Differences across a bound would see the jump of the curvature.
fn skin() -> Ogden {
    published([2.3583e-2, 4.5408e-5, 4.0878e-2], [-2.0623, 25.0, -3.4784], [0.1, 10.0])
}

/// Chen, Shuai & Zhu's fat, which loses ellipticity, everywhere on its continuation or inside it.
fn fat() -> Ogden {
    let calibrated_stretch = [0.999_999, 1.000_001];
    published([6.3754e-3, 1.8874e-4, -3.7709e-4], [1.3416, 25.0, -7.8571], calibrated_stretch)
}

fn relaxing<L: Isochoric>(law: L) -> Relaxing<L> {
    let series =
        Prony::new(&[PronyTerm { share: 0.3, time_s: 0.5 }, PronyTerm { share: 0.2, time_s: 5.0 }]);
    let mut history = vec![0.0; series.history_len()];
    let before = Kinematics::new([[0.1, 0.05, 0.0], [-0.02, -0.1, 0.03], [0.0, 0.1, 0.05]]);
    prony::advance(&law, &series, &before, 0.2, &mut history);
    Relaxing::new(law, &series, &history, 0.4)
}

/// A symmetric stretch with principal values `1 + s` turned about two axes.
fn stretched(s: [f64; 3], angle: f64) -> Mat3 {
    let (sin, cos) = angle.sin_cos();
    let axes = [[cos, sin, 0.0], [-sin * cos, cos * cos, sin], [sin * sin, -sin * cos, cos]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|a| s[a] * axes[a][i] * axes[a][j]).sum())
    })
}

macro_rules! derivative_tests {
    ($($name:ident => $law:expr),* $(,)?) => {$(
        mod $name {
            use super::*;

            proptest! {
                #[test]
                fn anywhere(v in prop::array::uniform9(-0.25f64..0.25)) {
                    check(&$law, [[v[0], v[1], v[2]], [v[3], v[4], v[5]], [v[6], v[7], v[8]]]);
                }

                /// Principal stretches that differ by 0, 1e-16 ... 1e-4.
                #[test]
                fn at_equal_stretches(s in -0.2f64..0.3, t in -0.2f64..0.3, digits in 3i32..17, angle in 0.0f64..3.0) {
                    let gap = if digits == 16 { 0.0 } else { 10f64.powi(-digits) };
                    check(&$law, stretched([s, s + gap, t], angle));
                    check(&$law, stretched([s, s + gap, s - gap], angle));
                }
            }

            #[test]
            fn nearly_flat_and_at_rest() {
                check(&$law, [[-0.9, 0.0, 0.0], [0.0, 0.1, 0.02], [0.0, 0.0, 0.0]]);
                check(&$law, [[0.0; 3]; 3]);
            }
        }
    )*};
}

derivative_tests! {
    neo_hookean => NeoHookean { mu_mpa: 0.7 },
    linear => LinearElastic { mu_mpa: 0.7 },
    ogden => skin(),
    ogden_continued => fat(),
    relaxing_neo_hookean => relaxing(NeoHookean { mu_mpa: 0.7 }),
    relaxing_ogden => relaxing(skin()),
    relaxing_linear => relaxing(LinearElastic { mu_mpa: 0.7 }),
}
