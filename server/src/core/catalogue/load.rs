//! Reads and checks single files of a folder of models.

use std::{sync::Arc, time::Duration};

use papilla_engine::{
    Backend, Card, Choice, Ladder, Model,
    card::Index,
    error_law::ErrorLaws,
    ladder::{Kind, POSES_SET, SET_NAMES},
    load_with,
};
use papilla_proto::{
    atlas::{Atlas, Patch},
    contact::Input,
    json,
};
use serde_json::Value;

use super::{Held, NamedOnly, Tier, TrainedOn, golden};
use crate::{
    config::Config,
    core::{digest::sha256_hex, latency::Latency},
};

/// Reads the ladder. Rungs that were measured with another model file than the tier's are left out.
pub(super) fn load_ladder(json: &[u8], atlas: &Atlas, tiers: &[Tier]) -> Result<Ladder, String> {
    let mut ladder = Ladder::from_json(text(json)?).map_err(|error| error.to_string())?;
    if ladder.atlas_hash != atlas.hash() {
        let (measured, ours) = (&ladder.atlas_hash, atlas.hash());
        return Err(format!("measured on atlas {measured}, but atlas.json is {ours}"));
    }
    ladder.rungs.retain(|rung| {
        let Some(tier) = tiers.iter().find(|t| rung.model.as_ref() == Some(&t.name)) else {
            return rung.model.is_none();
        };
        let same = |hash: &String| *hash == tier.onnx_sha256;
        let fresh = rung.onnx_sha256.as_ref().is_none_or(same);
        if !fresh {
            tracing::warn!(tier = %tier.name, "ladder.json has figures of another file; measure it anew");
        }
        fresh
    });
    Ok(ladder)
}

/// Reads the error laws. None: they were calibrated on another atlas, which is logged.
pub(super) fn load_error_laws(
    json: &[u8],
    atlas: &Atlas,
    tiers: &[Tier],
) -> Result<Option<ErrorLaws>, String> {
    let laws = ErrorLaws::from_json(text(json)?).map_err(|error| error.to_string())?;
    if laws.atlas_hash != atlas.hash() {
        tracing::warn!(
            calibrated = %laws.atlas_hash,
            ours = %atlas.hash(),
            "errors.json is of another atlas; answers tell nothing of their errors"
        );
        return Ok(None);
    }
    for of in &laws.networks {
        if tiers.iter().any(|tier| tier.name == of.name && tier.onnx_sha256 != of.onnx_sha256) {
            tracing::warn!(tier = %of.name, "errors.json is of another file; calibrate it anew");
        }
    }
    Ok(Some(laws))
}

/// The time of a tier in the ladder, ms, with the backend that runs it here.
fn shipped_ms(ladder: &Ladder, tier: &Tier) -> Option<f64> {
    ladder.rung_of(&tier.name)?.time_ms_in(tier.backend())
}

/// Gives the tiers their times and errors from the ladder, and marks those that no budget may pick.
/// Returns the name of the test set that all tiers are compared on for clients that give pressure;
/// None: there is no ladder, or no set has an error of every tier.
pub(super) fn judge(tiers: &mut [Tier], ladder: Option<&Ladder>) -> Option<String> {
    for tier in tiers.iter_mut() {
        tier.named_only = tier.on_demand.then_some(NamedOnly::OnDemand);
    }
    let ladder = ladder?;
    for tier in tiers.iter() {
        // A tier that outlasts a reload shares its times with the old catalogue, and has measured
        // them here.
        if let (Some(ms), 1) = (shipped_ms(ladder, tier), Arc::strong_count(&tier.latency)) {
            tier.latency.expect(milliseconds(ms));
        }
    }
    let error = |tier: &Tier, set: &str| ladder.rung_of(&tier.name)?.relative_l2(set);
    let is_complete = |set: &str| tiers.iter().all(|tier| error(tier, set).is_some());
    let from_poses = is_complete(POSES_SET);
    let set = SET_NAMES.into_iter().find(|set| *set != POSES_SET && is_complete(set))?;
    for tier in tiers.iter_mut() {
        tier.relative_l2_median = error(tier, set).unwrap_or(tier.relative_l2_median);
        tier.relative_l2_median_from_poses = error(tier, POSES_SET).filter(|_| from_poses);
    }
    let outdone: Vec<bool> = tiers.iter().map(|tier| is_outdone(tier, tiers, ladder)).collect();
    for (tier, outdone) in tiers.iter_mut().zip(outdone) {
        if outdone {
            tier.named_only = Some(NamedOnly::Outdone);
        }
    }
    Some(set.to_owned())
}

