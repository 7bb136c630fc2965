//! Ogden's law in Abaqus' convention, with a continuation outside the stretches
//! it was fitted to.
//!
//! `U = sum_p 2 mu_p / alpha_p^2 (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3)` of the
//! isochoric principal stretches `l_a = J^(-1/3) lambda_a`. With `y_a = ln l_a` it is
//! `U = sum_a w(y_a)`, a function of one variable (Valanis & Landel 1967), and all
//! derivatives follow from `w', w''`. Outside `[y_min, y_max]` the law goes on as the
//! parabola in `y` that has its value, slope and curvature at the bound (the curvature at
//! least a small positive one): stress is C1, and `alpha = 25` cannot overflow.

use super::Isochoric;
use crate::tensor::{Kinematics, Mat3, Tensor4, eigen};

/// Most terms of a law.
const TERMS_MAX: usize = 6;

/// One term of an Ogden law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OgdenTerm {
    /// Modulus `mu_p`, MPa; may be negative.
    pub mu_mpa: f64,
    /// Exponent `alpha_p`, not 0.
    pub alpha: f64,
}

/// Ogden's law of up to [`Self::TERMS_MAX`] terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ogden {
    terms: [OgdenTerm; TERMS_MAX],
    count: usize,
    /// Logarithms of the least and the largest calibrated stretch.
    range: [f64; 2],
    /// Value, slope and curvature of `w` at both bounds.
    bounds: [[f64; 3]; 2],
}

/// Least principal Green strain that has a finite logarithm of the stretch.
const STRAIN_MIN: f64 = -0.5 + 0.5 * f64::EPSILON;

/// Share of the modulus at rest that the continuation's curvature has at least.
const CURVATURE_MIN: f64 = 1e-2;

impl Ogden {
    /// Most terms.
    pub const TERMS_MAX: usize = TERMS_MAX;

    /// A law that holds for isochoric principal stretches in `calibrated`.
    /// Terms beyond [`Self::TERMS_MAX`] must not be given.
    ///
    /// # Panics
    /// With more than [`Self::TERMS_MAX`] terms.
    #[must_use]
    pub fn new(given: &[OgdenTerm], calibrated: [f64; 2]) -> Self {
        assert!(given.len() <= TERMS_MAX, "at most {TERMS_MAX} terms");
        let mut terms = [OgdenTerm::default(); TERMS_MAX];
        terms[..given.len()].copy_from_slice(given);
        let range = calibrated.map(f64::ln);
        let mut law = Self { terms, count: given.len(), range, bounds: [[0.0; 3]; 2] };
        // At rest w'' = 2 mu0. The floor keeps the continuation convex where a
        // negative mu has made the law concave.
        let floor = CURVATURE_MIN * 2.0 * law.shear_modulus_mpa().abs();
        law.bounds = range.map(|y| {
            let [value, slope, curvature] = law.inside(y);
            [value, slope, curvature.max(floor)]
        });
        law
    }

    fn terms(&self) -> &[OgdenTerm] {
        &self.terms[..self.count]
    }

    /// `w(y)` less its linear part, `w'(y) - w'(0)` and `w''(y)`. The linear part
    /// adds nothing to a sum over `y_a` that adds up to zero.
    fn inside(&self, y: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for t in self.terms() {
            let z = t.alpha * y;
            let c = 2.0 * t.mu_mpa / t.alpha;
            let less_one = z.exp_m1();
            sum[0] += c / t.alpha * exp_remainder(z, less_one);
            sum[1] += c * less_one;
            sum[2] += c * t.alpha * z.exp();
        }
        sum
    }

    /// The same with the continuation.
    fn everywhere(&self, y: f64) -> [f64; 3] {
        let side = if y < self.range[0] {
            0
        } else if y > self.range[1] {
            1
        } else {
            return self.inside(y);
        };
        let [value, slope, curvature] = self.bounds[side];
        let d = y - self.range[side];
        [value + d * (slope + 0.5 * curvature * d), slope + curvature * d, curvature]
    }

    /// `(w'(b) - w'(a)) / (b - a)`, also for equal and nearly equal arguments.
    fn divided_difference(&self, a: f64, b: f64) -> f64 {
        let within = |y: f64| y >= self.range[0] && y <= self.range[1];
        let (middle, d) = (0.5 * (a + b), b - a);
        if within(a) && within(b) {
            // e^(alpha b) - e^(alpha a) = 2 e^(alpha (a + b) / 2) sinh(alpha (b - a) / 2),
            // accurate however small the difference.
            return self
                .terms()
                .iter()
                .map(|t| {
                    let half = 0.5 * t.alpha * d;
                    let ratio = if half == 0.0 { 1.0 } else { half.sinh() / half };
                    2.0 * t.mu_mpa * (t.alpha * middle).exp() * ratio
                })
                .sum();
        }
        // On and beyond a bound w' is C0 and nearly linear: the secant loses
        // digits as d shrinks, the slope is off by O(d).
        if d.abs() > 1e-7 {
            (self.everywhere(b)[1] - self.everywhere(a)[1]) / d
        } else {
            self.everywhere(middle)[2]
        }
    }

