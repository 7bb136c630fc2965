//! The cards of models, and the index of a folder of models.
//!
//! A card (`models/NAME.json`) holds what `model-export evaluate` measured of `models/NAME.onnx` in
//! this engine, on simulations that no training saw.

use crate::{EngineError, MODEL_FORMAT, ModelInfo};
use papilla_proto::{InputStatistics, Warning, contact::Input, json};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The card of one model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    /// Version of this layout.
    pub format: u32,
    /// Name of the model, such as `small`.
    pub name: String,
    /// SHA-256 of the `.onnx` file, 64 lower-case hexadecimal digits.
    pub onnx_sha256: String,
    /// Length of the `.onnx` file, bytes.
    pub bytes: u64,
    /// Hash of the atlas whose maps it takes and gives.
    pub atlas_hash: String,
    /// Effects of the physics in its training data.
    pub effects: Vec<String>,
    /// Kind and size of the network.
    pub network: Value,
    /// Least and greatest pressure of the training data, Pa.
    pub pressure_range_pa: [f32; 2],
    /// Greatest statistics of the training's pressure maps; a map beyond them is flagged. Absent
    /// from models that were not fitted to maps, and until `model-export patterns` has measured
    /// them.
    #[serde(rename = "pattern_max", default, skip_serializing_if = "Option::is_none")]
    pub input_statistics_max: Option<InputStatistics>,
    /// The greatest ratio, over the maps of the training data, of a map's greatest SED to its
    /// greatest pressure squared, 1/MPa. An answer far beyond it is flagged. Absent as above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub response_max_per_mpa: Option<f32>,
    /// Greatest SED of the training data, J/m3.
    pub sed_max_j_per_m3: f32,
    /// SHA-256 of the dataset it was trained on. If there were several, SHA-256 of their hashes
    /// joined in order.
    pub dataset_sha256: String,
    /// How it was trained.
    pub training: Value,
    /// Accuracy on held-out indentations.
    pub metrics: Metrics,
    /// Time of one inference.
    pub latency_ms: Latency,
    /// Greatest difference from ONNX Runtime over all samples, relative to the greatest
    /// value of each sample; absent if it was not measured.
    pub onnxruntime_difference_max: Option<f64>,
}

/// Which pressure a network learnt from.
///
/// The service's own contact methods err, and not by chance. From their pressure a network that
/// learnt it answers nearer to the SED of finite elements (FE) than one that learnt FE's pressure,
/// and the other way round; one that learnt both lies between the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Learnt {
    /// The pressure of the simulations alone.
    Fe,
    /// What the contact methods find for the same poses, alone.
    Contact,
    /// Both.
    Both,
}

impl Learnt {
    /// Whether it learnt the pressure of contact methods.
    #[must_use]
    pub fn knows_contact(self) -> bool {
        self != Self::Fe
    }

    /// Whether it learnt the pressure of the simulations.
    #[must_use]
    pub fn knows_fe(self) -> bool {
        self != Self::Contact
    }
}

/// The warning about a model that a hello names and that did not learn such pressure as it will get,
/// where the default did.
#[must_use]
pub fn unlearnt(input: Input, named: &str, default: &str) -> Warning {
    let (learnt, gets) = match input {
        Input::Pressure => ("that contact finds from poses", "pressure that the client sends"),
        Input::Gaps | Input::Objects => {
            ("of simulations", "the pressure that contact finds from poses and gaps")
        }
    };
    let question = format!(
        "tier {named} learnt the pressure {learnt}; from {gets} its SED is further off than that of \
         {default}, which a hello without 'tier' gets"
    );
    Warning { member: "tier".to_owned(), value: None, question }
}

