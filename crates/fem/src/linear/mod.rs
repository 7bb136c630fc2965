//! Sparse symmetric systems: pattern, ordering, factorization, iteration.
//!
//! The pattern of a mesh never changes (contact couples only degrees of freedom
//! that an element couples already), so [`SymbolicSystem`] is built once per mesh
//! and shared by every indentation of a campaign.

mod cg;
mod direct;
mod dof_map;
mod dominant;
mod dot;
mod eigen;
mod factor;
mod ordering;
mod pattern;
mod saddle;
mod symbolic;

pub use cg::{CgOutcome, CgWorkspace, conjugate_gradient};
pub use direct::Direct;
pub use dof_map::DofMap;
pub use dominant::dominant;
pub(crate) use dot::dot;
pub(crate) use eigen::eigen;
pub use factor::{FactorError, FactorKind, FactorMemory, NumericFactor};
pub use ordering::{Elimination, OrderingError};
pub use saddle::{Coupling, SaddleSolver, SaddleSystem};
pub use symbolic::{SymbolicError, SymbolicSystem, SymmetricMatrix};
