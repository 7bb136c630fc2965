//! A plane section instead of a solid.

use super::Effect;
use crate::scene::Geometry;

pub(super) const EFFECT: Effect = Effect {
    name: "plane_strain",
    adds: "the section in its plane, per mm of length: two unknowns a node",
    without: "the solid finger",
    needs: &[],
    fits: |scene| match scene.geometry {
        Geometry::Mesh { .. } => Ok(()),
        _ => Err("this geometry is a solid; geometry.kind = \"section\" is plane"),
    },
    state: |c| c.plane_elements,
    state_is: "plane elements",
    switch_on: |_, plan| plan.plane_strain = true,
};
