//! The fingertip's cross-section as a body.

use super::body::{Body, SimulationError};
use crate::geometry::section::SectionShape;
use crate::mesh::fingertip::{Density, Order, Parts, Patch};
use crate::mesh::section::{Extent, build};
use papilla_fem::element::ElementKind;
use papilla_fem::solve::Materials;

/// A cross-section and how it is meshed.
#[derive(Clone, Copy, Debug)]
pub struct SectionSpec<'a> {
    /// Dimensions.
    pub shape: &'a SectionShape,
    /// Mesh density.
    pub density: Density,
    /// Element order.
    pub order: Order,
    /// Half or whole.
    pub extent: Extent,
}

impl Body {
    /// Meshes a cross-section of the fingertip, with its supports.
    ///
    /// # Errors
    /// See [`SimulationError`].
    pub fn section(
        spec: &SectionSpec<'_>,
        materials: Materials,
        parts: Parts,
    ) -> Result<Self, SimulationError> {
        let kind = match spec.order {
            Order::Linear => ElementKind::Quad4,
            Order::Quadratic | Order::Graded => ElementKind::Quad9,
        };
        let section = build(spec.shape, parts, spec.density, kind, spec.extent)?;
        let (fixed, mesh) = (section.fixed(), section.mesh);
        let [skin, interface] = ["skin", "interface"].map(|name| mesh.surfaces[name].walk());
        let patch = Patch { skin, interface, triangles: Vec::new(), vertices: None };
        Self::with_patch(mesh, materials, fixed, patch, true)
    }
}