/// Accuracy over the samples of a split. All but SSIM are errors, relative, without unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metrics {
    /// SHA-256 of the dataset measured on, one of those it was trained on; absent from cards
    /// written before it was recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset_sha256: Option<String>,
    /// Which split of the dataset: `test` for indentations that training never saw.
    pub split: String,
    /// Number of samples measured.
    pub samples: usize,
    /// `|p - t| / |t|` over the pixels of the interface.
    pub relative_l2: Spread,
    /// The same over pixels where the truth is below 10 % of its maximum. Absent if no sample has
    /// such pixels with SED above zero.
    pub far_field_relative_l2: Option<Spread>,
    /// `|max p - max t| / max t`.
    pub peak_error: Spread,
    /// Distance between the places of the two peaks on the undeformed interface, mm; absent
    /// from cards written before it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_distance_mm: Option<Spread>,
    /// `|p - t| / |t|` over the zone toward the nail base; absent as above, and if no sample
    /// has anything there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nail_base_error: Option<Spread>,
    /// `|sum p - sum t| / sum t`.
    pub total_energy_error: Spread,
    /// Structural similarity of the maps over the truth's maximum; 1 is equal.
    pub ssim: Similarity,
}

/// Median and 95th percentile of an error over samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// 95th percentile: one sample in twenty is worse.
    pub p95: f64,
}

/// Median and 5th percentile of a similarity over samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Similarity {
    /// Median.
    pub median: f64,
    /// 5th percentile: one sample in twenty is worse.
    pub p5: f64,
}

/// Time of one inference, ms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Latency {
    /// The backend that ran it, with its version.
    pub backend: String,
    /// Threads it ran on.
    pub threads: usize,
    /// Median, ms.
    pub p50: f64,
    /// 99th percentile, ms.
    pub p99: f64,
}

impl Card {
    /// The card of a model of which this was measured; what else a card may tell is absent.
    #[must_use]
    pub fn of(info: &ModelInfo, metrics: Metrics, latency_ms: Latency) -> Self {
        Self {
            format: MODEL_FORMAT,
            name: info.name.clone(),
            onnx_sha256: info.onnx_sha256.clone(),
            bytes: info.bytes,
            atlas_hash: info.atlas_hash.clone(),
            effects: info.effects.clone(),
            network: info.network.clone(),
            pressure_range_pa: [0.0, info.pressure_max_pa],
            input_statistics_max: None,
            response_max_per_mpa: None,
            sed_max_j_per_m3: info.sed_max_j_per_m3,
            dataset_sha256: info.dataset_sha256.clone(),
            training: info.training.clone(),
            metrics,
            latency_ms,
            onnxruntime_difference_max: None,
        }
    }

    /// Reads a card.
    ///
    /// # Errors
    /// [`EngineError::BadCard`] if it is not JSON of this shape,
    /// [`EngineError::UnsupportedFormat`] if its format is another.
    pub fn from_json(text: &str) -> Result<Self, EngineError> {
        let card: Self = json::read(text.as_bytes())
            .map_err(|error| EngineError::BadCard { reason: error.to_string() })?;
        card.require_format()?;
        Ok(card)
    }

