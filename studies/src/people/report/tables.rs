//! Tables beside the page, as comma-separated values: what is too long for it.

use super::{Report, rates};
use std::fmt::Write as _;

impl Report {
    /// Names after the page's own, and texts.
    pub(super) fn tables(&self) -> Vec<(&'static str, String)> {
        let mut all = Vec::new();
        if let Some(found) = &self.afferents {
            all.push(("felt", rates::fits_csv(found)));
            all.push(("rates", rates::rates_csv(found)));
        }
        if !self.mesh_errors.is_empty() {
            all.push(("mesh", rates::mesh_csv(&self.mesh_errors)));
        }
        if !self.plates.is_empty() {
            all.push(("plates", self.plates_csv()));
        }
        all
    }

    fn plates_csv(&self) -> String {
        let mut text = String::from(
            "\"plate, degrees\",\"depth, mm\",\"force, N\",\"stiffness, N/mm\",\"contact area, mm2\"\n",
        );
        for p in &self.plates {
            for (k, s) in p.path.stiffness_n_per_mm().iter().enumerate() {
                let _ = writeln!(
                    text,
                    "{},{:.2},{:.3},{s:.2},{:.1}",
                    p.pitch_deg, p.path.depth_mm[k], p.path.force_n[k], p.area_mm2[k]
                );
            }
        }
        text
    }
}
