//! Each tissue has its own constants.

use super::{Effect, always};
use crate::mesh::Tissue;

pub(super) const EFFECT: Effect = Effect {
    name: "layers",
    adds: "epidermis, dermis and subcutaneous tissue with their own constants",
    without: "all soft tissue is subcutaneous",
    needs: &[],
    fits: always,
    switch_on: |_, plan| plan.tissues = Tissue::ALL,
};
