//! Material cards, and the energy that belongs to each.

use super::ExportError;
use std::fmt::Write;

/// A material as CalculiX 2.20 can express it. Moduli in MPa.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialCard {
    /// `U = mu/2 (I1bar - 3) + K/2 (J - 1)^2`.
    NeoHookean {
        /// Shear modulus, MPa.
        mu_mpa: f64,
        /// Bulk modulus, MPa.
        bulk_mpa: f64,
    },
    /// `U = sum 2 mu_i / alpha_i^2 (sum_k lbar_k^alpha_i - 3) + K/2 (J - 1)^2`
    /// (Abaqus' convention), one to three terms.
    Ogden {
        /// Moduli of the terms, MPa; they sum to the shear modulus at rest.
        mu_mpa: Vec<f64>,
        /// Exponents of the terms.
        alpha: Vec<f64>,
        /// Bulk modulus, MPa.
        bulk_mpa: f64,
    },
    /// Hooke's law in the small strain. Next to a hyperelastic tissue CalculiX
    /// takes it for every strain, as stress `S = C : E` of the Green strain.
    Linear {
        /// Young's modulus, MPa.
        youngs_modulus_mpa: f64,
        /// Poisson's ratio.
        poissons_ratio: f64,
    },
}

/// Most terms of an Ogden law that CalculiX reads.
const OGDEN_TERMS_MAX: usize = 3;
/// A compressibility that adds no energy. 0 would do the opposite: CalculiX
/// puts `(0.1 / mu)^i` in its place without stopping.
const NO_ENERGY: f64 = 1e20;

impl MaterialCard {
    /// Whether the law is hyperelastic, which makes CalculiX geometrically nonlinear.
    #[must_use]
    pub const fn is_hyperelastic(&self) -> bool {
        !matches!(self, Self::Linear { .. })
    }

    /// Shear modulus at rest, MPa.
    #[must_use]
    pub fn shear_modulus_mpa(&self) -> f64 {
        match self {
            Self::NeoHookean { mu_mpa, .. } => *mu_mpa,
            Self::Ogden { mu_mpa, .. } => mu_mpa.iter().sum(),
            Self::Linear { youngs_modulus_mpa: e, poissons_ratio: nu } => e / (2.0 * (1.0 + nu)),
        }
    }

    /// Bulk modulus, MPa.
    #[must_use]
    pub const fn bulk_modulus_mpa(&self) -> f64 {
        match self {
            Self::NeoHookean { bulk_mpa, .. } | Self::Ogden { bulk_mpa, .. } => *bulk_mpa,
            Self::Linear { youngs_modulus_mpa: e, poissons_ratio: nu } => {
                *e / (3.0 * (1.0 - 2.0 * *nu))
            }
        }
    }

    /// Terms `(mu_i, alpha_i)` of the isochoric energy; none for Hooke's law.
    fn ogden_terms(&self) -> Vec<(f64, f64)> {
        match self {
            Self::NeoHookean { mu_mpa, .. } => vec![(*mu_mpa, 2.0)],
            Self::Ogden { mu_mpa, alpha, .. } => {
                mu_mpa.iter().copied().zip(alpha.iter().copied()).collect()
            }
            Self::Linear { .. } => Vec::new(),
        }
    }

    /// Refuses what CalculiX would read as something else.
    pub(super) fn check(&self, tissue: &'static str) -> Result<(), ExportError> {
        let refuse = |why: String| Err(ExportError::Material { tissue, why });
        let (mu, bulk) = (self.shear_modulus_mpa(), self.bulk_modulus_mpa());
        if !(mu.is_finite() && mu > 0.0 && bulk.is_finite() && bulk > 0.0) {
            return refuse(format!(
                "its moduli at rest, mu = {mu} MPa and K = {bulk} MPa, have to be positive and \
                 finite: CalculiX has no incompressible elements and takes D1 = 0 for D1 = 0.1/mu"
            ));
        }
        if let Self::Ogden { mu_mpa, alpha, .. } = self {
            let n = mu_mpa.len();
            if n != alpha.len() || !(1..=OGDEN_TERMS_MAX).contains(&n) {
                return refuse(format!(
                    "an Ogden law with {n} moduli and {} exponents; CalculiX takes one to three \
                     of each",
                    alpha.len()
                ));
            }
        }
        Ok(())
    }