    /// Principal frame of the deformation.
    #[inline(always)]
    fn principal(&self, k: &Kinematics) -> Principal {
        let (strain, axes) = eigen::symmetric(&k.green_strain());
        // A stretch below 1e-8 is not told from 0 by its Green strain, -1/2; its logarithm
        // would be infinite. A NaN stays one.
        let told = |e: f64| if e < STRAIN_MIN { STRAIN_MIN } else { e };
        let strain = strain.map(told);
        let x = strain.map(|e| 0.5 * (2.0 * e).ln_1p());
        let mean = k.j_minus_1.ln_1p() / 3.0;
        let y = x.map(|v| v - mean);
        let w = y.map(|v| self.everywhere(v));
        let third = (w[0][1] + w[1][1] + w[2][1]) / 3.0;
        let slope = w.map(|v| v[1] - third);
        Principal {
            axes,
            x,
            per_square: strain.map(|e| 1.0 / (1.0 + 2.0 * e)),
            y,
            energy: w[0][0] + w[1][0] + w[2][0],
            slope,
            curvature: w.map(|v| v[2]),
        }
    }
}

/// Principal axes of `C` and what the law says along them.
struct Principal {
    /// Unit vectors `N_a`, one a row.
    axes: Mat3,
    /// `ln lambda_a`.
    x: [f64; 3],
    /// `1 / lambda_a^2`.
    per_square: [f64; 3],
    /// `ln l_a`.
    y: [f64; 3],
    /// Energy density, MPa.
    energy: f64,
    /// `T_a = w'(y_a) - mean w'`: principal Kirchhoff stress, MPa.
    slope: [f64; 3],
    /// `w''(y_a)`, MPa.
    curvature: [f64; 3],
}

impl Principal {
    /// `F N_a`, one a row.
    fn pushed(&self, f: &Mat3) -> Mat3 {
        self.axes.map(|n| std::array::from_fn(|i| f[i][0] * n[0] + f[i][1] * n[1] + f[i][2] * n[2]))
    }

    /// `P = F S`.
    fn first_piola(&self, f: &Mat3) -> Mat3 {
        let (s, f) = (self.second_piola(), self.pushed(f));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|a| s[a] * f[a][i] * self.axes[a][j]).sum())
        })
    }

    /// Principal second Piola-Kirchhoff stress, `S_a = T_a / lambda_a^2`.
    fn second_piola(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.per_square[a] * self.slope[a])
    }

    /// `2 dS_a / dC_b`: with `dT_a/dx_b = sum_c P_ac w''_c P_cb`, `P = I - 1/3`.
    fn normal_tangent(&self) -> Mat3 {
        let p = |a: usize, b: usize| if a == b { 2.0 / 3.0 } else { -1.0 / 3.0 };
        std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let mut d: f64 = (0..3).map(|c| p(a, c) * self.curvature[c] * p(c, b)).sum();
                if a == b {
                    d -= 2.0 * self.slope[a];
                }
                self.per_square[a] * self.per_square[b] * d
            })
        })
    }

    /// `(S_b - S_a) / (C_b - C_a)`. With `d = x_b - x_a` and the mean `m` of `x` it is
    /// `e^(-4 m) [ (T_b - T_a) coth d - (T_a + T_b) ] / 2`, exact for `d = 0`
    /// too once `T_b - T_a` is written as a divided difference.
    fn shear_tangent(&self, law: &Ogden, a: usize, b: usize) -> f64 {
        let d = self.x[b] - self.x[a];
        // d coth d.
        let ratio = if d == 0.0 { 1.0 } else { d / d.tanh() };
        let secant = law.divided_difference(self.y[a], self.y[b]);
        let scale = 0.5 * self.per_square[a] * self.per_square[b];
        scale * (secant * ratio - (self.slope[a] + self.slope[b]))
    }
}

impl Isochoric for Ogden {
    const FINITE: bool = true;

    fn energy(&self, k: &Kinematics) -> f64 {
        self.principal(k).energy
    }

    /// `P = F S`, `S = sum_a S_a N_a (x) N_a`.
    fn first_piola(&self, k: &Kinematics) -> Mat3 {
        self.principal(k).first_piola(&k.f)
    }

    #[inline(always)]
    fn energy_and_first_piola(&self, k: &Kinematics) -> (f64, Mat3) {
        let p = self.principal(k);
        (p.energy, p.first_piola(&k.f))
    }

