//! The ladder: every way to a map of SED, with its error and its time.
//!
//! `model-export ladder` measures it and writes `models/ladder.json`. The server embeds that file,
//! publishes it, and chooses tiers by it.

use crate::card::{Learnt, Metrics, Similarity, Spread};
use crate::{Backend, EngineError, MODEL_FORMAT};
use papilla_proto::{contact::Input, json};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the set of states on the finest mesh.
pub const REFERENCE_SET: &str = "reference";

/// Name of the set whose pressure the service's contact found from poses. The other sets have the
/// pressure of the simulations.
pub const POSES_SET: &str = "poses";

/// Names of the held-out sets. For clients that give pressure, tiers are compared on the first of
/// them on which all were measured; for clients that give poses or gaps, on [`POSES_SET`].
pub const SET_NAMES: [&str; 8] = [
    "heldout-presses",
    "heldout-shapes",
    REFERENCE_SET,
    "reference-anew",
    "reference-shapes",
    "pressed",
    "s1",
    POSES_SET,
];

/// All rungs, measured on the same sets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ladder {
    /// Version of this layout.
    pub format: u32,
    /// Hash of the atlas of all maps.
    pub atlas_hash: String,
    /// Processor and system that the times were taken on.
    pub machine: String,
    /// Whether only part of each set was measured, to save time.
    #[serde(default)]
    pub quick: bool,
    /// The sets, measured or not.
    pub sets: Vec<Set>,
    /// The set whose median relative L2 decides [`Rung::pareto`]; absent if no set was measured.
    #[serde(default)]
    pub pareto_set: Option<String>,
    /// Estimated error of the reference itself; absent without a reference.
    #[serde(default)]
    pub discretisation_error: Option<Discretisation>,
    /// How much the reference's pressure maps depend on the mesh; absent without the same states on
    /// another mesh.
    #[serde(default)]
    pub readings: Option<Readings>,
    /// How much traction along the skin improves SED; empty without datasets of simulations with
    /// friction.
    #[serde(default)]
    pub traction: Vec<Traction>,
    /// The rungs.
    pub rungs: Vec<Rung>,
}

/// One held-out set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Set {
    /// One of [`SET_NAMES`].
    pub name: String,
    /// Samples measured; 0 if the set was not there.
    pub samples: usize,
    /// What the set holds, or why it was not measured.
    #[serde(default)]
    pub about: String,
    /// SHA-256 of the dataset; absent for the reference, and if the set was not there.
    #[serde(default)]
    pub dataset_sha256: Option<String>,
}

/// Estimated error of the reference itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Discretisation {
    /// Relative L2 of SED.
    pub sed_relative_l2: f64,
    /// How it was estimated.
    pub how: String,
}

/// Differences between the same states on the reference's mesh and on another mesh, relative L2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Readings {
    /// The other mesh.
    pub mesh: String,
    /// Number of states solved on both meshes.
    pub states: usize,
    /// Difference between the two pressure maps.
    pub pressure: Spread,
    /// The same after both maps are smoothed by a Gaussian of 0.1 mm.
    pub averaged: Spread,
    /// Difference between a model's answers to the two pressure maps, by the model's name.
    pub answers: BTreeMap<String, Spread>,
}

/// The gain by the effect `shear_energy`, measured on states with friction that no network was
/// trained on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Traction {
    /// Name of the network.
    pub model: String,
    /// Name of the campaign.
    pub set: String,
    /// Number of states.
    pub samples: usize,
    /// Relative L2 of the network's SED from pressure alone.
    pub alone: Spread,
    /// The same with the SED that traction adds.
    pub felt: Spread,
    /// Processor time that traction adds to a frame, ms.
    pub added_ms: Spread,
}

/// The kind of a rung.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A half-space in place of the finger.
    ClosedForm,
    /// The linear operator of this finger at small strain.
    Operator,
    /// A trained network.
    Network,
    /// The network of the U-Net paper (docs/glossary.md, sources): the baseline.
    #[serde(rename = "s1_network")]
    PublishedUNet,
    /// The finite-element solver itself.
    Fe,
    /// The same map for every pressure: the error of knowing nothing about the pressure.
    Floor,
}

