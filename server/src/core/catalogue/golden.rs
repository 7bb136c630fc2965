//! Golden answers: what a model makes of FE states whose SED is known.
//!
//! A model that loads, belongs to its card and answers with finite values can still be the wrong
//! one: other units, another orientation, an engine that computes it wrongly. So it is asked for
//! the states of `replay.json`, and its answers are held against the FE solver's.

use std::sync::Arc;

use papilla_engine::{Backend, EngineError, Model};
use papilla_proto::{MAP_LEN, atlas::Raster};
use serde::Serialize;

use super::{Tier, replay::Replay};

/// A state may err by so many times the 95th percentile of the card's test states: rare ones do,
/// while a wrong scale or orientation errs by about 1.
const TIMES_P95: f64 = 3.0;

/// And by so much in any case, so that a nearly exact model is not held to its rounding.
const ERROR_MIN: f64 = 0.05;

/// Least share of the FE solver's map in an answer, whatever error the card allows. A model of
/// zeros holds nothing, one in kJ/m3 a thousandth; of the shipped models a half-space holds .22 and
/// all others .7 or more.
const SHARE_MIN: f64 = 0.1;

/// The state a model does worst.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Golden {
    /// Number of states compared.
    #[serde(rename = "presses")]
    pub(crate) states: usize,
    /// Name of the worst.
    #[serde(rename = "press")]
    pub(crate) state: String,
    /// Its relative L2 error.
    pub(crate) relative_l2: f64,
    /// The error it may have.
    pub(crate) relative_l2_max: f64,
    /// Least share of the due map in an answer: `sum found due / sum due^2`.
    pub(crate) share: f64,
}

/// Why a model is not to be trusted.
#[derive(Debug, thiserror::Error)]
pub(crate) enum GoldenError {
    /// It does not run.
    #[error("it does not run: {0}")]
    Engine(#[from] EngineError),
    /// The state does not fit the atlas.
    #[error("press '{state}' does not fit the atlas: {reason}")]
    State { state: String, reason: String },
    /// It answers wrongly.
    #[error(
        "its answer to state '{}' is off by {:.3} of the FE solver's (relative L2), {:.3} is the \
         most its card allows", .0.state, .0.relative_l2, .0.relative_l2_max
    )]
    Wrong(Golden),
    /// It answers next to nothing.
    #[error(
        "its answers hold {:.3} of the FE solver's map, {SHARE_MIN} is the least: are they in J/m3, \
         and the right way up?", .0.share
    )]
    Empty(Golden),
}

/// What is asked for, and where on a map it lies.
#[derive(Clone, Copy)]
pub(crate) struct States<'a> {
    pub(crate) replay: &'a Replay,
    pub(crate) skin: &'a Raster,
    pub(crate) interface: &'a Raster,
}

/// Asks `tier` for every state of the replay; None if there are none.
///
/// # Errors
/// It does not run, or an answer is further off than its card allows.
pub(crate) fn check(of: States<'_>, tier: &Tier) -> Result<Option<Golden>, GoldenError> {
    let mut session = tier.model.session()?;
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
                relative_l2_max: (TIMES_P95 * tier.relative_l2_p95).max(ERROR_MIN),
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

/// Gives back to tract every model that another backend answers wrongly; `in_tract` loads it there.
/// That backend was the faster one and did well on one map.
///
/// # Errors
/// A model does not load in tract.
pub(crate) fn fall_back(
    states: States<'_>,
    tiers: &mut [Tier],
    in_tract: impl Fn(&Tier) -> Result<Arc<dyn Model>, EngineError>,
) -> Result<(), (String, EngineError)> {
    for tier in tiers.iter_mut().filter(|tier| tier.model.backend() != Backend::Tract) {
        let Err(error) = check(states, tier) else { continue };
        let backend = &tier.model.info().backend;
        tracing::warn!(tier = tier.name, backend, %error, "tract runs this model");
        tier.model = in_tract(tier).map_err(|error| (tier.name.clone(), error))?;
    }
    Ok(())
}

/// `|found - due| / |due|` over the pixels of the mask; 0 where nothing is due and found.
fn relative_l2(found: &[f32], due: &[f32], mask: &[bool]) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for ((found, due), _) in found.iter().zip(due).zip(mask).filter(|(_, inside)| **inside) {
        difference += f64::from(found - due).powi(2);
        size += f64::from(*due).powi(2);
    }
    if difference > 0.0 { (difference / size.max(f64::MIN_POSITIVE)).sqrt() } else { 0.0 }
}

