//! The networks that training begins with.

use super::error::TeachError;
use anyhow::Context as _;
use papilla_output::atomic;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Median and 95th percentile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Spread {
    pub median: f64,
    pub p95: f64,
}

/// What is read of a card.
#[derive(Debug, Deserialize)]
pub(super) struct Card {
    pub onnx_sha256: String,
    pub atlas_hash: String,
    network: Network,
    pub metrics: Metrics,
    pub training: Training,
}

#[derive(Debug, Deserialize)]
struct Network {
    kind: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct Metrics {
    pub relative_l2: Spread,
}

/// Absent numbers are those of models that learnt nothing.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Training {
    pub seconds: f64,
    epochs: f64,
    presses: Presses,
    /// Files of contact's pressure that it learnt from.
    contact: Vec<String>,
    /// Whether it learnt from those alone.
    contact_alone: bool,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Presses {
    fit: f64,
}

/// What is read of `contact.json`: what a network errs from the poses of its own finger.
#[derive(Debug, Deserialize)]
struct FromPoses {
    network: Option<String>,
    methods: Vec<Method>,
}

#[derive(Debug, Deserialize)]
struct Method {
    name: String,
    errors: Vec<MethodError>,
}

#[derive(Debug, Deserialize)]
struct MethodError {
    sed_relative_l2: Option<Spread>,
}

/// The method by which poses are judged, as `contact.json` calls it.
const METHOD: &str = "pixels";

/// A network of another finger, which the training begins with.
#[derive(Debug)]
pub(super) struct Lender {
    pub name: String,
    pub onnx: PathBuf,
    pub card: Card,
    /// What it errs from the poses of its own finger; none if its folder does not say.
    pub from_poses: Option<Spread>,
}

/// Kind of network that can be trained on.
const TRAINABLE: &str = "map_net";

impl Lender {
    pub(super) fn read(folder: &Path, name: &str) -> anyhow::Result<Self> {
        let onnx = folder.join(format!("{name}.onnx"));
        let path = folder.join(format!("{name}.json"));
        if !onnx.is_file() || !path.is_file() {
            return Err(TeachError::NoNetwork { file: onnx, known: names(folder)? }.into());
        }
        let card: Card = atomic::read_json(&path)?;
        if card.network.kind != TRAINABLE {
            return Err(TeachError::NotTrainable { card: path, kind: card.network.kind }.into());
        }
        let from_poses = from_poses(folder, name)?;
        Ok(Self { name: name.to_owned(), onnx, card, from_poses })
    }

    /// Whether it learnt from the pressure of contact, and so will the network that it becomes.
    pub(super) fn knows_contact(&self) -> bool {
        !self.card.training.contact.is_empty()
    }

    /// Whether it learnt from that alone, and not from the pressure of presses.
    pub(super) fn knows_contact_alone(&self) -> bool {
        self.card.training.contact_alone
    }

    /// Core seconds of an epoch over one press, where it was trained.
    pub(super) fn seconds_per_press_and_epoch(&self) -> f64 {
        let Training { seconds, epochs, presses, .. } = &self.card.training;
        seconds / (epochs * presses.fit).max(1.0)
    }
}

/// The error of a network from poses, as the folder's `contact.json` has it: its first set is that of
/// the cards.
fn from_poses(folder: &Path, name: &str) -> anyhow::Result<Option<Spread>> {
    let path = folder.join("contact.json");
    if !path.is_file() {
        return Ok(None);
    }
    let found: FromPoses = atomic::read_json(&path)?;
    if found.network.as_deref() != Some(name) {
        return Ok(None);
    }
    let method = found.methods.into_iter().find(|method| method.name == METHOD);
    Ok(method.and_then(|method| method.errors.first()?.sed_relative_l2))
}

/// What is read of an index.
#[derive(Debug, Deserialize)]
struct Index {
    default: String,
    default_for_pressure: Option<String>,
}

/// Names of a folder's defaults: the network for poses and gaps, and the one for pressure.
pub(super) fn usual(folder: &Path) -> anyhow::Result<Vec<String>> {
    let Index { default, default_for_pressure } = atomic::read_json(&folder.join("index.json"))?;
    let other = default_for_pressure.filter(|name| *name != default);
    Ok(std::iter::once(default).chain(other).collect())
}

/// Refuses networks of another finger in a bundle, but for those that are going to be replaced.
pub(super) fn refuse_strangers(
    folder: &Path,
    atlas_hash: &str,
    replaced: &[Lender],
) -> anyhow::Result<()> {
    for name in names(folder)? {
        if replaced.iter().any(|lender| lender.name == name) {
            continue;
        }
        let file = folder.join(format!("{name}.onnx"));
        let card: Card = atomic::read_json(&folder.join(format!("{name}.json")))?;
        if card.atlas_hash != atlas_hash {
            return Err(TeachError::Stranger { file, name, found: card.atlas_hash }.into());
        }
    }
    Ok(())
}

/// Names of the networks in a folder, in their order.
fn names(folder: &Path) -> anyhow::Result<Vec<String>> {
    let entries = std::fs::read_dir(folder)
        .with_context(|| format!("{} cannot be listed", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "onnx") {
            names.extend(path.file_stem().map(|name| name.to_string_lossy().into_owned()));
        }
    }
    names.sort_unstable();
    Ok(names)
}