impl Kind {
    /// The kind of a model, from the `kind` in its `papilla.network`.
    #[must_use]
    pub fn of_network(network: &serde_json::Value) -> Self {
        match network.get("kind").and_then(serde_json::Value::as_str) {
            Some("half_space") => Self::ClosedForm,
            Some("fe_operator") => Self::Operator,
            Some("s1_unet") => Self::PublishedUNet,
            _ => Self::Network,
        }
    }

    /// Whether it is a trained network: one of this project or the published one.
    #[must_use]
    pub const fn is_network(self) -> bool {
        matches!(self, Self::Network | Self::PublishedUNet)
    }

    /// Whether it learnt such pressure as frames with this input give. What is no network learnt
    /// none, and takes any.
    #[must_use]
    pub fn suits(self, learnt: Learnt, input: Input) -> bool {
        !self.is_network()
            || match input {
                Input::Pressure => learnt.knows_fe(),
                Input::Gaps | Input::Objects => learnt.knows_contact(),
            }
    }
}

/// One way of getting a SED map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: Kind,
    /// Name of the model that serves it; None for FE and floors.
    pub model: Option<String>,
    /// SHA-256 of the model measured.
    #[serde(default)]
    pub onnx_sha256: Option<String>,
    /// Length of the model file.
    pub bytes: Option<u64>,
    /// Time from the file's bytes to the first answer, ms.
    pub load_ms: Option<f64>,
    /// Peak growth of resident memory while it was loaded and answered one map, MiB.
    pub memory_mib: Option<f64>,
    /// Time of one inference on one thread, by engine.
    pub latency_ms: Option<LatencyByEngine>,
    /// Processor seconds of one FE state.
    #[serde(default)]
    pub seconds: Option<Percentiles>,
    /// Whether its SED is the truth of the set `reference`.
    #[serde(default)]
    pub reference: bool,
    /// Errors by the name of the set.
    pub errors: BTreeMap<String, SetErrors>,
    /// Number of answers that were refused, since a value was NaN, infinite or negative.
    #[serde(default)]
    pub refused: usize,
    /// Greatest answer to a map of zeros, relative to the greatest SED of its training data.
    #[serde(default)]
    pub zero_answer: Option<f64>,
    /// Whether it lies on the Pareto front of [`Ladder::pareto_set`]; see [`Ladder::mark_front`].
    pub pareto: bool,
}

impl Rung {
    /// A rung that no model serves, and of which nothing is measured yet.
    #[must_use]
    pub const fn unserved(name: String, kind: Kind) -> Self {
        Self {
            name,
            kind,
            model: None,
            onnx_sha256: None,
            bytes: None,
            load_ms: None,
            memory_mib: None,
            latency_ms: None,
            seconds: None,
            reference: false,
            errors: BTreeMap::new(),
            refused: 0,
            zero_answer: None,
            pareto: false,
        }
    }

    /// Time of one map, ms: an inference in tract, or one FE state.
    #[must_use]
    pub fn time_ms(&self) -> Option<f64> {
        let tract = self.latency_ms.as_ref().map(|latency| latency.tract.p50);
        tract.or(self.seconds.map(|seconds| 1e3 * seconds.p50))
    }

    /// The same in this backend if it was measured there, otherwise as [`time_ms`](Self::time_ms).
    #[must_use]
    pub fn time_ms_in(&self, backend: Backend) -> Option<f64> {
        let ort = self.latency_ms.as_ref().and_then(|latency| latency.ort);
        let ort = ort.filter(|_| backend == Backend::Ort).map(|times| times.p50);
        ort.or_else(|| self.time_ms())
    }

    /// Median relative L2 on a set.
    #[must_use]
    pub fn relative_l2(&self, set: &str) -> Option<f64> {
        self.errors.get(set).map(|errors| errors.relative_l2.median)
    }
}

/// Time of one inference by engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatencyByEngine {
    /// In tract.
    pub tract: Percentiles,
    /// In ONNX Runtime; absent if it was not available.
    pub ort: Option<Percentiles>,
}

/// Median and 99th percentile of a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
}

