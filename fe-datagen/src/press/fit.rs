//! Whether the skin follows the indenter that it touches.
//!
//! Where two smooth bodies touch, the normal of one is that of the other. Contact is found at
//! nodes, and a node on an edge much sharper than the faces around it can slip off to a
//! flank: it is then in balance, pushed aside by the flank, while the edge stands in a face
//! between the nodes, unseen. Pressure, balances and residual say nothing of it, the normals do.

use super::body::{Body, PressError};
use crate::mesh::surface::norm;
use crate::solve::Solver;

/// Most of the contact force's normal part that may act along the skin. It is 0 in the limit of
/// fine meshes, at most .16 in random presses of the coarse fingertip whose faces are as wide
/// as some of the indenters, .35 on one half of a wedge and .97 where a row of nodes slipped.
const ASIDE_MAX: f64 = 0.5;

impl Body {
    /// Refuses an equilibrium whose indenter pushes nodes along the skin instead of into it.
    ///
    /// # Errors
    /// [`PressError::Slipped`].
    pub(super) fn follows(&self, solver: &Solver<'_>, depth_mm: f64) -> Result<(), PressError> {
        let Some(contact) = &self.problem.contact else { return Ok(()) };
        let surface = &self.problem.mesh.surfaces[&self.contact];
        let x = solver.deformed();
        let mut normal = vec![[0.0; 3]; x.len()];
        let rule = surface.kind.quadrature();
        surface.integrate(&rule, &|n| x[n as usize], &mut |face, value, area| {
            for (&n, v) in face.iter().zip(value) {
                for i in 0..3 {
                    normal[n as usize][i] += v * area[i];
                }
            }
        });
        let (mut pressing_n, mut touched_mm2, mut touching) = (0.0, 0.0, 0u32);
        let mut aside_n = [0.0; 3];
        for ((&n, &area_mm2), &traction) in
            contact.nodes.iter().zip(&contact.area_mm2).zip(solver.traction_mpa())
        {
            let n = n as usize;
            let size = norm(normal[n]);
            if !(traction > 0.0 && size > 0.0) {
                continue;
            }
            let Some(found) = solver.distance(x[n]) else { return Ok(()) };
            let (push, skin) = (found.normal, normal[n].map(|v| v / size));
            let into: f64 = (0..3).map(|i| push[i] * skin[i]).sum();
            let force_n = traction * area_mm2;
            for i in 0..3 {
                aside_n[i] += force_n * (push[i] - into * skin[i]);
            }
            (pressing_n, touched_mm2) = (pressing_n + force_n, touched_mm2 + area_mm2);
            touching += 1;
        }
        let share = norm(aside_n) / pressing_n;
        if touching > 0 && !(share <= ASIDE_MAX) {
            let spacing_mm = (touched_mm2 / f64::from(touching)).sqrt();
            return Err(PressError::Slipped { depth_mm, share, spacing_mm });
        }
        Ok(())
    }
}
