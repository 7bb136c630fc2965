//! The tiers this service can render with, their atlas, and the replay.

use std::{sync::Arc, sync::atomic::AtomicUsize, time::Duration};

use bytes::Bytes;
use papilla_engine::{
    Card, Ladder, Model,
    card::Index,
    ladder::{Kind, SET_NAMES},
};
use papilla_proto::atlas::{Atlas, Patch, Raster};
use serde_json::Value;

use crate::{
    StartError,
    assets::Assets,
    effects,
    replay::Replay,
    speed::{Overhead, Speed},
};

/// One way of getting a SED map: a model, and what is known of it.
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
    /// Greatest SED it was trained on, J/m3.
    pub(crate) sed_max_j_per_m3: f32,
    /// What it is.
    pub(crate) kind: Kind,
    /// Median relative L2 error on [`Catalogue::judged_on`].
    pub(crate) relative_l2_median: f64,
    /// How long it takes here.
    pub(crate) speed: Speed,
    /// Sessions that render with it now.
    pub(crate) sessions: AtomicUsize,
}

/// All there is to render with and to show.
pub(crate) struct Catalogue {
    /// In the index's order.
    pub(crate) tiers: Vec<Tier>,
    /// Index of the tier to take unasked.
    pub(crate) default: usize,
    pub(crate) atlas: Atlas,
    pub(crate) atlas_json: Bytes,
    pub(crate) skin: Raster,
    pub(crate) interface: Raster,
    pub(crate) replay: Replay,
    /// All rungs as shipped, FE included; none if the folder has no `ladder.json`.
    pub(crate) ladder: Option<Ladder>,
    /// The set by which tiers are compared; none: each by its card.
    pub(crate) judged_on: Option<String>,
    pub(crate) overhead: Overhead,
    /// What sessions with effects share.
    pub(crate) runtime: effects::Shared,
}

impl Catalogue {
    /// Loads and checks everything.
    ///
    /// # Errors
    /// A file is missing, unreadable, or at odds with another.
    pub(crate) fn load(assets: &Assets, default: Option<&str>) -> Result<Self, StartError> {
        let origin = || assets.origin.clone();
        let read = |name: &str| {
            assets
                .get(name)
                .ok_or_else(|| StartError::Missing { file: name.to_owned(), origin: origin() })
        };
        let bad = |file: &str, error: &dyn std::fmt::Display| StartError::Unusable {
            file: file.to_owned(),
            origin: origin(),
            reason: error.to_string(),
        };
        let index = text(read("index.json")?)
            .and_then(|json| Index::from_json(json).map_err(|e| e.to_string()))
            .map_err(|e| bad("index.json", &e))?;
        let atlas_json = Bytes::copy_from_slice(read("atlas.json")?);
        let atlas = text(&atlas_json)
            .and_then(|json| Atlas::from_json(json).map_err(|e| e.to_string()))
            .map_err(|e| bad("atlas.json", &e))?;
        let mut tiers = Vec::with_capacity(index.models.len());
        for name in &index.models {
            let (onnx, card) = (format!("{name}.onnx"), format!("{name}.json"));
            let tier = load_tier(name, read(&onnx)?, read(&card)?).map_err(|e| bad(&onnx, &e))?;
            if tier.atlas_hash != atlas.hash() {
                let (model, ours) = (&tier.atlas_hash, atlas.hash());
                return Err(bad(
                    &onnx,
                    &format!("trained on atlas {model}, but atlas.json is {ours}"),
                ));
            }
            tiers.push(tier);
        }
        let wanted = default.unwrap_or(&index.default);
        let default = tiers.iter().position(|t| t.name == wanted).ok_or_else(|| {
            StartError::UnknownDefault { name: wanted.to_owned(), known: index.models.join(", ") }
        })?;
        let replay = match assets.get("replay.json") {
            Some(json) => {
                Replay::parse(json, atlas.vertex_count()).map_err(|e| bad("replay.json", &e))?
            }
            None => Replay::default(),
        };
        let ladder = match assets.get("ladder.json") {
            Some(json) => {
                Some(load_ladder(json, &atlas, &tiers).map_err(|e| bad("ladder.json", &e))?)
            }
            None => None,
        };
        let judged_on = ladder.as_ref().and_then(|ladder| judge(&mut tiers, ladder));
        let (skin, interface) =
            (Raster::new(&atlas, Patch::Skin), Raster::new(&atlas, Patch::Interface));
        let overhead = Overhead::default();
        Ok(Self {
            tiers,
            default,
            atlas,
            atlas_json,
            skin,
            interface,
            replay,
            ladder,
            judged_on,
            overhead,
            runtime: effects::Shared::default(),
        })
    }

