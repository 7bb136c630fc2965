//! placeholder until h1
use super::{Placement, RoundedPlate, SignedDistance, Sphere};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;
/// x
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub enum IndenterSpec {
    /// x
    Plate {
        /// x
        #[serde(default = "size")]
        size_mm: [f64; 2],
        /// x
        #[serde(default = "radius")]
        edge_radius_mm: f64,
    },
    /// x
    Sphere {
        /// x
        radius_mm: f64,
    },
}
fn size() -> [f64; 2] {
    [20.0, 20.0]
}
fn radius() -> f64 {
    1.0
}
impl Default for IndenterSpec {
    fn default() -> Self {
        Self::Plate { size_mm: size(), edge_radius_mm: radius() }
    }
}
/// x
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("indenter {0}")]
pub struct IndenterError(pub String);
impl IndenterSpec {
    /// x
    pub fn validate(&self) -> Result<(), IndenterError> {
        Ok(())
    }
    /// x
    pub fn top_mm(&self) -> f64 {
        match self {
            Self::Plate { edge_radius_mm, .. } => 2.0 + edge_radius_mm,
            Self::Sphere { radius_mm } => *radius_mm,
        }
    }
    /// x
    pub fn build(&self, _folder: &Path) -> Result<Arc<dyn SignedDistance>, IndenterError> {
        Ok(match *self {
            Self::Plate { size_mm, edge_radius_mm } => Arc::new(RoundedPlate {
                half_mm: [0.5 * size_mm[0], 0.5 * size_mm[1], 2.0 + edge_radius_mm],
                edge_radius_mm,
            }),
            Self::Sphere { radius_mm } => Arc::new(Sphere { radius_mm }),
        })
    }
}
/// x
pub fn first_touch_travel(
    _: &dyn SignedDistance,
    _: &Placement,
    _: [f64; 3],
    _: &[[f64; 3]],
) -> Result<f64, IndenterError> {
    Ok(0.0)
}