    /// The cards below `*MATERIAL`.
    pub(super) fn cards(&self) -> String {
        let n = super::number;
        match self {
            Self::NeoHookean { mu_mpa, bulk_mpa } => {
                format!("*HYPERELASTIC, NEO HOOKE\n{},{}\n", n(mu_mpa / 2.0), n(2.0 / bulk_mpa))
            }
            Self::Ogden { mu_mpa, alpha, bulk_mpa } => {
                let mut values: Vec<f64> =
                    mu_mpa.iter().zip(alpha).flat_map(|(m, a)| [*m, *a]).collect();
                values.push(2.0 / bulk_mpa);
                values.resize(3 * mu_mpa.len(), NO_ENERGY);
                let mut text = format!("*HYPERELASTIC, OGDEN, N={}\n", mu_mpa.len());
                // Eight values a line.
                for line in values.chunks(8) {
                    let line: Vec<_> = line.iter().map(|&v| n(v)).collect();
                    let _ = writeln!(text, "{}", line.join(","));
                }
                text
            }
            Self::Linear { youngs_modulus_mpa, poissons_ratio } => {
                format!("*ELASTIC\n{},{}\n", n(*youngs_modulus_mpa), n(*poissons_ratio))
            }
        }
    }

    /// Energy density, MPa = mJ/mm3, of a strain as CalculiX prints it
    /// (xx, yy, zz, xy, xz, yz; tensor components): Green strain, or small
    /// strain for a geometrically linear step.
    ///
    /// `ENER` in its place would be a sum over increments and depend on their
    /// number. Not a number if a principal stretch is not positive.
    #[must_use]
    pub fn energy_mpa(&self, strain: &[f64; 6]) -> f64 {
        if let Self::Linear { .. } = self {
            let [xx, yy, zz, xy, xz, yz] = *strain;
            let trace = xx + yy + zz;
            let square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz);
            let mu = self.shear_modulus_mpa();
            let lambda = self.bulk_modulus_mpa() - 2.0 / 3.0 * mu;
            return 0.5 * lambda * trace * trace + mu * square;
        }
        // Logarithms of the principal stretches, exact at small strain.
        self.energy_of_logarithms(principal(strain).map(|e| 0.5 * (2.0 * e).ln_1p()))
    }

    /// `sum 2 mu/alpha^2 sum_k (exp(alpha d_k) - 1 - alpha d_k) + K/2 (J - 1)^2`
    /// with the deviatoric logarithms `d`, which sum to zero.
    fn energy_of_logarithms(&self, logarithm: [f64; 3]) -> f64 {
        let ln_j: f64 = logarithm.iter().sum();
        let mut energy = 0.5 * self.bulk_modulus_mpa() * ln_j.exp_m1().powi(2);
        for (mu, alpha) in self.ogden_terms() {
            for l in logarithm {
                let d = alpha * (l - ln_j / 3.0);
                energy += 2.0 * mu / (alpha * alpha) * (d.exp_m1() - d);
            }
        }
        energy
    }

    /// Principal nominal stresses `dU / d lambda_k`, MPa, of a hyperelastic law.
    pub(super) fn nominal_mpa(&self, stretch: [f64; 3]) -> [f64; 3] {
        let logarithm = stretch.map(f64::ln);
        let ln_j: f64 = logarithm.iter().sum();
        let volumetric = self.bulk_modulus_mpa() * ln_j.exp_m1() * ln_j.exp();
        let mut stress = [volumetric; 3];
        for (mu, alpha) in self.ogden_terms() {
            let power = logarithm.map(|l| (alpha * (l - ln_j / 3.0)).exp());
            let mean = power.iter().sum::<f64>() / 3.0;
            for k in 0..3 {
                stress[k] += 2.0 * mu / alpha * (power[k] - mean);
            }
        }
        std::array::from_fn(|k| stress[k] / stretch[k])
    }
}

