//! Tissue is full of fluid.

use super::Effect;
use crate::mesh::fingertip::Order;
use crate::scene::{Geometry, Scene};
use crate::tissue::Tissue;

pub(super) const EFFECT: Effect = Effect {
    name: "biphasic",
    adds: "fluid that flows through every tissue that has a table [materials.TISSUE.biphasic]",
    without: "tissue of one phase: no fluid pressure, volume by Poisson's ratio",
    needs: &[],
    fits,
    state: |c| c.pressure_unknowns,
    state_is: "unknowns of fluid pressure",
    switch_on: |scene, plan| plan.fluid = Some(scene.biphasic.skin),
};

fn fits(scene: &Scene) -> Result<(), &'static str> {
    if scene.motion.path.is_none() {
        return Err("needs to know how fast: give motion.path with times");
    }
    let quadratic = match &scene.geometry {
        Geometry::Fingertip { order, .. }
        | Geometry::Section { order, .. }
        | Geometry::Block { order, .. } => *order == Order::Quadratic,
        // Its elements are looked at when it is read.
        Geometry::Mesh { .. } => true,
    };
    if !quadratic {
        return Err("needs displacement quadratic where pressure is linear: give \
                    geometry.order = \"quadratic\"");
    }
    let any = Tissue::ALL.iter().any(|&t| scene.materials.of(t).biphasic.is_some());
    if any { Ok(()) } else { Err("no tissue has a table [materials.TISSUE.biphasic]") }
}
