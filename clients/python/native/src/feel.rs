//! What is felt of maps of SED that are known: rates, spikes, actuators.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex},
};

use papilla_inside::{Bundle, Feel as Inside, Problem, read_hello};
use papilla_proto::{FrameHeader, FrameStatus, HEADER_LEN};
use pyo3::{buffer::PyBuffer, prelude::*, types::PyByteArray};
use serde_json::json;

use crate::border::{bad_models, compute, error, lock, refused};

/// Effects of one finger on maps of SED, and what they remember.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Feel {
    told: String,
    /// None once a panic has left it half done.
    state: Mutex<Option<Inside>>,
}

#[pymethods]
impl Feel {
    /// Reads the atlas of a folder, and takes the effects of a hello, as JSON.
    #[new]
    fn new(py: Python<'_>, folder: PathBuf, hello: &str) -> PyResult<Self> {
        let bundle = compute(py, move || Bundle::without_contact(&folder))?;
        let bundle = Arc::new(bundle.map_err(|problem| bad_models(py, &problem))?);
        let opened = compute(py, || Inside::open(&bundle, &read_hello(hello)?))?;
        let inside = opened.map_err(|problem| refused(py, &problem))?;
        let told = json!({
            "sections": inside.sections(),
            "units": inside.units(),
            "atlas_hash": bundle.atlas.hash(),
            "vertices": bundle.atlas.vertex_count(),
            "sample_type": inside.sample_type(),
        });
        Ok(Self { told: told.to_string(), state: Mutex::new(Some(inside)) })
    }

    /// What a session's ready says of the effects, as JSON.
    fn told(&self) -> &str {
        &self.told
    }

    /// Feels a map of SED under pressure, each 224 x 224 float32: the answer to the frame with this
    /// header. Raises Refused.
    fn frame<'py>(
        &self,
        py: Python<'py>,
        head: &[u8],
        sed_j_per_m3: PyBuffer<f32>,
        pressure_pa: PyBuffer<f32>,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let header = FrameHeader::decode(head)
            .map_err(|problem| refused(py, &Problem::new(problem.code(), problem.to_string())))?;
        let [sed, pressure] = [sed_j_per_m3, pressure_pa].map(|map| map.to_vec(py));
        let (sed, pressure) = (sed?, pressure?);
        let made = compute(py, || {
            let mut held = lock(&self.state);
            let mut inside = held.take()?;
            let made = inside.frame(&sed, &pressure, header.client_time_us).map(|written| {
                let mut head = header.answer(FrameStatus::Ok, 0, written.scale);
                head = head.windowed(written.window);
                head.sample_type = inside.sample_type();
                (head.queue_us, head.tier, head.flags) = (0, 0, inside.flags());
                let mut message = inside.bytes().to_vec();
                message[..HEADER_LEN].copy_from_slice(&head.encode());
                message
            });
            *held = Some(inside);
            Some(made)
        })?;
        let fault = || error(py, "NativeFault", ("a fault before has left this half done",));
        let message = made.ok_or_else(fault)?.map_err(|problem| refused(py, &problem))?;
        Ok(PyByteArray::new(py, &message))
    }
}
