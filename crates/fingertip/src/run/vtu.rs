//! A whole body at one equilibrium, for looking at.

use crate::simulation::body::Body;
use crate::simulation::fields::ElementFields;
use papilla_atlas::PA_PER_MPA;
use papilla_fem::mesh::Mesh;
use papilla_fem::solve::Solver;
use papilla_output::OutputError;
use papilla_output::vtu::{self, Field, Values, VtuMesh};
use std::path::Path;

/// Fields of a body at one equilibrium.
pub struct BodyFields {
    /// Of each node, mm.
    pub displacement_mm: Vec<[f64; 3]>,
    /// Of the indenter on each node, Pa; 0 off the contact surface.
    pub pressure_pa: Vec<f64>,
    /// Of the fluid at each node, Pa; empty of tissue without.
    pub fluid_pressure_pa: Vec<f64>,
    /// Of the elements, and stress and strain at the nodes too.
    pub elements: ElementFields,
}

impl BodyFields {
    /// Of the body at the solver's equilibrium.
    #[must_use]
    pub fn new(body: &Body, solver: &Solver<'_>) -> Self {
        let pa = |values: Vec<f64>| values.into_iter().map(|p| p * PA_PER_MPA).collect();
        Self {
            displacement_mm: solver.displacement_mm().to_vec(),
            pressure_pa: pa(body.pressure_mpa(solver)),
            fluid_pressure_pa: pa(solver.fluid_pressure_mpa()),
            elements: ElementFields::new(body, solver),
        }
    }
}

/// Cells of a mesh as files have them: nodes of all cells, where each cell's end, and VTK's types.
#[must_use]
pub fn cells(mesh: &Mesh) -> (Vec<usize>, Vec<usize>, Vec<u8>) {
    let (mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new());
    for block in &mesh.blocks {
        for e in 0..block.len() {
            connectivity.extend(block.element(e).iter().map(|&n| n as usize));
            offsets.push(connectivity.len());
            types.push(block.kind.vtk_cell_type());
        }
    }
    (connectivity, offsets, types)
}

/// Writes a body as `.vtu`: points with displacement (mm), contact pressure and, of biphasic tissue,
/// the fluid's (Pa), Cauchy stress (Pa) and Green-Lagrange strain (xx yy zz xy yz xz); cells with the
/// means of these two, SED (J/m3 of undeformed volume), volume ratio and layer id (0 epidermis,
/// 1 dermis, 2 subcutaneous, 3 nail, 4 bone).
///
/// # Errors
/// [`OutputError`] if the file cannot be written.
pub fn write_vtu(path: &Path, mesh: &Mesh, fields: &BodyFields) -> Result<(), OutputError> {
    let (connectivity, offsets, types) = cells(mesh);
    let BodyFields { displacement_mm, pressure_pa, fluid_pressure_pa, elements } = fields;
    let view = VtuMesh {
        points: &mesh.nodes,
        connectivity: &connectivity,
        offsets: &offsets,
        types: &types,
    };
    let rounded =
        |name, components, values| Field { name, components, values: Values::F64As32(values) };
    let mut points = vec![
        Field {
            name: "displacement_mm",
            components: 3,
            values: Values::F64(displacement_mm.as_flattened()),
        },
        rounded("pressure_pa", 1, pressure_pa),
    ];
    if !fluid_pressure_pa.is_empty() {
        points.push(rounded("fluid_pressure_pa", 1, fluid_pressure_pa));
    }
    points.push(rounded("stress_pa", 6, elements.node_stress_pa.as_flattened()));
    points.push(rounded("strain", 6, elements.node_strain.as_flattened()));
    let cells = [
        rounded("sed_j_per_m3", 1, &elements.sed_j_per_m3),
        rounded("volume_ratio", 1, &elements.volume_ratio),
        Field { name: "layer", components: 1, values: Values::I32(&elements.layer) },
        rounded("stress_pa", 6, elements.stress_pa.as_flattened()),
        rounded("strain", 6, elements.strain.as_flattened()),
    ];
    vtu::write(path, &view, &points, &cells)
}
