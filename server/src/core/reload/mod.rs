//! Models that change while the service runs: they are read, checked and prepared, and then replace
//! the old ones. If anything is wrong, nothing changes.

mod fingers;
mod first_use;
mod watch;

use std::{
    collections::BTreeMap,
    sync::{Arc, PoisonError, RwLock, atomic::Ordering},
};

use papilla_metrics::{Metrics, TIERS_MAX, TierLabels};
use papilla_proto::{ErrorCode, Problem};
use serde::Serialize;
use tokio::sync::{Mutex, OwnedMutexGuard, watch::Sender};

pub(crate) use watch::{once, watch};

use crate::{
    StartError,
    config::Config,
    core::{
        catalogue::{
            Catalogue, Loading, Tier,
            assets::Assets,
            calibrate,
            golden::{self, GoldenError},
        },
        fingers::{BundleError, Named},
        scheduler::{Exchange, Sessions},
    },
};
use fingers::Failed;

/// Holds the catalogues in use, loads the fingers that clients name, and reloads the models of a
/// folder.
pub(crate) struct Reloader {
    /// The default finger's catalogue. The lock is held only to copy or replace the pointer. A
    /// lock-free pointer would allocate when a thread first reads it, which may be in the middle of
    /// a session's frames.
    running: RwLock<Arc<Catalogue>>,
    /// The other fingers; the one at index i has place i + 1. The lock is held as briefly.
    named: RwLock<Vec<Named>>,
    /// The fingers that could not be loaded a moment ago.
    failed: Failed,
    /// True once the server drains.
    drain: Arc<Sender<bool>>,
    config: Config,
    exchange: Exchange,
    metrics: Arc<Metrics>,
    /// One reload, or one model at its first use, at a time.
    turn: Arc<Mutex<()>>,
}

/// Permission for one reload or one first use. The next can begin when it is dropped.
pub(crate) struct Turn(#[expect(dead_code, reason = "held, not read")] OwnedMutexGuard<()>);

/// What a reload changed, by tier names.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Changes {
    /// The default tier.
    pub(crate) default: String,
    pub(crate) added: Vec<String>,
    /// Tiers that kept their name and have another file.
    pub(crate) changed: Vec<String>,
    pub(crate) removed: Vec<String>,
    pub(crate) unchanged: Vec<String>,
    /// The same for the fingers beside the default one, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) fingers: BTreeMap<String, Changes>,
}

/// A catalogue that is ready to replace the old one, with the sessions of its new models.
struct Renewed {
    catalogue: Arc<Catalogue>,
    sessions: Vec<Sessions>,
    changes: Changes,
}

