//! The fingers beside the default one. Each is loaded when a client first names it, and reloaded
//! together with the models.
//!
//! One finger is loaded at a time, and never beside a reload. Clients find it only when every
//! thread has prepared its tiers.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use papilla_metrics::resident_bytes;
use papilla_proto::Problem;
use papilla_session_contact::ContactAssets;

use super::{Changes, ReloadError, Reloader, Renewed, Turn};
use crate::{
    StartError,
    core::{
        catalogue::{Catalogue, Loading, RETRY_AFTER, assets::FINGER, calibrate},
        fingers::{self, Bundle, BundleError, FingerError, Loaded, Memory, Named},
    },
};

/// The most failures that are remembered.
const FAILED_MAX: usize = 16;

/// Fingers that could not be loaded within the last [`RETRY_AFTER`], and why.
#[derive(Default)]
pub(super) struct Failed(Mutex<Vec<(String, Instant, Problem)>>);

impl Failed {
    fn of(&self, name: &str) -> Option<Problem> {
        let failed = self.list();
        let (_, when, problem) = failed.iter().find(|(of, ..)| of == name)?;
        (when.elapsed() < RETRY_AFTER).then(|| problem.clone())
    }

    fn note(&self, name: &str, problem: &Problem) {
        let mut failed = self.list();
        failed.retain(|(of, when, _)| of != name && when.elapsed() < RETRY_AFTER);
        if failed.len() < FAILED_MAX {
            failed.push((name.to_owned(), Instant::now(), problem.clone()));
        }
    }

    /// Forgets all failures, so that every finger may be tried again at once.
    fn forget(&self) {
        self.list().clear();
    }

