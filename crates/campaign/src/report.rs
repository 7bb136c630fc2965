//! The reports of a slice and of a merged campaign.

use crate::state::{IndentationState, Outcome};
use papilla_dataset::{DroppedSample, FailedIndentation};
use papilla_fingertip::campaign::{CampaignSpec, Slice};
use papilla_progress::clock;
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// An indentation that failed, in short.
#[derive(Clone, Debug, Serialize)]
pub struct Failure {
    /// Its number.
    pub id: usize,
    /// Name of its indenter.
    pub indenter: String,
    /// Why.
    pub error: String,
}

/// What a process made of its slice.
#[derive(Clone, Debug, Serialize)]
pub struct SliceReport {
    /// Name of the campaign.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// The part of the campaign.
    pub slice: Slice,
    /// Indentations in it.
    pub presses: usize,
    /// Those solved by this run.
    pub solved: usize,
    /// Those taken over, solved or failed, from an earlier run.
    pub reused: usize,
    /// Those that failed.
    pub failed: Vec<Failure>,
    /// Samples that failed their own checks.
    pub dropped: usize,
    /// Those left to the next run, since this one was asked to stop.
    pub left: usize,
    /// Threads used.
    pub threads: usize,
    /// Wall time of this run, s.
    pub seconds: f64,
}

impl SliceReport {
    pub(crate) fn new(
        spec: &CampaignSpec,
        folder: &Path,
        slice: Slice,
        (known, solved, left): (&[IndentationState], &[IndentationState], usize),
        threads: usize,
        seconds: f64,
    ) -> Self {
        let (mut failed, mut dropped) = (Vec::new(), 0);
        for IndentationState { press, outcome, .. } in known.iter().chain(solved) {
            match outcome {
                Outcome::Failed { error } => failed.push(Failure {
                    id: press.id,
                    indenter: press.indenter.clone(),
                    error: error.clone(),
                }),
                Outcome::Solved { dropped: d, .. } => dropped += d.len(),
            }
        }
        failed.sort_by_key(|f| f.id);
        Self {
            name: spec.name.clone(),
            folder: folder.into(),
            slice,
            presses: known.len() + solved.len() + left,
            solved: solved.iter().filter(|s| !s.is_failed()).count(),
            reused: known.len(),
            failed,
            dropped,
            left,
            threads,
            seconds,
        }
    }

    /// Did every sample make it? What the exit code is to say.
    pub fn is_complete(&self) -> bool {
        self.failed.is_empty() && self.dropped == 0 && self.left == 0
    }
}

impl fmt::Display for SliceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "slice {} of {}: {} indentations, {} solved now, {} taken over, {} failed, {} left, in \
             {} on {} threads",
            self.slice,
            self.name,
            self.presses,
            self.solved,
            self.reused,
            self.failed.len(),
            self.left,
            clock(Duration::from_secs_f64(self.seconds)),
            self.threads
        )?;
        for Failure { id, indenter, error } in &self.failed {
            writeln!(f, "  FAILED indentation {id} ({indenter}): {error}")?;
        }
        Ok(())
    }
}

/// What a merged campaign says of itself.
#[derive(Clone, Debug, Serialize)]
pub struct CampaignReport {
    /// Name of the campaign.
    pub name: String,
    /// The dataset's folder.
    pub folder: PathBuf,
    /// Indentations of the campaign.
    pub presses: usize,
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
            "dataset {}: {} of {} samples from {} indentations",
            self.name, self.samples, self.samples_due, self.presses,
        )?;
        writeln!(
            f,
            "  pressure up to {:.0} Pa, SED up to {:.1} J/m3, {:.1} s of solver per indentation",
            self.pressure_max_pa,
            self.sed_max_j_per_m3,
            self.solver_seconds / self.presses.max(1) as f64,
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