/// Why a reload changed nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReloadError {
    #[error(
        "the models in the binary cannot change; start the service with --models DIR, or with \
         --fingers DIR"
    )]
    Embedded,
    #[error("models are being loaded already; try again in a moment")]
    Busy,
    #[error("the server drains")]
    Draining,
    #[error(transparent)]
    Load(#[from] StartError),
    #[error("tier {tier}: {source}")]
    Golden { tier: String, source: GoldenError },
    #[error("atlas.json is another atlas ({found}, not {running}); restart the service for it")]
    OtherAtlas { found: String, running: String },
    #[error("tier {tier} no longer renders {effect}, which open sessions were promised")]
    BrokenPromise { tier: String, effect: String },
    #[error("more than {TIERS_MAX} tier names since the start; restart the service")]
    TooMany,
    #[error("finger '{name}': {source}")]
    Finger { name: String, source: Box<ReloadError> },
    #[error(transparent)]
    Bundle(#[from] BundleError),
}

impl From<ReloadError> for Problem {
    fn from(error: ReloadError) -> Self {
        let code = match error {
            ReloadError::Busy => ErrorCode::Overloaded,
            ReloadError::Draining => ErrorCode::ShuttingDown,
            _ => ErrorCode::BadModel,
        };
        Self::new(code, format!("{error}; the models that run were left as they are"))
    }
}

impl Reloader {
    pub(crate) fn new(
        config: &Config,
        catalogue: Arc<Catalogue>,
        exchange: Exchange,
        metrics: Arc<Metrics>,
        drain: Arc<Sender<bool>>,
    ) -> Self {
        metrics.fingers_loaded.set(1);
        Self {
            running: RwLock::new(catalogue),
            named: RwLock::default(),
            failed: Failed::default(),
            drain,
            config: config.clone(),
            exchange,
            metrics,
            turn: Arc::default(),
        }
    }

    /// The catalogue of the default finger now. A reload may replace it at any time, so a caller
    /// that needs it twice keeps the pointer.
    pub(crate) fn catalogue(&self) -> Arc<Catalogue> {
        Arc::clone(&self.running.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes the turn, if nothing is being loaded.
    ///
    /// # Errors
    /// Something is being loaded. The metrics count this.
    pub(crate) fn try_begin(&self) -> Result<Turn, ReloadError> {
        Arc::clone(&self.turn).try_lock_owned().map(Turn).map_err(|_| {
            self.metrics.reload_busy();
            ReloadError::Busy
        })
    }

    /// Waits for the turn.
    pub(crate) async fn begin(&self) -> Turn {
        Turn(Arc::clone(&self.turn).lock_owned().await)
    }

    /// Reads the folders, checks every new model, hands warm sessions to the threads, and then
    /// replaces the catalogues. This takes seconds, so it must not run on a worker thread of tokio.
    /// It ends early when the drain begins.
    ///
    /// # Errors
    /// Anything that would keep the service from starting, a wrong golden answer, another atlas, an
    /// effect that an open session was promised and that is gone, or the drain began. Nothing has
    /// changed then.
    pub(crate) fn reload(&self, _turn: Turn) -> Result<Changes, ReloadError> {
        let result = self.replace();
        self.metrics.reload(result.is_ok());
        match &result {
            Ok(changes) => tracing::info!(?changes, "models reloaded"),
            Err(error) => tracing::error!(%error, "models not reloaded; nothing has changed"),
        }
        result
    }

    fn replace(&self) -> Result<Changes, ReloadError> {
        if self.config.models.is_none() && self.config.fingers.is_none() {
            return Err(ReloadError::Embedded);
        }
        let old = self.catalogue();
        let default = match self.config.models {
            Some(_) => Some(self.renew_default(&old)?),
            None => None,
        };
        let fingers = self.renew_fingers()?;
        // From here on nothing fails. The threads come first: whoever reads a new catalogue may
        // submit a job for a new tier at once.
        let coming = fingers.iter().filter_map(|(_, next)| next.catalogue());
        let coming: Vec<_> = default.iter().map(|new| &new.catalogue).chain(coming).collect();
        self.name_tiers(&coming);
        let mut changes = match default {
            Some(renewed) => {
                self.exchange.hand_over(&renewed.catalogue, renewed.sessions);
                *self.running.write().unwrap_or_else(PoisonError::into_inner) = renewed.catalogue;
                renewed.changes
            }
            None => Changes {
                default: old.tiers[old.default].name.clone(),
                unchanged: old.offered().map(|(_, tier)| tier.name.clone()).collect(),
                ..Changes::default()
            },
        };
        changes.fingers = self.put_fingers(fingers);
        // A second time, so that the metrics learn which tiers are gone.
        self.name_tiers(&[]);
        Ok(changes)
    }

    fn renew_default(&self, old: &Arc<Catalogue>) -> Result<Renewed, ReloadError> {
        let assets = Assets::of_unless(&self.config, &|| self.is_draining())?
            .ok_or(ReloadError::Draining)?;
        let new = Catalogue::load(&assets, Loading::of(&self.config), Some(old))?;
        self.renew(new, old)
    }

    /// Prepares the replacement of `old` by `new`: checks and times the new models, and makes warm
    /// sessions of them.
    fn renew(&self, new: Catalogue, old: &Catalogue) -> Result<Renewed, ReloadError> {
        let go_on = || if self.is_draining() { Err(ReloadError::Draining) } else { Ok(()) };
        if new.atlas.hash() != old.atlas.hash() {
            let [found, running] = [&new, old].map(|c| c.atlas.hash().to_owned());
            return Err(ReloadError::OtherAtlas { found, running });
        }
        for tier in new.tiers.iter().filter(|tier| is_new(tier, old)) {
            let name = || tier.name.clone();
            go_on()?;
            if let Some(model) = tier.model() {
                golden::check(new.golden_states(), model.as_ref(), tier.relative_l2_p95)
                    .map_err(|source| ReloadError::Golden { tier: name(), source })?;
            }
            keeps_promises(tier, old)?;
        }
        let (new, changes) = succeed(new, old);
        if new.tiers.len() > TIERS_MAX {
            return Err(ReloadError::TooMany);
        }
        go_on()?;
        calibrate::calibrate(&new, self.config.calibration())?;
        go_on()?;
        let fresh = |place: usize| is_new(&new.tiers[place], old);
        let sessions = self.exchange.prepare(&new, fresh)?;
        Ok(Renewed { catalogue: Arc::new(new), sessions, changes })
    }

    /// Tells the metrics which tiers there are, including those of the catalogues that are
    /// `coming`. This has to be done before those are in use, so that no frame goes uncounted.
    fn name_tiers(&self, coming: &[&Arc<Catalogue>]) {
        let (default, named) = (self.catalogue(), self.named());
        let running = named.iter().map(|named| (&named.loaded.catalogue, named.retired));
        let running = std::iter::once((&default, false)).chain(running);
        let stays = |of: &(&Arc<Catalogue>, bool)| coming.iter().all(|new| new.place != of.0.place);
        let all = running.filter(stays).chain(coming.iter().map(|new| (*new, false)));
        self.metrics.name_tiers(all.clone().flat_map(|(catalogue, retired)| {
            let labels = catalogue.tier_labels();
            labels.map(move |of| TierLabels { is_offered: of.is_offered && !retired, ..of })
        }));
        self.metrics.fingers_loaded.set(i64::try_from(all.count()).unwrap_or(i64::MAX));
    }

    fn is_draining(&self) -> bool {
        *self.drain.borrow()
    }
}

/// Whether `old` has no tier of this name with this model.
fn is_new(tier: &Tier, old: &Catalogue) -> bool {
    let same = |t: &&Tier| t.name == tier.name && Arc::ptr_eq(&t.held, &tier.held);
    old.tiers.iter().find(same).is_none()
}

/// Requires that a tier which open sessions use still renders all effects that they were told of.
fn keeps_promises(tier: &Tier, old: &Catalogue) -> Result<(), ReloadError> {
    let in_use = |t: &&Tier| t.name == tier.name && t.sessions.load(Ordering::Relaxed) > 0;
    let Some(before) = old.tiers.iter().find(in_use) else { return Ok(()) };
    match before.effects.iter().find(|effect| !tier.effects.contains(effect)) {
        None => Ok(()),
        Some(effect) => {
            let (tier, effect) = (tier.name.clone(), effect.clone());
            Err(ReloadError::BrokenPromise { tier, effect })
        }
    }
}

/// Orders the tiers of `new` so that each keeps the place it has in `old`; tiers with new names
/// come last. Tiers that only `old` has stay in their places and are retired.
fn succeed(mut new: Catalogue, old: &Catalogue) -> (Catalogue, Changes) {
    let [default, for_pressure] =
        [new.default, new.default_for_pressure].map(|place| new.tiers[place].name.clone());
    let mut coming = std::mem::take(&mut new.tiers);
    let mut changes = Changes { default: default.clone(), ..Changes::default() };
    for before in &old.tiers {
        let name = before.name.clone();
        let Some(index) = coming.iter().position(|tier| tier.name == name) else {
            if !before.retired {
                changes.removed.push(name);
            }
            new.tiers.push(Tier { retired: true, ..before.clone() });
            continue;
        };
        let tier = coming.remove(index);
        match (before.retired, is_new(&tier, old)) {
            (true, _) => changes.added.push(name),
            (false, true) => changes.changed.push(name),
            (false, false) => changes.unchanged.push(name),
        }
        new.tiers.push(tier);
    }
    changes.added.extend(coming.iter().map(|tier| tier.name.clone()));
    new.tiers.append(&mut coming);
    new.default = new.find(&default).unwrap_or_default();
    new.default_for_pressure = new.find(&for_pressure).unwrap_or_default();
    (new, changes)
}
