//! The report of the hard cases: the page `docs/reports/stability.md`, and the table beside it.

use super::line::{comparison, first_line};
use super::{CASES, End, Extent, Hardness, Line};
use crate::csv::quoted;
use papilla_processor::today_here;
use serde::Serialize;
use std::fmt::Write;

/// Head of docs/reports/stability.md up to the table.
const INTRODUCTION: &str = include_str!("introduction.md");

/// Head of the table of cases.
const CASES_HEAD: &str = "\
| case | what is promised | variants |
|---|---|---|
";

/// Head of the table of what came of them.
const OUTCOMES_HEAD: &str = "
| case | converged or evaluated | refused | iterations | smallest J | condition | nearest to its tolerance |
|---|---|---|---|---|---|---|
";

/// Head of the table of variants, docs/reports/stability.csv.
const VARIANTS_HEAD: &str = "case,variant,end,error,iterations,steps,cuts,smallest J,condition at least,\
worse balance,nearest to its tolerance,promise\n";

/// Every line of one run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// How much was run.
    pub extent: Extent,
    /// Lines in the order of the cases.
    pub lines: Vec<Line>,
}

impl Report {
    /// Whether there is at least one line and every one keeps its promise.
    #[must_use]
    pub fn passed(&self) -> bool {
        !self.lines.is_empty() && self.lines.iter().all(|l| l.kept)
    }

    /// One line that sums the table up.
    #[must_use]
    pub fn summary(&self) -> String {
        let broken = self.lines.iter().filter(|l| !l.kept).count();
        let refused = self.lines.iter().filter(|l| matches!(l.end, End::Refused(_))).count();
        let cases: Vec<_> = CASES.iter().filter_map(|c| self.of(c.name).next()).collect();
        let seconds: f64 = cases.iter().map(|l| l.seconds).sum();
        format!(
            "{} variants of {} cases: {} converged or evaluated, {refused} refused, {broken} break their \
             promise; {seconds:.0} s",
            self.lines.len(),
            cases.len(),
            self.lines.len() - refused - self.lines.iter().filter(|l| l.is_broken()).count(),
        )
    }

    fn of<'a>(&'a self, case: &'a str) -> impl Iterator<Item = &'a Line> {
        self.lines.iter().filter(move |l| l.case == case)
    }

    /// docs/reports/stability.md: two tables with a row a case.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = String::from(INTRODUCTION);
        out.push('\n');
        out += CASES_HEAD;
        for case in CASES {
            let count = self.of(case.name).count();
            if count > 0 {
                let breaking = self.of(case.name).filter(|line| !line.kept).count();
                let warning =
                    if breaking > 0 { format!("; **{breaking} break it**") } else { String::new() };
                let _ = writeln!(out, "| `{}` | {} | {count}{warning} |", case.name, case.promise);
            }
        }
        out += OUTCOMES_HEAD;
        for case in CASES {
            let lines: Vec<_> = self.of(case.name).collect();
            if !lines.is_empty() {
                let _ = writeln!(out, "{}", row(case.name, &lines));
            }
        }
        let _ = writeln!(out, "\n{}. {}.", self.summary(), today_here());
        out
    }

    /// docs/reports/stability.csv: a row a variant.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut out = String::from(VARIANTS_HEAD);
        for line in &self.lines {
            out += &line.csv_row();
        }
        out
    }
}

/// What came of a case.
fn row(name: &str, lines: &[&Line]) -> String {
    let hard: Vec<&Hardness> = lines.iter().filter_map(|line| line.hardness.as_ref()).collect();
    let refused = lines.iter().filter(|line| matches!(line.end, End::Refused(_))).count();
    let broken = lines.iter().filter(|line| line.is_broken()).count();
    let [iterations, j, condition] = if hard.is_empty() {
        <[String; 3]>::default()
    } else {
        let iterations = hard.iter().map(|h| h.newton_iterations).max().unwrap_or_default();
        let j = hard.iter().map(|h| h.j_min).fold(f64::INFINITY, f64::min);
        let condition = hard.iter().map(|h| h.condition_at_least).fold(0.0, f64::max);
        [iterations.to_string(), format!("{j:.4}"), format!("{condition:.1e}")]
    };
    let nearest = lines.iter().filter_map(|line| line.tightest());
    let nearest = nearest.max_by(|a, b| a.strain().total_cmp(&b.strain()));
    let nearest = nearest.map_or_else(String::new, comparison).replace('|', "\\|");
    format!(
        "| `{name}` | {} | {refused} | {iterations} | {j} | {condition} | {nearest} |",
        lines.len() - refused - broken,
    )
}

impl Line {
    fn is_broken(&self) -> bool {
        matches!(self.end, End::Broken(_))
    }

    fn csv_row(&self) -> String {
        let (end, error) = match &self.end {
            End::Converged => ("converged", ""),
            End::Evaluated => ("evaluated", ""),
            End::Refused(why) => ("refused", first_line(why)),
            End::Broken(what) => ("broken", what.as_str()),
        };
        let number = |v: f64| if v.is_nan() { String::new() } else { format!("{v:.1e}") };
        let [iterations, steps, cuts, j, condition, balance] =
            self.hardness.as_ref().map_or_else(Default::default, |h| {
                [
                    h.newton_iterations.to_string(),
                    h.steps.to_string(),
                    h.cuts.to_string(),
                    format!("{:.4}", h.j_min),
                    number(h.condition_at_least),
                    number(h.balance_worst),
                ]
            });
        let check = self.tightest().map_or_else(String::new, comparison);
        let promise = if self.kept { "kept" } else { "broken" };
        let [variant, error, check] = [self.variant.as_str(), error, check.as_str()].map(quoted);
        format!(
            "{},{variant},{end},{error},{iterations},{steps},{cuts},{j},{condition},{balance},{check},{promise}\n",
            self.case
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Page and table are written by minutes of solving; their words are those of this file.
    #[test]
    fn the_committed_page_is_of_the_committed_variants() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reports/stability.md");
        let page = std::fs::read_to_string(root).unwrap();
        assert!(page.starts_with(INTRODUCTION), "fe-datagen stability --markdown {root}");
        assert!(page.contains(CASES_HEAD), "fe-datagen stability --markdown {root}");
        let variants = std::fs::read_to_string(root.replace(".md", ".csv")).unwrap();
        let rows = variants.strip_prefix(VARIANTS_HEAD).unwrap();
        let mut all = 0;
        for case in CASES {
            let of_case = |line: &&str| line.starts_with(&format!("{},", case.name));
            let count = rows.lines().filter(of_case).count();
            let row = format!("| `{}` | {} | {count} |", case.name, case.promise);
            assert!(page.contains(&row), "{row}");
            all += count;
        }
        assert_eq!(all, rows.lines().count(), "a case that is no more");
        assert!(rows.lines().all(|row| row.ends_with(",kept")), "a promise that is broken");
    }
}
