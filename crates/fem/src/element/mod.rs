//! Elements: reference shapes, undeformed geometry and the mean-dilatation kernel.

pub mod carried;
pub mod extrapolate;
pub mod geometry;
pub mod kernel;
mod materials;
pub mod reference;
pub mod shape;
pub mod solid;

pub use carried::{Carried, Dilatation, next_dilatation};
pub use geometry::{BlockGeometry, ShapeError};
pub use kernel::{ElementState, Inverted};
pub use materials::{Materials, Region};
pub use reference::ElementKind;
pub use solid::{Elastic, Memory, Solid, Viscoelastic};
