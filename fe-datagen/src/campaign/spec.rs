//! The campaign file.

use super::CampaignError;
use crate::indenter::IndenterSpec;
use crate::mesh::fingertip::Density;
use crate::output::OutputError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Ranges \[lowest, highest\] of the plate's orientation, degrees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseRanges {
    /// Pitch about the lateral axis; positive presses the tip first.
    pub pitch_deg: [f64; 2],
    /// Roll about the finger's axis.
    pub roll_deg: [f64; 2],
    /// Yaw about the plate's normal.
    pub yaw_deg: [f64; 2],
}

/// A campaign: which presses to solve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CampaignSpec {
    /// Name of the campaign.
    pub name: String,
    /// Seed of the poses and of the split.
    pub seed: u64,
    /// Number of presses, each with its own pose.
    pub presses: usize,
    /// Depths stored for each press, mm from first touch, rising.
    pub depths_mm: Vec<f64>,
    /// Share of the presses that is held out, 0 to less than 1.
    pub test_fraction: f64,
    /// Density of the mesh.
    pub density: Density,
    /// Effects that the solver models; so far always [`EFFECTS`].
    #[serde(default = "default_effects")]
    pub effects: Vec<String>,
    /// The indenter.
    pub indenter: IndenterSpec,
    /// Ranges of its orientation.
    pub pose: PoseRanges,
}

/// The effects of every campaign's solver. Naming others is an error: a dataset
/// must not claim what was not modelled.
pub const EFFECTS: [&str; 2] = ["finite_strain", "layers"];

fn default_effects() -> Vec<String> {
    EFFECTS.map(String::from).to_vec()
}

/// Points that the low-discrepancy sequence has.
const PRESSES_MAX: usize = 1 << 16;

impl CampaignSpec {
    /// Reads and checks a campaign file.
    ///
    /// # Errors
    /// [`CampaignError`] naming the file and line, or the field and what it
    /// may be.
    pub fn read(path: &Path) -> Result<Self, CampaignError> {
        let text = std::fs::read_to_string(path).map_err(OutputError::io("read", path))?;
        let spec: Self = toml::from_str(&text).map_err(|e| CampaignError::Spec {
            path: path.to_path_buf(),
            message: e.to_string(),
        })?;
        spec.validate()?;
        Ok(spec)
    }

    /// Samples in all.
    pub fn samples(&self) -> usize {
        self.presses * self.depths_mm.len()
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`CampaignError::Value`] for the first that makes no sense.
    pub fn validate(&self) -> Result<(), CampaignError> {
        let require = |ok: bool, field: &'static str, message: String| {
            let campaign = self.name.clone();
            if ok { Ok(()) } else { Err(CampaignError::Value { campaign, field, message }) }
        };
        require(!self.name.trim().is_empty(), "name", "must not be empty".into())?;
        require(
            (1..=PRESSES_MAX).contains(&self.presses),
            "presses",
            format!("is {}, it has to be 1 to {PRESSES_MAX}", self.presses),
        )?;
        let rising = self.depths_mm.windows(2).all(|d| d[0] < d[1]);
        let positive = self.depths_mm.iter().all(|d| d.is_finite() && *d > 0.0);
        require(
            !self.depths_mm.is_empty() && rising && positive,
            "depths_mm",
            format!("is {:?}, it has to be a rising list of depths above 0", self.depths_mm),
        )?;
        require(
            (0.0..1.0).contains(&self.test_fraction),
            "test_fraction",
            format!("is {}, it has to be 0 or more and less than 1", self.test_fraction),
        )?;
        let mut effects: Vec<&str> = self.effects.iter().map(String::as_str).collect();
        effects.sort_unstable();
        require(
            effects == EFFECTS,
            "effects",
            format!("is {:?}, the solver of campaigns models {EFFECTS:?}", self.effects),
        )?;
        if let Err(e) = self.indenter.validate() {
            require(false, "indenter", e.to_string())?;
        }
        let ranges = [
            ("pose.pitch_deg", self.pose.pitch_deg, 90.0),
            ("pose.roll_deg", self.pose.roll_deg, 180.0),
            ("pose.yaw_deg", self.pose.yaw_deg, 180.0),
        ];
        for (field, [low, high], limit) in ranges {
            require(
                -limit <= low && low <= high && high <= limit,
                field,
                format!("is [{low}, {high}], it has to rise within -{limit} to {limit}"),
            )?;
        }
        Ok(())
    }
}
