//! One equilibrium of a scene, and its fields.

use std::{path::PathBuf, sync::Arc};

use papilla_fem::mesh::Mesh;
use papilla_fingertip::{
    run::{BodyFields, Increment, cells, write_vtu},
    simulation::Simulation,
};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};

use crate::border::{bytes_of, compute, doubles, error, to_json};

/// A state, ready for Python.
pub(crate) struct Found {
    pub(crate) number: usize,
    pub(crate) increment: Increment,
    pub(crate) maps: Vec<(&'static str, Vec<f32>)>,
    pub(crate) body: Option<(Arc<Simulation>, BodyFields)>,
}

/// One equilibrium.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct State {
    found: Found,
}

impl State {
    pub(crate) fn new(found: Found) -> Self {
        Self { found }
    }
}

#[pymethods]
impl State {
    /// What `summary.json` says of it, as JSON.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        to_json(py, &self.found.increment)
    }

    /// Maps by name, float32, one or three of 224 x 224; empty of what has no atlas.
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let maps = PyDict::new(py);
        for (name, pixels) in &self.found.maps {
            maps.set_item(name, bytes_of(py, pixels, f32::to_le_bytes)?)?;
        }
        Ok(maps)
    }

    /// Fields of the nodes by name, float64; empty if they were not asked for.
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let nodes = PyDict::new(py);
        let Some((setup, fields)) = &self.found.body else { return Ok(nodes) };
        let mesh: &Mesh = &setup.body.problem.mesh;
        let BodyFields { displacement_mm, pressure_pa, fluid_pressure_pa, elements } = fields;
        let fields = [
            ("places_mm", mesh.nodes.as_flattened()),
            ("displacement_mm", displacement_mm.as_flattened()),
            ("pressure_pa", pressure_pa),
            ("fluid_pressure_pa", fluid_pressure_pa),
            ("stress_pa", elements.node_stress_pa.as_flattened()),
            ("strain", elements.node_strain.as_flattened()),
        ];
        for (name, values) in fields.into_iter().filter(|(_, values)| !values.is_empty()) {
            nodes.set_item(name, doubles(py, values)?)?;
        }
        Ok(nodes)
    }

    /// Fields of the cells by name, float64, but for the layer, int32, and `connectivity` and
    /// `offsets`, int64; empty if they were not asked for.
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        let Some((setup, fields)) = &self.found.body else { return Ok(found) };
        let elements = &fields.elements;
        let (connectivity, offsets, types) = cells(&setup.body.problem.mesh);
        let whole = |value: usize| (value as i64).to_le_bytes();
        found.set_item("connectivity", bytes_of(py, &connectivity, whole)?)?;
        found.set_item("offsets", bytes_of(py, &offsets, whole)?)?;
        found.set_item("types", PyBytes::new(py, &types))?;
        found.set_item("layer", bytes_of(py, &elements.layer, i32::to_le_bytes)?)?;
        let fields = [
            ("sed_j_per_m3", &elements.sed_j_per_m3[..]),
            ("volume_ratio", &elements.volume_ratio[..]),
            ("stress_pa", elements.stress_pa.as_flattened()),
            ("strain", elements.strain.as_flattened()),
        ];
        for (name, values) in fields {
            found.set_item(name, doubles(py, values)?)?;
        }
        Ok(found)
    }

    /// Writes the body as a file for ParaView.
    fn write_vtu(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let Some((setup, fields)) = &self.found.body else {
            let message = "the state has no fields: solve(fields=True) keeps them";
            return Err(error(py, "BadInput", ("path", message)));
        };
        let written = compute(py, move || write_vtu(&path, &setup.body.problem.mesh, fields))?;
        written.map_err(|e| pyo3::exceptions::PyOSError::new_err(papilla_output::told(&e)))
    }
}
