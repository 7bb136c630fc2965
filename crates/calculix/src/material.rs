//! Material cards, and the energy that belongs to each.

use super::ExportError;
use papilla_fem::element::{ConstitutiveModel, Elastic};
use papilla_fingertip::materials::{MaterialError, MaterialSpec};
use papilla_fingertip::scene::effects::{Law, Plan};
use papilla_solid::tensor::eigen::symmetric;
use papilla_solid::{LinearElastic, NeoHookean, Ogden, OgdenTerm};
use std::fmt::Write;
use std::sync::Arc;

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
    /// Hooke's law in the small strain; every tissue of a body or none.
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
    /// What `plan` makes of a tissue's constants. Relaxation is no matter of a card.
    ///
    /// # Errors
    /// [`MaterialError`] names what is out of range.
    pub fn of(spec: &MaterialSpec, plan: &Plan) -> Result<Self, MaterialError> {
        if let (Law::Ogden, Some(ogden)) = (plan.law, &spec.ogden) {
            let (_, bulk_mpa) = ogden.law()?;
            let (mu_mpa, alpha) = (ogden.mu_mpa.clone(), ogden.alpha.clone());
            return Ok(Self::Ogden { mu_mpa, alpha, bulk_mpa });
        }
        let [mu_mpa, bulk_mpa] = spec.constants().moduli_mpa()?;
        Ok(match plan.law {
            Law::Linear => Self::Linear {
                youngs_modulus_mpa: spec.youngs_modulus_mpa,
                poissons_ratio: spec.poissons_ratio,
            },
            Law::NeoHookean | Law::Ogden => Self::NeoHookean { mu_mpa, bulk_mpa },
        })
    }

    /// The same law in our solver, Ogden's without its continuation outside
    /// stretches of 1/5 to 5, which CalculiX does not have.
    #[must_use]
    pub fn solid(&self) -> Arc<dyn ConstitutiveModel> {
        let bulk_mpa = self.bulk_modulus_mpa();
        match self {
            Self::NeoHookean { mu_mpa, .. } => {
                Elastic::shared(NeoHookean { mu_mpa: *mu_mpa }, bulk_mpa)
            }
            Self::Ogden { mu_mpa, alpha, .. } => {
                let terms: Vec<_> = mu_mpa
                    .iter()
                    .zip(alpha)
                    .map(|(&mu_mpa, &alpha)| OgdenTerm { mu_mpa, alpha })
                    .collect();
                Elastic::shared(Ogden::new(&terms, [0.2, 5.0]), bulk_mpa)
            }
            Self::Linear { .. } => {
                Elastic::shared(LinearElastic { mu_mpa: self.shear_modulus_mpa() }, bulk_mpa)
            }
        }
    }

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
}

/// Eigenvalues of a symmetric matrix (xx, yy, zz, xy, xz, yz).
fn principal(v: &[f64; 6]) -> [f64; 3] {
    symmetric(&[[v[0], v[3], v[4]], [v[3], v[1], v[5]], [v[4], v[5], v[2]]]).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fingertip::scene::TissueTable;
    use papilla_solid::tensor::Kinematics;
    use proptest::prelude::*;

    fn ogden() -> MaterialCard {
        MaterialCard::Ogden {
            mu_mpa: vec![2.3583e-2, 4.5408e-5, 4.0878e-2],
            alpha: vec![-2.0623, 25.0, -3.4784],
            bulk_mpa: 1.6,
        }
    }

    fn neo_hookean() -> MaterialCard {
        MaterialCard::NeoHookean { mu_mpa: 0.03, bulk_mpa: 0.9 }
    }

    fn linear() -> MaterialCard {
        MaterialCard::Linear { youngs_modulus_mpa: 0.08, poissons_ratio: 0.45 }
    }

    /// A plan's card has the moduli of the plan's law.
    #[test]
    fn cards_of_a_plan_are_its_laws() {
        let table = TissueTable::default();
        for law in [Law::Linear, Law::NeoHookean, Law::Ogden] {
            let plan = Plan { law, ..Plan::usual() };
            let solids = papilla_fingertip::simulation::laws::solids(&table, &plan).unwrap();
            for tissue in papilla_fingertip::tissue::Tissue::ALL {
                let (card, solid) =
                    (MaterialCard::of(table.of(tissue), &plan).unwrap(), &solids[tissue.region()]);
                let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
                assert!(close(card.shear_modulus_mpa(), solid.shear_modulus_mpa()), "{card:?}");
                assert!(close(card.bulk_modulus_mpa(), solid.bulk_modulus_mpa()), "{card:?}");
                assert_eq!(card.is_hyperelastic(), solid.is_finite_strain());
            }
        }
    }

    proptest! {
        /// The energy of the printed strain is our law's, whatever the rotation.
        #[test]
        fn energy_agrees_with_the_law_of_our_solver(v in prop::array::uniform9(-0.25f64..0.25)) {
            let k = Kinematics::new([[v[0], v[1], v[2]], [v[3], v[4], v[5]], [v[6], v[7], v[8]]]);
            prop_assume!(k.j() > 0.2);
            let green = k.green_strain();
            let small = |i: usize, j: usize| 0.5 * (k.h[i][j] + k.h[j][i]);
            for card in [neo_hookean(), ogden(), linear()] {
                let finite = card.is_hyperelastic();
                let e = |i: usize, j: usize| if finite { green[i][j] } else { small(i, j) };
                let strain = [e(0, 0), e(1, 1), e(2, 2), e(0, 1), e(0, 2), e(1, 2)];
                let growth = if finite { k.j_minus_1 } else { k.h[0][0] + k.h[1][1] + k.h[2][2] };
                let law = card.solid().stored_mpa(&k, growth, &[]);
                let energy = card.energy_mpa(&strain);
                prop_assert!((energy - law).abs() <= 1e-11 * law, "{card:?}: {energy} {law}");
            }
        }
    }

    #[test]
    fn energy_keeps_its_digits_at_tiny_strain() {
        // Simple shear g, to first order: mu g^2 / 2 for every law.
        let g = 1e-7;
        let strain = [0.0, 0.5 * g * g, 0.0, 0.5 * g, 0.0, 0.0];
        for card in [ogden(), neo_hookean()] {
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
        assert_eq!(values[6..].to_vec(), [2.0 / 1.6, NO_ENERGY, NO_ENERGY]);
        let neo = MaterialCard::NeoHookean { mu_mpa: 0.5, bulk_mpa: 4.0 }.cards();
        assert_eq!(neo, "*HYPERELASTIC, NEO HOOKE\n2.500000000000E-1,5.000000000000E-1\n");
    }

    #[test]
    fn what_calculix_would_misread_is_refused() {
        let incompressible = MaterialCard::NeoHookean { mu_mpa: 0.5, bulk_mpa: f64::INFINITY };
        let four = MaterialCard::Ogden { mu_mpa: vec![0.1; 4], alpha: vec![2.0; 4], bulk_mpa: 1.0 };
        let half = MaterialCard::Linear { youngs_modulus_mpa: 1.0, poissons_ratio: 0.5 };
        for card in [incompressible, four, half] {
            let message = card.check("dermis").unwrap_err().to_string();
            assert!(message.contains("dermis"), "{message}");
        }
        assert_eq!(ogden().check("dermis"), Ok(()));
    }
}
