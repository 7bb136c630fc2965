//! The nail plate deforms.

use super::Effect;
use crate::scene::Geometry;

pub(super) const EFFECT: Effect = Effect {
    name: "nail",
    adds: "the nail plate is meshed and elastic, carried by the tissue below it",
    without: "the nail plate is rigid: the skin under it does not move",
    needs: &[],
    fits: |scene| match scene.geometry {
        Geometry::Fingertip { .. } | Geometry::Section { .. } => Ok(()),
        _ => Err("only fingertip and section have a nail of their own; a mesh names its tissues"),
    },
    state: |c| c.nail_elements,
    state_is: "elements of nail",
    switch_on: |_, plan| plan.parts.nail = true,
};
