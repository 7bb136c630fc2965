//! Finite viscoelasticity with a Prony series (Simo & Hughes 1998, sec. 10.3).
//!
//! With `S = J^(2/3) F^-1 P_iso`, the isochoric stress that the law would have at once, and
//! shares `g_i` that relax with `tau_i`, the stress is
//! `J^(-2/3) DEV[ g_inf S + sum Q_i ]`, `tau_i dQ_i/dt + Q_i = tau_i g_i dS/dt`. For an `S`
//! that changes linearly over a step this integrates exactly to
//!
//! `Q_i' = e^-x Q_i + g_i gamma (S' - S)`,  `x = dt / tau_i`, `gamma = (1 - e^-x) / x`.
//!
//! All that is known before the step gathers in one symmetric tensor
//! `B = sum e^-x Q_i - g_i gamma S`, so the step minimises the potential
//! `c U_iso(F) + B : (Cbar - I) / 2` with `c = g_inf + sum g_i gamma`: force and symmetric
//! tangent follow as for any elastic law.

use super::Isochoric;
use super::linear::deviatoric_strain;
use crate::tensor::{Kinematics, Mat3, Tensor4, double_dot, product};

/// Most terms of a series.
const TERMS_MAX: usize = 6;

/// One relaxing share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PronyTerm {
    /// Share `g_i` of the instantaneous modulus, 0 to 1.
    pub share: f64,
    /// Relaxation time `tau_i`, s.
    pub time_s: f64,
}

/// A Prony series of shear relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prony {
    terms: [PronyTerm; TERMS_MAX],
    count: usize,
}

/// History of one point: `S`, then `Q_i`, symmetric tensors as
/// `xx, yy, zz, xy, yz, zx`, MPa; then dissipated energy density, MPa.
pub type History<'a> = &'a [f64];

impl Prony {
    /// Most terms.
    pub const TERMS_MAX: usize = TERMS_MAX;

    /// A series.
    ///
    /// # Panics
    /// With more than [`Self::TERMS_MAX`] terms.
    #[must_use]
    pub fn new(given: &[PronyTerm]) -> Self {
        assert!(given.len() <= TERMS_MAX, "at most {TERMS_MAX} terms");
        let mut terms = [PronyTerm::default(); TERMS_MAX];
        terms[..given.len()].copy_from_slice(given);
        Self { terms, count: given.len() }
    }

    /// The terms.
    #[must_use]
    pub fn terms(&self) -> &[PronyTerm] {
        &self.terms[..self.count]
    }

    /// Share that never relaxes, `1 - sum g_i`.
    #[must_use]
    pub fn long_term_share(&self) -> f64 {
        1.0 - self.terms().iter().map(|t| t.share).sum::<f64>()
    }

    /// Numbers of history a point has.
    #[must_use]
    pub fn history_len(&self) -> usize {
        6 * (1 + self.count) + 1
    }

    /// `c` and `B` of a step of `dt_s` from `history`.
    fn step(&self, history: History<'_>, dt_s: f64) -> (f64, [f64; 6]) {
        let mut scale = self.long_term_share();
        let mut pull = [0.0; 6];
        for (t, q) in self.terms().iter().zip(history[6..].chunks_exact(6)) {
            let (decay, gamma) = decay(dt_s, t.time_s);
            scale += t.share * gamma;
            for i in 0..6 {
                pull[i] += decay * q[i] - t.share * gamma * history[i];
            }
        }
        (scale, pull)
    }
}

/// `e^-x` and `(1 - e^-x) / x`, `x = dt / tau`, right in both limits.
fn decay(dt_s: f64, time_s: f64) -> (f64, f64) {
    let x = dt_s / time_s;
    let gamma = if x == 0.0 {
        1.0
    } else if x.is_finite() {
        -(-x).exp_m1() / x
    } else {
        0.0
    };
    ((-x).exp(), gamma)
}

