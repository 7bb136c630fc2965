//! Golden answers: the answers of a model for states of finite elements (FE) whose SED is known.
//!
//! A model may load, belong to its card and answer with finite values, and yet be the wrong one:
//! with other units, another orientation, or an engine that computes it wrongly. So it is given the
//! pressure of the states in `replay.json`, and its answers are compared with the SED of the FE
//! solver.

use std::sync::Arc;

use papilla_engine::{
    Backend, EngineError, Model,
    agreement::{relative_l2, share},
};
use papilla_proto::{MAP_LEN, atlas::Raster};
use serde::Serialize;

use super::replay::Replay;

/// The error of a state may be this many times the 95th percentile on the card. Rare states come near
/// it; with a wrong scale or orientation the error is about 1.
const TIMES_P95: f64 = 3.0;

/// An error that is always allowed, so that a nearly exact model is not refused for its rounding.
const ERROR_MIN: f64 = 0.05;

/// Least share of the FE solver's map in an answer, whatever error the card allows. A model that
/// answers zeros has 0, one that answers in kJ/m3 has 0.001. Of the shipped models the half-space
/// has 0.22 and all others 0.7 or more.
const SHARE_MIN: f64 = 0.1;

/// The comparison of a model's answers with the FE solver's: its worst state, and the least share
/// of all states.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Golden {
    /// Number of states compared.
    #[serde(rename = "presses")]
    pub(crate) states: usize,
    /// Name of the state with the greatest error.
    #[serde(rename = "press")]
    pub(crate) state: String,
    /// Relative L2 error of the answer to that state.
    pub(crate) relative_l2: f64,
    /// Greatest error with which the model is still accepted.
    pub(crate) relative_l2_max: f64,
    /// Least share, over all states, of the true map in the answer: `sum found true / sum true^2`.
    pub(crate) share: f64,
}

/// Why a model is not to be trusted.
#[derive(Debug, thiserror::Error)]
pub(crate) enum GoldenError {
    /// The model does not run.
    #[error("it does not run: {0}")]
    Engine(#[from] EngineError),
    /// The state does not fit the atlas.
    #[error("press '{state}' does not fit the atlas: {reason}")]
    State { state: String, reason: String },
    /// An answer differs too much from the FE solver's.
    #[error(
        "its answer to state '{}' is off by {:.3} of the FE solver's (relative L2), {:.3} is the \
         most its card allows", .0.state, .0.relative_l2, .0.relative_l2_max
    )]
    Wrong(Golden),
    /// An answer holds next to nothing of the FE solver's map.
    #[error(
        "its answers hold {:.3} of the FE solver's map, {SHARE_MIN} is the least: are they in J/m3, \
         and the right way up?", .0.share
    )]
    Empty(Golden),
}

/// The states that models are tried on, and the pixels that their values belong to.
#[derive(Clone, Copy)]
pub(crate) struct States<'a> {
    pub(crate) replay: &'a Replay,
    pub(crate) skin: &'a Raster,
    pub(crate) interface: &'a Raster,
}

/// Runs a model on every state of the replay and compares its answers. `relative_l2_p95` is the
/// 95th percentile of the error on the model's card. None: the replay has no states.
///
/// # Errors
/// The model does not run, a state does not fit the atlas, or an answer is further off than the
/// card allows.
pub(crate) fn check(
    of: States<'_>,
    model: &dyn Model,
    relative_l2_p95: f64,
) -> Result<Option<Golden>, GoldenError> {
    let mut session = model.session()?;
    let [mut pressure_pa, mut due, mut found] = [0, 1, 2].map(|_| vec![0.0; MAP_LEN]);
    let states = &of.replay.states;
    let mut worst: Option<Golden> = None;
    for state in states {
        let fill = |raster: &Raster, values: &[f32], map: &mut [f32]| {
            raster.scatter(values, map).map_err(|error| GoldenError::State {
                state: state.name.clone(),
                reason: error.to_string(),
            })
        };
        fill(of.skin, &state.pressure_pa, &mut pressure_pa)?;
        fill(of.interface, &state.sed_j_per_m3, &mut due)?;
        session.infer(&pressure_pa, &mut found)?;
        let mask = of.interface.mask();
        let relative_l2 = relative_l2(&found, &due, mask);
        let share = worst
            .as_ref()
            .map_or(f64::INFINITY, |worst| worst.share)
            .min(share(&found, &due, mask));
        if worst.as_ref().is_none_or(|worst| relative_l2 > worst.relative_l2) {
            worst = Some(Golden {
                states: states.len(),
                state: state.name.clone(),
                relative_l2,
                relative_l2_max: (TIMES_P95 * relative_l2_p95).max(ERROR_MIN),
                share,
            });
        }
        if let Some(worst) = &mut worst {
            worst.share = share;
        }
    }
    match worst {
        Some(worst) if worst.relative_l2 > worst.relative_l2_max => Err(GoldenError::Wrong(worst)),
        Some(worst) if worst.share < SHARE_MIN => Err(GoldenError::Empty(worst)),
        worst => Ok(worst),
    }
}

/// If another backend than tract answers the golden states wrongly, replaces the model by the one
/// that `in_tract` loads. The other backend had been chosen because it was faster and right on one
/// map.
///
/// # Errors
/// The model does not load in tract.
pub(crate) fn fall_back(
    states: States<'_>,
    model: Arc<dyn Model>,
    relative_l2_p95: f64,
    in_tract: impl FnOnce() -> Result<Arc<dyn Model>, EngineError>,
) -> Result<Arc<dyn Model>, EngineError> {
    if model.backend() == Backend::Tract {
        return Ok(model);
    }
    let Err(error) = check(states, model.as_ref(), relative_l2_p95) else { return Ok(model) };
    let (tier, backend) = (&model.info().name, &model.info().backend);
    tracing::warn!(tier, backend, %error, "tract runs this model");
    in_tract()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::core::catalogue::testing::{self, model};

    /// Finite elements answer the pressure; one model in each backend does, and one is wrong.
    #[test]
    fn a_backend_that_misses_golden_answers_gives_the_model_back() {
        let models = [
            model("right", Backend::Ort, 1.0),
            model("wrong", Backend::Ort, 0.001),
            model("tract's own", Backend::Tract, 0.001),
        ];
        let catalogue = testing::catalogue(vec![testing::tier(models[0].clone(), 0.1)]);
        let values = vec![3.0; catalogue.skin.pixel_count()];
        let state =
            json!({"name": "flat", "depth_mm": 1, "pressure_pa": values, "sed_j_per_m3": values});
        let replay = serde_json::from_value(json!({"presses": [state]})).unwrap();
        let (skin, interface) = (&catalogue.skin, &catalogue.interface);
        let states = States { replay: &replay, skin, interface };
        let failed = || Err(EngineError::BadCard { reason: "none".to_owned() });
        assert!(fall_back(states, models[1].clone(), 0.0, failed).is_err());
        let fallen = models.map(|found| {
            let in_tract = || Ok(model(&found.info().name, Backend::Tract, 1.0));
            fall_back(states, Arc::clone(&found), 0.0, in_tract).unwrap()
        });
        let backends = fallen.each_ref().map(|model| model.backend());
        assert_eq!(backends, [Backend::Ort, Backend::Tract, Backend::Tract]);
        assert!(check(states, fallen[1].as_ref(), 0.0).is_ok());
        // Answers of tract are not compared here; `papilla-server check` and a reload compare them.
        assert!(check(states, fallen[2].as_ref(), 0.0).is_err());
    }
}
