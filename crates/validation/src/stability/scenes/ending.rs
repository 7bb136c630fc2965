//! What became of one scene.

use papilla_fem::contact::ContactRule;
use papilla_fingertip::campaign::Indentation;
use papilla_fingertip::simulation::balanced::Attempt;
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

/// How a scene was solved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// Lines did not say so when this one was written.
    Unrecorded,
    /// By this.
    Recorded {
        /// Program and version.
        version: String,
        /// Where on the skin contact was found on the way that was kept; absent if none was.
        contact: Option<ContactRule>,
        /// Every way taken.
        attempts: Vec<Attempt>,
    },
}

/// One line of the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    /// How it was solved.
    pub how: How,
}

impl SceneRecord {
    /// In equilibrium, every balance kept.
    pub(super) fn balances(&self) -> bool {
        self.ending == Ending::Balanced
    }
}
