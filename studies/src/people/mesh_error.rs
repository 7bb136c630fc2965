//! How far what receptors feel moves on a finer mesh.

use crate::people::PeopleError;
use crate::people::measured::Sa1;
use crate::people::press::{Press, Subject};
use crate::people::receptors::{DEPTHS_MM, Stimulus};
use crate::people::solution::{Reads, Solution, held_at};
use papilla_fingertip::mesh::fingertip::Density;
use serde::Serialize;
use std::path::Path;

/// How far past the last state's force a value may be taken, of the force.
const BEYOND: f64 = 0.2;

/// How far what is felt under the middle moves on a finer mesh.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MeshError {
    /// The stimulus.
    pub stimulus: Stimulus,
    /// Index into [`DEPTHS_MM`].
    pub depth: usize,
    /// Curvature of the sphere, 1/m.
    pub curvature_per_m: f64,
    /// Largest |coarser - finer| over the finer, of all forces.
    pub relative: f64,
}

/// The curved spheres of the profiles on both meshes.
pub(crate) fn mesh_errors(
    sa1: &Sa1,
    subject: &Subject,
    [coarser, finer]: [Density; 2],
    folder: &Path,
    told: &mut dyn FnMut(&str),
) -> Result<Vec<MeshError>, PeopleError> {
    let mut errors = Vec::new();
    // A plate costs several times what a sphere does.
    for p in sa1.profiles.iter().filter(|p| p.curvature_per_m > 0.0) {
        let press = Press::sphere(p.curvature_per_m, subject.clone());
        told(&format!("{} on the finer mesh", press.name));
        let fine = held_at(&press, &sa1.force_n, finer, Reads::Receptors, folder)?;
        let coarse = held_at(&press, &sa1.force_n, coarser, Reads::Receptors, folder)?;
        let middle = |found: &Solution, force_n: f64, s: Stimulus, d: usize| {
            let values: Vec<f64> =
                found.states.iter().map(|state| state.felt[d][s as usize][0]).collect();
            found.path.value_at(force_n, &values, BEYOND).unwrap_or(f64::NAN)
        };
        for stimulus in Stimulus::ALL {
            for depth in 0..DEPTHS_MM.len() {
                let relative = sa1.force_n.iter().map(|&f| {
                    let found = [&coarse, &fine].map(|s| middle(s, f, stimulus, depth));
                    (found[0] / found[1] - 1.0).abs()
                });
                let relative = relative.fold(0.0, f64::max);
                let curvature_per_m = p.curvature_per_m;
                errors.push(MeshError { stimulus, depth, curvature_per_m, relative });
            }
        }
    }
    Ok(errors)
}
