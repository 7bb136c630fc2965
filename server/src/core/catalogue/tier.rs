//! A tier: a model, and what is known of it.

use std::sync::{Arc, atomic::AtomicUsize};

use papilla_engine::{Model, Session, ladder::Kind};
use papilla_proto::InputStatistics;
use serde::Serialize;
use serde_json::Value;

use crate::{
    StartError,
    core::latency::{Latency, probe_map},
};

/// One way of getting a SED map: a model, and what is known of it.
#[derive(Clone)]
pub(crate) struct Tier {
    /// Name in the protocol.
    pub(crate) name: String,
    pub(crate) model: Arc<dyn Model>,
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
    /// Why no budget picks it; None: budgets do.
    pub(crate) named_only: Option<NamedOnly>,
    /// How long it takes here.
    pub(crate) latency: Arc<Latency>,
    /// Sessions that render with it now.
    pub(crate) sessions: Arc<AtomicUsize>,
    /// A reload found it gone: sessions that have it go on, nobody else gets it.
    pub(crate) retired: bool,
}

/// Why a tier is taken by name alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum NamedOnly {
    /// Another tier is more accurate and no slower.
    Outdone,
    /// It learnt FE's pressure alone: of contact's, which most sessions bring, it makes worse SED.
    FePressure,
}

impl Tier {
    /// Whether it renders these effects.
    pub(crate) fn renders(&self, effects: &[String]) -> bool {
        effects.iter().all(|effect| self.effects.contains(effect))
    }

    /// A session that has rendered [`probe_map`]: the memory that frames will use has been touched.
    /// `pressure_pa` and `sed_j_per_m3` (224 x 224 each) then hold that map and its answer.
    ///
    /// # Errors
    /// The tier does not run.
    pub(crate) fn warm_session(
        &self,
        pressure_pa: &mut [f32],
        sed_j_per_m3: &mut [f32],
    ) -> Result<Box<dyn Session>, StartError> {
        let failed = |source| StartError::Engine { tier: self.name.clone(), source };
        let mut session = self.model.session().map_err(failed)?;
        probe_map(self.pressure_max_pa, pressure_pa);
        session.infer(pressure_pa, sed_j_per_m3).map_err(failed)?;
        Ok(session)
    }
}
