//! The catalogue of one finger: its tiers, their atlas, and the replay.

pub(crate) mod assets;
pub(crate) mod calibrate;
pub(crate) mod golden;
mod held;
mod load;
pub(crate) mod replay;
#[cfg(test)]
pub(crate) mod testing;
mod tier;

use std::{borrow::Cow, sync::Arc};

use bytes::Bytes;
use papilla_codec::{Output, Quantity};
use papilla_engine::{card::Index, error_law::ErrorLaws};
use papilla_metrics::{TIERS_MAX, TierLabels};
use papilla_proto::{
    ErrorCode, Problem,
    atlas::{Atlas, Patch, Raster},
    contact::{DEFAULT_FINGER, Input},
    error::shortened,
};
use papilla_render::SkinPixels;
use papilla_session_effects as effects;

use self::{
    assets::{Assets, ERROR_LAWS},
    load::{TierFiles, judge, load_error_laws, load_ladder, require_atlas, text},
    replay::Replay,
};
pub(crate) use self::{
    held::{Held, RETRY_AFTER},
    load::{Loading, ReadCard, Similar},
    tier::{NamedOnly, Tier, TrainedOn},
};
use crate::{
    StartError,
    core::{cache::Cache, latency::Overhead},
};

/// A step of loading, told while it goes on.
pub(crate) enum Step<'a> {
    /// These models will be loaded.
    Listed(&'a [String]),
    /// This model is loaded.
    Loaded(&'a str),
}

/// Key of the cached answers about a catalogue, which do not change while it is in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Document {
    Models,
    Atlas,
    AtlasObj,
    AtlasGlb,
    Mask(Patch),
    /// The list of the replay's states.
    States,
    /// Vertex values of a state, by its number.
    State(usize),
    /// A state as a map.
    StateMap(usize, Quantity, Output),
}

/// Everything needed to render one finger and to show it.
///
/// **Invariant:** a tier keeps its place in `tiers` for the life of the process, whatever is
/// reloaded. Jobs and sessions name a tier by a number that contains this place.
pub(crate) struct Catalogue {
    /// The finger's name.
    pub(crate) name: String,
    /// Its place among the fingers, which it keeps; that of the default finger is 0.
    pub(crate) place: usize,
    /// In the index's order.
    pub(crate) tiers: Vec<Tier>,
    /// Index of the tier for clients that give poses or gaps and name neither a tier nor a budget.
    pub(crate) default: usize,
    /// The same for clients that give pressure.
    pub(crate) default_for_pressure: usize,
    pub(crate) atlas: Atlas,
    pub(crate) atlas_json: Bytes,
    pub(crate) skin: Arc<Raster>,
    /// Which pixels show `skin`.
    pub(crate) skin_pixels: SkinPixels,
    pub(crate) interface: Raster,
    pub(crate) replay: Replay,
    /// All rungs as shipped, FE included, as JSON; `null` if the folder has no `ladder.json`.
    pub(crate) ladder_json: String,
    /// The laws by which the error of an answer is estimated. None: the folder has no `errors.json`
    /// of this atlas.
    pub(crate) error_laws: Option<ErrorLaws>,
    /// The test set by whose errors tiers are compared for clients that give pressure. None: each
    /// is judged by the error on its card.
    pub(crate) judged_on: Option<String>,
    pub(crate) overhead: Overhead,
    /// What all sessions with effects share.
    pub(crate) runtime: effects::Shared,
    /// Cached answers about this catalogue.
    pub(crate) cache: Cache<Document>,
}

/// Splits a tier's number into the place of the finger and the place of the tier.
pub(crate) fn places(number: usize) -> (usize, usize) {
    (number / TIERS_MAX, number % TIERS_MAX)
}

impl Catalogue {
    /// A catalogue of these tiers on this atlas, without files.
    #[cfg(test)]
    pub(crate) fn bare(atlas: Atlas, tiers: Vec<Tier>) -> Self {
        let [skin, interface] = [Patch::Skin, Patch::Interface].map(|p| Raster::new(&atlas, p));
        Self {
            name: DEFAULT_FINGER.to_owned(),
            place: 0,
            tiers,
            default: 0,
            default_for_pressure: 0,
            atlas_json: Bytes::new(),
            skin_pixels: SkinPixels::from(&skin),
            skin: Arc::new(skin),
            interface,
            atlas,
            replay: Replay::default(),
            ladder_json: "null".to_owned(),
            error_laws: None,
            judged_on: None,
            overhead: Overhead::default(),
            runtime: effects::Shared::default(),
            cache: Cache::default(),
        }
    }

