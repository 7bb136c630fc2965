//! The report as Markdown and as plain text.

use super::{Report, Row, Verdict};
use crate::afferents::{Afferents, Fit};
use crate::receptors::depth_name;
use papilla_fingertip::mesh::fingertip::Density;
use std::fmt::Write as _;

/// Folder of the plots, beside the page.
pub(super) const PICTURES: &str = "pictures/human";

/// What stands before the tables.
const HEAD: &str = include_str!("head.md");

impl Verdict {
    fn text(&self) -> String {
        match self {
            Self::Ok => "ok".into(),
            Self::Failed => "**failed**".into(),
            Self::TimesPeople(factor) => format!("{factor:.2} times people's"),
            Self::NotReached(why) => format!("**not reached**: {why}"),
        }
    }
}

impl Row {
    fn here_text(&self) -> String {
        match self.here {
            None => String::new(),
            Some(v) if v.abs() < 0.1 => format!("{v:.4}"),
            Some(v) if v.abs() < 10.0 => format!("{v:.3}"),
            Some(v) => format!("{v:.1}"),
        }
    }

    /// What would mend a row that does not hold, or is a tenth off.
    fn mends_text(&self) -> &'static str {
        match self.verdict {
            Verdict::Ok => "",
            Verdict::TimesPeople(factor) if (factor - 1.0).abs() <= 0.1 => "",
            _ => self.mends,
        }
    }
}

impl Report {
    /// The report as a page of docs/reports.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = format!(
            "{HEAD}\n{}. Materials: {}. Spheres on the mesh `{}` in `order = \"graded\"`, plates on \
             `coarse`.\n\n## Rows\n\n| quantity | finger here | people | spread | source | | what would \
             mend it |\n|---|---|---|---|---|---|---|\n",
            self.made,
            self.materials.name(),
            density(self.density)
        );
        for r in &self.rows {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} |",
                r.quantity,
                r.here_text(),
                r.people,
                r.spread,
                r.source,
                r.verdict.text(),
                r.mends_text()
            );
        }
        if let Some(found) = &self.afferents {
            afferents(&mut text, found);
        }
        if !self.plates.is_empty() {
            self.plates(&mut text);
        }
        text
    }

    fn plates(&self, text: &mut String) {
        let _ = write!(text, "\n## Plates\n\n![Force under a plate]({PICTURES}/force.svg)\n\n");
        text.push_str("| plate | depth, mm | force, N | stiffness, N/mm | contact area, mm2 |\n");
        text.push_str("|---|---|---|---|---|\n");
        for p in &self.plates {
            let stiffness = p.path.stiffness_n_per_mm();
            for (k, s) in stiffness.iter().enumerate() {
                let _ = writeln!(
                    text,
                    "| {} degrees | {:.2} | {:.3} | {s:.2} | {:.1} |",
                    p.pitch_deg, p.path.depth_mm[k], p.path.force_n[k], p.area_mm2[k]
                );
            }
        }
        for p in &self.plates {
            let _ = writeln!(
                text,
                "\nPlate at {} degrees: {} unknowns, {:.0} s of processor time, energy and work part \
                 by {:.2} % at most{}.",
                p.pitch_deg,
                p.unknowns,
                p.solve_s,
                100.0 * p.energy_vs_work_max,
                p.ended.as_deref().map(|w| format!("; it ended: {w}")).unwrap_or_default()
            );
        }
    }

    /// A table for people.
    #[must_use]
    pub fn human(&self) -> String {
        let mut text = format!("{:78} {:>8}  {:<18} verdict\n", "quantity", "here", "people");
        for r in &self.rows {
            let verdict = r.verdict.text().replace("**", "");
            let (here, people) = (r.here_text(), &r.people);
            let _ = writeln!(text, "{:78} {here:>8}  {people:<18} {verdict}", r.quantity);
        }
        if let Some(found) = &self.afferents {
            let _ = writeln!(
                text,
                "\n{:60} {:>8} {:>8} {:>8}",
                "SA1 rates from", "R2 fit", "others", "profiles"
            );
            for f in &found.fits {
                let name = format!("{} at {}", f.stimulus.name(), depth_name(f.depth));
                let _ = writeln!(
                    text,
                    "{name:60} {:8.3} {:8.3} {:8.3}",
                    f.r2_fitted, f.r2_others, f.r2_profiles
                );
            }
        }
        text
    }
}

fn afferents(text: &mut String, found: &Afferents) {
    let _ = write!(
        text,
        "\n## SA1 rates\n\n`rate = gain (felt - threshold)`, not below 0; both numbers from the rates at \
         the smallest force alone. States lie within {:.1} % of their force, and what is felt is taken to \
         it along a line; energy and work part by {:.2} % at most; {:.0} s of processor time.\n\n\
         | felt | depth | gain, impulses/s | threshold | R2 of the fit | **R2 of the others** | R2 of the \
         profiles | peaks, mm (people's) |\n|---|---|---|---|---|---|---|---|\n",
        100.0 * found.force_missed_max,
        100.0 * found.energy_vs_work_max,
        found.solve_s
    );
    for f in &found.fits {
        let (gain, threshold) =
            f.law.map_or_else(Default::default, |l| (per(l.gain), per(l.threshold)));
        let _ = writeln!(
            text,
            "| {}, {} | {} | {gain} | {threshold} | {:.3} | {:.3} | {:.3} | {} |",
            f.stimulus.name(),
            f.stimulus.unit(),
            depth_name(f.depth),
            f.r2_fitted,
            f.r2_others,
            f.r2_profiles,
            peaks(f)
        );
    }
    let best = &found.fits[found.best];
    let _ = write!(
        text,
        "\n![Rates]({PICTURES}/rates.svg)\n\n![Profiles]({PICTURES}/profiles.svg)\n\nRates at the middle, \
         impulses/s; 'best' is {} at {}.\n\n| force, N | curvature, 1/m | distance, mm | measured | SED at \
         the interface | best |\n|---|---|---|---|---|---|\n",
        best.stimulus.name(),
        depth_name(best.depth)
    );
    for (sed, best) in found.of_sed.iter().zip(&found.of_best) {
        for k in 0..sed.measured_per_s.len() {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {:.1} | {:.1} | {:.1} |",
                sed.force_n,
                sed.curvature_per_m[k],
                sed.distance_mm[k],
                sed.measured_per_s[k],
                sed.here_per_s[k],
                best.here_per_s[k]
            );
        }
    }
}

fn peaks(fit: &Fit) -> String {
    let peak = |p: &crate::afferents::Peak| format!("{:.1} ({})", p.here_mm, p.people_mm);
    fit.peaks.iter().map(peak).collect::<Vec<_>>().join(", ")
}

/// Three digits.
fn per(v: f64) -> String {
    if v != 0.0 && !(1e-2..1e4).contains(&v.abs()) { format!("{v:.2e}") } else { format!("{v:.3}") }
}

const fn density(density: Density) -> &'static str {
    match density {
        Density::Coarse => "coarse",
        Density::Medium => "medium",
        Density::Fine => "fine",
    }
}
