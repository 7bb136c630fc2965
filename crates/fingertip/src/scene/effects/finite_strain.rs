//! Large displacements and strains.

use super::{Effect, Law, always};

pub(super) const EFFECT: Effect = Effect {
    name: "finite_strain",
    adds: "large strain and rotation: neo-Hookean law, geometric stiffness",
    without: "linear elasticity at small strain (contact stays on the deformed skin)",
    needs: &[],
    fits: always,
    state: |c| c.finite_strain_points,
    state_is: "quadrature points with geometric stiffness",
    switch_on: |_, plan| plan.law = Law::NeoHookean,
};
