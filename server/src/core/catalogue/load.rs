//! Reading single files of a model folder.

use std::{sync::Arc, time::Duration};

use papilla_engine::{
    Backend, Card, Choice, EngineError, Ladder, Model,
    ladder::{Kind, SET_NAMES},
    load_with,
};
use papilla_proto::{atlas::Atlas, json};
use serde_json::Value;

use super::{NamedOnly, Tier, assets::Assets, golden};
use crate::{
    StartError,
    config::Config,
    core::{digest::sha256_hex, latency::Latency},
};

/// Reads the ladder. Rungs measured on another file than the tier's are left out: their figures
/// are of a model that is not served.
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
        let same = |hash: &String| *hash == tier.model.info().onnx_sha256;
        let fresh = rung.onnx_sha256.as_ref().is_none_or(same);
        if !fresh {
            tracing::warn!(tier = %tier.name, "ladder.json has figures of another file; measure it anew");
        }
        fresh
    });
    Ok(ladder)
}

/// The shipped time of a tier, ms, in what runs it here.
fn shipped_ms(ladder: &Ladder, tier: &Tier) -> Option<f64> {
    ladder.rung_of(&tier.name)?.time_ms_in(tier.model.backend())
}

/// Gives tiers the shipped times and errors, marks what no budget picks; the set they are judged on.
pub(super) fn judge(tiers: &mut [Tier], ladder: Option<&Ladder>) -> Option<String> {
    let is_choice = tiers.iter().any(|tier| tier.knows_contact);
    for tier in tiers.iter_mut() {
        let is_narrow = is_choice && tier.kind == Kind::Network && !tier.knows_contact;
        tier.named_only = is_narrow.then_some(NamedOnly::FePressure);
    }
    let ladder = ladder?;
    for tier in tiers.iter() {
        // A tier that goes on over a reload shares its times, which it has learnt here.
        if let (Some(ms), 1) = (shipped_ms(ladder, tier), Arc::strong_count(&tier.latency)) {
            tier.latency.expect(milliseconds(ms));
        }
    }
    let error = |tier: &Tier, set: &str| ladder.rung_of(&tier.name)?.relative_l2(set);
    let complete = |set: &&str| tiers.iter().all(|tier| error(tier, set).is_some());
    let set = SET_NAMES.into_iter().find(complete)?;
    for tier in tiers.iter_mut() {
        tier.relative_l2_median = error(tier, set).unwrap_or(tier.relative_l2_median);
    }
    let ms = |tier: &Tier| shipped_ms(ladder, tier);
    let beats = |better: &Tier, tier: &Tier| {
        ms(better).zip(ms(tier)).is_some_and(|(a, b)| a <= MARGIN * b)
            && better.relative_l2_median < tier.relative_l2_median
            && better.renders(&tier.effects)
    };
    let wide = || tiers.iter().filter(|tier| tier.named_only.is_none());
    let outdone: Vec<_> = tiers.iter().map(|tier| wide().any(|t| beats(t, tier))).collect();
    for (tier, outdone) in tiers.iter_mut().zip(outdone) {
        tier.named_only = tier.named_only.or(outdone.then_some(NamedOnly::Outdone));
    }
    Some(set.to_owned())
}

/// By so much a shipped time may be greater and still not count as slower.
const MARGIN: f64 = 1.1;

fn milliseconds(ms: f64) -> Duration {
    Duration::try_from_secs_f64(ms / 1e3).unwrap_or_default()
}

pub(super) fn text(bytes: &[u8]) -> Result<&str, String> {
    json::text(bytes).map_err(|error| error.to_string())
}

/// A card, and the same as it was shipped.
pub(super) struct ReadCard {
    card: Card,
    shipped: Value,
}

impl ReadCard {
    pub(super) fn parse(json: &[u8]) -> Result<Self, String> {
        let json = text(json)?;
        let card = Card::from_json(json).map_err(|error| error.to_string())?;
        let shipped = serde_json::from_str(json).map_err(|error| error.to_string())?;
        Ok(Self { card, shipped })
    }
}

/// What the settings say of loading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Loading<'a> {
    /// The tier to take unasked, if not the index's.
    pub(crate) default: Option<&'a str>,
    backend: Choice,
    calibration: Duration,
}

impl<'a> Loading<'a> {
    pub(crate) fn of(config: &'a Config) -> Self {
        let (default, calibration) = (config.default_tier.as_deref(), config.calibration());
        Self { default, backend: config.backend, calibration }
    }

    /// Loads one of so many models. Finding out which backends are faster takes half as long as
    /// the calibration.
    pub(super) fn model(
        self,
        onnx: &[u8],
        card: &Card,
        of: usize,
    ) -> Result<Arc<dyn Model>, EngineError> {
        let shares = u32::try_from(2 * of).unwrap_or(u32::MAX).max(1);
        self.backend.load(onnx, Some(card), self.calibration / shares)
    }

    /// Tries what was chosen for its speed on golden answers; what fails runs in tract.
    ///
    /// # Errors
    /// Tract does not load that model.
    pub(super) fn hold_to_golden_answers(
        self,
        states: golden::States<'_>,
        tiers: &mut [Tier],
        assets: &Assets,
    ) -> Result<(), StartError> {
        if self.backend != Choice::Auto {
            return Ok(());
        }
        let in_tract = |tier: &Tier| {
            let read = |ending| assets.get(&format!("{}.{ending}", tier.name)).unwrap_or_default();
            let card = json::text(read("json")).unwrap_or_default();
            load_with(Backend::Tract, read("onnx"), Some(&Card::from_json(card)?))
        };
        golden::fall_back(states, tiers, in_tract)
            .map_err(|(tier, source)| StartError::Engine { tier, source })
    }
}

pub(super) fn load_tier(
    name: &str,
    onnx: &[u8],
    ReadCard { card, shipped }: ReadCard,
    load: impl Fn(&[u8], &Card) -> Result<Arc<dyn Model>, EngineError>,
    running: Option<&Tier>,
) -> Result<Tier, Box<dyn std::error::Error>> {
    let same = running.filter(|tier| {
        let hash = &tier.model.info().onnx_sha256;
        *hash == card.onnx_sha256 && *hash == sha256_hex(onnx)
    });
    let model = match same {
        Some(tier) => {
            card.require_model(tier.model.info())?;
            Arc::clone(&tier.model)
        }
        None => load(onnx, &card)?,
    };
    let info = model.info();
    if info.name != name {
        return Err(format!("the model calls itself '{}'", info.name).into());
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
        kind: Kind::of_network(&info.network),
        sessions: running.map(|tier| Arc::clone(&tier.sessions)).unwrap_or_default(),
        effects: info.effects.clone(),
        atlas_hash: info.atlas_hash.clone(),
        pressure_max_pa: info.pressure_max_pa,
        input_statistics_max: card.input_statistics_max,
        response_max_per_mpa: card.response_max_per_mpa,
        sed_max_j_per_m3: info.sed_max_j_per_m3,
        relative_l2_median: card.metrics.relative_l2.median,
        relative_l2_p95: card.metrics.relative_l2.p95,
        knows_contact: card.knows_contact(),
        card: shipped,
        latency,
        named_only: None,
        retired: false,
        model,
    })
}
