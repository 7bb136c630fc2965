//! What to ask before a scene is solved that is valid and may be a mistake all the same.

use crate::scene::{Pressure, Scene};
use crate::simulation::Simulation;
use crate::simulation::body::SimulationError;
use crate::simulation::drive::Drive;

/// Part of the way to the bone from which little tissue is left to yield.
const NEAR_BONE: f64 = 0.5;

/// What is doubtful about a scene; empty if nothing is.
///
/// # Errors
/// As [`Simulation::new`].
pub fn doubts(scene: &Scene, setup: &Simulation) -> Result<Vec<String>, SimulationError> {
    let Simulation { body, approach, drive, .. } = setup;
    let mut found = Vec::new();
    if let Some(pressure) = &scene.pressure {
        let map_pa = pressure.map_pa(&scene.folder)?;
        found.extend(Pressure::tiny_pa(&map_pa).map(|most_pa| {
            format!("pressure: {most_pa:.4} Pa at most; were kPa or MPa given? Pa are due")
        }));
        return Ok(found);
    }
    if let Some([width_mm, spacing_mm]) = body.too_narrow_mm(approach) {
        found.push(format!(
            "indenter: it is {width_mm:.3} mm wide, and the nodes of the skin are about {spacing_mm:.3} mm \
             apart: the force is that of single nodes. Take geometry.order = \"graded\" or a finer mesh"
        ));
    }
    if let Drive::Depths(depths_mm) = drive
        && let Some(room_mm) = body.room_mm(&body.indenter(approach, drive)?)
        && let Some(&depth_mm) = depths_mm.last()
        && depth_mm > NEAR_BONE * room_mm
    {
        found.push(format!(
            "motion.depth_mm: {depth_mm} of the {room_mm:.2} mm to the bone. The counts of iterations \
             come from less deep presses: it may take several times as long, or end without an \
             equilibrium"
        ));
    }
    Ok(found)
}
