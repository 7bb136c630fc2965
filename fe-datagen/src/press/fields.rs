//! Fields of a whole body at one equilibrium, for looking at.

use super::body::Body;
use crate::element::Memory;
use crate::element::kernel::displacement_gradient;
use crate::material::Kinematics;
use crate::output::vtu::{self, Field, VtuMesh};
use crate::output::{OutputError, vtu::Values};
use crate::solve::Solver;
use std::path::Path;

/// Pa per MPa, and J/m3 per mJ/mm3.
pub const PA_PER_MPA: f64 = 1e6;

/// Element means, in the order of the mesh's blocks.
struct ElementFields {
    sed_j_per_m3: Vec<f64>,
    volume_ratio: Vec<f64>,
    layer: Vec<i32>,
}

impl ElementFields {
    fn new(body: &Body, solver: &Solver<'_>) -> Self {
        let mut fields =
            Self { sed_j_per_m3: Vec::new(), volume_ratio: Vec::new(), layer: Vec::new() };
        let (problem, u) = (&body.problem, solver.displacement_mm());
        for (b, (block, geometry)) in problem.mesh.blocks.iter().zip(&problem.geometry).enumerate()
        {
            let n = block.kind.nodes();
            let mut force = vec![[0.0; 3]; n];
            for e in 0..block.len() {
                let local: Vec<_> = block.element(e).iter().map(|&n| u[n as usize]).collect();
                let solid = &problem.materials[block.tissue[e].index()];
                let shape = geometry.element(e);
                let history = solver.history_of(b, e);
                let memory = Memory { history, dt_s: 0.0 };
                // An equilibrium has no inverted element; NaN would show one.
                let theta = solid
                    .evaluate(shape, &local, memory, &mut force, None)
                    .map_or([f64::NAN; 4], |s| s.theta_minus_1);
                let (mut energy, mut volume, mut growth) = (0.0, 0.0, 0.0);
                let len = solid.history_len();
                for (q, gradients) in shape.gradients.chunks_exact(n).enumerate() {
                    let k = Kinematics::new(displacement_gradient(&local, gradients));
                    let t: f64 = shape.basis[q].iter().zip(theta).map(|(b, t)| b * t).sum();
                    let own = &history[q * len..(q + 1) * len];
                    let weight = shape.weights[q];
                    energy += weight * solid.stored_mpa(&k, t, own);
                    volume += weight;
                    growth += weight * t;
                }
                fields.sed_j_per_m3.push(energy / volume * PA_PER_MPA);
                fields.volume_ratio.push(1.0 + growth / volume);
                fields.layer.push(block.tissue[e].index() as i32);
            }
        }
        fields
    }
}

/// Writes the body at the solver's equilibrium as `.vtu`: points with
/// displacement (mm) and contact pressure (Pa), cells with SED (J/m3 of
/// undeformed volume, element mean), volume ratio and layer id (0 epidermis,
/// 1 dermis, 2 subcutaneous, 3 nail, 4 bone).
///
/// # Errors
/// [`OutputError`] if the file cannot be written.
pub fn write_vtu(path: &Path, body: &Body, solver: &Solver<'_>) -> Result<(), OutputError> {
    let mesh = &body.problem.mesh;
    let (mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new());
    for block in &mesh.blocks {
        for e in 0..block.len() {
            connectivity.extend(block.element(e).iter().map(|&n| n as usize));
            offsets.push(connectivity.len());
            types.push(block.kind.vtk_cell_type());
        }
    }
    let u = solver.displacement_mm();
    let fields = ElementFields::new(body, solver);
    let pressure: Vec<f64> = solver
        .pressure_mpa(&mesh.surfaces[&body.contact])
        .into_iter()
        .map(|p| p * PA_PER_MPA)
        .collect();
    let view = VtuMesh {
        points: &mesh.nodes,
        connectivity: &connectivity,
        offsets: &offsets,
        types: &types,
    };
    let points = [
        Field { name: "displacement_mm", components: 3, values: Values::F64(u.as_flattened()) },
        Field { name: "pressure_pa", components: 1, values: Values::F64As32(&pressure) },
    ];
    let cells = [
        Field {
            name: "sed_j_per_m3",
            components: 1,
            values: Values::F64As32(&fields.sed_j_per_m3),
        },
        Field {
            name: "volume_ratio",
            components: 1,
            values: Values::F64As32(&fields.volume_ratio),
        },
        Field { name: "layer", components: 1, values: Values::I32(&fields.layer) },
    ];
    vtu::write(path, &view, &points, &cells)
}