/// `sum found due / sum due^2` over the pixels of the mask; 1 where nothing is due.
fn share(found: &[f32], due: &[f32], mask: &[bool]) -> f64 {
    let (mut common, mut size) = (0.0, 0.0);
    for ((&found, &due), _) in found.iter().zip(due).zip(mask).filter(|(_, inside)| **inside) {
        common += f64::from(found) * f64::from(due);
        size += f64::from(due).powi(2);
    }
    if size > 0.0 { common / size } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use papilla_engine::{ModelInfo, Session};
    use serde_json::Value;

    use super::*;
    use crate::core::catalogue::{replay::State, testing};

    /// Answers the pressure, times a factor.
    struct Times {
        info: ModelInfo,
        backend: Backend,
        factor: f32,
    }

    struct TimesSession(f32);

    impl Model for Times {
        fn info(&self) -> &ModelInfo {
            &self.info
        }

        fn backend(&self) -> Backend {
            self.backend
        }

        fn session(&self) -> Result<Box<dyn Session>, EngineError> {
            Ok(Box::new(TimesSession(self.factor)))
        }
    }

    impl Session for TimesSession {
        fn infer(&mut self, pressure_pa: &[f32], sed: &mut [f32]) -> Result<(), EngineError> {
            sed.iter_mut().zip(pressure_pa).for_each(|(sed, pressure)| *sed = self.0 * pressure);
            Ok(())
        }
    }

    fn model(name: &str, backend: Backend, factor: f32) -> Arc<dyn Model> {
        Arc::new(Times { info: testing::info(name), backend, factor })
    }

    /// Finite elements answer the pressure; one model in each backend does, and one is wrong.
    fn with_states(of: impl FnOnce(States<'_>, &mut [Tier])) {
        let models = [
            model("right", Backend::Ort, 1.0),
            model("wrong", Backend::Ort, 0.001),
            model("tract's own", Backend::Tract, 0.001),
        ];
        let tiers = models.map(|model| testing::tier(model, 0.1)).to_vec();
        let mut catalogue = testing::catalogue(tiers);
        let values = vec![3.0; catalogue.skin.pixel_count()];
        let replay = Replay {
            states: vec![State {
                name: "flat".to_owned(),
                pose: Value::Null,
                depth_mm: 1.0,
                pressure_pa: values.clone(),
                sed_j_per_m3: values,
            }],
        };
        let (skin, interface) = (&catalogue.skin, &catalogue.interface);
        of(States { replay: &replay, skin, interface }, &mut catalogue.tiers);
    }

    #[test]
    fn a_backend_that_misses_golden_answers_gives_the_model_back() {
        with_states(|states, tiers| {
            let in_tract = |tier: &Tier| Ok(model(&tier.name, Backend::Tract, 1.0));
            fall_back(states, tiers, in_tract).unwrap();
            let backends: Vec<Backend> = tiers.iter().map(|tier| tier.model.backend()).collect();
            assert_eq!(backends, [Backend::Ort, Backend::Tract, Backend::Tract]);
            assert!(check(states, &tiers[1]).is_ok());
            // What tract answers is not asked for here: `papilla-server check` and a reload do.
            assert!(check(states, &tiers[2]).is_err());
        });
    }

    #[test]
    fn a_model_that_nothing_runs_is_an_error() {
        with_states(|states, tiers| {
            let failed = |_: &Tier| Err(EngineError::NonFiniteOutput);
            assert_eq!(fall_back(states, tiers, failed).unwrap_err().0, "wrong");
        });
    }

    #[test]
    fn the_share_of_a_multiple_is_its_factor() {
        let (due, mask) = ([6.0, 8.0, 5.0], [true, true, false]);
        for factor in [0.0, 0.001, 0.5, 1.0, 2.0] {
            let found = due.map(|due| factor * due);
            assert!((share(&found, &due, &mask) - f64::from(factor)).abs() < 1e-7);
        }
        assert!((share(&[8.0, -6.0, 9.0], &due, &mask)).abs() < 1e-12, "nothing in common");
        assert!((share(&[1.0; 3], &[0.0; 3], &mask) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_error_is_relative_and_of_the_patch_alone() {
        let mask = [true, true, false];
        assert!((relative_l2(&[3.0, 4.0, 9.0], &[6.0, 8.0, 0.0], &mask) - 0.5).abs() < 1e-12);
        assert!(relative_l2(&[0.0; 3], &[0.0; 3], &mask).abs() < 1e-12);
        assert!(relative_l2(&[1.0, 0.0, 0.0], &[0.0; 3], &mask) > 1e100);
    }
}
