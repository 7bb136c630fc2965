//! The table of all rows.

use super::{CASES, CaseError, Check};
use crate::csv::quoted;
use papilla_processor::today_here;
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

**Question.** Does the finite-element solver give the results that theory, the literature and its own invariants
ask for?

**What it means.** Yes: all comparisons are within their tolerances. This checks the solver, and not how well the
fingertip stands for a real one. The model is compared with [another program](../../studies/reports/calculix.md) and
[with people](../../studies/reports/human.md) elsewhere.

**Method.** The command `fe-datagen verify` solves problems with known results, with the same solver that simulates
fingers. A *case* is
a kind of problem, such as a sphere on a half-space. It has several *comparisons*, each of one number with its truth,
and each with a tolerance of its own. The command writes this page and [all comparisons](verification.csv). It exits
with code 3 if a difference is above its tolerance.

```sh
cargo run --release -p papilla-fe-datagen -- verify --markdown docs/reports/verification.md
```

| option | does |
|---|---|
| `--quick` | takes smaller meshes and leaves out the cases `density` and `solid-parts`, as `./test` does |
| `--only NAME` | runs one case |
| `--json` | prints the comparisons for a program |

These words are used in the tables. Units are mm, N and MPa, unless a row says otherwise.

| word | meaning |
|---|---|
| SED | strain energy density |
| Hex8, Tet4, Quad9 and others | hexahedra, tetrahedra and plane quadrilaterals; the number is that of their nodes |
| nu, E, mu | Poisson's ratio; Young's modulus; for `coulomb` mu is the coefficient of friction |
| L2 | root of the sum of squares over all nodes or points, relative to that of the truth |
| E* | plane strain modulus, `E / (1 - nu^2)` |

## What each case shows

";

/// Head of the table of cases.
const CASES_HEAD: &str = "\
| case | what is shown | comparisons |
|---|---|---|
";

/// Head of the table of the tightest comparisons.
const NEAREST_HEAD: &str = "
## The comparison nearest to its tolerance

Of each case this table has one comparison: the one that uses up most of its tolerance.

| column | meaning |
|---|---|
| comparison | what is compared |
| this code, truth | the two numbers. Some numbers only have to stay below a bound; then the bound stands as the truth |
| difference | computed from all digits, relative to the truth. It is absolute if the truth is zero, and for orders of convergence. For a bound it is 0 as long as the bound is kept; the two columns before show how near the number is to it |
| allowed | the tolerance, or `bound` |

| case | comparison | this code | truth | source of the truth | difference | allowed |
|---|---|---|---|---|---|---|
";

/// Head of the table of comparisons, docs/reports/verification.csv.
const ROWS_HEAD: &str =
    "case,quantity,this code,truth,source,difference,tolerance,within,seconds of the case\n";

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
    pub fn take(
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
        format!("{} comparisons, {failed} past tolerance, {seconds:.0} s", self.rows.len())
    }

    fn of<'a>(&'a self, case: &'a str) -> impl Iterator<Item = &'a Row> {
        self.rows.iter().filter(move |row| row.case == case)
    }

    /// docs/reports/verification.md: two tables with a row a case.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = String::from(INTRODUCTION);
        out += CASES_HEAD;
        for case in CASES {
            let count = self.of(case.name).count();
            if count > 0 {
                let failed = self.of(case.name).filter(|row| !row.check.pass).count();
                let warning =
                    if failed > 0 { format!("; **{failed} fail**") } else { String::new() };
                let _ = writeln!(out, "| `{}` | {} | {count}{warning} |", case.name, case.shows);
            }
        }
        out += NEAREST_HEAD;
        for case in CASES {
            let checks = self.of(case.name).map(|row| &row.check);
            let Some(c) = checks.max_by(|a, b| a.strain().total_cmp(&b.strain())) else { continue };
            let allowed =
                if c.tolerance == 0.0 { "bound".into() } else { format!("{:.1e}", c.tolerance) };
            let _ = writeln!(
                out,
                "| `{}` | {} | {} | {} | {} | {:.1e} | {allowed} |",
                case.name,
                c.quantity.replace('|', "\\|"),
                number(c.value),
                number(c.reference),
                c.source,
                c.difference,
            );
        }
        let _ = writeln!(out, "\n{}. {}.", self.summary(), today_here());
        out
    }

    /// docs/reports/verification.csv: a row a comparison.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut out = String::from(ROWS_HEAD);
        for Row { case, check: c, seconds } in &self.rows {
            let _ = writeln!(
                out,
                "{case},{},{},{},{},{:.1e},{:.1e},{},{seconds:.1}",
                quoted(&c.quantity),
                number(c.value),
                number(c.reference),
                quoted(c.source),
                c.difference,
                c.tolerance,
                if c.pass { "yes" } else { "no" },
            );
        }
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

    /// Page and table are written by minutes of solving; their words are those of this code.
    #[test]
    fn the_committed_page_is_of_the_committed_rows() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reports/verification.md");
        let page = std::fs::read_to_string(path).unwrap();
        let head = format!("{INTRODUCTION}{CASES_HEAD}");
        assert!(page.starts_with(&head), "fe-datagen verify --markdown {path}");
        let table = std::fs::read_to_string(path.replace(".md", ".csv")).unwrap();
        let rows = table.strip_prefix(ROWS_HEAD).unwrap();
        let mut all = 0;
        for case in CASES {
            let of_case = |line: &&str| line.starts_with(&format!("{},", case.name));
            let count = rows.lines().filter(of_case).count();
            let row = format!("| `{}` | {} | {count} |", case.name, case.shows);
            assert!(page.contains(&row), "{row}");
            all += count;
        }
        assert_eq!(all, rows.lines().count(), "a case that is no more");
        assert!(page.contains(&format!("{all} comparisons, 0 past tolerance")));
    }
}
