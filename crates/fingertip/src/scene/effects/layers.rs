//! Each tissue has its own constants.

use super::{Effect, always};
use crate::tissue::Tissue;

pub(super) const EFFECT: Effect = Effect {
    name: "layers",
    adds: "epidermis, dermis and subcutaneous tissue with their own constants",
    without: "all soft tissue is subcutaneous",
    needs: &[],
    fits: always,
    state: |c| c.layered_elements,
    state_is: "elements of skin with constants of their own",
    switch_on: |_, plan| plan.tissues = Tissue::ALL,
};
