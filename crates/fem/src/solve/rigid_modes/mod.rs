//! Parts of a body that nothing holds: found before anything is solved.
//!
//! A part is what elements connect.

mod modes;

pub use modes::FreeMode;

use super::problem::Problem;
use crate::mesh::Mesh;
use modes::free_modes;
use std::collections::HashMap;

/// A part that can move as a rigid whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{part} can move freely: nothing keeps it from {motion}. Hold more of its surface \
     (fixed surfaces: bone, nail, base); contact alone does not hold it{hint}",
    part = self.part(), motion = self.motion(), hint = self.hint()
)]
pub struct FreePart {
    /// Elements of the part, of how many.
    pub elements: [usize; 2],
    /// Middle of the part, mm.
    pub middle_mm: [f64; 3],
    /// What it can do.
    pub modes: Vec<FreeMode>,
    /// Nodes of the part that lie on nodes of another.
    pub coincident_nodes: usize,
}

impl FreePart {
    fn part(&self) -> String {
        let [own, all] = self.elements;
        if own == all {
            return "the body".into();
        }
        let [x, y, z] = self.middle_mm;
        format!(
            "a part of {own} of the {all} elements around ({x:.3}, {y:.3}, {z:.3}) mm, connected \
             to nothing else,"
        )
    }

    fn motion(&self) -> String {
        self.modes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
    }

    fn hint(&self) -> String {
        match self.coincident_nodes {
            0 => String::new(),
            n => format!(
                ". {n} of its nodes lie on nodes of another part: were the two meant to be one? In \
                 Gmsh, Coherence Mesh merges them"
            ),
        }
    }
}

impl Problem {
    /// Whether every part of the body is held.
    ///
    /// # Errors
    /// [`FreePart`], the first that is not.
    pub fn is_held(&self) -> Result<(), FreePart> {
        let part_of = parts(&self.mesh);
        let count = part_of.iter().max().map_or(0, |p| *p as usize + 1);
        let mut members = vec![Vec::new(); count];
        for (node, part) in part_of.iter().enumerate() {
            members[*part as usize].push(node);
        }
        for (part, nodes) in members.iter().enumerate() {
            let modes = free_modes(&self.mesh, nodes, &self.fixed);
            if !modes.is_empty() {
                return Err(self.free_part(part as u32, nodes, modes, &part_of));
            }
        }
        Ok(())
    }

    fn free_part(
        &self,
        part: u32,
        nodes: &[usize],
        modes: Vec<FreeMode>,
        part_of: &[u32],
    ) -> FreePart {
        let mesh = &self.mesh;
        let own = |b: &crate::mesh::Block| {
            (0..b.len()).filter(|&e| part_of[b.element(e)[0] as usize] == part).count()
        };
        // Adding zero turns -0 into 0.
        let key = |p: &[f64; 3]| p.map(|v| (v + 0.0).to_bits());
        let others: std::collections::HashSet<_> = (0..part_of.len())
            .filter(|&n| part_of[n] != part)
            .map(|n| key(&mesh.nodes[n]))
            .collect();
        FreePart {
            elements: [mesh.blocks.iter().map(own).sum(), mesh.element_count()],
            middle_mm: middle(mesh, nodes),
            modes,
            coincident_nodes: nodes
                .iter()
                .filter(|&&n| others.contains(&key(&mesh.nodes[n])))
                .count(),
        }
    }
}

/// Part of every node, numbered from 0 in the order of nodes.
fn parts(mesh: &Mesh) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    fn root(parent: &mut [u32], mut n: u32) -> u32 {
        while parent[n as usize] != n {
            parent[n as usize] = parent[parent[n as usize] as usize];
            n = parent[n as usize];
        }
        n
    }
    for block in &mesh.blocks {
        for e in 0..block.len() {
            let nodes = block.element(e);
            let first = root(&mut parent, nodes[0]);
            for &n in &nodes[1..] {
                let other = root(&mut parent, n);
                parent[other as usize] = first;
            }
        }
    }
    let mut number = HashMap::new();
    (0..mesh.nodes.len() as u32)
        .map(|n| {
            let next = number.len() as u32;
            *number.entry(root(&mut parent, n)).or_insert(next)
        })
        .collect()
}

fn middle(mesh: &Mesh, nodes: &[usize]) -> [f64; 3] {
    let sum = |i: usize| nodes.iter().map(|&n| mesh.nodes[n][i]).sum::<f64>();
    std::array::from_fn(|i| sum(i) / nodes.len() as f64)
}