/// A law at one point during one step: itself elastic.
#[derive(Clone, Copy, Debug)]
pub struct Relaxing<L> {
    law: L,
    scale: f64,
    pull: Mat3,
}

impl<L: Isochoric> Relaxing<L> {
    /// `law` with the history variables `history` over a step of `dt_s`.
    pub fn new(law: L, prony: &Prony, history: History<'_>, dt_s: f64) -> Self {
        let (scale, pull) = prony.step(history, dt_s);
        Self { law, scale, pull: full(&pull) }
    }
}

fn full(s: &[f64; 6]) -> Mat3 {
    [[s[0], s[3], s[5]], [s[3], s[1], s[4]], [s[5], s[4], s[2]]]
}

fn packed(m: &Mat3) -> [f64; 6] {
    [m[0][0], m[1][1], m[2][2], m[0][1], m[1][2], m[0][2]]
}

impl<L: Isochoric> Relaxing<L> {
    /// Energy density of the branches, MPa.
    fn branches_energy(&self, k: &Kinematics) -> f64 {
        if L::FINITE {
            // Cbar - I = J^(-2/3) (2 E - (J^(2/3) - 1) I).
            let (m, e) = (k.j_pow_minus_two_thirds(), k.green_strain());
            let grown = (2.0 / 3.0 * k.j_minus_1.ln_1p()).exp_m1();
            let trace = self.pull[0][0] + self.pull[1][1] + self.pull[2][2];
            m * (double_dot(&self.pull, &e) - 0.5 * grown * trace)
        } else {
            double_dot(&self.pull, &deviatoric_strain(&k.h))
        }
    }

    /// First Piola-Kirchhoff stress of the law and the branches, MPa.
    fn with_branches(&self, elastic: &Mat3, k: &Kinematics) -> Mat3 {
        let branches = if L::FINITE {
            let fb = product(&k.f, &self.pull);
            let third = double_dot(&fb, &k.f) / 3.0;
            let (m, g) = (k.j_pow_minus_two_thirds(), k.f_inverse());
            std::array::from_fn(|i| std::array::from_fn(|j| m * (fb[i][j] - third * g[j][i])))
        } else {
            let third = (self.pull[0][0] + self.pull[1][1] + self.pull[2][2]) / 3.0;
            let mut b = self.pull;
            for (i, row) in b.iter_mut().enumerate() {
                row[i] -= third;
            }
            b
        };
        std::array::from_fn(|i| {
            std::array::from_fn(|j| self.scale * elastic[i][j] + branches[i][j])
        })
    }
}

impl<L: Isochoric> Isochoric for Relaxing<L> {
    const FINITE: bool = L::FINITE;

    /// `c U + B : (Cbar - I) / 2`; of small strain `c U + B : dev e`.
    fn energy(&self, k: &Kinematics) -> f64 {
        self.scale * self.law.energy(k) + self.branches_energy(k)
    }

    /// `P = c P_L + J^(-2/3) (F B - 1/3 (F B : F) F^-T)`.
    fn first_piola(&self, k: &Kinematics) -> Mat3 {
        self.with_branches(&self.law.first_piola(k), k)
    }

    fn energy_and_first_piola(&self, k: &Kinematics) -> (f64, Mat3) {
        let (energy, elastic) = self.law.energy_and_first_piola(k);
        (self.scale * energy + self.branches_energy(k), self.with_branches(&elastic, k))
    }

    fn tangent(&self, k: &Kinematics) -> Tensor4 {
        let mut t = self.law.tangent(k);
        for v in t.as_flattened_mut().as_flattened_mut().as_flattened_mut() {
            *v *= self.scale;
        }
        if L::FINITE {
            // As the neo-Hookean law's with B in the place of the unit tensor.
            let fb = product(&k.f, &self.pull);
            let ib = double_dot(&fb, &k.f);
            let (m, g) = (k.j_pow_minus_two_thirds(), k.f_inverse());
            let (c23, c29, c3) = (2.0 / 3.0 * m, 2.0 / 9.0 * ib * m, ib / 3.0 * m);
            for a in 0..3 {
                for b in 0..3 {
                    for c in 0..3 {
                        for d in 0..3 {
                            t[a][b][c][d] += -c23 * (fb[a][b] * g[d][c] + g[b][a] * fb[c][d])
                                + c29 * g[b][a] * g[d][c]
                                + c3 * g[b][c] * g[d][a];
                        }
                        t[a][b][a][c] += m * self.pull[b][c];
                    }
                }
            }
        }
        t
    }

