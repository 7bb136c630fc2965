//! Bone deforms.

use super::Effect;
use crate::scene::Geometry;

pub(super) const EFFECT: Effect = Effect {
    name: "elastic_bone",
    adds: "bone is meshed and elastic, held at its base",
    without: "bone is rigid: its surface does not move",
    needs: &[],
    fits: |scene| match scene.geometry {
        Geometry::Fingertip { .. } | Geometry::Section { .. } => Ok(()),
        _ => Err("only fingertip and section have a bone of their own; a mesh names its tissues"),
    },
    state: |c| c.bone_elements,
    state_is: "elements of bone",
    switch_on: |_, plan| plan.parts.bone = true,
};
