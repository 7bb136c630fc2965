//! Datasets: what campaigns leave, as arrays.

use std::path::PathBuf;

use papilla_atlas::MAP_LEN;
use papilla_dataset::{Dataset as Read, DatasetError, Field, Maps, Shard};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};

use crate::border::{bytes_of, compute, doubles, error, to_json};

fn bad_dataset(py: Python<'_>, problem: &DatasetError) -> PyErr {
    error(py, "BadDataset", (papilla_output::told(problem),))
}

/// A map by its name, one field for each of its components.
fn fields(name: &str) -> Option<&'static [Field]> {
    match name {
        "pressure_pa" => Some(&[Field::Pressure]),
        "sed_dermis_j_per_m3" => Some(&[Field::SedDermis]),
        "sed_epidermis_j_per_m3" => Some(&[Field::SedEpidermis]),
        "shear_pa" => Some(&[Field::Shear(0), Field::Shear(1), Field::Shear(2)]),
        _ => None,
    }
}

/// A dataset whose manifest and atlas were read and checked.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Dataset {
    dataset: Read,
    maps: Maps,
}

#[pymethods]
impl Dataset {
    /// Opens a folder.
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let open = move || -> Result<Self, DatasetError> {
            let dataset = Read::open(&folder)?;
            let maps = Maps::read(&folder, dataset.atlas())?;
            Ok(Self { dataset, maps })
        };
        compute(py, open)?.map_err(|problem| bad_dataset(py, &problem))
    }

    /// The manifest as JSON.
    fn manifest(&self, py: Python<'_>) -> PyResult<String> {
        to_json(py, self.dataset.manifest())
    }

    /// Arrays of an indentation's states by name, with the state as first axis: `depth_mm`, `force_n`
    /// and `slide_mm`, float32; `checks`, float64; and the maps that were asked for, float32.
    fn press<'py>(
        &self,
        py: Python<'py>,
        id: usize,
        maps: Vec<String>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let presses = &self.dataset.manifest().presses;
        let at = presses.binary_search_by_key(&id, |press| press.id);
        let Ok(at) = at else {
            let message = format!("the dataset has no simulation {id}");
            return Err(error(py, "BadInput", ("id", message)));
        };
        let read = || self.dataset.shard(&presses[at]);
        let shard = compute(py, read)?.map_err(|problem| bad_dataset(py, &problem))?;
        let arrays = PyDict::new(py);
        let floats = |values: Vec<f32>| bytes_of(py, &values, f32::to_le_bytes);
        arrays.set_item("depth_mm", floats(shard.depth_mm.to_vec())?)?;
        arrays.set_item("force_n", floats(shard.force_n.iter().copied().collect())?)?;
        if let Some(slide_mm) = &shard.slide_mm {
            arrays.set_item("slide_mm", floats(slide_mm.iter().copied().collect())?)?;
        }
        let checks: Vec<f64> = shard.checks.iter().copied().collect();
        arrays.set_item("checks", doubles(py, &checks)?)?;
        for name in maps {
            arrays.set_item(&name, self.drawn(py, &shard, &name)?)?;
        }
        Ok(arrays)
    }
}

impl Dataset {
    fn drawn<'py>(
        &self,
        py: Python<'py>,
        shard: &Shard,
        name: &str,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let Some(fields) = fields(name) else {
            let known = "pressure_pa, sed_dermis_j_per_m3, sed_epidermis_j_per_m3, shear_pa";
            let message = format!("there is no map '{name}'; there are {known}");
            return Err(error(py, "BadInput", ("maps", message)));
        };
        let draw = || -> Result<Vec<f32>, DatasetError> {
            let of_shard = self.maps.of(shard);
            let mut pixels = vec![0.0; shard.len() * fields.len() * MAP_LEN];
            let each = (0..shard.len()).flat_map(|state| fields.iter().map(move |f| (state, *f)));
            for ((state, field), map) in each.zip(pixels.chunks_exact_mut(MAP_LEN)) {
                of_shard.draw(field, state, map)?;
            }
            Ok(pixels)
        };
        let pixels = compute(py, draw)?.map_err(|problem| bad_dataset(py, &problem))?;
        bytes_of(py, &pixels, f32::to_le_bytes)
    }
}
