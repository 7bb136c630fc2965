//! Strain on the dermis side of the interface as a linear map of displacement, in
//! numbers whose squares sum to the energy density.

use crate::tissue::{NoTissue, Tissue};
use papilla_fem::element::{HistoryVariables, Inverted};
use papilla_fem::mesh::recovery::SedRecovery;
use papilla_fem::solve::Problem;
use papilla_solid::tensor::{Mat3, trace};

/// Numbers of strain at a vertex: five deviatoric, one volumetric.
pub const COMPONENTS: usize = 6;

/// Weighted strain of one point: SED is the sum of squares.
pub type Weighted = [f64; COMPONENTS];

/// The five numbers of a symmetric tensor's deviator whose squares sum to its double
/// product with itself, times `sqrt(mu)`, and `sqrt(K / 2)` times `dilatation`.
///
/// `U = mu dev(e) : dev(e) + K/2 theta^2`; `h` is the displacement gradient, moduli are
/// in MPa and the result in sqrt(MPa).
#[must_use]
pub fn weighted(h: &Mat3, dilatation: f64, mu_mpa: f64, bulk_mpa: f64) -> Weighted {
    let third = trace(h) / 3.0;
    let [x, y, z] = [0, 1, 2].map(|i| h[i][i] - third);
    let shear = |i: usize, j: usize| (h[i][j] + h[j][i]) * std::f64::consts::FRAC_1_SQRT_2;
    let deviator = [
        (x - y) / 2f64.sqrt(),
        (x + y - 2.0 * z) / 6f64.sqrt(),
        shear(0, 1),
        shear(0, 2),
        shear(1, 2),
    ];
    let [a, b, c, d, e] = deviator.map(|v| mu_mpa.sqrt() * v);
    [a, b, c, d, e, (0.5 * bulk_mpa).sqrt() * dilatation]
}

/// The map from displacement to weighted strain on the interface's faces.
///
/// Strain is sampled where SED is sampled and the dilatation is the element's own
/// (constant or linear in an element). A vertex averages its samples by the
/// weights that the record of an indentation averages SED with.
pub struct StrainMap {
    samples: Vec<SampleMap>,
    terms: Vec<Vec<(usize, f64)>>,
}

/// Weighted strain of one sample for a unit displacement of each of its element's
/// degrees of freedom.
struct SampleMap {
    nodes: Vec<u32>,
    columns: Vec<[Weighted; 3]>,
}

/// Why the map could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum StrainError {
    /// The layer does not reach the interface.
    #[error(transparent)]
    NoTissue(#[from] NoTissue),
    /// An element turned inside out under an infinitesimal displacement.
    #[error("an element at the interface: {0}")]
    Inverted(#[from] Inverted),
}

impl StrainMap {
    /// The map of a body of small strain at the interface nodes `nodes`.
    ///
    /// # Errors
    /// [`StrainError`] if a node has no dermis below it.
    pub fn new(problem: &Problem, nodes: &[u32]) -> Result<Self, StrainError> {
        let recovery = SedRecovery::new(&problem.mesh, "interface", Tissue::Dermis.region(), nodes)
            .map_err(NoTissue::from)?;
        let mut used: Vec<usize> = recovery.terms().iter().flatten().map(|t| t.0).collect();
        used.sort_unstable();
        used.dedup();
        let place = |s: &usize| used.binary_search(s).unwrap_or_default();
        let terms = recovery
            .terms()
            .iter()
            .map(|terms| terms.iter().map(|(s, w)| (place(s), *w)).collect())
            .collect();
        let samples = used
            .iter()
            .map(|&s| &recovery.samples()[s])
            .map(|sample| {
                let block = &problem.mesh.blocks[sample.block];
                let nodes = block.element(sample.element).to_vec();
                let solid = &problem.materials[sample.region(&problem.mesh)];
                let shape = problem.geometry[sample.block].element(sample.element);
                let mut force = vec![[0.0; 3]; nodes.len()];
                let mut local = vec![[0.0; 3]; nodes.len()];
                let mut unit = |a: usize, i: usize| -> Result<Weighted, Inverted> {
                    local[a][i] = 1.0;
                    let state = solid.evaluate(
                        shape,
                        &local,
                        HistoryVariables::default(),
                        &mut force,
                        None,
                    )?;
                    local[a][i] = 0.0;
                    let theta = sample.basis.iter().zip(state.theta_minus_1).map(|(b, t)| b * t);
                    let mut h = [[0.0; 3]; 3];
                    h[i] = sample.gradients[a];
                    let (mu, bulk) = (solid.shear_modulus_mpa(), solid.bulk_modulus_mpa());
                    Ok(weighted(&h, theta.sum(), mu, bulk))
                };
                let columns = (0..nodes.len())
                    .map(|a| Ok([unit(a, 0)?, unit(a, 1)?, unit(a, 2)?]))
                    .collect::<Result<Vec<_>, Inverted>>()?;
                Ok(SampleMap { nodes, columns })
            })
            .collect::<Result<Vec<_>, Inverted>>()?;
        Ok(Self { samples, terms })
    }

    /// Number of samples: faces of the interface round the vertices.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples.len()
    }

    /// Per vertex the samples that it averages, with weights that sum to 1.
    #[must_use]
    pub fn terms(&self) -> &[Vec<(usize, f64)>] {
        &self.terms
    }

    /// Weighted strain, sqrt(MPa), of every sample. `u(node)` is a node's
    /// displacement, mm.
    #[must_use]
    pub fn apply(&self, u: impl Fn(u32) -> [f64; 3]) -> Vec<Weighted> {
        self.samples.iter().map(|s| s.apply(&u)).collect()
    }

    /// Means of the samples' strain at the vertices.
    #[must_use]
    pub fn average(&self, samples: &[Weighted]) -> Vec<Weighted> {
        let mean = |terms: &Vec<(usize, f64)>| {
            std::array::from_fn(|k| terms.iter().map(|&(s, w)| w * samples[s][k]).sum())
        };
        self.terms.iter().map(mean).collect()
    }
}

impl SampleMap {
    fn apply(&self, u: &impl Fn(u32) -> [f64; 3]) -> Weighted {
        let mut sum = [0.0; COMPONENTS];
        for (&node, columns) in self.nodes.iter().zip(&self.columns) {
            for (displacement, column) in u(node).into_iter().zip(columns) {
                for k in 0..COMPONENTS {
                    sum[k] += displacement * column[k];
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fem::element::{ConstitutiveModel, Elastic};
    use papilla_solid::LinearElastic;
    use papilla_solid::tensor::Kinematics;
    use proptest::prelude::*;

    proptest! {
        /// The squares sum to what the law says.
        #[test]
        fn squares_sum_to_the_energy_density(
            h in prop::array::uniform3(prop::array::uniform3(-0.5f64..0.5)),
            theta in -0.1f64..0.1, mu in 0.01f64..10.0, bulk in 0.01f64..100.0,
        ) {
            let law = Elastic { law: LinearElastic { mu_mpa: mu }, bulk_mpa: bulk };
            let due = law.stored_mpa(&Kinematics::new(h), theta, &[]);
            let found: f64 = weighted(&h, theta, mu, bulk).iter().map(|v| v * v).sum();
            prop_assert!((found - due).abs() <= 1e-13 * due.max(1e-3), "{} {}", found, due);
        }
    }
}