    fn shear_modulus_mpa(&self) -> f64 {
        self.scale * self.law.shear_modulus_mpa()
    }

    fn outside_calibration(&self, k: &Kinematics) -> bool {
        self.law.outside_calibration(k)
    }
}

/// `S = J^(2/3) F^-1 P_iso`; of small strain the deviatoric stress itself.
fn instantaneous<L: Isochoric>(law: &L, k: &Kinematics) -> Mat3 {
    let p = law.first_piola(k);
    if L::FINITE {
        let m = 1.0 / k.j_pow_minus_two_thirds();
        product(&k.f_inverse(), &p).map(|row| row.map(|v| m * v))
    } else {
        p
    }
}

/// Moves the history of a point over a step of `dt_s` that ended at `k`.
pub fn advance<L: Isochoric>(
    law: &L,
    prony: &Prony,
    k: &Kinematics,
    dt_s: f64,
    history: &mut [f64],
) {
    let now = packed(&instantaneous(law, k));
    let before: [f64; 6] = std::array::from_fn(|i| history[i]);
    let started = branch_energies(law, prony, k, history);
    let (tensors, rest) = history.split_at_mut(6 * (1 + prony.count));
    for (t, q) in prony.terms().iter().zip(tensors[6..].chunks_exact_mut(6)) {
        let (decay, gamma) = decay(dt_s, t.time_s);
        for i in 0..6 {
            q[i] = decay * q[i] + t.share * gamma * (now[i] - before[i]);
        }
    }
    tensors[..6].copy_from_slice(&now);
    let ended = branch_energies(law, prony, k, tensors);
    rest[0] += prony
        .terms()
        .iter()
        .zip(started.iter().zip(&ended))
        .map(|(t, (&e0, &e1))| 2.0 * dt_s / t.time_s * mean_energy(e0, e1))
        .sum::<f64>();
}

/// Mean over a step of what a Maxwell branch stores, of which it dissipates `2 / tau` a
/// second, from its values at both ends: exponential decay where it falls, which makes a
/// held strain's dissipation exact, and stress linear in time where it grows.
fn mean_energy(start: f64, end: f64) -> f64 {
    if end < start && end > 0.0 {
        let fall = (start - end) / end;
        (start - end) / fall.ln_1p()
    } else {
        (start + (start * end).sqrt() + end) / 3.0
    }
}

/// Energy density that each branch stores, MPa.
///
/// `g_i U (|Q_i| / |g_i S|)^2` with the norm `tr(Q Cbar Q Cbar)`: `g_i U` right after a sudden
/// strain, `|Q|^2 / (4 g_i mu)` for small strain, 0 when relaxed.
fn branch_energies<L: Isochoric>(
    law: &L,
    prony: &Prony,
    k: &Kinematics,
    history: &[f64],
) -> [f64; TERMS_MAX] {
    let metric =
        if L::FINITE { isochoric_cauchy_green(k) } else { full(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]) };
    let square = |s: &Mat3| {
        let m = product(s, &metric);
        double_dot(&m, &std::array::from_fn(|i| std::array::from_fn(|j| m[j][i])))
    };
    let stress = square(&instantaneous(law, k));
    let compliance =
        if stress > 0.0 { law.energy(k) / stress } else { 0.25 / law.shear_modulus_mpa() };
    let mut energy = [0.0; TERMS_MAX];
    for ((e, t), q) in energy.iter_mut().zip(prony.terms()).zip(history[6..].chunks_exact(6)) {
        if t.share > 0.0 {
            *e = compliance * square(&full(&std::array::from_fn(|i| q[i]))) / t.share;
        }
    }
    energy
}

