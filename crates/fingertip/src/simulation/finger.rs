//! The solid fingertip as a body.

use super::body::{Body, Guide, SimulationError};
use super::laws::solids;
use crate::geometry::fingertip::FingertipShape;
use crate::mesh::fingertip::{Density, FingertipMesh, Order, Parts, blame, build, build_guide};
use crate::mesh::grading::Contact;
use crate::scene::effects::Law;
use crate::scene::{Plan, TissueTable};
use papilla_fem::mesh::Mesh;
use papilla_fem::solve::{Materials, ProblemError};

/// An element that is inside out is the fault of the finger's dimensions.
fn of_shape(error: SimulationError, shape: &FingertipShape, parts: Parts) -> SimulationError {
    match error {
        SimulationError::Problem(ProblemError::Shape { .. }) => blame(shape, parts).into(),
        error => error,
    }
}

impl Body {
    /// Meshes a fingertip and holds what carries it.
    ///
    /// Always the axial displacement of the soft tissue's base, which goes on as
    /// the rest of the finger. A rigid bone is held as a whole. An elastic one is
    /// clamped where the base plane cuts it, because there the joint carries it; its
    /// marrow cavity is free: marrow and cancellous bone are softer than the cortex
    /// by a factor of ten and more, and to hold the cavity's wall would leave but
    /// 0.75 mm of cortex to deform on a rigid core. The skin under a rigid nail is
    /// held; an elastic nail is carried by that skin alone.
    ///
    /// # Errors
    /// See [`SimulationError`].
    pub fn fingertip(
        shape: &FingertipShape,
        materials: Materials,
        density: Density,
        order: Order,
        parts: Parts,
        contact: Option<&Contact>,
    ) -> Result<Self, SimulationError> {
        let fine = build(shape, density, order, parts, contact)?;
        if let Some(error) = fine.unresolved(density) {
            return Err(error.into());
        }
        let guide = build_guide(shape, density, parts, &fine)?;
        let body = |mesh: FingertipMesh, materials, guide| {
            let FingertipMesh { mesh, patch, .. } = mesh;
            let fixed = Self::held(&mesh, parts);
            let body = Self::with_patch(mesh, materials, fixed, patch, false)
                .map_err(|error| of_shape(error, shape, parts))?;
            let (graded, first_touch) = (order == Order::Graded, contact.cloned());
            Ok::<_, SimulationError>(Self { graded, first_touch, guide, ..body })
        };
        let guide = match guide {
            Some((mesh, transfer)) => {
                let body = body(mesh, materials.clone(), None)?;
                Some(Box::new(Guide { body, transfer }))
            }
            None => None,
        };
        body(fine, materials, guide)
    }

    /// Degrees of freedom of a fingertip that are held.
    pub(super) fn held(mesh: &Mesh, parts: Parts) -> Vec<bool> {
        let mut fixed = vec![false; 3 * mesh.nodes.len()];
        for &n in &mesh.node_sets["base"] {
            fixed[3 * n as usize] = true;
        }
        let bone = if parts.bone { "bone_base" } else { "bone" };
        let nail = (!parts.nail).then_some("nail");
        for &n in std::iter::once(bone).chain(nail).flat_map(|set| &mesh.node_sets[set]) {
            fixed[3 * n as usize..3 * n as usize + 3].fill(true);
        }
        fixed
    }

    /// The default finger on an even mesh with the surface-pressure study's analysis: neo-Hookean
    /// layers, rigid bone and nail.
    ///
    /// # Errors
    /// [`SimulationError`] if it cannot be set up.
    pub fn usual(density: Density) -> Result<Self, SimulationError> {
        Self::even(&FingertipShape::default(), &TissueTable::default(), density)
    }

    /// A finger on an even mesh with the surface-pressure study's analysis, but with Ogden's law where
    /// its tissues were fitted with that.
    ///
    /// # Errors
    /// [`SimulationError`] if it cannot be set up.
    pub fn even(
        shape: &FingertipShape,
        tissues: &TissueTable,
        density: Density,
    ) -> Result<Self, SimulationError> {
        let law = if tissues.needs("hyperelastic") { Law::Ogden } else { Law::NeoHookean };
        let plan = Plan { law, ..Plan::usual() };
        let materials = solids(tissues, &plan)?;
        Self::fingertip(shape, materials, density, Order::Linear, plan.parts, None)
    }
}
