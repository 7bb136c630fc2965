//! Models that are loaded while the service answers: when a client first names their tier, or by
//! the start once the default tier answers.
//!
//! A model that no client has named costs neither time at the start nor memory. It is loaded once,
//! one model at a time, and never beside a reload. The tier answers only when every thread has
//! prepared it.

use std::{sync::Arc, time::Duration};

use papilla_engine::{Backend, Choice};
use papilla_proto::{ErrorCode, Problem};

use super::{Reloader, Turn};
use crate::{
    StartError,
    core::catalogue::{
        Catalogue, Loading, ReadCard, Tier,
        assets::Assets,
        calibrate,
        golden::{self, GoldenError},
        places,
    },
};

/// Why a tier's model cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FirstUseError {
    #[error(transparent)]
    File(#[from] StartError),
    #[error("{0}")]
    Model(String),
    #[error(transparent)]
    Golden(#[from] GoldenError),
}

impl Reloader {
    /// Loads the model of the tier with this number if it is not loaded: reads it, checks it
    /// against its card and its golden answers, times it, and hands a warm session to every thread.
    /// This takes seconds, so it must not run on a worker thread of tokio.
    ///
    /// # Errors
    /// The model is unusable, failed a moment ago, or the drain began. Nothing has changed then,
    /// and all other tiers answer as before.
    pub(crate) fn load_first(&self, _turn: &Turn, number: usize) -> Result<(), Problem> {
        let (finger, place) = places(number);
        let Some(catalogue) = self.catalogue_at(finger) else { return Ok(()) };
        let Some(tier) = catalogue.tiers.get(place).filter(|tier| !tier.is_loaded()) else {
            return Ok(());
        };
        if let Some(problem) = tier.held.failed_lately() {
            return Err(problem);
        }
        if self.is_draining() {
            return Err(super::ReloadError::Draining.into());
        }
        let result = self.try_load(&catalogue, place, 1);
        if tier.on_demand {
            self.metrics.first_use(result.is_ok());
        }
        result.map_err(|error| {
            tracing::error!(tier = tier.name, %error, "not loaded at its first use");
            let message = format!(
                "tier {} cannot be loaded at its first use: {error}; name another tier, or mend \
                 the file and reload the models",
                tier.name
            );
            let problem = Problem::new(ErrorCode::BadModel, message).at("tier");
            tier.held.fail(problem.clone());
            problem
        })
    }

    /// Loads the model of the default finger's tier at `place`, one of `of` that the start loads.
    /// Does nothing if it is loaded or the drain has begun. It blocks until its turn, so it must
    /// not be called on a worker thread of tokio.
    ///
    /// # Errors
    /// The model is unusable.
    pub(crate) fn load_at_start(&self, place: usize, of: usize) -> Result<(), StartError> {
        let _turn = Turn(Arc::clone(&self.turn).blocking_lock_owned());
        let catalogue = self.catalogue();
        let Some(tier) = catalogue.tiers.get(place) else { return Ok(()) };
        if tier.is_loaded() || tier.retired || self.is_draining() {
            return Ok(());
        }
        self.try_load(&catalogue, place, of).map_err(|error| match error {
            FirstUseError::File(error) => error,
            error => StartError::Unusable {
                file: format!("{}.onnx", tier.name),
                origin: Assets::origin(&self.config),
                reason: error.to_string(),
            },
        })
    }

    fn try_load(
        &self,
        catalogue: &Arc<Catalogue>,
        place: usize,
        of: usize,
    ) -> Result<(), FirstUseError> {
        let tier: &Tier = &catalogue.tiers[place];
        let folder = self.folder_of(catalogue);
        let onnx = Assets::one(folder.as_deref(), &format!("{}.onnx", tier.name))?;
        let unusable = |error: &dyn std::fmt::Display| FirstUseError::Model(error.to_string());
        // The card as it was when the tier was listed; the file must have the hash that this card
        // names.
        let card = ReadCard::parse(tier.card.to_string().as_bytes()).map_err(|e| unusable(&e))?;
        let states = catalogue.golden_states();
        let model = Loading::of(&self.config)
            .model(&tier.name, &onnx, &card.card, states, of)
            .map_err(|e| unusable(&e))?;
        drop(onnx);
        // Of the models that the start loads, only those in ONNX Runtime by the operator's choice
        // are checked here. With `Choice::Auto`, `Loading::model` has checked those that do not run
        // in tract.
        if tier.on_demand || self.config.backend == Choice::Only(Backend::Ort) {
            golden::check(states, model.as_ref(), tier.relative_l2_p95)?;
        }
        if tier.on_demand && !self.config.calibration().is_zero() {
            // Zero time means the fewest runs: no budget picks this tier.
            calibrate::measure(tier, model.as_ref(), Duration::ZERO)?;
        }
        let sessions = self.exchange.prepare_one(catalogue, place, model.as_ref())?;
        // The threads come first: whoever sees that the tier is loaded may submit a job at once.
        self.exchange.hand_over(catalogue, sessions);
        tier.held.open(Arc::clone(&model));
        // The metrics name its backend from now on.
        self.name_tiers(&[]);
        let backend = &model.info().backend;
        tracing::info!(tier = tier.name, backend, on_demand = tier.on_demand, "loaded");
        Ok(())
    }
}
