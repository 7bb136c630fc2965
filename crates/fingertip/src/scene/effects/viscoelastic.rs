//! Tissue relaxes.

use super::Effect;
use crate::tissue::Tissue;

pub(super) const EFFECT: Effect = Effect {
    name: "viscoelastic",
    adds: "Prony relaxation of shear for every tissue that has a table [materials.TISSUE.prony]",
    without: "no time: instantaneous moduli, no memory at any point",
    needs: &[],
    fits: |scene| {
        if scene.motion.path.is_none() {
            return Err("needs to know how fast: give motion.path with times");
        }
        let any = Tissue::ALL.iter().any(|&t| scene.materials.of(t).prony.is_some());
        if any { Ok(()) } else { Err("no tissue has a table [materials.TISSUE.prony]") }
    },
    state: |c| c.history_numbers,
    state_is: "numbers of history",
    switch_on: |_, plan| plan.relaxes = true,
};
