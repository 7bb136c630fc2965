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

#[cfg(test)]
mod tests {
    use crate::element::{Elastic, ElementKind, Materials};
    use crate::material::NeoHookean;
    use crate::mesh::block::even;
    use crate::mesh::lattice::lattice;
    use crate::mesh::{HangingNode, Mesh};
    use crate::solve::{Loading, Options, Problem, Solver};

    /// A large cube beside two half its size along y, joined at x = 1.
    fn joined() -> Mesh {
        let axis = |n: usize| even(1.0, n);
        let kind = ElementKind::Hex27;
        let large = lattice(kind, [axis(2), axis(2), axis(2)], |p| p);
        let small = lattice(kind, [axis(2), axis(4), axis(2)], |[x, y, z]| [1.0 + 0.5 * x, y, z]);
        let mut mesh = Mesh { nodes: large.nodes.clone(), ..Mesh::default() };
        let find = |nodes: &[[f64; 3]], p: [f64; 3]| {
            nodes.iter().position(|q| (0..3).all(|i| (p[i] - q[i]).abs() < 1e-9)).map(|n| n as u32)
        };
        let number: Vec<u32> = small
            .nodes
            .iter()
            .map(|&p| {
                find(&mesh.nodes, p).unwrap_or_else(|| {
                    mesh.nodes.push(p);
                    mesh.nodes.len() as u32 - 1
                })
            })
            .collect();
        let mut block = large.blocks[0].clone();
        block.connectivity.extend(small.blocks[0].connectivity.iter().map(|&n| number[n as usize]));
        block.region.extend(&small.blocks[0].region);
        mesh.blocks.push(block);
        for z in [0.0, 0.5, 1.0] {
            let at = |y: f64| find(&mesh.nodes, [1.0, y, z]).unwrap();
            for (y, near, far) in [(0.25, 0.0, 1.0), (0.75, 1.0, 0.0)] {
                let masters = [at(near), at(0.5), at(far)];
                mesh.hanging.push(HangingNode { node: at(y), masters });
            }
        }
        mesh.hanging.sort_unstable_by_key(|h| h.node);
        mesh
    }

    /// Solves for what lies between the two ends, where `field` is prescribed.
    fn solve(mesh: Mesh, field: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[f64; 3]> {
        let law = NeoHookean { mu_mpa: 0.3 };
        let materials = Materials::new([0; 5].map(|_| Elastic::shared(law, 4.0)).into());
        let nodes = mesh.nodes.clone();
        let mut fixed = vec![false; 3 * nodes.len()];
        let mut loading = Loading::default();
        for (n, &p) in nodes.iter().enumerate().filter(|(_, p)| p[0] < 1e-9 || p[0] > 1.5 - 1e-9) {
            for i in 0..3 {
                fixed[3 * n + i] = true;
                loading.prescribed_mm.push((3 * n + i, field(p)[i]));
            }
        }
        let problem = Problem::new(mesh, materials, fixed, None).unwrap();
        let options = Options { residual_tolerance: 1e-11, ..Options::default() };
        let mut solver = Solver::new(&problem, options).unwrap();
        solver.start(loading);
        solver.advance_to(1.0).unwrap();
        solver.displacement_mm().to_vec()
    }

    /// A bar that is pulled, its ends held, against one of small cubes only: the joint costs no
    /// accuracy beyond that of the large cube, but for its small cubes' being on one side.
    #[test]
    fn a_joint_is_no_worse_than_the_large_side() {
        let field = |[x, _, _]: [f64; 3]| [0.1 * x, 0.0, 0.0];
        let mesh = joined();
        let u = solve(mesh.clone(), field);
        for h in &mesh.hanging {
            assert_eq!(h.of(|m| u[m as usize]), u[h.node as usize], "the node follows");
        }
        let kind = ElementKind::Hex27;
        let fine = lattice(kind, [even(1.5, 12), even(1.0, 8), even(1.0, 4)], |p| p);
        let large =
            lattice(kind, [vec![0.0, 0.5, 1.0, 1.25, 1.5], even(1.0, 2), even(1.0, 2)], |p| p);
        let (fine_at, large_at) = (fine.nodes.clone(), large.nodes.clone());
        let due = solve(fine, field);
        // At the nodes of the large cubes, which all meshes have.
        let error = |at: &[[f64; 3]], u: &[[f64; 3]]| -> f64 {
            let find = |at: &[[f64; 3]], p: &[f64; 3]| {
                at.iter().position(|q| (0..3).all(|i| (p[i] - q[i]).abs() < 1e-9)).unwrap()
            };
            let miss = |p: &[f64; 3]| {
                let (a, b) = (u[find(at, p)], due[find(&fine_at, p)]);
                (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>()
            };
            large_at.iter().map(miss).sum::<f64>().sqrt()
        };
        let (joint, coarse) = (error(&mesh.nodes, &u), error(&large_at, &solve(large, field)));
        assert!(joint < 1.2 * coarse, "{joint} against {coarse}");
    }

    /// A strain that is even in every direction, prescribed on the whole outside: inside and on the
    /// joint nodes find it themselves, to rounding.
    #[test]
    fn the_patch_test_is_passed_to_rounding() {
        let h = [[0.08, 0.03, -0.02], [0.01, -0.05, 0.04], [0.02, 0.01, 0.06]];
        let field = |p: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| (0..3).map(|j| h[i][j] * p[j]).sum())
        };
        let mesh = joined();
        let nodes = mesh.nodes.clone();
        let law = NeoHookean { mu_mpa: 0.3 };
        let materials = Materials::new([0; 5].map(|_| Elastic::shared(law, 4.0)).into());
        let mut fixed = vec![false; 3 * nodes.len()];
        let mut loading = Loading::default();
        let outside =
            |p: &[f64; 3]| (0..3).any(|i| p[i] < 1e-9 || p[i] > [1.5, 1.0, 1.0][i] - 1e-9);
        for (n, &p) in nodes.iter().enumerate() {
            if mesh.hanging_node(n as u32).is_none() && outside(&p) {
                for i in 0..3 {
                    fixed[3 * n + i] = true;
                    loading.prescribed_mm.push((3 * n + i, field(p)[i]));
                }
            }
        }
        let problem = Problem::new(mesh, materials, fixed, None).unwrap();
        assert!(problem.system.dofs.count >= 9);
        let options = Options { residual_tolerance: 1e-12, ..Options::default() };
        let mut solver = Solver::new(&problem, options).unwrap();
        solver.start(loading);
        solver.advance_to(1.0).unwrap();
        for (p, u) in nodes.iter().zip(solver.displacement_mm()) {
            let due = field(*p);
            assert!((0..3).all(|i| (due[i] - u[i]).abs() < 1e-9), "{p:?}: {u:?} {due:?}");
        }
    }
}