    /// Loads and checks everything. A tier whose file is the same as in `running` shares that one's
    /// model and its times, and is not loaded again.
    ///
    /// # Errors
    /// A file is missing or unreadable, or two files contradict each other.
    pub(crate) fn load(
        assets: &Assets,
        loading: Loading<'_>,
        running: Option<&Self>,
    ) -> Result<Self, StartError> {
        Self::load_noting(assets, loading, running, &mut |_| ())
    }

    /// As [`load`](Self::load), and calls `note` at each step.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub(crate) fn load_noting(
        assets: &Assets,
        loading: Loading<'_>,
        running: Option<&Self>,
        note: &mut dyn FnMut(Step<'_>),
    ) -> Result<Self, StartError> {
        let origin = || assets.origin.clone();
        let read = |name: &str| assets.require(name);
        let bad = |file: &str, error: &dyn std::fmt::Display| StartError::Unusable {
            file: file.to_owned(),
            origin: origin(),
            reason: error.to_string(),
        };
        let index = text(read("index.json")?)
            .and_then(|json| Index::from_json(json).map_err(|e| e.to_string()))
            .map_err(|e| bad("index.json", &e))?;
        for (place, name) in index.models.iter().enumerate() {
            if index.models[..place].contains(name) {
                return Err(bad("index.json", &format!("the model '{name}' is listed twice")));
            }
        }
        // Clients get the file as it is here, without a byte order mark.
        let atlas_json = text(read("atlas.json")?).map_err(|e| bad("atlas.json", &e))?;
        let atlas = Atlas::from_json(atlas_json).map_err(|e| bad("atlas.json", &e))?;
        let atlas_json = Bytes::copy_from_slice(atlas_json.as_bytes());
        let [skin, interface] = [Patch::Skin, Patch::Interface].map(|p| Raster::new(&atlas, p));
        let pixels = [skin.pixel_count(), interface.pixel_count()];
        let replay = match assets.get("replay.json") {
            Some(json) => {
                Replay::parse(json, pixels, atlas.hash()).map_err(|e| bad("replay.json", &e))?
            }
            None => Replay::default(),
        };
        let states = golden::States { replay: &replay, skin: &skin, interface: &interface };
        let is_late = |name: &String| loading.is_on_demand(name, &index);
        let at_start: Vec<_> = index.models.iter().filter(|name| !is_late(name)).cloned().collect();
        note(Step::Listed(&at_start));
        let mut tiers = Vec::with_capacity(index.models.len());
        for name in &index.models {
            let (onnx, file) = (format!("{name}.onnx"), format!("{name}.json"));
            let on_demand = is_late(name);
            let running =
                running.and_then(|running| running.tiers.iter().find(|t| t.name == *name));
            // A tier that was loaded before a reload is loaded after it too, since sessions may
            // render with it.
            let is_to_load = loading.is_now(name, &index) || running.is_some_and(Tier::is_loaded);
            let bytes = if is_to_load {
                Some(assets.model(&onnx)?)
            } else {
                assets.require_there(&onnx)?;
                None
            };
            let card = ReadCard::parse(read(&file)?).map_err(|e| bad(&file, &e))?;
            let files = TierFiles { name, onnx: bytes.as_deref(), card, on_demand };
            let mut tier =
                files.load(loading, states, at_start.len(), running).map_err(|e| bad(&onnx, &e))?;
            require_atlas(&mut tier, &atlas, &index, loading).map_err(|e| bad(&onnx, &e))?;
            if tier.is_loaded() {
                note(Step::Loaded(name));
            }
            tiers.push(tier);
        }
        let place_of = |name: &str| {
            tiers.iter().position(|t| t.name == name).ok_or_else(|| StartError::UnknownDefault {
                name: name.to_owned(),
                known: index.models.join(", "),
            })
        };
        let default = place_of(loading.default.unwrap_or(&index.default))?;
        let for_pressure = loading.default.unwrap_or_else(|| index.default_for_pressure());
        let default_for_pressure = place_of(for_pressure)?;
        let ladder = match assets.get("ladder.json") {
            Some(json) => {
                Some(load_ladder(json, &atlas, &tiers).map_err(|e| bad("ladder.json", &e))?)
            }
            None => None,
        };
        let judged_on = judge(&mut tiers, ladder.as_ref());
        let ladder_json = serde_json::to_string(&ladder).map_err(|e| bad("ladder.json", &e))?;
        let error_laws = match assets.get(ERROR_LAWS) {
            Some(json) => load_error_laws(json, &atlas, &tiers).map_err(|e| bad(ERROR_LAWS, &e))?,
            None => None,
        };
        let overhead = Overhead::default();
        Ok(Self {
            name: DEFAULT_FINGER.to_owned(),
            place: 0,
            tiers,
            default,
            default_for_pressure,
            atlas,
            atlas_json,
            skin_pixels: SkinPixels::from(&skin),
            skin: Arc::new(skin),
            interface,
            replay,
            ladder_json,
            error_laws,
            judged_on,
            overhead,
            runtime: effects::Shared::default(),
            cache: Cache::default(),
        })
    }