/// `Cbar = J^(-2/3) F^T F`.
fn isochoric_cauchy_green(k: &Kinematics) -> Mat3 {
    let m = k.j_pow_minus_two_thirds();
    let f = &k.f;
    std::array::from_fn(|i| {
        std::array::from_fn(|j| m * (0..3).map(|a| f[a][i] * f[a][j]).sum::<f64>())
    })
}

/// Isochoric energy density that can be got back, MPa: the long-term share and
/// what the branches hold.
pub fn stored<L: Isochoric>(law: &L, prony: &Prony, k: &Kinematics, history: History<'_>) -> f64 {
    prony.long_term_share() * law.energy(k)
        + branch_energies(law, prony, k, history).iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NeoHookean;

    const LAW: NeoHookean = NeoHookean { mu_mpa: 0.02 };

    fn series() -> Prony {
        Prony::new(&[PronyTerm { share: 0.3, time_s: 0.4 }, PronyTerm { share: 0.2, time_s: 5.0 }])
    }

    fn shear(g: f64) -> Kinematics {
        Kinematics::new([[0.0, g, 0.0], [0.0; 3], [0.0; 3]])
    }

    #[test]
    fn stress_relaxes_as_the_series_says() {
        let prony = series();
        let mut history = vec![0.0; prony.history_len()];
        let k = shear(0.3);
        advance(&LAW, &prony, &k, 0.0, &mut history);
        let first = LAW.first_piola(&k)[0][1];
        let mut time = 0.0;
        for dt in [1e-6, 0.1, 0.3, 2.0, 7.0, 1e6] {
            let stress = Relaxing::new(LAW, &prony, &history, dt).first_piola(&k)[0][1];
            time += dt;
            let expected =
                first * (0.5 + 0.3 * (-time / 0.4f64).exp() + 0.2 * (-time / 5.0f64).exp());
            assert!((stress - expected).abs() < 1e-13 * first, "t = {time}");
            advance(&LAW, &prony, &k, dt, &mut history);
        }
        assert!(
            (stored(&LAW, &prony, &k, &history) - 0.5 * LAW.energy(&k)).abs()
                < 1e-12 * LAW.energy(&k)
        );
    }

    #[test]
    fn work_is_stored_or_dissipated() {
        let prony = series();
        let mut history = vec![0.0; prony.history_len()];
        let (steps, dt) = (4000, 0.001);
        let (mut work, mut last) = (0.0, 0.0);
        for i in 1..=steps {
            let g = 0.05 * (f64::from(i) * dt * 3.0).sin();
            let before = 0.05 * (f64::from(i - 1) * dt * 3.0).sin();
            let k = shear(g);
            let stress = Relaxing::new(LAW, &prony, &history, dt).first_piola(&k)[0][1];
            advance(&LAW, &prony, &k, dt, &mut history);
            work += 0.5 * (stress + last) * (g - before);
            last = stress;
        }
        let k = shear(0.05 * (f64::from(steps) * dt * 3.0).sin());
        let found = stored(&LAW, &prony, &k, &history) + history[history.len() - 1];
        assert!((found - work).abs() < 5e-3 * work, "{found} {work}");
    }

    #[test]
    fn both_limits_of_the_step_are_the_moduli() {
        let (prony, k) = (series(), shear(0.2));
        let rest = vec![0.0; prony.history_len()];
        let stress = |dt| Relaxing::new(LAW, &prony, &rest, dt).first_piola(&k)[0][1];
        let now = LAW.first_piola(&k)[0][1];
        assert!((stress(1e-12) - now).abs() < 1e-11 * now);
        assert!((stress(1e12) - 0.5 * now).abs() < 1e-11 * now);
        assert!(stress(f64::MAX).is_finite());
    }
}
