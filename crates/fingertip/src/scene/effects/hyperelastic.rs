//! Ogden's law where a tissue has one.

use super::{Effect, Law};
use crate::tissue::Tissue;

pub(super) const EFFECT: Effect = Effect {
    name: "hyperelastic",
    adds: "Ogden's law for every tissue that has a table [materials.TISSUE.ogden]",
    without: "neo-Hookean law from Young's modulus and Poisson's ratio",
    needs: &["finite_strain"],
    fits: |scene| {
        let any = Tissue::ALL.iter().any(|&t| scene.materials.of(t).ogden.is_some());
        if any { Ok(()) } else { Err("no tissue has a table [materials.TISSUE.ogden]") }
    },
    state: |c| c.ogden_points,
    state_is: "quadrature points with Ogden's law",
    switch_on: |_, plan| plan.law = Law::Ogden,
};
