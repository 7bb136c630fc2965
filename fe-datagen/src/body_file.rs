//! A whole body at one equilibrium as a `.vtu`, for looking at.

use papilla_fem::solve::Solver;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::fields::{ElementFields, PA_PER_MPA};
use papilla_output::OutputError;
use papilla_output::vtu::{self, Field, Values, VtuMesh};
use std::path::Path;

/// Writes the body at the solver's equilibrium as `.vtu`: points with
/// displacement (mm), contact pressure and, of biphasic tissue, the fluid's (Pa), cells with SED (J/m3 of
/// undeformed volume, element mean), volume ratio and layer id (0 epidermis,
/// 1 dermis, 2 subcutaneous, 3 nail, 4 bone).
///
/// # Errors
/// [`OutputError`] if the file cannot be written.
pub(crate) fn write_vtu(path: &Path, body: &Body, solver: &Solver<'_>) -> Result<(), OutputError> {
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
    let mut points = vec![
        Field { name: "displacement_mm", components: 3, values: Values::F64(u.as_flattened()) },
        Field { name: "pressure_pa", components: 1, values: Values::F64As32(&pressure) },
    ];
    let fluid: Vec<f64> = solver.fluid_pressure_mpa().iter().map(|p| p * PA_PER_MPA).collect();
    if !fluid.is_empty() {
        let values = Values::F64As32(&fluid);
        points.push(Field { name: "fluid_pressure_pa", components: 1, values });
    }
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
