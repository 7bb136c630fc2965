//! The table of all rows.

use super::{CASES, CaseError, Check};
use crate::processor::today_here;
use serde::Serialize;
use std::fmt::Write;
use std::time::Instant;

/// A check with the case it belongs to.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the case.
    pub case: &'static str,
    /// What was compared.
    #[serde(flatten)]
    pub check: Check,
    /// Wall time of the whole case, s.
    pub seconds: f64,
}

/// Head of docs/reports/verification.md.
const INTRODUCTION: &str = "# Verification

Written by

```sh
cargo run --release -p papilla-fe-datagen -- verify --markdown docs/reports/verification.md
```

which solves every problem below with the solver of the fingertip and exits with code 3 if a row is
past its tolerance. `--quick` runs smaller meshes and leaves out `density` and `solid-parts` (part of
`./test`), `--only NAME` one case, `--json` prints the rows for a program. *Difference* is relative
where the reference is a nonzero value in mm, N or MPa; absolute for orders; the excess where a value
is accepted up to the reference (tolerance 0). Units: mm, N, MPa.

";

/// Every row of one run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Whether the smaller problems were run.
    pub quick: bool,
    /// Rows in the order of the cases.
    pub rows: Vec<Row>,
}

impl Report {
    /// Runs a case and adds its rows; an error is one row that fails.
    pub(crate) fn take(
        &mut self,
        case: &'static str,
        run: impl FnOnce() -> Result<Vec<Check>, CaseError>,
    ) -> &[Row] {
        let clock = Instant::now();
        let checks = run().unwrap_or_else(|e| vec![Check::failed(e.as_ref())]);
        let seconds = clock.elapsed().as_secs_f64();
        let before = self.rows.len();
        self.rows.extend(checks.into_iter().map(|check| Row { case, check, seconds }));
        &self.rows[before..]
    }
}

impl Row {
    /// The row as a line of a terminal's table.
    #[must_use]
    pub fn line(&self) -> String {
        let c = &self.check;
        let verdict = if c.pass { "ok" } else { "FAIL" };
        format!(
            "{verdict:<4} {:<12} {:<58} {:>12} {:>12} {:>9.2e} {:>9.1e}  {}",
            self.case,
            c.quantity,
            number(c.value),
            number(c.reference),
            c.difference,
            c.tolerance,
            c.source
        )
    }

    /// Heading of the lines.
    #[must_use]
    pub fn heading() -> String {
        format!(
            "{:<4} {:<12} {:<58} {:>12} {:>12} {:>9} {:>9}  {}",
            "", "case", "quantity", "this code", "reference", "differs", "allowed", "source"
        )
    }
}

impl Report {
    /// Whether there is at least one row and every one passed.
    #[must_use]
    pub fn passed(&self) -> bool {
        !self.rows.is_empty() && self.rows.iter().all(|r| r.check.pass)
    }

    /// Seconds of all cases together.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        let mut total = 0.0;
        let mut last = "";
        for row in &self.rows {
            if row.case != last {
                total += row.seconds;
                last = row.case;
            }
        }
        total
    }

    /// One line that sums the table up.
    #[must_use]
    pub fn summary(&self) -> String {
        let failed = self.rows.iter().filter(|r| !r.check.pass).count();
        let seconds = self.seconds();
        format!("{} rows, {failed} past tolerance, {seconds:.0} s", self.rows.len())
    }

    /// The table for docs/reports/verification.md, a section a case.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = String::from(INTRODUCTION);
        for case in CASES {
            let rows: Vec<_> = self.rows.iter().filter(|r| r.case == case.name).collect();
            let Some(first) = rows.first() else { continue };
            let _ =
                writeln!(out, "## `{}`\n\n{} ({:.1} s)\n", case.name, case.shows, first.seconds);
            out.push_str(
                "| quantity | this code | reference | source | difference | tolerance | |\n",
            );
            out.push_str("|---|---|---|---|---|---|---|\n");
            for Row { check: c, .. } in rows {
                let _ = writeln!(
                    out,
                    "| {} | {} | {} | {} | {:.1e} | {:.1e} | {} |",
                    c.quantity.replace('|', "\\|"),
                    number(c.value),
                    number(c.reference),
                    c.source,
                    c.difference,
                    c.tolerance,
                    if c.pass { "ok" } else { "**fails**" }
                );
            }
            out.push('\n');
        }
        let _ = writeln!(out, "{}. {}.", self.summary(), today_here());
        out
    }
}

/// Six digits, without an exponent where none is needed.
fn number(v: f64) -> String {
    if v == 0.0 {
        "0".into()
    } else if v.abs() < 1e-3 || v.abs() >= 1e6 {
        format!("{v:.2e}")
    } else {
        let digits = (5 - v.abs().log10().floor() as i32).clamp(0, 7) as usize;
        format!("{v:.digits$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page is written by minutes of solving; its words are those of this code.
    #[test]
    fn the_committed_page_begins_as_a_new_one_would() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reports/verification.md");
        let page = std::fs::read_to_string(path).unwrap();
        assert!(page.starts_with(INTRODUCTION), "fe-datagen verify --markdown {path}");
        for case in CASES {
            let head = format!("## `{}`\n\n{} (", case.name, case.shows);
            assert!(page.contains(&head), "{head}");
        }
        let heads = page.lines().filter(|l| l.starts_with("## ")).count();
        assert_eq!(heads, CASES.len(), "a case that is no more");
    }
}
