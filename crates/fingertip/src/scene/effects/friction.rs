//! Coulomb friction between skin and indenter.

use super::Effect;

pub(super) const EFFECT: Effect = Effect {
    name: "friction",
    adds: "Coulomb friction with friction.coefficient; maps of shear traction",
    without: "the skin slides freely; no tangential unknowns",
    needs: &[],
    fits: |scene| {
        if scene.friction.coefficient > 0.0 {
            Ok(())
        } else {
            Err("friction.coefficient is 0; leave the effect out or give a coefficient")
        }
    },
    state: |c| c.friction_states,
    state_is: "tangential states of contact nodes",
    switch_on: |scene, plan| plan.friction = scene.friction.coefficient,
};
