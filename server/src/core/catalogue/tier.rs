//! A tier: a model, and what is known of it.

use std::sync::{Arc, atomic::AtomicUsize};

use papilla_engine::{Backend, Model, Session, ladder::Kind};
use papilla_proto::InputStatistics;
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
    /// Name in the protocol.
    pub(crate) name: String,
    /// Its model, once it is loaded.
    pub(crate) held: Arc<Held>,
    /// Whether it is loaded when a client first names it, and not before.
    pub(crate) on_demand: bool,
    /// SHA-256 of the model's file, as its card names it.
    pub(crate) onnx_sha256: String,
    /// What runs it, or is expected to while it is not loaded.
    pub(crate) backend_expected: Backend,
    /// The card as it was shipped.
    pub(crate) card: Value,
    /// Effects it renders.
    pub(crate) effects: Vec<String>,
    pub(crate) atlas_hash: String,
    /// Greatest pressure it was trained on, Pa.
    pub(crate) pressure_max_pa: f32,
    /// Roughest and heaviest map it was trained on; none if it was fitted to no maps.
    pub(crate) input_statistics_max: Option<InputStatistics>,
    /// Greatest SED over squared pressure it was trained on, 1/MPa; none likewise.
    pub(crate) response_max_per_mpa: Option<f32>,
    /// Greatest SED it was trained on, J/m3.
    pub(crate) sed_max_j_per_m3: f32,
    /// What it is.
    pub(crate) kind: Kind,
    /// Median relative L2 error on `Catalogue::judged_on`.
    pub(crate) relative_l2_median: f64,
    /// 95th percentile of that error on the card's own split.
    pub(crate) relative_l2_p95: f64,
    /// Whether it learnt the pressure that contact makes, beside FE's.
    pub(crate) knows_contact: bool,
    /// The finger whose presses trained it, if that is not its catalogue's: it serves by similarity
    /// alone, and its answers say so.
    pub(crate) trained_on: Option<TrainedOn>,
    /// Why no budget picks it; None: budgets do.
    pub(crate) named_only: Option<NamedOnly>,
    /// How long it takes here.
    pub(crate) latency: Arc<Latency>,
    /// Sessions that render with it now.
    pub(crate) sessions: Arc<AtomicUsize>,
    /// A reload found it gone: sessions that have it go on, nobody else gets it.
    pub(crate) retired: bool,
}

/// The finger whose presses trained a tier of another.
#[derive(Clone, Debug)]
pub(crate) struct TrainedOn {
    pub(crate) name: String,
    /// How far apart the places of one vertex are on the two maps, at most, px.
    pub(crate) apart_px: f32,
}

/// Why a tier is taken by name alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum NamedOnly {
    /// Another tier is more accurate and no slower.
    Outdone,
    /// It learnt FE's pressure alone: of contact's, which most sessions bring, it makes worse SED.
    FePressure,
    /// It is loaded when a client names it: no budget waits for that.
    OnDemand,
}

impl Tier {
    /// Whether it renders these effects.
    pub(crate) fn renders(&self, effects: &[String]) -> bool {
        effects.iter().all(|effect| self.effects.contains(effect))
    }

    /// Its model; none before its first use.
    pub(crate) fn model(&self) -> Option<&Arc<dyn Model>> {
        self.held.model()
    }

    /// Whether it answers.
    pub(crate) fn is_loaded(&self) -> bool {
        self.model().is_some()
    }

    /// What runs it, or is expected to while it is not loaded.
    pub(crate) fn backend(&self) -> Backend {
        self.model().map_or(self.backend_expected, |model| model.backend())
    }

    /// The same with its version; none before its first use.
    pub(crate) fn backend_label(&self) -> Option<&str> {
        self.model().map(|model| model.info().backend.as_str())
    }

    /// A session of its model `model` that has rendered [`probe_map`]: the memory that frames will
    /// use has been touched. `pressure_pa` and `sed_j_per_m3` (224 x 224 each) then hold that map
    /// and its answer.
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
