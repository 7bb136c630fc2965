//! A tier: a model, and what is known of it.

use std::sync::{Arc, atomic::AtomicUsize};

use papilla_engine::{Backend, Model, Session, card::Learnt, ladder::Kind};
use papilla_proto::{InputStatistics, contact::Input};
use serde::Serialize;
use serde_json::Value;

use super::held::Held;
use crate::{
    StartError,
    core::latency::{Latency, probe_map},
};

/// One way of getting a SED map: a model, and what is known of it.
#[derive(Clone)]
pub(crate) struct Tier {
    /// Its name in the protocol.
    pub(crate) name: String,
    /// Its model, once it is loaded.
    pub(crate) held: Arc<Held>,
    /// Whether it is loaded only when a client first names it.
    pub(crate) on_demand: bool,
    /// SHA-256 of the model's file, as its card names it.
    pub(crate) onnx_sha256: String,
    /// The backend that it is expected to run in, for the time while it is not loaded.
    pub(crate) backend_expected: Backend,
    /// The card as it was shipped.
    pub(crate) card: Value,
    /// Effects of the physics that it was trained with.
    pub(crate) effects: Vec<String>,
    pub(crate) atlas_hash: String,
    /// Hash of dimensions and tissues of the finger whose simulations trained it; None: the default
    /// finger, or no simulations.
    pub(crate) finger_sha256: Option<String>,
    /// Greatest pressure it was trained on, Pa.
    pub(crate) pressure_max_pa: f32,
    /// Greatest statistics of the maps it was trained on, by which unfamiliar maps are recognised;
    /// None if it was not fitted to maps.
    pub(crate) input_statistics_max: Option<InputStatistics>,
    /// Greatest ratio of SED to squared pressure in its training, 1/MPa; None likewise.
    pub(crate) response_max_per_mpa: Option<f32>,
    /// Greatest SED it was trained on, J/m3.
    pub(crate) sed_max_j_per_m3: f32,
    /// What kind of rung it is on the ladder.
    pub(crate) kind: Kind,
    /// Median relative L2 error from the client's pressure, on `Catalogue::judged_on`.
    pub(crate) relative_l2_median: f64,
    /// Median relative L2 error from the pressure that contact finds for poses. None: the ladder
    /// does not have it for every tier.
    pub(crate) relative_l2_median_from_poses: Option<f64>,
    /// 95th percentile of the relative L2 error on the test set of its card.
    pub(crate) relative_l2_p95: f64,
    /// Which pressure it learnt from.
    pub(crate) learnt: Learnt,
    /// The finger whose simulations trained it. None: that of this catalogue. Some: it serves by
    /// similarity alone, and its answers have the flag for that.
    pub(crate) trained_on: Option<TrainedOn>,
    /// Why no budget picks it; None: budgets may.
    pub(crate) named_only: Option<NamedOnly>,
    /// How long it takes on this machine.
    pub(crate) latency: Arc<Latency>,
    /// Number of sessions that render with it now.
    pub(crate) sessions: Arc<AtomicUsize>,
    /// A reload no longer found it. Open sessions go on with it, and new ones cannot name it.
    pub(crate) retired: bool,
}

/// The finger whose simulations trained another finger's tier.
#[derive(Clone, Debug)]
pub(crate) struct TrainedOn {
    pub(crate) name: String,
    /// The greatest distance between the places of the same vertex on the two maps, px.
    pub(crate) apart_px: f32,
}

/// Why a tier is used only if a client names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum NamedOnly {
    /// Another tier is more accurate and no slower.
    Outdone,
    /// It is loaded when a client names it, and a budget must not wait for that.
    OnDemand,
}

impl Tier {
    /// Whether it learnt such pressure as frames with this input give.
    pub(crate) fn suits(&self, input: Input) -> bool {
        self.kind.suits(self.learnt, input)
    }

    /// Its median relative L2 error from frames with this input.
    pub(crate) fn error(&self, input: Input) -> f64 {
        let of_pressure = self.relative_l2_median;
        match input {
            Input::Pressure => of_pressure,
            Input::Gaps | Input::Objects => {
                self.relative_l2_median_from_poses.unwrap_or(of_pressure)
            }
        }
    }

    /// Whether it renders these effects.
    pub(crate) fn renders(&self, effects: &[String]) -> bool {
        effects.iter().all(|effect| self.effects.contains(effect))
    }

    /// Its model; None while it is not loaded.
    pub(crate) fn model(&self) -> Option<&Arc<dyn Model>> {
        self.held.model()
    }

    /// Whether its model is loaded.
    pub(crate) fn is_loaded(&self) -> bool {
        self.model().is_some()
    }

    /// The backend that runs it, or the expected one while it is not loaded.
    pub(crate) fn backend(&self) -> Backend {
        self.model().map_or(self.backend_expected, |model| model.backend())
    }

    /// The backend with its version; None while the tier is not loaded.
    pub(crate) fn backend_label(&self) -> Option<&str> {
        self.model().map(|model| model.info().backend.as_str())
    }

    /// A session of `model` that has rendered [`probe_map`], so that the memory that frames will
    /// use has been touched. `pressure_pa` and `sed_j_per_m3` (224 x 224 each) hold that map and
    /// its answer afterwards.
    ///
    /// # Errors
    /// The tier does not run.
    pub(crate) fn warm_session(
        &self,
        model: &dyn Model,
        pressure_pa: &mut [f32],
        sed_j_per_m3: &mut [f32],
    ) -> Result<Box<dyn Session>, StartError> {
        let failed = |source| StartError::Engine { tier: self.name.clone(), source };
        let mut session = model.session().map_err(failed)?;
        probe_map(self.pressure_max_pa, pressure_pa);
        session.infer(pressure_pa, sed_j_per_m3).map_err(failed)?;
        Ok(session)
    }
}
