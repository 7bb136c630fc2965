//! Nodes in the middle of an edge that is half an edge of a coarser neighbour.
//!
//! Where a cell of quadratic elements borders on two cells half its size, the middle nodes of
//! the two small edges lie a quarter along the large one. Displacement is continuous there only if
//! such a node follows the three nodes of the large edge, by their shape functions at the quarter:
//! `u = 3/8 u_near + 3/4 u_middle - 1/8 u_far`. The ends of the small edges are nodes of the large
//! one and free.

use super::{Block, Mesh};

/// A node that follows three others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HangingNode {
    /// The node.
    pub node: u32,
    /// Near end, middle and far end of the large edge.
    pub masters: [u32; 3],
}

impl HangingNode {
    /// Shape functions of the masters at the node.
    pub const WEIGHTS: [f64; 3] = [0.375, 0.75, -0.125];

    /// What a nodal vector field has at the node.
    #[must_use]
    pub fn of(&self, field: impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
        let at = self.masters.map(field);
        std::array::from_fn(|i| (0..3).map(|k| Self::WEIGHTS[k] * at[k][i]).sum())
    }

    /// The same in another numbering of nodes.
    #[must_use]
    pub fn renumbered(&self, number: impl Fn(u32) -> u32) -> Self {
        Self { node: number(self.node), masters: self.masters.map(number) }
    }
}

/// How an element's node hangs: the two masters that the element has itself; the third takes the
/// node's place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HangingInElement {
    local: usize,
    /// Local number and weight.
    own: [(usize, f64); 2],
    /// The master that takes the node's place, and its weight.
    other: (u32, f64),
}

impl HangingInElement {
    /// Turns a dense matrix over an element's nodes (three unknowns each, whole) into one over the
    /// nodes that they follow.
    pub(crate) fn condense(&self, dense: &mut [f64]) {
        let size = dense.len().isqrt();
        for i in 0..3 {
            let h = 3 * self.local + i;
            for row in dense.chunks_exact_mut(size) {
                let v = row[h];
                for (m, w) in self.own {
                    row[3 * m + i] += w * v;
                }
                row[h] = self.other.1 * v;
            }
            for c in 0..size {
                let v = dense[h * size + c];
                for (m, w) in self.own {
                    dense[(3 * m + i) * size + c] += w * v;
                }
                dense[h * size + c] = self.other.1 * v;
            }
        }
    }
}

impl Mesh {
    /// How the node hangs, if it does.
    #[must_use]
    pub fn hanging_node(&self, node: u32) -> Option<&HangingNode> {
        let at = self.hanging.binary_search_by_key(&node, |h| h.node).ok()?;
        Some(&self.hanging[at])
    }

    /// Gives nodes that hang what a nodal vector field has at them.
    pub(crate) fn follow(&self, field: &mut [[f64; 3]]) {
        for h in &self.hanging {
            field[h.node as usize] = h.of(|n| field[n as usize]);
        }
    }

    /// Moves what acts on nodes that hang (three components a node) to their masters: nothing is
    /// left there.
    pub(crate) fn condense(&self, force_n: &mut [f64]) {
        for h in &self.hanging {
            for i in 0..3 {
                let own = std::mem::take(&mut force_n[3 * h.node as usize + i]);
                for (&m, w) in h.masters.iter().zip(HangingNode::WEIGHTS) {
                    force_n[3 * m as usize + i] += w * own;
                }
            }
        }
    }

    /// Nodes whose unknowns an element couples: its own, but for one that hangs the master that
    /// the element does not have.
    pub(crate) fn coupled_nodes(&self, block: &Block, element: usize) -> Vec<u32> {
        let mut nodes = block.element(element).to_vec();
        for h in self.hanging_in_element(block, element) {
            nodes[h.local] = h.other.0;
        }
        nodes
    }

    /// How nodes of an element hang.
    pub(crate) fn hanging_in_element(
        &self,
        block: &Block,
        element: usize,
    ) -> Vec<HangingInElement> {
        let own = block.element(element);
        let place = |n: u32| own.iter().position(|&o| o == n);
        let in_element = |(local, &node): (usize, &u32)| {
            let hanging = self.hanging_node(node)?;
            let (mut of, mut other) = (Vec::new(), (node, 0.0));
            for (&m, w) in hanging.masters.iter().zip(HangingNode::WEIGHTS) {
                match place(m) {
                    Some(at) => of.push((at, w)),
                    None => other = (m, w),
                }
            }
            Some(HangingInElement { local, own: [of[0], of[1]], other })
        };
        own.iter().enumerate().filter_map(in_element).collect()
    }

    /// Nodes and shape functions of a point with those of nodes that hang handed to their masters.
    pub(crate) fn free_support(&self, nodes: &[u32], values: &[f64]) -> Vec<(u32, f64)> {
        let mut support: Vec<(u32, f64)> = Vec::with_capacity(nodes.len() + 1);
        let mut add = |node: u32, value: f64| match support.iter_mut().find(|(n, _)| *n == node) {
            Some((_, v)) => *v += value,
            None => support.push((node, value)),
        };
        for (&n, &v) in nodes.iter().zip(values) {
            match self.hanging_node(n) {
                None => add(n, v),
                Some(h) => {
                    for (m, w) in h.masters.into_iter().zip(HangingNode::WEIGHTS) {
                        add(m, w * v);
                    }
                }
            }
        }
        support
    }
}
