//! The report as Markdown and as plain text.

use super::{PICTURES, Report, Row, Verdict, rates};
use papilla_fingertip::mesh::fingertip::Density;
use std::fmt::Write as _;

/// What stands before the tables; DENSITY is that of the mesh.
const HEAD: &str = include_str!("head.md");

impl Verdict {
    pub(crate) fn text(&self) -> String {
        match self {
            Self::Ok => "ok".into(),
            Self::Failed => "**failed**".into(),
            Self::TimesPeople(factor) => format!("{factor:.2} times the measured"),
            Self::NotReached(why) => format!("**not reached**: {why}"),
        }
    }
}

impl Row {
    pub(crate) fn here_text(&self) -> String {
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
    /// The report as a page of studies/reports, which links the tables beside it.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = format!(
            "{}Computed on {}. {}. The meshes are [graded](../../docs/reference/scenes.md#geometry), \
             unless the table above names the even mesh. Their density is `{}` under the spheres and \
             `coarse` under the plates.\n\n## Rows\n\n| quantity | the model | measured | kind of spread | source | verdict | what would bring the model nearer |\n|---|---|---|---|---|---|---|\n",
            HEAD.replace("DENSITY", density(self.density)),
            self.made,
            self.finger_text(),
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
            rates::afferents(&mut text, found);
        }
        if !self.mesh_errors.is_empty() {
            rates::mesh_errors(&mut text, &self.mesh_errors);
        }
        if !self.plates.is_empty() {
            self.plates(&mut text);
        }
        text
    }

    fn finger_text(&self) -> String {
        match &self.finger {
            Some(name) => format!("The finger is {name}; its law is {}", self.materials.law()),
            None => format!(
                "The finger is the default one; its materials are {}",
                self.materials.name()
            ),
        }
    }

    fn plates(&self, text: &mut String) {
        let _ = write!(
            text,
            "\n## Plates\n\n![Force under a plate]({PICTURES}/force.svg)\n\nThe plate is pressed step by step, without friction. The table holds every fourth state; all of \
         them are in \
             [human-plates.csv](human-plates.csv).\n\n"
        );
        text.push_str("| plate | depth, mm | force, N | stiffness, N/mm | contact area, mm2 |\n");
        text.push_str("|---|---|---|---|---|\n");
        for p in &self.plates {
            let stiffness = p.path.stiffness_n_per_mm();
            for (k, s) in stiffness.iter().enumerate() {
                if (k + 1) % 4 != 0 && k + 1 != stiffness.len() {
                    continue;
                }
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
                "\nPlate at {} degrees: {} unknowns, {:.0} s of processor time, energy and work differ \
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
            rates::human(&mut text, found);
        }
        text
    }
}

const fn density(density: Density) -> &'static str {
    match density {
        Density::Coarse => "coarse",
        Density::Medium => "medium",
        Density::Fine => "fine",
    }
}