/// Whether, for each kind of pressure that this tier suits, another that a budget may pick is more
/// accurate and no slower.
fn is_outdone(tier: &Tier, tiers: &[Tier], ladder: &Ladder) -> bool {
    let ms = |tier: &Tier| shipped_ms(ladder, tier);
    let beats = |better: &Tier, input: Input| {
        ms(better).zip(ms(tier)).is_some_and(|(a, b)| a <= MARGIN * b)
            && better.error(input) < tier.error(input)
            && better.renders(&tier.effects)
    };
    let by_another = |input: Input| {
        let others = tiers.iter().filter(|other| other.named_only.is_none() && other.suits(input));
        others.into_iter().any(|other| beats(other, input))
    };
    // Gaps count as poses.
    let mut suited = [Input::Pressure, Input::Objects].into_iter().filter(|of| tier.suits(*of));
    suited.all(by_another)
}

/// A tier whose shipped time is at most this many times another's does not count as slower.
const MARGIN: f64 = 1.1;

fn milliseconds(ms: f64) -> Duration {
    Duration::try_from_secs_f64(ms / 1e3).unwrap_or_default()
}

pub(super) fn text(bytes: &[u8]) -> Result<&str, String> {
    json::text(bytes).map_err(|error| error.to_string())
}

/// Requires that a tier was trained on the atlas of this folder. If it was not, it may still be a
/// network borrowed from another finger: the index has to say so, and both atlases have to be alike
/// ([`APART_MAX_PX`]). Then the tier is marked as borrowed.
///
/// # Errors
/// The reason why the tier cannot serve this finger.
pub(super) fn require_atlas(
    tier: &mut Tier,
    atlas: &Atlas,
    index: &Index,
    loading: Loading<'_>,
) -> Result<(), String> {
    if tier.atlas_hash == atlas.hash() {
        // A finger that differs from the lender in bone or tissues alone has the same atlas.
        let is_borrowed = |lender: &Similar<'_>| {
            tier.kind.is_network()
                && tier.finger_sha256.is_none()
                && index.trained_on.as_deref() == Some(lender.name)
                && tier.atlas_hash == lender.atlas.hash()
        };
        if let Some(lender) = loading.similar.filter(is_borrowed) {
            tier.trained_on = Some(TrainedOn { name: lender.name.to_owned(), apart_px: 0.0 });
        }
        return Ok(());
    }
    let (model, ours) = (&tier.atlas_hash, atlas.hash());
    let mixed = format!("trained on atlas {model}, but atlas.json is {ours}");
    let (Some(lender), Some(trained_on)) = (loading.similar, &index.trained_on) else {
        let hint = loading.similar.map_or_else(String::new, |of| {
            format!(
                "; if finger '{name}' trained it, and it is to serve this one by similarity alone, \
                 index.json has to say so: \"trained_on\": \"{name}\"",
                name = of.name
            )
        });
        return Err(format!("{mixed}{hint}"));
    };
    if trained_on != lender.name {
        let lender = lender.name;
        return Err(format!(
            "{mixed}, and index.json has it from finger '{trained_on}'; '{lender}' is the one finger \
             whose networks another may borrow"
        ));
    }
    if *model != lender.atlas.hash() {
        let (lender, its) = (lender.name, lender.atlas.hash());
        return Err(format!("{mixed}; finger '{lender}', which index.json names, has {its}"));
    }
    let apart_px = lender.apart_px(atlas).filter(|px| *px <= APART_MAX_PX);
    let Some(apart_px) = apart_px else {
        return Err(format!(
            "trained on finger '{}', whose pixels show other places of the skin than those of \
             atlas.json: its network cannot serve this finger, even by similarity; train one",
            lender.name
        ));
    };
    tier.trained_on = Some(TrainedOn { name: lender.name.to_owned(), apart_px });
    ours.clone_into(&mut tier.atlas_hash);
    Ok(())
}

