//! A plane section instead of a solid.

use super::Effect;
use crate::mesh::section::Extent;
use crate::scene::{Geometry, Scene};

pub(super) const EFFECT: Effect = Effect {
    name: "plane_strain",
    adds: "the section in its plane, per mm of length: two unknowns a node",
    without: "the solid finger",
    needs: &[],
    fits,
    state: |c| c.plane_elements,
    state_is: "plane elements",
    switch_on: |_, plan| plan.plane_strain = true,
};

/// The indenter stays in the plane, and a half section's on its axis of symmetry.
fn fits(scene: &Scene) -> Result<(), &'static str> {
    let half = match scene.geometry {
        Geometry::Section { extent, .. } => extent == Extent::Half,
        Geometry::Mesh { .. } => false,
        _ => return Err("this geometry is a solid; geometry.kind = \"section\" is plane"),
    };
    let motion = &scene.motion;
    let shifts = || motion.path.iter().flatten().map(|p| p.shift_mm);
    let aside = |[x, y]: [f64; 2]| (x != 0.0, y != 0.0);
    let moves: Vec<_> = shifts().chain([motion.offset_mm]).map(aside).collect();
    if motion.roll_deg != 0.0 || motion.yaw_deg != 0.0 || moves.iter().any(|m| m.1) {
        return Err(
            "is in a plane: leave out motion.roll_deg, yaw_deg and every second component \
                    of offset_mm and shift_mm",
        );
    }
    if half && (motion.pitch_deg != 0.0 || moves.iter().any(|m| m.0)) {
        return Err("half a section needs a press along its axis of symmetry: give \
                    geometry.extent = \"whole\", or leave out pitch_deg, offset_mm and shift_mm");
    }
    Ok(())
}