/// Eigenvalues of a symmetric matrix (xx, yy, zz, xy, xz, yz), by Jacobi's rotations.
fn principal(v: &[f64; 6]) -> [f64; 3] {
    let mut a = [[v[0], v[3], v[4]], [v[3], v[1], v[5]], [v[4], v[5], v[2]]];
    // Quadratic convergence: six sweeps are more than enough for three rows.
    for _ in 0..6 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            let old = a;
            for k in 0..3 {
                a[k][p] = c * old[k][p] - s * old[k][q];
                a[k][q] = s * old[k][p] + c * old[k][q];
            }
            let old = a;
            for k in 0..3 {
                a[p][k] = c * old[p][k] - s * old[q][k];
                a[q][k] = s * old[p][k] + c * old[q][k];
            }
        }
    }
    [a[0][0], a[1][1], a[2][2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Isochoric, Kinematics, NeoHookean};
    use proptest::prelude::*;

    fn ogden() -> MaterialCard {
        MaterialCard::Ogden {
            mu_mpa: vec![2.3583e-2, 4.5408e-5, 4.0878e-2],
            alpha: vec![-2.0623, 25.0, -3.4784],
            bulk_mpa: 1.6,
        }
    }

    proptest! {
        /// The energy of the Green strain is the law's, whatever the rotation.
        #[test]
        fn neo_hookean_energy_agrees_with_the_law(v in prop::array::uniform9(-0.25f64..0.25)) {
            let k = Kinematics::new([[v[0], v[1], v[2]], [v[3], v[4], v[5]], [v[6], v[7], v[8]]]);
            prop_assume!(k.j() > 0.2);
            let e = k.green_strain();
            let strain = [e[0][0], e[1][1], e[2][2], e[0][1], e[0][2], e[1][2]];
            let law = NeoHookean { mu_mpa: 0.03 }.energy(&k) + 0.5 * 0.9 * k.j_minus_1.powi(2);
            let card = MaterialCard::NeoHookean { mu_mpa: 0.03, bulk_mpa: 0.9 };
            let energy = card.energy_mpa(&strain);
            prop_assert!((energy - law).abs() <= 1e-12 * law, "{energy} {law}");
        }

        #[test]
        fn nominal_stress_is_the_energys_derivative(s in prop::array::uniform3(0.7f64..1.4)) {
            let card = ogden();
            let stress = card.nominal_mpa(s);
            for k in 0..3 {
                let h = 1e-5;
                let at = |d: f64| {
                    let mut q = s;
                    q[k] += d;
                    card.energy_of_logarithms(q.map(f64::ln))
                };
                let difference = (at(h) - at(-h)) / (2.0 * h);
                let scale = card.bulk_modulus_mpa();
                prop_assert!((difference - stress[k]).abs() < 1e-7 * scale, "{k}");
            }
        }
    }

    #[test]
    fn energy_keeps_its_digits_at_tiny_strain() {
        // Simple shear g, to first order: mu g^2 / 2 for every law.
        let g = 1e-7;
        let strain = [0.0, 0.5 * g * g, 0.0, 0.5 * g, 0.0, 0.0];
        for card in [ogden(), MaterialCard::NeoHookean { mu_mpa: 0.03, bulk_mpa: 0.9 }] {
            let expected = 0.5 * card.shear_modulus_mpa() * g * g;
            assert!((card.energy_mpa(&strain) / expected - 1.0).abs() < 1e-6, "{card:?}");
        }
    }

    #[test]
    fn cards_hold_what_calculix_reads() {
        let text = ogden().cards();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("*HYPERELASTIC, OGDEN, N=3"));
        let (first, second) = (lines.next().unwrap(), lines.next().unwrap());
        assert_eq!((first.split(',').count(), second.split(',').count()), (8, 1));
        let fields = first.split(',').chain(second.split(','));
        let values: Vec<f64> = fields.map(|f| f.parse().unwrap()).collect();
        assert_eq!(values[6..], [2.0 / 1.6, NO_ENERGY, NO_ENERGY]);
        let neo = MaterialCard::NeoHookean { mu_mpa: 0.5, bulk_mpa: 4.0 }.cards();
        assert_eq!(
            neo,
            "*HYPERELASTIC, NEO HOOKE\n2.500000000000E-1,5.000000000000E-1\n"
        );
    }

    #[test]
    fn what_calculix_would_misread_is_refused() {
        let incompressible = MaterialCard::NeoHookean { mu_mpa: 0.5, bulk_mpa: f64::INFINITY };
        let four = MaterialCard::Ogden {
            mu_mpa: vec![0.1; 4],
            alpha: vec![2.0; 4],
            bulk_mpa: 1.0,
        };
        let half = MaterialCard::Linear { youngs_modulus_mpa: 1.0, poissons_ratio: 0.5 };
        for card in [incompressible, four, half] {
            let message = card.check("dermis").unwrap_err().to_string();
            assert!(message.contains("dermis"), "{message}");
        }
        assert_eq!(ogden().check("dermis"), Ok(()));
    }
}