/// A card, and the JSON that it was read from.
pub(crate) struct ReadCard {
    pub(crate) card: Card,
    shipped: Value,
}

impl ReadCard {
    pub(crate) fn parse(json: &[u8]) -> Result<Self, String> {
        let json = text(json)?;
        let card = Card::from_json(json).map_err(|error| error.to_string())?;
        let shipped = serde_json::from_str(json).map_err(|error| error.to_string())?;
        Ok(Self { card, shipped })
    }
}

/// How models are to be loaded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Loading<'a> {
    /// The default tier, if it is to be another than the index's.
    pub(crate) default: Option<&'a str>,
    backend: Choice,
    calibration: Duration,
    what: What,
    /// The finger whose networks this one may borrow. None: only networks of its own may serve.
    similar: Option<Similar<'a>>,
}

/// Greatest distance, px, between the places of the same vertex on the maps of two fingers, if one
/// is to borrow the other's networks. For a finger scaled as a whole it is 0.01 px; for one that is
/// a sixth wider and otherwise the same it is 12 px.
const APART_MAX_PX: f32 = 16.0;

/// A finger whose networks another one borrows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Similar<'a> {
    pub(crate) name: &'a str,
    pub(crate) atlas: &'a Atlas,
}

impl Similar<'_> {
    /// The greatest distance, px, between the places of the same vertex on both maps. None: the two
    /// atlases have other triangles.
    fn apart_px(&self, atlas: &Atlas) -> Option<f32> {
        let mut apart_px: f32 = 0.0;
        for patch in [Patch::Skin, Patch::Interface] {
            let [ours, theirs] = [self.atlas, atlas].map(|atlas| &atlas.patch(patch).uv_px);
            for (a, b) in ours.iter().zip(theirs) {
                apart_px = apart_px.max((a[0] - b[0]).hypot(a[1] - b[1]));
            }
        }
        (self.atlas.triangles() == atlas.triangles()).then_some(apart_px)
    }
}

/// Which models are loaded now. Models that run already are loaded in any case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    /// Only the default tier's, which then answers while the others are being loaded.
    Default,
    /// All but those that are loaded on demand.
    OfStart,
    All,
}

impl<'a> Loading<'a> {
    pub(crate) fn of(config: &'a Config) -> Self {
        let (default, calibration) = (config.default_tier.as_deref(), config.calibration());
        let backend = config.backend;
        Self { default, backend, calibration, what: What::OfStart, similar: None }
    }

    /// As [`of`](Self::of), but for the models of the default tiers alone, so that they answer before
    /// the others are loaded.
    pub(crate) fn of_default(config: &'a Config) -> Self {
        Self { what: What::Default, ..Self::of(config) }
    }

    /// The same for another finger than the default one. It may borrow networks of `lender` if its
    /// index says so.
    pub(crate) fn of_finger(self, lender: Similar<'a>) -> Self {
        Self { default: None, similar: Some(lender), ..self }
    }

    /// As [`of`](Self::of), but all models are loaded, also those on demand.
    pub(crate) fn of_all(config: &'a Config) -> Self {
        Self { what: What::All, ..Self::of(config) }
    }

    /// Whether a model waits until a client first names it.
    pub(super) fn is_on_demand(self, name: &str, index: &Index) -> bool {
        let is_listed = index.on_demand.iter().any(|listed| listed == name);
        is_listed && self.default != Some(name)
    }

    /// Whether a model is loaded now.
    pub(super) fn is_now(self, name: &str, index: &Index) -> bool {
        match self.what {
            What::Default => match self.default {
                Some(default) => default == name,
                None => index.defaults().any(|(_, default)| default == name),
            },
            What::OfStart => !self.is_on_demand(name, index),
            What::All => true,
        }
    }

    /// The backend that a tier is expected to run in.
    fn backend_expected(self) -> Backend {
        match self.backend {
            Choice::Auto => Backend::Tract,
            Choice::Only(backend) => backend,
        }
    }

