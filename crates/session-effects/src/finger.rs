//! The finger that effects are placed on.

use std::sync::{Arc, OnceLock};

use papilla_proto::{
    RuntimeEffect,
    atlas::{Atlas, Raster},
};
use serde::Serialize;

use super::Geometry;

/// The finger that effects are placed on, and what all sessions on it share.
#[derive(Debug, Clone, Copy)]
pub struct Finger<'a> {
    /// Both surfaces.
    pub atlas: &'a Atlas,
    /// Pixels of the skin.
    pub skin: &'a Raster,
    /// Pixels of the interface.
    pub interface: &'a Raster,
    /// What is made once for all sessions.
    pub shared: &'a Shared,
}

impl Finger<'_> {
    /// Areas and places of its pixels.
    pub(crate) fn geometry(&self) -> Arc<Geometry> {
        let make = || Arc::new(Geometry::new(self.atlas, self.skin, self.interface));
        Arc::clone(self.shared.geometry.get_or_init(make))
    }
}

/// What an effect adds to a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// The effect.
    #[serde(rename = "name")]
    pub effect: RuntimeEffect,
    /// Time, us; below zero where it saves more than it takes.
    pub us: f64,
}

/// What all sessions on one catalogue share; made when it is first asked for.
#[derive(Debug, Default)]
pub struct Shared {
    pub(crate) geometry: OnceLock<Arc<Geometry>>,
    pub(crate) costs: OnceLock<Vec<Cost>>,
}

impl Shared {
    /// What each effect costs here; none without a calibration.
    #[must_use]
    pub fn costs(&self) -> Option<&[Cost]> {
        self.costs.get().map(Vec::as_slice)
    }

    /// What these effects add to a frame, us.
    #[must_use]
    pub fn cost_us(&self, effects: &[RuntimeEffect]) -> u64 {
        let costs = self.costs.get().into_iter().flatten();
        let us: f64 = costs.filter(|cost| effects.contains(&cost.effect)).map(|cost| cost.us).sum();
        us.ceil() as u64
    }
}
