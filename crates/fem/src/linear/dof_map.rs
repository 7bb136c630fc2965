//! Numbers of the unknowns.

use crate::mesh::HangingNode;

/// Which degrees of freedom are unknown.
#[derive(Clone, Debug)]
pub struct DofMap {
    /// Equation of each degree of freedom `3 node + component`; [`Self::FIXED`] if prescribed or
    /// of a node that follows others.
    pub of_dof: Vec<u32>,
    /// Number of unknowns.
    pub count: usize,
}

impl DofMap {
    /// Mark of a prescribed degree of freedom.
    pub const FIXED: u32 = u32::MAX;

    /// Numbers the degrees of freedom for which `fixed` is false, but those of `hanging` nodes.
    #[must_use]
    pub fn new(fixed: &[bool], hanging: &[HangingNode]) -> Self {
        let mut fixed = fixed.to_vec();
        for h in hanging {
            let first = 3 * h.node as usize;
            fixed[first..first + 3].fill(true);
        }
        let mut count = 0;
        let of_dof = fixed
            .into_iter()
            .map(|f| {
                if f {
                    Self::FIXED
                } else {
                    count += 1;
                    count - 1
                }
            })
            .collect();
        Self { of_dof, count: count as usize }
    }
}