    /// Text of a card, indented, with a final newline.
    ///
    /// # Errors
    /// [`EngineError::BadCard`] if the serialiser fails (out of memory apart, it does not).
    pub fn to_json(&self) -> Result<String, EngineError> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|error| EngineError::BadCard { reason: error.to_string() })?;
        Ok(text + "\n")
    }

    /// SHA-256 of each dataset the model was trained on, as [`ModelInfo::datasets`].
    #[must_use]
    pub fn datasets(&self) -> Vec<&str> {
        crate::info::datasets(&self.dataset_sha256, &self.training)
    }

    /// Which pressure it learnt from.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        let is_alone = self.training.get("contact_alone") == Some(&Value::Bool(true));
        match self.training.get("contact") {
            None => Learnt::Fe,
            Some(_) if is_alone => Learnt::Contact,
            Some(_) => Learnt::Both,
        }
    }

    /// Hash of dimensions and tissues of the finger whose simulations trained it; None: the default
    /// finger, or no simulations at all.
    #[must_use]
    pub fn finger_sha256(&self) -> Option<&str> {
        self.training.get("finger_sha256")?.as_str()
    }

    fn require_format(&self) -> Result<(), EngineError> {
        if self.format == MODEL_FORMAT {
            return Ok(());
        }
        Err(EngineError::UnsupportedFormat { file: "the card", found: self.format })
    }

    /// Refuses the card of another model.
    ///
    /// # Errors
    /// [`EngineError::CardMismatch`] naming the first field that differs,
    /// [`EngineError::UnsupportedFormat`].
    pub fn require_model(&self, info: &ModelInfo) -> Result<(), EngineError> {
        self.require_format()?;
        let [scale, model_scale] =
            [self.sed_max_j_per_m3, info.sed_max_j_per_m3].map(|scale| scale.to_string());
        let [pressure, model_pressure] =
            [self.pressure_range_pa[1], info.pressure_max_pa].map(|scale| scale.to_string());
        for (field, card, model) in [
            ("name", &self.name, &info.name),
            ("onnx_sha256", &self.onnx_sha256, &info.onnx_sha256),
            ("atlas_hash", &self.atlas_hash, &info.atlas_hash),
            ("dataset_sha256", &self.dataset_sha256, &info.dataset_sha256),
            ("sed_max_j_per_m3", &scale, &model_scale),
            ("pressure_range_pa", &pressure, &model_pressure),
        ] {
            if card != model {
                let (card, model) = (card.clone(), model.clone());
                return Err(EngineError::CardMismatch { field, card, model });
            }
        }
        if self.network != info.network {
            let [card, model] = [&self.network, &info.network].map(ToString::to_string);
            return Err(EngineError::CardMismatch { field: "network", card, model });
        }
        if self.effects != info.effects {
            let [card, model] = [&self.effects, &info.effects].map(|effects| effects.join(", "));
            return Err(EngineError::CardMismatch { field: "effects", card, model });
        }
        Ok(())
    }
}

/// `models/index.json`: which models there are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Index {
    /// The default model; one of `models`.
    pub default: String,
    /// The default for clients that give pressure, not poses or gaps; one of `models`. None: the
    /// same as for the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default_for_pressure: Option<String>,
    /// Names of all models; each has `NAME.onnx` and `NAME.json` beside the index.
    pub models: Vec<String>,
    /// Those of `models` that a service loads when a client first names them; no budget picks them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub on_demand: Vec<String>,
    /// Name of the finger whose simulations trained those models whose atlas is not the one beside
    /// the index. They serve this finger by similarity alone. None: there are no such models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trained_on: Option<String>,
}

impl Index {
    /// Reads the index.
    ///
    /// # Errors
    /// [`EngineError::BadIndex`] if it is not JSON of this shape, if `models` lacks the default or
    /// a name in `on_demand`, or if the default is in `on_demand`.
    pub fn from_json(text: &str) -> Result<Self, EngineError> {
        let index: Self = json::read(text.as_bytes())
            .map_err(|error| EngineError::BadIndex { reason: error.to_string() })?;
        match index.fault() {
            None => Ok(index),
            Some(reason) => Err(EngineError::BadIndex { reason }),
        }
    }

    fn fault(&self) -> Option<String> {
        let Self { models, on_demand, .. } = self;
        for (member, default) in self.defaults() {
            if !models.contains(default) {
                return Some(format!("'{default}' of '{member}' is not in 'models'"));
            }
            if on_demand.contains(default) {
                return Some(format!(
                    "'{default}' of '{member}' is in 'on_demand'; take it out of there"
                ));
            }
        }
        let stranger = on_demand.iter().find(|name| !models.contains(name));
        stranger.map(|name| format!("'{name}' of 'on_demand' is not in 'models'"))
    }

    /// The models that answer clients who name none, with the members that name them.
    pub fn defaults(&self) -> impl Iterator<Item = (&'static str, &String)> {
        let for_pressure =
            self.default_for_pressure.iter().map(|name| ("default_for_pressure", name));
        std::iter::once(("default", &self.default)).chain(for_pressure)
    }

    /// The model for clients who name none and give pressure.
    #[must_use]
    pub fn default_for_pressure(&self) -> &str {
        self.default_for_pressure.as_ref().unwrap_or(&self.default)
    }
}
