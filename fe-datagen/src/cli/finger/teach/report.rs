//! What teaching a finger came to.

use super::lender::Spread;
use serde::{Deserialize, Serialize};

/// Errors of one network on the held-out presses, relative L2 against FE of the finger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Errors {
    /// From FE's pressure.
    pub pressure_to_sed: Spread,
    /// From the pressure that contact makes of the indenter's pose; none without contact.
    pub pose_to_sed: Option<Spread>,
}

/// One network.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Taught {
    pub name: String,
    /// Hash of the network that it began with.
    pub start_onnx_sha256: String,
    pub epochs: usize,
    pub training_seconds: f64,
    /// The network that it began with, on this finger: similarity alone.
    pub before: Errors,
    pub after: Errors,
    /// The network that it began with, on its own finger's held-out presses.
    pub of_own_finger: Errors,
}

/// `teach/report.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Report {
    /// Hash of dimensions and tissues.
    pub finger_sha256: String,
    pub dataset_sha256: String,
    /// Solved; and of these, held out.
    pub presses: usize,
    pub held_out: usize,
    /// States that errors are measured on.
    pub held_out_states: usize,
    /// Presses left out, since they failed.
    pub failed: usize,
    /// Core hours of the presses.
    pub press_core_hours: f64,
    /// Error of contact's pressure on the held-out presses, relative L2; none without contact.
    pub pose_to_pressure: Option<Spread>,
    pub networks: Vec<Taught>,
}

impl Report {
    /// For people.
    pub(super) fn human(&self) -> String {
        let percent = |s: Spread| format!("{:.1} / {:.1}", 100.0 * s.median, 100.0 * s.p95);
        let or_dash = |s: Option<Spread>| s.map_or_else(|| "-".to_owned(), percent);
        let mut text = format!(
            "\nerror of SED, relative L2 against FE of this finger, %, median / 95th percentile of {} \
             states of {} held-out presses\n{:10} {:>24} {:>14} {:>14}   {:>24} {:>14} {:>14}\n",
            self.held_out_states,
            self.held_out,
            "network",
            "pressure to SED, before",
            "after",
            "default finger",
            "pose to SED, before",
            "after",
            "default finger"
        );
        for n in &self.networks {
            text += &format!(
                "{:10} {:>24} {:>14} {:>14}   {:>24} {:>14} {:>14}\n",
                n.name,
                percent(n.before.pressure_to_sed),
                percent(n.after.pressure_to_sed),
                percent(n.of_own_finger.pressure_to_sed),
                or_dash(n.before.pose_to_sed),
                or_dash(n.after.pose_to_sed),
                or_dash(n.of_own_finger.pose_to_sed)
            );
        }
        text += "before: the default finger's network, by similarity alone. default finger: that network \
                 on held-out presses of its own finger\n";
        let train = self.presses - self.held_out;
        text += &format!(
            "{train} presses were learnt from, in {:.2} core hours of FE",
            self.press_core_hours
        );
        if self.failed > 0 {
            text += &format!("; {} presses failed and were left out", self.failed);
        }
        text
    }
}
