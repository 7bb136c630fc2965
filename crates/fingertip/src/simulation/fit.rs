//! Whether the skin follows the indenter that it touches.
//!
//! Where two smooth bodies touch, the normal of one is that of the other. Contact is found at
//! nodes, and a node on an edge much sharper than the faces around it can slip off to a
//! flank: it is then in balance, pushed aside by the flank, while the edge stands in a face
//! between the nodes, unseen. Pressure, balances and residual say nothing of it, the normals do.

use super::body::{Body, SimulationError};
use papilla_fem::mesh::Surface;
use papilla_fem::solve::Solver;
use papilla_vector::{dot, norm, scaled_to_one};
use std::collections::BTreeMap;

/// Most of the contact force's normal part that may act along the skin. It is 0 in the limit of
/// fine meshes, at most .16 in random indentations of the coarse fingertip whose faces are as wide
/// as some of the indenters, .35 on one half of a wedge and .73 where a row of nodes slipped.
const ASIDE_MAX: f64 = 0.5;
/// Cosine of the angle between a node's undeformed faces and their mean beyond which the skin has
/// an edge of its own there: an indenter may push it in any direction between.
const SMOOTH_MIN: f64 = 0.866;

impl Body {
    /// Refuses an equilibrium whose indenter pushes nodes along the skin instead of into it.
    ///
    /// # Errors
    /// [`SimulationError::Slipped`].
    pub(super) fn follows(
        &self,
        solver: &Solver<'_>,
        depth_mm: f64,
    ) -> Result<(), SimulationError> {
        let Some(contact) = &self.problem.contact else { return Ok(()) };
        let surface = &self.problem.mesh.surfaces[&self.contact];
        let x = solver.deformed();
        let normal = mean_normals(surface, &x);
        let smooth = smooth_nodes(surface, &self.problem.mesh.nodes);
        let (mut pressing_n, mut touched_mm2, mut touching) = (0.0, 0.0, 0u32);
        let mut aside_n = [0.0; 3];
        for ((&n, &area_mm2), traction) in
            contact.nodes().iter().zip(contact.area_mm2()).zip(solver.traction_mpa())
        {
            let n = n as usize;
            if !(traction > 0.0) {
                continue;
            }
            let force_n = traction * area_mm2;
            (pressing_n, touched_mm2) = (pressing_n + force_n, touched_mm2 + area_mm2);
            touching += 1;
            let (Some(found), true) = (solver.distance(x[n]), smooth[n]) else { continue };
            let (push, skin) = (found.normal, normal[n]);
            let into = dot(push, skin);
            for i in 0..3 {
                aside_n[i] += force_n * (push[i] - into * skin[i]);
            }
        }
        let share = norm(aside_n) / pressing_n;
        if touching > 0 && !(share <= ASIDE_MAX) {
            let spacing_mm = (touched_mm2 / f64::from(touching)).sqrt();
            return Err(SimulationError::Slipped { depth_mm, share, spacing_mm });
        }
        Ok(())
    }
}

/// Mean normal of the faces around each node at the positions `x`; zero off the surface.
fn mean_normals(surface: &Surface, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut sum = vec![[0.0; 3]; x.len()];
    surface.integrate(&surface.kind.quadrature(), &|n| x[n as usize], &mut |face, value, area| {
        for (&n, v) in face.iter().zip(value) {
            for i in 0..3 {
                sum[n as usize][i] += v * area[i];
            }
        }
    });
    sum.into_iter().map(scaled_to_one).collect()
}

/// Nodes at which the undeformed skin has one normal: neither on its rim nor on an edge of it.
fn smooth_nodes(surface: &Surface, x: &[[f64; 3]]) -> Vec<bool> {
    let mean = mean_normals(surface, x);
    let mut smooth = vec![true; x.len()];
    surface.integrate(&surface.kind.quadrature(), &|n| x[n as usize], &mut |face, _, area| {
        let own = scaled_to_one(area);
        for &n in face {
            smooth[n as usize] &= dot(own, mean[n as usize]) >= SMOOTH_MIN;
        }
    });
    // An edge that only one face has is on the rim, its middle node too; of a line its ends.
    let corners = surface.kind.corners();
    let mut edges: BTreeMap<[u32; 2], (u32, Option<u32>)> = BTreeMap::new();
    for face in surface.faces() {
        for k in 0..corners {
            let (a, b) = (face[k], face[(k + 1) % corners]);
            let (ends, middle) = if corners == 2 {
                ([a, a], None)
            } else {
                ([a.min(b), a.max(b)], face.get(corners + k).copied())
            };
            edges.entry(ends).or_insert((0, middle)).0 += 1;
        }
    }
    for (ends, (_, middle)) in edges.into_iter().filter(|(_, (faces, _))| *faces == 1) {
        ends.into_iter().chain(middle).for_each(|n| smooth[n as usize] = false);
    }
    smooth
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fem::mesh::surface::FaceKind;

    #[test]
    fn rims_and_edges_are_not_smooth() {
        // Two squares in the plane and one that stands on their end: an L.
        let mut x: Vec<[f64; 3]> = Vec::new();
        for i in 0..3 {
            x.extend([0.0, 1.0, 2.0].map(|y| [f64::from(i), y, 0.0]));
        }
        x.extend([0.0, 1.0, 2.0].map(|y| [2.0, y, -1.0]));
        let face = |a: u32| [a, a + 3, a + 4, a + 1];
        let connectivity = [0, 1, 3, 4, 6, 7].into_iter().flat_map(face).collect();
        let surface = Surface { kind: FaceKind::Quad4, connectivity };
        let smooth = smooth_nodes(&surface, &x);
        let found: Vec<_> = (0..x.len()).filter(|&n| smooth[n]).collect();
        assert_eq!(found, [4], "the middle of the flat part alone");
        let chain = Surface { kind: FaceKind::Line2, connectivity: vec![0, 3, 3, 6] };
        let smooth = smooth_nodes(&chain, &x);
        assert_eq!([smooth[0], smooth[3], smooth[6]], [false, true, false]);
    }
}
