//! Networks on maps, evaluated in passes over rows that stay in the nearest cache.
//!
//! The graph of such a network (`docs/concepts/networks.md`) defines its answer, and tract can run
//! it. But the graph does more work than is needed:
//!
//! - It interpolates components by a convolution over 3 x 3 pixels. To mix the components first,
//!   and then to interpolate by rows and columns, gives the same.
//! - It computes the influence of pressures everywhere, although this is zero where no pressure is
//!   near.
//! - Between any two operators it writes and reads a map that is as large as the cache.
//!
//! So [`find`] looks for the network in the graph, operator by operator, and [`Runner`] evaluates
//! it. When a file is loaded, the answers to several maps are compared with those of tract. If a
//! graph is not recognised, or the answers differ, tract runs it.

mod around;
mod correction;
mod gain;
mod gated;
mod graph;
mod level;
mod near;
mod net;
mod parts;
mod pattern;
mod pixels;
mod pressures;
mod reach;
mod sums;
#[cfg(test)]
mod tests;
mod trial;
mod upsampling;

use crate::{
    Backend, EngineError, Model, ModelInfo, Session, check_maps, check_output, guard::guarded,
    tract_backend::LABEL,
};
use net::{Net, Work, Workspace};
use std::sync::Arc;
use tract_onnx::pb::ModelProto;

pub(crate) use trial::{Preferred, prefer};

/// The networks of a model, laid out for the evaluation. The answer is the sum of theirs.
#[derive(Clone, Debug)]
pub(crate) struct Runner(Arc<Vec<Net>>);

/// The constants of the networks that were found in a graph.
pub(crate) struct Found(Vec<parts::Parts>);

impl Found {
    /// Lays the networks out for the evaluation. The memory is allocated by the calling thread.
    pub(crate) fn runner(&self) -> Runner {
        Runner(Arc::new(self.0.iter().map(Net::new).collect()))
    }
}

/// Looks for such a network, or a mean of several, in a graph whose 16-bit constants have been
/// widened. None: the graph is something else.
pub(crate) fn find(proto: &ModelProto) -> Option<Found> {
    pattern::find(proto).map(Found)
}

/// A model that is evaluated by rows.
pub(crate) struct MapModel {
    info: ModelInfo,
    runner: Runner,
}

impl MapModel {
    pub(crate) fn new(mut info: ModelInfo, runner: Runner) -> Self {
        info.backend = format!("{LABEL} by rows");
        Self { info, runner }
    }
}

impl Model for MapModel {
    fn info(&self) -> &ModelInfo {
        &self.info
    }

    fn backend(&self) -> Backend {
        Backend::Tract
    }

    fn session(&self) -> Result<Box<dyn Session>, EngineError> {
        let runner = self.runner.clone();
        let spaces = runner.spaces();
        Ok(Box::new(MapSession { runner, spaces }))
    }
}

impl Runner {
    fn spaces(&self) -> Vec<Workspace> {
        self.0.iter().map(Workspace::new).collect()
    }
}

struct MapSession {
    runner: Runner,
    spaces: Vec<Workspace>,
}

impl Session for MapSession {
    fn infer(&mut self, pressure_pa: &[f32], sed_j_per_m3: &mut [f32]) -> Result<(), EngineError> {
        check_maps(pressure_pa, sed_j_per_m3)?;
        let (nets, spaces) = (&self.runner.0, &mut self.spaces);
        let done = guarded("infer a map", || {
            for (index, (net, space)) in nets.iter().zip(spaces).enumerate() {
                let sed_j_per_m3 = &mut *sed_j_per_m3;
                Work { net, space, pressure_pa, sed_j_per_m3, adds: index > 0 }.run();
            }
            Ok(())
        });
        if let Err(error) = done {
            // The contents of the workspaces after an interrupted run are unknown, so they are made
            // anew.
            self.spaces = self.runner.spaces();
            return Err(error);
        }
        check_output(sed_j_per_m3)
    }
}
