//! What became of one scene.

use papilla_fingertip::campaign::Indentation;
use serde::{Deserialize, Serialize};

/// What became of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// In equilibrium, every balance of a dataset kept.
    Balanced,
    /// In equilibrium, a balance missed.
    Unbalanced(String),
    /// A typed error.
    Refused(String),
    /// A panic.
    Panicked(String),
}

/// One scene in the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// What was pressed how.
    pub press: Indentation,
    /// What became of it.
    pub ending: Ending,
    /// Newton iterations.
    pub newton_iterations: u32,
    /// Halved load steps.
    pub cuts: u32,
    /// Smallest `J`; absent without an equilibrium.
    pub j_min: Option<f64>,
    /// Processor time, s.
    pub seconds: f64,
}
