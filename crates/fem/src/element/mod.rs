//! Elements: reference shapes, undeformed geometry and the mean-dilatation kernel.

pub mod extrapolate;
pub mod geometry;
pub mod independent;
pub mod kernel;
mod materials;
pub mod model;
pub mod reference;
pub mod shape;

pub use geometry::{BlockGeometry, ShapeError};
pub use independent::{Dilatation, IndependentDilatation, next_dilatation};
pub use kernel::{ElementState, Inverted};
pub use materials::{Materials, Region};
pub use model::{ConstitutiveModel, Elastic, HistoryVariables, ModelOf, Viscoelastic};
pub use reference::ElementKind;
