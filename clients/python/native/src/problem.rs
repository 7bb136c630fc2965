//! What can be wrong with a scene, as exceptions.

use std::path::Path;

use papilla_fem::solve::SolveError;
use papilla_fingertip::{
    scene::SceneError,
    simulation::{body::SimulationError, maps::MapError},
};
use pyo3::prelude::*;

use crate::border::error;

/// Why a scene or a campaign cannot be, or came to no state.
pub(crate) enum Problem {
    Scene(SceneError),
    Simulation(SimulationError),
    Maps(MapError),
}

impl From<SceneError> for Problem {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<SimulationError> for Problem {
    fn from(error: SimulationError) -> Self {
        Self::Simulation(error)
    }
}

impl From<MapError> for Problem {
    fn from(error: MapError) -> Self {
        Self::Maps(error)
    }
}

/// What Python is told of a scene that cannot be.
struct Fault {
    field: Option<String>,
    line: Option<usize>,
}

impl Problem {
    fn message(&self) -> String {
        match self {
            Self::Scene(error) => papilla_output::told(error),
            Self::Simulation(error) => papilla_output::told(error),
            Self::Maps(error) => papilla_output::told(error),
        }
    }

    /// Where in the scene the fault is; none of what failed while it was solved.
    fn fault(&self) -> Fault {
        match self {
            Self::Scene(error) => {
                let line = match error {
                    SceneError::Located(located) => Some(located.place.line),
                    _ => None,
                };
                Fault { field: error.field(), line }
            }
            Self::Simulation(error) => {
                let line = match error {
                    SimulationError::Located(located) => Some(located.place.line),
                    _ => None,
                };
                Fault { field: error.field(), line }
            }
            Self::Maps(_) => Fault { field: None, line: None },
        }
    }

    /// The exception: `NotSolved` of what found no equilibrium, `BadScene` of all else.
    pub(crate) fn raise(&self, py: Python<'_>, states: usize) -> PyErr {
        let message = self.message();
        if let Self::Simulation(found) = self
            && let Some((kind, depth_mm, reached)) = unsolved(found)
        {
            return error(py, "NotSolved", (message, kind, depth_mm, reached, states));
        }
        let Fault { field, line } = self.fault();
        error(py, "BadScene", (message, field, line))
    }
}

/// Kind, depth aimed at and load fraction reached of what found no equilibrium.
fn unsolved(error: &SimulationError) -> Option<(&'static str, Option<f64>, Option<f64>)> {
    match error {
        SimulationError::Located(located) => unsolved(&located.error),
        SimulationError::Solve { depth_mm, source } => {
            let (kind, reached) = match source {
                SolveError::CutsExhausted { reached, .. } => ("no_equilibrium", Some(*reached)),
                SolveError::StepsExhausted { reached, .. } => ("too_many_steps", Some(*reached)),
                SolveError::Stopped { reached } => ("stopped", Some(*reached)),
                SolveError::Factor(_) => ("too_large", None),
                SolveError::RigidBodyMode(_) => ("free_part", None),
            };
            Some((kind, Some(*depth_mm), reached))
        }
        SimulationError::Share { share, source } => {
            let at = SimulationError::Solve { depth_mm: 0.0, source: source.clone() };
            unsolved(&at).map(|(kind, _, reached)| (kind, None, reached.or(Some(*share))))
        }
        SimulationError::Slipped { depth_mm, .. } => Some(("slipped", Some(*depth_mm), None)),
        SimulationError::Force { .. } => Some(("force_not_reached", None, None)),
        SimulationError::Inverted(_) => Some(("inverted", None, None)),
        SimulationError::Halted => Some(("stopped", None, None)),
        _ => None,
    }
}

/// The TOML of a JSON object; what is null was not named.
pub(crate) fn toml_of(path: &Path, json: &str) -> Result<String, SceneError> {
    fn without_null(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Object(members) => {
                members.retain(|_, member| !member.is_null());
                members.values_mut().for_each(without_null);
            }
            serde_json::Value::Array(items) => items.iter_mut().for_each(without_null),
            _ => {}
        }
    }
    let incomplete = |message: String| SceneError::Incomplete { path: path.into(), message };
    let mut value: serde_json::Value =
        serde_json::from_str(json).map_err(|e| incomplete(e.to_string()))?;
    without_null(&mut value);
    toml::to_string(&value).map_err(|e| incomplete(e.to_string()))
}
