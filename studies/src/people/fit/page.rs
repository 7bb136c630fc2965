//! The page of a fit, and its tables for scenes.

use super::{Fit, Identified};
use crate::people::PeopleError;
use papilla_fingertip::scene::TissueTable;
use papilla_output::{OutputError, atomic};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// What the page says before its tables.
const HEAD: &str = include_str!("head.md");

/// What `materials.toml` holds.
#[derive(Serialize)]
struct Tables<'a> {
    materials: &'a TissueTable,
}

impl Fit {
    /// Writes `fit.json`, `fit.md` and `materials.toml`.
    pub(super) fn write(&self, folder: &Path) -> Result<(), PeopleError> {
        atomic::write_json(&folder.join("fit.json"), self)?;
        self.write_page(&folder.join("fit.md"))?;
        let text = toml::to_string(&Tables { materials: &self.tissues })
            .map_err(|e| OutputError::Encode { what: "TOML", message: e.to_string() })?;
        Ok(atomic::write(&folder.join("materials.toml"), text.as_bytes())?)
    }

    /// Writes the page.
    ///
    /// # Errors
    /// [`OutputError`] if it cannot be written.
    pub fn write_page(&self, page: &Path) -> Result<(), OutputError> {
        atomic::write(page, self.markdown().as_bytes())
    }

    /// The page.
    fn markdown(&self) -> String {
        let mut text = format!("{HEAD}\n{}.", self.made);
        if !self.left_out.is_empty() {
            let _ = write!(text, " **Left out of this run: {}.**", self.left_out.join(", "));
        }
        text.push_str("\n\n## Constants\n\n");
        text.push_str(
            "| constant | fitted value | lower bound | upper bound | standard error | source of the lower bound | source of the upper bound |\n\
             |---|---|---|---|---|---|---|\n",
        );
        for c in &self.constants {
            let p = &c.parameter;
            let _ = writeln!(
                text,
                "| {} | {}{} | {} | {} | {:.0} % | {} | {} |",
                p.name,
                c.value,
                if c.at_bound { " (at its bound)" } else { "" },
                p.low,
                p.high,
                100.0 * c.uncertainty,
                p.low_source,
                p.high_source
            );
        }
        let _ = write!(
            text,
            "\n*Standard error* is that of the constant, as a share of the distance between its bounds on a \
         logarithmic scale. At 100 % the rows do not determine the constant. Half the sum of the squared \
         residuals falls from {:.3} to {:.3} in {} evaluations ({}), {:.0} s of processor time.\n\n## Rows\n\n| quantity | people | at \
             the start | at the end | weighted residual at the end |\n|---|---|---|---|---|\n",
            self.cost[0],
            self.cost[1],
            self.tried.len(),
            self.end(),
            self.solve_s
        );
        for r in &self.rows {
            let [start, end] = r.here.map(digits);
            let _ = writeln!(
                text,
                "| {} | {} | {start} | {end} | {:.2} |",
                r.quantity, r.people, r.residual
            );
        }
        self.relaxation(&mut text);
        self.sets.page(&mut text);
        text
    }

    fn end(&self) -> &'static str {
        match self.ended {
            super::Ended::Converged => "no step gains a thousandth",
            super::Ended::Evaluations => "the most that were allowed",
        }
    }

    fn relaxation(&self, text: &mut String) {
        let Some(s) = &self.shares else { return };
        text.push_str(
            "\n## Relaxation\n\n| share of the first time | energy lost, % | largest force, N | \
             processor time, s |\n|---|---|---|---|\n",
        );
        for t in &s.taps {
            let _ = writeln!(
                text,
                "| {} | {:.1} | {:.2} | {:.0} |",
                t.first_share, t.lost_percent, t.force_n_max, t.solve_s
            );
        }
        let stays = 1.0 - s.share.iter().sum::<f64>();
        let _ = write!(
            text,
            "\nPeople: {} %. The relaxation times are {:?} s and their shares {:?}. A share of {:.3} does not relax, so the \
         modulus against a sudden strain is {:.0} times that against a held strain.\n",
            s.people_percent,
            s.time_s,
            s.share.iter().map(|g| (1e4 * g).round() / 1e4).collect::<Vec<_>>(),
            stays,
            1.0 / stays
        );
    }

    /// A table for people.
    #[must_use]
    pub fn human(&self) -> String {
        let mut text = String::new();
        let line = |c: &Identified| {
            let bound = if c.at_bound { " (at its bound)" } else { "" };
            format!("{:40} {:>10}{bound}\n", c.parameter.name, c.value)
        };
        text.extend(self.constants.iter().map(line));
        let _ = writeln!(text, "\n{:64} {:>12} {:>8} {:>8}", "row", "people", "start", "end");
        for r in &self.rows {
            let [start, end] = r.here.map(digits);
            let (name, people) = (&r.quantity, &r.people);
            let _ = writeln!(text, "{name:64} {people:>12} {start:>8} {end:>8}");
        }
        let _ = writeln!(text, "\ncost {:.3} -> {:.3}, {}", self.cost[0], self.cost[1], self.end());
        self.relaxation(&mut text);
        text
    }
}

/// Three digits.
fn digits(v: f64) -> String {
    if v.abs() < 1.0 { format!("{v:.4}") } else { format!("{v:.3}") }
}