/// Errors on one set, as in a card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetErrors {
    /// Samples measured.
    pub samples: usize,
    /// See [`Metrics::relative_l2`].
    pub relative_l2: Spread,
    /// See [`Metrics::far_field_relative_l2`].
    pub far_field_relative_l2: Option<Spread>,
    /// See [`Metrics::peak_error`].
    pub peak_error: Spread,
    /// See [`Metrics::peak_distance_mm`].
    pub peak_distance_mm: Option<Spread>,
    /// See [`Metrics::nail_base_error`].
    pub nail_base_error: Option<Spread>,
    /// See [`Metrics::total_energy_error`].
    pub total_energy_error: Spread,
    /// See [`Metrics::ssim`].
    pub ssim: Similarity,
}

impl From<Metrics> for SetErrors {
    fn from(metrics: Metrics) -> Self {
        Self {
            samples: metrics.samples,
            relative_l2: metrics.relative_l2,
            far_field_relative_l2: metrics.far_field_relative_l2,
            peak_error: metrics.peak_error,
            peak_distance_mm: metrics.peak_distance_mm,
            nail_base_error: metrics.nail_base_error,
            total_energy_error: metrics.total_energy_error,
            ssim: metrics.ssim,
        }
    }
}

impl Ladder {
    /// Reads a ladder.
    ///
    /// # Errors
    /// [`EngineError::BadLadder`] if it is not JSON of this shape,
    /// [`EngineError::UnsupportedFormat`] if its format is another.
    pub fn from_json(text: &str) -> Result<Self, EngineError> {
        let ladder: Self = json::read(text.as_bytes())
            .map_err(|error| EngineError::BadLadder { reason: error.to_string() })?;
        if ladder.format == MODEL_FORMAT {
            return Ok(ladder);
        }
        Err(EngineError::UnsupportedFormat { file: "the ladder", found: ladder.format })
    }

    /// Text of a ladder, indented, with a final newline.
    ///
    /// # Errors
    /// [`EngineError::BadLadder`] if the serialiser fails (out of memory apart, it does not).
    pub fn to_json(&self) -> Result<String, EngineError> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|error| EngineError::BadLadder { reason: error.to_string() })?;
        Ok(text + "\n")
    }

    /// The rung that a model serves.
    #[must_use]
    pub fn rung_of(&self, model: &str) -> Option<&Rung> {
        self.rungs.iter().find(|rung| rung.model.as_deref() == Some(model))
    }

    /// Marks the rungs on the [front](Self::front) of `pareto_set`. Does nothing without such a
    /// set.
    pub fn mark_front(&mut self) {
        let Some(set) = self.pareto_set.clone() else { return };
        let on_front = self.front(&set);
        for (rung, on_front) in self.rungs.iter_mut().zip(on_front) {
            rung.pareto = on_front;
        }
    }

    /// Which rungs lie on the Pareto front of time ([`Rung::time_ms`]) and median relative L2 on a
    /// set. A rung does if its error is smaller than that of every faster rung on the front, by
    /// more than the set can [tell](Self::told_apart). Rungs without a time or an error do not.
    #[must_use]
    pub fn front(&self, set: &str) -> Vec<bool> {
        let place = |(i, rung): (usize, &Rung)| Some((i, rung.time_ms()?, rung.relative_l2(set)?));
        let mut by_time: Vec<_> = self.rungs.iter().enumerate().filter_map(place).collect();
        by_time.sort_by(|(_, t, e), (_, time, error)| t.total_cmp(time).then(e.total_cmp(error)));
        let (apart, mut least) = (self.told_apart(set), f64::INFINITY);
        let mut on_front = vec![false; self.rungs.len()];
        for (i, _, error) in by_time {
            if error + apart < least {
                (least, on_front[i]) = (error, true);
            }
        }
        on_front
    }

    /// Differences between two errors below this are not significant on the set: the error of the
    /// reference itself, or 0 on other sets.
    #[must_use]
    pub fn told_apart(&self, set: &str) -> f64 {
        let own = self.discretisation_error.as_ref().filter(|_| set == REFERENCE_SET);
        own.map_or(0.0, |own| own.sed_relative_l2)
    }
}

#[cfg(test)]
mod tests;