    /// Time of a tier from receipt to answer on an idle machine, us.
    pub(crate) fn predicted_latency_us(&self, tier: usize) -> u64 {
        self.tiers[tier].speed.typical_us().saturating_add(self.overhead.us())
    }

    /// Whether a tier is expected to meet a budget; none without one.
    pub(crate) fn meets(&self, tier: usize, budget_us: Option<u32>) -> Option<bool> {
        budget_us.map(|budget| self.predicted_latency_us(tier) <= u64::from(budget))
    }

    /// Index of the tier called `name`.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        self.tiers.iter().position(|tier| tier.name == name)
    }

    /// The names, for messages.
    pub(crate) fn names(&self) -> String {
        self.tiers.iter().map(|t| t.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// The tier for a client that named none.
    ///
    /// Without a budget: the default. With one: of the tiers that render
    /// `effects` and are expected to meet it the most accurate, or else the fastest.
    pub(crate) fn choose(&self, budget_us: Option<u32>, effects: &[String]) -> Option<usize> {
        let renders = |tier: &Tier| effects.iter().all(|e| tier.effects.contains(e));
        let fitting = || self.tiers.iter().enumerate().filter(|(_, tier)| renders(tier));
        let Some(budget_us) = budget_us else {
            return if renders(&self.tiers[self.default]) {
                Some(self.default)
            } else {
                fitting().next().map(|(index, _)| index)
            };
        };
        fitting()
            .filter(|(index, _)| self.meets(*index, Some(budget_us)) == Some(true))
            .min_by(|(_, a), (_, b)| a.relative_l2_median.total_cmp(&b.relative_l2_median))
            .or_else(|| fitting().min_by_key(|(_, tier)| tier.speed.typical_us()))
            .map(|(index, _)| index)
    }
}

/// Reads the ladder. Rungs measured on another file than the tier's are left out: their figures
/// are of a model that is not served.
fn load_ladder(json: &[u8], atlas: &Atlas, tiers: &[Tier]) -> Result<Ladder, String> {
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

/// Gives the tiers the shipped times, and the errors of the first set that all were measured
/// on; the name of that set.
fn judge(tiers: &mut [Tier], ladder: &Ladder) -> Option<String> {
    for tier in tiers.iter() {
        if let Some(ms) = ladder.rung_of(&tier.name).and_then(|rung| rung.time_ms()) {
            tier.speed.expect(milliseconds(ms));
        }
    }
    let error = |tier: &Tier, set: &str| ladder.rung_of(&tier.name)?.relative_l2(set);
    let complete = |set: &&str| tiers.iter().all(|tier| error(tier, set).is_some());
    let set = SET_NAMES.into_iter().find(complete)?;
    for tier in tiers.iter_mut() {
        if let Some(error) = error(tier, set) {
            tier.relative_l2_median = error;
        }
    }
    Some(set.to_owned())
}

fn milliseconds(ms: f64) -> Duration {
    Duration::try_from_secs_f64(ms / 1e3).unwrap_or_default()
}

fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|error| error.to_string())
}

fn load_tier(name: &str, onnx: &[u8], card: &[u8]) -> Result<Tier, Box<dyn std::error::Error>> {
    let json = text(card)?;
    let card = Card::from_json(json)?;
    let model = papilla_engine::load(onnx, Some(&card))?;
    let info = model.info();
    if info.name != name {
        return Err(format!("the model calls itself '{}'", info.name).into());
    }
    let speed = Speed::default();
    speed.expect(milliseconds(card.latency_ms.p50));
    Ok(Tier {
        name: name.to_owned(),
        kind: Kind::of_network(&info.network),
        sessions: AtomicUsize::new(0),
        effects: info.effects.clone(),
        atlas_hash: info.atlas_hash.clone(),
        pressure_max_pa: info.pressure_max_pa,
        sed_max_j_per_m3: info.sed_max_j_per_m3,
        relative_l2_median: card.metrics.relative_l2.median,
        card: serde_json::from_str(json)?,
        speed,
        model,
    })
}
