//! What can stop the influence operator.

use super::strain::StrainError;
use crate::simulation::body::SimulationError;
use papilla_atlas::flatten::BuildAtlasError;
use papilla_fem::linear::FactorError;
use papilla_fem::solve::StepError;

/// The influence operator could not be built or written.
#[derive(Debug, thiserror::Error)]
pub enum InfluenceError {
    /// The finger could not be set up.
    #[error(transparent)]
    Body(#[from] SimulationError),
    /// The body has no atlas, or it could not be flattened.
    #[error(transparent)]
    Atlas(#[from] BuildAtlasError),
    /// The body is no fingertip, so it has no skin and interface to map between.
    #[error(
        "the body has no atlas patch: the influence operator maps skin to interface of a fingertip"
    )]
    NoPatch,
    /// A law of finite strain has no one influence operator.
    #[error(
        "the body's law is of finite strain, so its response to pressure is not linear: build the \
         body without the effect 'finite_strain'"
    )]
    FiniteStrain,
    /// The tangent at rest could not be assembled.
    #[error("the tangent at rest: {0}")]
    Tangent(#[from] StepError),
    /// The tangent could not be factorized.
    #[error(transparent)]
    Factor(#[from] FactorError),
    /// Strain could not be recovered.
    #[error(transparent)]
    Strain(#[from] StrainError),
    /// A linear system was not solved.
    #[error(
        "the systems were solved to a relative residual of {found:.1e} only, at most {accepted:.0e} \
         is accepted: a badly shaped mesh or moduli that are too far apart"
    )]
    Residual {
        /// Largest found.
        found: f64,
        /// Accepted.
        accepted: f64,
    },
    /// Loads that give no modes.
    #[error("no load modes can be made of the loads: there are none, or one is not finite")]
    Loads,
    /// Pressure of another length than the influence operator has vertices.
    #[error("{found} pressures for an influence operator of {expected} vertices")]
    Pressures {
        /// Found.
        found: usize,
        /// Expected.
        expected: usize,
    },
}