    /// Loads the model called `name`, one of `of` models. Choosing a backend by its speed takes up
    /// to half of the calibration's time, shared by all models. A model in a backend chosen that
    /// way is tried on the golden states, and runs in tract if it fails there.
    ///
    /// # Errors
    /// The file is unusable, or names another model.
    pub(crate) fn model(
        self,
        name: &str,
        onnx: &[u8],
        card: &Card,
        states: golden::States<'_>,
        of: usize,
    ) -> Result<Arc<dyn Model>, Box<dyn std::error::Error>> {
        let shares = u32::try_from(2 * of).unwrap_or(u32::MAX).max(1);
        let model = self.backend.load(onnx, Some(card), self.calibration / shares)?;
        if model.info().name != name {
            return Err(format!("the model calls itself '{}'", model.info().name).into());
        }
        if self.backend != Choice::Auto {
            return Ok(model);
        }
        let in_tract = || load_with(Backend::Tract, onnx, Some(card));
        Ok(golden::fall_back(states, model, card.metrics.relative_l2.p95, in_tract)?)
    }
}

/// The files of a tier.
pub(super) struct TierFiles<'a> {
    pub(super) name: &'a str,
    /// The bytes of the network. None: the tier waits for its first use.
    pub(super) onnx: Option<&'a [u8]>,
    pub(super) card: ReadCard,
    pub(super) on_demand: bool,
}

impl TierFiles<'_> {
    /// Makes the tier, one of `of` that are loaded. If its file is the same as that of `running`,
    /// both share the model and its times. They always share the count of sessions.
    ///
    /// # Errors
    /// A file is unusable, or card and network contradict each other.
    pub(super) fn load(
        self,
        loading: Loading<'_>,
        states: golden::States<'_>,
        of: usize,
        running: Option<&Tier>,
    ) -> Result<Tier, Box<dyn std::error::Error>> {
        let Self { name, onnx, card: ReadCard { card, shipped }, on_demand } = self;
        if card.name != name && onnx.is_none() {
            return Err(format!("its card is that of '{}'", card.name).into());
        }
        let is_of_card = |onnx: &[u8]| sha256_hex(onnx) == card.onnx_sha256;
        let same = running
            .filter(|tier| tier.onnx_sha256 == card.onnx_sha256 && onnx.is_none_or(is_of_card));
        let held = match (same, onnx) {
            (Some(tier), _) if tier.is_loaded() => Arc::clone(&tier.held),
            (Some(tier), None) => {
                // The file may have been mended before this reload, so a failure does not count any
                // more.
                tier.held.forgive();
                Arc::clone(&tier.held)
            }
            (None, None) => Arc::default(),
            (_, Some(onnx)) => Held::loaded(loading.model(name, onnx, &card, states, of)?),
        };
        if let Some(model) = held.model() {
            card.require_model(model.info())?;
        }
        let latency = same.map_or_else(
            || {
                let latency = Latency::default();
                latency.expect(milliseconds(card.latency_ms.p50));
                Arc::new(latency)
            },
            |tier| Arc::clone(&tier.latency),
        );
        Ok(Tier {
            name: name.to_owned(),
            held,
            on_demand,
            backend_expected: loading.backend_expected(),
            kind: Kind::of_network(&card.network),
            sessions: running.map(|tier| Arc::clone(&tier.sessions)).unwrap_or_default(),
            pressure_max_pa: card.pressure_range_pa[1],
            input_statistics_max: card.input_statistics_max,
            response_max_per_mpa: card.response_max_per_mpa,
            sed_max_j_per_m3: card.sed_max_j_per_m3,
            relative_l2_median: card.metrics.relative_l2.median,
            relative_l2_median_from_poses: None,
            relative_l2_p95: card.metrics.relative_l2.p95,
            learnt: card.learnt(),
            finger_sha256: card.finger_sha256().map(str::to_owned),
            effects: card.effects,
            atlas_hash: card.atlas_hash,
            onnx_sha256: card.onnx_sha256,
            card: shipped,
            latency,
            trained_on: None,
            named_only: None,
            retired: false,
        })
    }
}
