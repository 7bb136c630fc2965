//! What a model file says about itself.

use crate::{EngineError, MAP_SIDE_PX, MODEL_FORMAT};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fmt::Write;
use tract_onnx::pb::{ModelProto, tensor_proto::DataType};

/// What a model is, from the `metadata_props` of its file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelInfo {
    /// Name, such as `small`.
    pub name: String,
    /// SHA-256 of the file, 64 lower-case hexadecimal digits.
    pub onnx_sha256: String,
    /// Length of the file, bytes.
    pub bytes: u64,
    /// Number of floating-point values in the network's tensors, without those that are maps, such
    /// as masks.
    pub weights: u64,
    /// Hash of the atlas whose maps it takes and gives.
    pub atlas_hash: String,
    /// Effects of the physics in its training data, such as `finite_strain`.
    pub effects: Vec<String>,
    /// Kind and size of the network.
    pub network: Value,
    /// Greatest pressure of the training data, Pa; beyond it the model extrapolates.
    pub pressure_max_pa: f32,
    /// Greatest SED of the training data, J/m3.
    pub sed_max_j_per_m3: f32,
    /// SHA-256 of the dataset it was trained on. If there were several, SHA-256 of the hashes of
    /// its [`datasets`](Self::datasets) joined in order.
    pub dataset_sha256: String,
    /// How it was trained: seed, epochs, optimiser, loss, versions, seconds.
    pub training: Value,
    /// The backend that runs it, with its version.
    pub backend: String,
}

impl ModelInfo {
    /// Reads the metadata of a model. `onnx` is the file that `proto` was decoded from.
    ///
    /// # Errors
    /// [`EngineError::MissingMetadata`], [`EngineError::BadMetadata`],
    /// [`EngineError::UnsupportedFormat`].
    pub(crate) fn read(proto: &ModelProto, onnx: &[u8]) -> Result<Self, EngineError> {
        let metadata = Metadata(proto);
        let format: u32 = metadata.parsed("papilla.format", "a whole number")?;
        if format != MODEL_FORMAT {
            return Err(EngineError::UnsupportedFormat { file: "the model", found: format });
        }
        let name = metadata.text("papilla.name")?;
        // The name becomes part of paths, URLs and metrics.
        if name.is_empty()
            || name.len() > 64
            || !name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
            || name.starts_with('.')
        {
            return Err(EngineError::BadMetadata {
                key: "papilla.name",
                value: name.to_owned(),
                expected: "1 to 64 letters, digits, '-', '_' or '.'",
            });
        }
        Ok(Self {
            name: name.to_owned(),
            onnx_sha256: hex(&Sha256::digest(onnx)),
            bytes: onnx.len() as u64,
            weights: weight_count(proto),
            atlas_hash: metadata.sha256("papilla.atlas_hash")?,
            effects: metadata.json("papilla.effects", "a JSON list of words")?,
            network: metadata.json("papilla.network", "JSON")?,
            pressure_max_pa: metadata.positive("papilla.pressure_max_pa")?,
            sed_max_j_per_m3: metadata.positive("papilla.sed_max_j_per_m3")?,
            dataset_sha256: metadata.sha256("papilla.dataset_sha256")?,
            training: metadata.json("papilla.training", "JSON")?,
            backend: String::new(),
        })
    }

    /// SHA-256 of each dataset it was trained on: the list `datasets` in `papilla.training`, if
    /// [`dataset_sha256`](Self::dataset_sha256) is the hash of that list, otherwise
    /// `dataset_sha256` alone.
    #[must_use]
    pub fn datasets(&self) -> Vec<&str> {
        datasets(&self.dataset_sha256, &self.training)
    }
}

/// The list `datasets` in `training` if `own` is the hash of that list, otherwise `own` alone.
pub(crate) fn datasets<'a>(own: &'a str, training: &'a Value) -> Vec<&'a str> {
    let listed = training.get("datasets").and_then(Value::as_array);
    let parts: Vec<&str> = listed.into_iter().flatten().filter_map(Value::as_str).collect();
    let joined = hex(&Sha256::digest(parts.concat()));
    if parts.len() > 1 && joined == own { parts } else { vec![own] }
}

/// Number of values in floating-point initialisers, also those stored in 16 bits, without maps
/// (masks, coordinates).
fn weight_count(proto: &ModelProto) -> u64 {
    const SIDE: i64 = MAP_SIDE_PX as i64;
    let Some(graph) = &proto.graph else { return 0 };
    let count =
        |dims: &[i64]| dims.iter().fold(1u64, |n, &d| n.saturating_mul(d.max(0).unsigned_abs()));
    graph
        .initializer
        .iter()
        .filter(|t| [DataType::Float as i32, DataType::Float16 as i32].contains(&t.data_type))
        .filter(|t| !t.dims.ends_with(&[SIDE, SIDE]))
        .map(|t| count(&t.dims))
        .fold(0, u64::saturating_add)
}

struct Metadata<'m>(&'m ModelProto);

impl<'m> Metadata<'m> {
    fn text(&self, key: &'static str) -> Result<&'m str, EngineError> {
        let entry = self.0.metadata_props.iter().find(|entry| entry.key == key);
        Ok(entry.ok_or(EngineError::MissingMetadata { key })?.value.as_str())
    }

    fn parsed<T: std::str::FromStr>(
        &self,
        key: &'static str,
        expected: &'static str,
    ) -> Result<T, EngineError> {
        let value = self.text(key)?;
        value.parse().map_err(|_| EngineError::BadMetadata {
            key,
            value: value.to_owned(),
            expected,
        })
    }

    fn json<T: DeserializeOwned>(
        &self,
        key: &'static str,
        expected: &'static str,
    ) -> Result<T, EngineError> {
        let value = self.text(key)?;
        serde_json::from_str(value).map_err(|_| EngineError::BadMetadata {
            key,
            value: value.to_owned(),
            expected,
        })
    }

    fn positive(&self, key: &'static str) -> Result<f32, EngineError> {
        const EXPECTED: &str = "a positive finite number";
        let value: f32 = self.parsed(key, EXPECTED)?;
        if value.is_finite() && value > 0.0 {
            return Ok(value);
        }
        Err(EngineError::BadMetadata { key, value: value.to_string(), expected: EXPECTED })
    }

    fn sha256(&self, key: &'static str) -> Result<String, EngineError> {
        let value = self.text(key)?;
        if value.len() == 64 && value.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f')) {
            return Ok(value.to_owned());
        }
        Err(EngineError::BadMetadata {
            key,
            value: value.to_owned(),
            expected: "64 lower-case hexadecimal digits",
        })
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}
