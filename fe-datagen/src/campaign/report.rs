//! What a finished campaign says of itself.

use papilla_dataset::{DroppedSample, FailedIndentation};
use papilla_progress::clock;
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

/// The report of `generate`.
#[derive(Clone, Debug, Serialize)]
pub struct CampaignReport {
    /// Name of the campaign.
    pub name: String,
    /// The dataset's folder.
    pub folder: PathBuf,
    /// Indentations of the campaign.
    pub presses: usize,
    /// Indentations solved by this run.
    pub solved: usize,
    /// Indentations taken over from an earlier run.
    pub reused: usize,
    /// Samples in the dataset.
    pub samples: usize,
    /// Samples that the campaign asks for.
    pub samples_due: usize,
    /// Indentations that failed.
    pub failed: Vec<FailedIndentation>,
    /// Samples that failed their own checks.
    pub dropped: Vec<DroppedSample>,
    /// Largest pressure, Pa.
    pub pressure_max_pa: f64,
    /// Largest SED on the dermis side, J/m3.
    pub sed_max_j_per_m3: f64,
    /// Hash of the dataset.
    pub dataset_sha256: String,
    /// Threads used.
    pub threads: usize,
    /// Wall time of this run, s.
    pub seconds: f64,
    /// Solver time of all indentations, summed over threads and runs, s.
    pub solver_seconds: f64,
}

impl CampaignReport {
    /// Did every sample make it? What the exit code is to say.
    pub fn is_complete(&self) -> bool {
        self.failed.is_empty() && self.dropped.is_empty() && self.samples == self.samples_due
    }
}

impl fmt::Display for CampaignReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "campaign {}: {} of {} samples from {} indentations ({} solved now, {} taken over) in {}",
            self.name,
            self.samples,
            self.samples_due,
            self.presses,
            self.solved,
            self.reused,
            clock(Duration::from_secs_f64(self.seconds))
        )?;
        writeln!(
            f,
            "  pressure up to {:.0} Pa, SED up to {:.1} J/m3, {:.1} s of solver per indentation, {} threads",
            self.pressure_max_pa,
            self.sed_max_j_per_m3,
            self.solver_seconds / self.presses.max(1) as f64,
            self.threads
        )?;
        writeln!(f, "  {} (sha256 {})", self.folder.display(), self.dataset_sha256)?;
        for press in &self.failed {
            let p = &press.pose;
            writeln!(
                f,
                "  FAILED indentation {} ({}; pitch {:.2}, roll {:.2}, yaw {:.2} deg): {}",
                press.id, press.indenter, p.pitch_deg, p.roll_deg, p.yaw_deg, press.error
            )?;
        }
        for sample in &self.dropped {
            let depth = sample.depth_mm.unwrap_or(f64::NAN);
            writeln!(f, "  DROPPED indentation {} at {depth} mm: {}", sample.press, sample.reason)?;
        }
        Ok(())
    }
}
