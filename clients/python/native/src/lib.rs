//! The module `papilla._native`: what the Python package computes by itself.
//!
//! Python hands over texts of JSON, bytes of the protocol and buffers of numbers; the package above
//! makes numpy arrays and named tuples of what comes back. The interpreter's lock is released
//! wherever something is computed, and a panic ends in `papilla.NativeFault`.

mod border;
mod campaign;
mod dataset;
mod feel;
mod finger;
mod models;
mod problem;
mod scene;
mod session;
mod state;

use pyo3::prelude::*;

/// What the Python package computes by itself.
#[pymodule]
#[pyo3(name = "_native")]
fn native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<campaign::Campaign>()?;
    module.add_class::<campaign::CampaignRun>()?;
    module.add_class::<dataset::Dataset>()?;
    module.add_class::<feel::Feel>()?;
    module.add_class::<finger::Contact>()?;
    module.add_class::<finger::Finger>()?;
    module.add_class::<models::Models>()?;
    module.add_class::<scene::Run>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<state::State>()?;
    module.add_class::<session::Session>()?;
    Ok(())
}
