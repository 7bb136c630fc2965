//! The tiers this service can render with, their atlas, and the replay.

use std::{
    sync::Arc,
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

use bytes::Bytes;
use papilla_engine::{Card, Model, card::Index};
use papilla_proto::atlas::{Atlas, Patch, Raster};
use serde_json::Value;

use crate::{StartError, assets::Assets, replay::Replay};

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
    /// Median relative L2 error on held-out presses, from the card.
    pub(crate) relative_l2_median: f64,
    /// How long it takes here.
    pub(crate) speed: Speed,
}

/// How long the inference of a tier takes on this machine, learnt from its runs.
#[derive(Debug)]
pub(crate) struct Speed {
    fastest_us: AtomicU64,
    typical_us: AtomicU64,
}

impl Default for Speed {
    fn default() -> Self {
        Self { fastest_us: AtomicU64::new(u64::MAX), typical_us: AtomicU64::new(0) }
    }
}

impl Speed {
    /// Takes note of one run of the warm-up: the fastest is what to expect. The others
    /// met cold caches, and the other threads warming up beside them.
    pub(crate) fn warm(&self, time: Duration) {
        self.learn(time);
        self.typical_us.store(self.fastest_us.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Takes note of one run.
    pub(crate) fn learn(&self, time: Duration) {
        let us = u64::try_from(time.as_micros()).unwrap_or(u64::MAX).max(1);
        self.fastest_us.fetch_min(us, Ordering::Relaxed);
        // Threads may overwrite each other's update; a lost one does not matter to a mean.
        let typical = match self.typical_us.load(Ordering::Relaxed) {
            0 => us,
            old => (old * 15 + us) / 16,
        };
        self.typical_us.store(typical.max(1), Ordering::Relaxed);
    }

    /// Less time than any run took so far: half the fastest, so that one lucky
    /// run on an idle machine does not condemn a frame that could be in time.
    pub(crate) fn floor(&self) -> Duration {
        match self.fastest_us.load(Ordering::Relaxed) {
            u64::MAX => Duration::ZERO,
            us => Duration::from_micros(us / 2),
        }
    }

    /// A running mean, us.
    pub(crate) fn typical_us(&self) -> u64 {
        self.typical_us.load(Ordering::Relaxed)
    }
}

/// What decoding, encoding and handing over add to the inference, us; for predictions.
const OVERHEAD_US: u64 = 500;

impl Tier {
    /// Time from receipt to answer on an idle machine, us.
    pub(crate) fn predicted_latency_us(&self) -> u64 {
        self.speed.typical_us() + OVERHEAD_US
    }
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
        let (skin, interface) =
            (Raster::new(&atlas, Patch::Skin), Raster::new(&atlas, Patch::Interface));
        Ok(Self { tiers, default, atlas, atlas_json, skin, interface, replay })
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
            .filter(|(_, tier)| tier.predicted_latency_us() <= u64::from(budget_us))
            .min_by(|(_, a), (_, b)| a.relative_l2_median.total_cmp(&b.relative_l2_median))
            .or_else(|| fitting().min_by_key(|(_, tier)| tier.speed.typical_us()))
            .map(|(index, _)| index)
    }
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
    Ok(Tier {
        name: name.to_owned(),
        effects: info.effects.clone(),
        atlas_hash: info.atlas_hash.clone(),
        pressure_max_pa: info.pressure_max_pa,
        sed_max_j_per_m3: info.sed_max_j_per_m3,
        relative_l2_median: card.metrics.relative_l2.median,
        card: serde_json::from_str(json)?,
        speed: Speed::default(),
        model,
    })
}
