//! `manifest.json`: what a dataset is and where it comes from.

use crate::record::{Checks, Pose};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Format number of manifests written here.
pub const FORMAT: u32 = 2;

/// Format numbers that are read: a dataset of 1 has all values at the atlas' vertices.
pub const FORMATS: RangeInclusive<u32> = 1..=FORMAT;

/// The manifest. Its bytes depend on campaign and shards alone: no time, no
/// host, no thread count.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: u32,
    /// Hash of `atlas.json`.
    pub atlas_hash: String,
    /// The campaign's own description.
    pub campaign: serde_json::Value,
    /// Seed of poses and split.
    pub seed: u64,
    /// Program and version that wrote the shards.
    pub software: String,
    /// Units of the shards' arrays.
    pub units: Units,
    /// Effects that the solver modelled.
    pub effects: Vec<String>,
    /// Vertices V of the atlas.
    pub vertex_count: usize,
    /// Largest pressure of the dataset, Pa.
    pub pressure_max_pa: f64,
    /// Largest SED on the dermis side, J/m3.
    pub sed_max_j_per_m3: f64,
    /// Names of the columns of the shards' `checks` array.
    pub check_columns: Vec<String>,
    /// The indentations that are in the dataset, by rising id.
    pub presses: Vec<IndentationEntry>,
    /// Indentations that did not converge; they have no shard.
    pub failed: Vec<FailedIndentation>,
    /// Samples that failed their own checks; they are not in the shards.
    pub dropped: Vec<DroppedSample>,
    /// Ids of the indentations of each split.
    pub splits: Splits,
    /// See [`dataset_sha256`].
    pub dataset_sha256: String,
}

/// Units of the arrays in a shard.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Units {
    /// Unit of `pressure_pa`.
    pub pressure: String,
    /// Unit of `sed_*_j_per_m3`.
    pub sed: String,
    /// Unit of `depth_mm`.
    pub depth: String,
    /// Unit of `force_n`.
    pub force: String,
}

impl Default for Units {
    fn default() -> Self {
        let [pressure, sed, depth, force] = ["Pa", "J/m3", "mm", "N"].map(String::from);
        Self { pressure, sed, depth, force }
    }
}

/// What an indentation is for. An indentation is never divided: its depths are near-copies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Seen in training.
    Train,
    /// Held out.
    Test,
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Train => "train",
            Self::Test => "test",
        })
    }
}

/// There is no such split.
#[derive(Clone, Debug, thiserror::Error)]
#[error("no split '{0}'; there are 'train' and 'test'")]
pub struct UnknownSplit(String);

impl FromStr for Split {
    type Err = UnknownSplit;

    fn from_str(name: &str) -> Result<Self, UnknownSplit> {
        let named = |split: &Self| split.to_string() == name;
        [Self::Train, Self::Test].into_iter().find(named).ok_or_else(|| UnknownSplit(name.into()))
    }
}

/// Ids of the indentations of each split, rising.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Splits {
    /// Training indentations.
    pub train: Vec<usize>,
    /// Held-out indentations.
    pub test: Vec<usize>,
}

/// One indentation of the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct IndentationEntry {
    /// Number within the campaign.
    pub id: usize,
    /// Its shard, relative to the manifest.
    pub file: String,
    /// SHA-256 of the shard file, lower-case hex.
    pub sha256: String,
    /// Training or held out.
    pub split: Split,
    /// Samples D in the shard.
    pub samples: usize,
    /// Name of the indenter in the campaign.
    pub indenter: String,
    /// Name of its shape.
    pub shape: String,
    /// Orientation of the indenter.
    #[serde(flatten)]
    pub pose: Pose,
    /// Where the indenter's axis met the skin, mm along its own x and y from the
    /// skin point that a flat plate would have touched first.
    pub offset_mm: [f64; 2],
    /// The worst of each check over the samples.
    pub checks: Checks,
}

/// An indentation without a shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FailedIndentation {
    /// Number within the campaign.
    pub id: usize,
    /// Name of the indenter in the campaign.
    pub indenter: String,
    /// Name of its shape.
    pub shape: String,
    /// Orientation of the indenter.
    #[serde(flatten)]
    pub pose: Pose,
    /// Where the indenter's axis meets the skin, mm, as in [`IndentationEntry`].
    pub offset_mm: [f64; 2],
    /// The solver's own words.
    pub error: String,
}

/// A sample that failed its own checks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroppedSample {
    /// Id of the indentation.
    pub press: usize,
    /// Depth of the sample, mm; null if the depth itself is not a number.
    pub depth_mm: Option<f64>,
    /// The check and the limit.
    pub reason: String,
}

/// SHA-256 of bytes, lower-case hex.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// Identity of a dataset: SHA-256 over the shards' hashes (as lower-case hex,
/// without separator) in order of the indentation id.
pub fn dataset_sha256<'a>(shard_hashes: impl IntoIterator<Item = &'a str>) -> String {
    sha256_hex(shard_hashes.into_iter().collect::<String>().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_the_published_ones() {
        // FIPS 180-2, appendix B.1.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_hex(b"abc"), abc);
        assert_eq!(dataset_sha256(["a", "bc"]), abc);
    }
}