    /// `A_iJkL = delta_ik S_JL + F_iM C_MJNL F_kN` with the spectral form of `C`
    /// (Holzapfel 2000, eq. 6.180). Of the dyads `D_ab = F N_a (x) N_b` the second part is
    /// `sum_ab n_ab D_aa (x) D_bb + sum_(a < b) s_ab (D_ab + D_ba) (x) (D_ab + D_ba)`: six products.
    #[inline(always)]
    fn tangent(&self, k: &Kinematics) -> Tensor4 {
        let p = self.principal(k);
        let (s, f, n) = (p.second_piola(), p.pushed(&k.f), &p.axes);
        let dyad = |a: usize, b: usize| -> [f64; 9] {
            std::array::from_fn(|ij| f[a][ij / 3] * n[b][ij % 3])
        };
        let own = [dyad(0, 0), dyad(1, 1), dyad(2, 2)];
        let mut t = [[0.0; 9]; 9];
        let mut add = |left: &[f64; 9], right: &[f64; 9]| {
            for (row, l) in t.iter_mut().zip(left) {
                row.iter_mut().zip(right).for_each(|(t, r)| *t += l * r);
            }
        };
        for (own_a, [x, y, z]) in own.iter().zip(p.normal_tangent()) {
            let right = std::array::from_fn(|i| x * own[0][i] + y * own[1][i] + z * own[2][i]);
            add(own_a, &right);
        }
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            let (ab, ba) = (dyad(a, b), dyad(b, a));
            let both: [f64; 9] = std::array::from_fn(|i| ab[i] + ba[i]);
            let shear = p.shear_tangent(self, a, b);
            add(&both, &both.map(|v| shear * v));
        }
        let stress = |j: usize, l: usize| (0..3).map(|a| s[a] * n[a][j] * n[a][l]).sum::<f64>();
        let second: Mat3 = std::array::from_fn(|j| std::array::from_fn(|l| stress(j, l)));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                std::array::from_fn(|kk| {
                    std::array::from_fn(|l| {
                        let geometric = if i == kk { second[j][l] } else { 0.0 };
                        t[3 * i + j][3 * kk + l] + geometric
                    })
                })
            })
        })
    }

    /// `mu0 = sum mu_p`.
    fn shear_modulus_mpa(&self) -> f64 {
        self.terms().iter().map(|t| t.mu_mpa).sum()
    }

    fn outside_calibration(&self, k: &Kinematics) -> bool {
        self.principal(k).y.iter().any(|y| *y < self.range[0] || *y > self.range[1])
    }
}

/// `e^z - 1 - z` without cancellation near `z = 0`, of `z` and `e^z - 1`.
fn exp_remainder(z: f64, less_one: f64) -> f64 {
    if z.abs() < 0.1 {
        // Taylor series; the first term left out is below 1e-19 of the sum.
        let mut term = 0.5 * z * z;
        let mut sum = term;
        for n in 3..14 {
            term *= z / f64::from(n);
            sum += term;
        }
        sum
    } else {
        less_one - z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NeoHookean;

    fn skin() -> Ogden {
        let term = |alpha, mu_mpa| OgdenTerm { mu_mpa, alpha };
        Ogden::new(
            &[term(-2.0623, 2.3583e-2), term(25.0, 4.5408e-5), term(-3.4784, 4.0878e-2)],
            [0.6, 1.6],
        )
    }

    #[test]
    fn two_terms_of_alpha_two_are_neo_hookean() {
        let ogden = Ogden::new(&[OgdenTerm { mu_mpa: 0.7, alpha: 2.0 }], [0.1, 10.0]);
        let neo = NeoHookean { mu_mpa: 0.7 };
        for h in [
            [[0.2, 0.1, -0.05], [0.0, -0.1, 0.3], [0.07, 0.0, 0.1]],
            [[1e-9, 2e-9, 0.0], [0.0, -1e-9, 0.0], [0.0, 0.0, 0.0]],
            [[0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.3]],
        ] {
            let k = Kinematics::new(h);
            let (a, b) = (ogden.energy(&k), neo.energy(&k));
            assert!((a - b).abs() <= 1e-7 * b + 1e-15 * neo.mu_mpa, "{a} {b}");
            let (p, q) = (ogden.first_piola(&k), neo.first_piola(&k));
            let (s, t) = (ogden.tangent(&k), neo.tangent(&k));
            for i in 0..3 {
                for j in 0..3 {
                    assert!((p[i][j] - q[i][j]).abs() < 1e-14, "{p:?} {q:?}");
                    for l in 0..3 {
                        for m in 0..3 {
                            assert!((s[i][j][l][m] - t[i][j][l][m]).abs() < 1e-13);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_overflows_and_the_flag_is_set_far_outside() {
        for law in [skin()] {
            for stretch in [1e-12f64, 1e-8, 1e-3, 0.05, 3.0, 1e4, 1e12] {
                let h = [[stretch - 1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
                let k = Kinematics::new(h);
                assert!(law.outside_calibration(&k));
                assert!(law.energy(&k).is_finite() && law.energy(&k) > 0.0);
                let all = law.tangent(&k);
                assert!(
                    all.as_flattened().as_flattened().as_flattened().iter().all(|v| v.is_finite())
                );
            }
        }
    }

    #[test]
    fn stress_is_continuous_where_the_continuation_starts() {
        let law = skin();
        for (y, side) in [(law.range[0], -1.0), (law.range[1], 1.0)] {
            let (inside, outside) = (law.everywhere(y), law.everywhere(y + side * 1e-12));
            assert!(
                (inside[0] - outside[0]).abs() < 1e-11 && (inside[1] - outside[1]).abs() < 1e-9
            );
        }
    }
}