    fn list(&self) -> MutexGuard<'_, Vec<(String, Instant, Problem)>> {
        // Every change leaves the list whole, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a reload found for a finger.
pub(super) enum Next {
    /// Its new catalogue and sessions, contact model and memory.
    Renewed(Box<Renewed>, Option<Arc<ContactAssets>>, Memory),
    /// Its folder is gone.
    Gone,
}

impl Next {
    pub(super) fn catalogue(&self) -> Option<&Arc<Catalogue>> {
        match self {
            Self::Renewed(renewed, ..) => Some(&renewed.catalogue),
            Self::Gone => None,
        }
    }
}

impl Reloader {
    /// The fingers beside the default one that were loaded. The one at index i has place i + 1.
    pub(crate) fn named(&self) -> Vec<Named> {
        self.named.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The finger of this name if it is loaded and on offer; never the default one.
    pub(crate) fn finger(&self, name: &str) -> Option<Named> {
        let named = self.named.read().unwrap_or_else(PoisonError::into_inner);
        let is_it = |named: &&Named| named.loaded.catalogue.name == name && !named.retired;
        named.iter().find(is_it).cloned()
    }

    /// The catalogue of the finger at `place`; None if no finger has that place.
    pub(crate) fn catalogue_at(&self, place: usize) -> Option<Arc<Catalogue>> {
        let Some(place) = place.checked_sub(1) else { return Some(self.catalogue()) };
        let named = self.named.read().unwrap_or_else(PoisonError::into_inner);
        named.get(place).map(|named| Arc::clone(&named.loaded.catalogue))
    }

    /// Why the finger of this name could not be loaded, if that was less than [`RETRY_AFTER`] ago.
    pub(crate) fn finger_failed_lately(&self, name: &str) -> Option<Problem> {
        self.failed.of(name)
    }

    /// Loads the finger of this name if it is not loaded: reads its folder, checks that the files
    /// belong together, checks its networks by their golden answers, times them, and hands warm
    /// sessions to every thread. This takes seconds, so it must not run on a worker thread of
    /// tokio.
    ///
    /// # Errors
    /// There is no such finger, too many are loaded, it is unusable, or the drain began. Nothing
    /// has changed then, and all other fingers answer as before.
    pub(crate) fn load_finger(&self, _turn: &Turn, name: &str) -> Result<(), Problem> {
        if self.finger(name).is_some() {
            return Ok(());
        }
        if let Some(problem) = self.failed.of(name) {
            return Err(problem);
        }
        self.try_finger(name).map_err(|error| {
            let is_unusable = matches!(error, FingerError::Unusable { .. });
            if is_unusable {
                tracing::error!(finger = name, %error, "not loaded");
            } else {
                // Not logged as an error, since any client can send any name.
                tracing::debug!(finger = name, %error, "not loaded");
            }
            let problem = error.into();
            if is_unusable {
                self.failed.note(name, &problem);
            }
            problem
        })
    }

    fn try_finger(&self, name: &str) -> Result<(), FingerError> {
        let folder = fingers::folder(&self.config, name)?;
        let named = self.named();
        let again = named.iter().position(|named| named.loaded.catalogue.name == name);
        let most = self.config.max_loaded_fingers.get();
        if again.is_none() && named.len() >= most {
            let names: Vec<&str> =
                named.iter().map(|named| &*named.loaded.catalogue.name).collect();
            let (name, loaded) = (name.to_owned(), names.join(", "));
            return Err(FingerError::TooMany { name, most, loaded });
        }
        let unusable = |source: BundleError| {
            let (name, source) = (name.to_owned(), Box::new(source));
            FingerError::Unusable { name, source }
        };
        if let Some(index) = again {
            // A reload found its folder gone, and now it is back.
            let next = self.renew_finger(&named[index], &folder).map_err(|error| match error {
                ReloadError::Draining => FingerError::Draining,
                ReloadError::Bundle(source) => unusable(source),
                ReloadError::Load(source) => unusable(source.into()),
                other => unusable(BundleError::Changed(other.to_string())),
            })?;
            self.name_tiers(&next.catalogue().into_iter().collect::<Vec<_>>());
            self.put_fingers(vec![(index, next)]);
            return Ok(());
        }
        let before = resident_bytes();
        let (default, loading) = (self.catalogue(), Loading::of(&self.config));
        let as_it_is = (name, named.len() + 1);
        let stops = || self.is_draining();
        let bundle = Bundle::read(&folder, as_it_is, loading, &default, None, &stops);
        let Bundle { catalogue, contact, files_bytes } =
            bundle.map_err(unusable)?.ok_or(FingerError::Draining)?;
        let failed = |source: StartError| unusable(source.into());
        if !self.config.calibration().is_zero() {
            // Zero time means the fewest runs, since a client is waiting.
            for tier in &catalogue.tiers {
                let Some(model) = tier.model() else { continue };
                calibrate::measure(tier, model.as_ref(), Duration::ZERO).map_err(failed)?;
            }
        }
        catalogue.overhead.set_us(default.overhead.us());
        let sessions = self.exchange.prepare(&catalogue, |_| true).map_err(failed)?;
        if self.is_draining() {
            return Err(FingerError::Draining);
        }
        let (catalogue, contact) = (Arc::new(catalogue), contact.map(Arc::new));
        let grown_bytes =
            resident_bytes().zip(before).map(|(after, before)| after.saturating_sub(before));
        let memory = Memory { files_bytes, grown_bytes };
        self.name_tiers(&[&catalogue]);
        // The threads come first: whoever sees that the finger is loaded may submit a job at once.
        self.exchange.hand_over(&catalogue, sessions);
        let tiers = catalogue.names();
        let loaded = Loaded { catalogue, contact };
        self.measure_beside(&loaded);
        let named = Named { loaded, memory, retired: false };
        self.named.write().unwrap_or_else(PoisonError::into_inner).push(named);
        tracing::info!(finger = name, tiers, files_bytes, grown_bytes, "finger loaded");
        Ok(())
    }

    /// Times the finger's contact and effects on a thread of its own while the finger is served,
    /// unless calibration is off. Until that is done, their times are estimates.
    fn measure_beside(&self, Loaded { catalogue, contact }: &Loaded) {
        if self.config.calibration().is_zero() {
            return;
        }
        let (catalogue, contact) = (Arc::clone(catalogue), contact.clone());
        let measure = move || {
            if let Some(contact) = contact {
                contact.measure();
            }
            calibrate::measure_effects(&catalogue);
        };
        // If no thread can be started, the estimates stand.
        if let Err(error) = thread::Builder::new().name("measure".to_owned()).spawn(measure) {
            tracing::warn!(%error, "a finger's contact cannot be measured");
        }
    }

    /// Reads every loaded finger anew. Returns what replaces each, with its index; nothing is
    /// replaced yet.
    pub(super) fn renew_fingers(&self) -> Result<Vec<(usize, Next)>, ReloadError> {
        self.failed.forget();
        let mut all = Vec::new();
        for (index, named) in self.named().iter().enumerate() {
            let name = &named.loaded.catalogue.name;
            let next = match fingers::folder(&self.config, name) {
                Ok(folder) if !named.retired || folder.join(FINGER).is_file() => {
                    self.renew_finger(named, &folder).map_err(|source| match source {
                        ReloadError::Draining => ReloadError::Draining,
                        source => {
                            ReloadError::Finger { name: name.clone(), source: Box::new(source) }
                        }
                    })?
                }
                Ok(_) | Err(_) => Next::Gone,
            };
            all.push((index, next));
        }
        Ok(all)
    }

    fn renew_finger(&self, old: &Named, folder: &Path) -> Result<Next, ReloadError> {
        let running = &old.loaded.catalogue;
        let (default, loading) = (self.catalogue(), Loading::of(&self.config));
        let as_it_is = (&*running.name, running.place);
        let stops = || self.is_draining();
        let bundle = Bundle::read(folder, as_it_is, loading, &default, Some(&old.loaded), &stops)?;
        let Bundle { catalogue, contact, files_bytes } = bundle.ok_or(ReloadError::Draining)?;
        let renewed = self.renew(catalogue, running)?;
        let contact = contact.map(Arc::new);
        Ok(Next::Renewed(Box::new(renewed), contact, Memory { files_bytes, ..old.memory }))
    }

    /// Puts what [`renew_fingers`](Self::renew_fingers) made into place. Returns what has changed.
    pub(super) fn put_fingers(&self, all: Vec<(usize, Next)>) -> BTreeMap<String, Changes> {
        let mut changed = BTreeMap::new();
        let mut named = self.named();
        for (index, next) in all {
            let before = &mut named[index];
            let name = before.loaded.catalogue.name.clone();
            match next {
                Next::Renewed(renewed, contact, memory) => {
                    let Renewed { catalogue, sessions, changes } = *renewed;
                    self.exchange.hand_over(&catalogue, sessions);
                    let loaded = Loaded { catalogue, contact };
                    self.measure_beside(&loaded);
                    *before = Named { loaded, memory, retired: false };
                    changed.insert(name, changes);
                }
                Next::Gone if before.retired => {}
                Next::Gone => {
                    before.retired = true;
                    let offered = before.loaded.catalogue.offered();
                    let removed = offered.map(|(_, tier)| tier.name.clone()).collect();
                    changed.insert(name, Changes { removed, ..Changes::default() });
                }
            }
        }
        // Only the holder of the turn changes the list, so nothing has changed it meanwhile.
        *self.named.write().unwrap_or_else(PoisonError::into_inner) = named;
        changed
    }

    /// The folder of a finger's models; None if they are embedded in the binary.
    pub(super) fn folder_of(&self, catalogue: &Catalogue) -> Option<PathBuf> {
        match catalogue.place {
            0 => self.config.models.clone(),
            _ => self.config.fingers.as_ref().map(|fingers| fingers.join(&catalogue.name)),
        }
    }
}