    /// The states that models are tried on.
    pub(crate) fn golden_states(&self) -> golden::States<'_> {
        golden::States { replay: &self.replay, skin: &self.skin, interface: &self.interface }
    }

    /// The finger that effects are placed on.
    pub(crate) fn finger(&self) -> effects::Finger<'_> {
        let Self { atlas, skin, interface, runtime, .. } = self;
        effects::Finger { atlas, skin, interface, shared: runtime }
    }

    /// Expected time of a tier from receipt to answer, us, without the wait for a thread. For a
    /// tier that was never timed here it is the shipped time, multiplied by the greatest slowdown
    /// of the tiers that frames have used (at least 1).
    pub(crate) fn predicted_latency_us(&self, tier: usize) -> u64 {
        let latency = &self.tiers[tier].latency;
        let slower = if latency.is_measured() { 1.0 } else { self.slowdown() };
        ((slower * latency.typical_us() as f64) as u64).saturating_add(self.overhead.us())
    }

    /// A hopeful estimate of the same time, us: by the tier's fastest run here, or by its shipped
    /// time and the present slowdown of the tier at place `by`, whichever is less. Never more than
    /// [`predicted_latency_us`](Self::predicted_latency_us).
    pub(crate) fn hoped_latency_us(&self, tier: usize, by: usize) -> u64 {
        let latency = &self.tiers[tier].latency;
        let likewise_us = (self.tiers[by].latency.slowdown() * latency.expected_us() as f64) as u64;
        let best_us = latency.fastest_us().unwrap_or(u64::MAX).min(likewise_us);
        self.predicted_latency_us(tier).min(best_us.saturating_add(self.overhead.us()))
    }

    /// The greatest factor, at least 1, by which tiers that frames have used are slower than
    /// shipped.
    fn slowdown(&self) -> f64 {
        let used = self.tiers.iter().filter(|tier| tier.latency.is_used());
        used.map(|tier| tier.latency.slowdown()).fold(1.0, f64::max)
    }

    /// Whether a tier is expected to meet the budget. None: there is no budget.
    pub(crate) fn meets(&self, tier: usize, budget_us: Option<u32>) -> Option<bool> {
        budget_us.map(|budget| self.predicted_latency_us(tier) <= u64::from(budget))
    }

    /// Index of the tier called `name`; None if there is none or it was retired.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        self.tiers.iter().position(|tier| tier.name == name && !tier.retired)
    }

    /// As [`find`](Self::find), with an error that lists the tiers.
    ///
    /// # Errors
    /// There is no tier of this name.
    pub(crate) fn tier_named(&self, name: &str) -> Result<usize, Problem> {
        self.find(name).ok_or_else(|| {
            let name = shortened(name);
            let message = format!("no tier '{name}'; there are {}", self.names());
            Problem::new(ErrorCode::UnknownTier, message).at("tier")
        })
    }

    /// The tiers on offer, each with its place.
    pub(crate) fn offered(&self) -> impl Iterator<Item = (usize, &Tier)> {
        self.tiers.iter().enumerate().filter(|(_, tier)| !tier.retired)
    }

    /// The number by which jobs and answers name the tier at `place`.
    pub(crate) fn tier_number(&self, place: usize) -> usize {
        self.place * TIERS_MAX + place
    }

    /// The labels of each tier in the metrics, in the order of `tiers`.
    pub(crate) fn tier_labels(&self) -> impl Iterator<Item = TierLabels<'_>> {
        let name = |tier: &'_ str| match self.place {
            0 => Cow::Owned(tier.to_owned()),
            _ => Cow::Owned(format!("{}/{tier}", self.name)),
        };
        self.tiers.iter().enumerate().map(move |(place, tier)| TierLabels {
            number: self.tier_number(place),
            name: name(&tier.name),
            atlas_hash: &tier.atlas_hash,
            onnx_sha256: &tier.onnx_sha256,
            backend: tier.backend_label().unwrap_or("none"),
            is_default: place == self.default || place == self.default_for_pressure,
            is_offered: !tier.retired,
        })
    }

    /// The names of the tiers on offer, for messages.
    pub(crate) fn names(&self) -> String {
        self.offered().map(|(_, t)| t.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// The default tier for frames with this input.
    pub(crate) fn default_for(&self, input: Input) -> usize {
        match input {
            Input::Pressure => self.default_for_pressure,
            Input::Gaps | Input::Objects => self.default,
        }
    }

    /// The tier for a client that named none, among tiers that render `effects`. None: no tier that
    /// renders them is loaded.
    ///
    /// Without a budget it is the default tier, or else the first that is loaded. With a budget it
    /// is the most accurate tier that is expected to meet it, or else the fastest. Tiers that are
    /// loaded on demand are never chosen.
    pub(crate) fn choose(
        &self,
        budget_us: Option<u32>,
        effects: &[String],
        input: Input,
    ) -> Option<usize> {
        let Some(budget_us) = budget_us else {
            let mut fitting = self.ready_for(effects).map(|(place, _)| place);
            let default = Some(self.default_for(input));
            let default = default.filter(|&tier| self.tiers[tier].renders(effects));
            return default.or_else(|| fitting.next());
        };
        self.choose_among(budget_us, effects, input, |_| true)
    }

    /// The tier for a budget among those that `may` accepts: the most accurate one that is expected
    /// to meet the budget, or else the fastest.
    pub(crate) fn choose_among(
        &self,
        budget_us: u32,
        effects: &[String],
        input: Input,
        may: impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let fitting = || self.for_budgets(effects, input).filter(|&place| may(place));
        let error = |place: usize| self.tiers[place].error(input);
        fitting()
            .filter(|&place| self.meets(place, Some(budget_us)) == Some(true))
            .min_by(|&a, &b| error(a).total_cmp(&error(b)))
            .or_else(|| fitting().min_by_key(|&place| self.predicted_latency_us(place)))
    }

    /// Places of the tiers that are to be loaded at the start and are not loaded yet.
    pub(crate) fn to_come(&self) -> impl Iterator<Item = usize> {
        let is_to_come = |tier: &Tier| !tier.on_demand && !tier.is_loaded();
        self.offered().filter(move |(_, tier)| is_to_come(tier)).map(|(place, _)| place)
    }

    /// The loaded tiers that render these effects, each with its place, without those that are
    /// loaded on demand.
    fn ready_for(&self, effects: &[String]) -> impl Iterator<Item = (usize, &Tier)> {
        let is_ready = |tier: &Tier| !tier.on_demand && tier.is_loaded();
        self.offered().filter(move |(_, tier)| is_ready(tier) && tier.renders(effects))
    }

    /// Places of the tiers that a budget may pick: they are loaded, render these effects, and are
    /// not loaded on demand. Tiers that learnt other pressure, and those marked as [`NamedOnly`],
    /// are left out if there are any others.
    pub(crate) fn for_budgets(
        &self,
        effects: &[String],
        input: Input,
    ) -> impl Iterator<Item = usize> {
        let is_choice = move |tier: &Tier| tier.named_only.is_none() && tier.suits(input);
        let fitting = move || self.ready_for(effects);
        let has_choice = fitting().any(|(_, tier)| is_choice(tier));
        fitting().filter(move |(_, tier)| !has_choice || is_choice(tier)).map(|(place, _)| place)
    }
}
