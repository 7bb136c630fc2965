//! The table of all lines.

use super::line::{comparison, first_line};
use super::{CASES, End, Extent, Line};
use crate::processor::today_here;
use serde::Serialize;
use std::fmt::Write;

/// Head of docs/reports/stability.md up to the table.
const INTRODUCTION: &str = include_str!("introduction.md");

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

    /// docs/reports/stability.md: a section a case.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = String::from(INTRODUCTION);
        let _ = writeln!(out, "\n{}. {}.\n", self.summary(), today_here());
        for case in CASES {
            let lines: Vec<_> = self.of(case.name).collect();
            let Some(first) = lines.first() else { continue };
            let _ =
                writeln!(out, "## `{}`\n\n{} ({:.1} s)\n", case.name, case.promise, first.seconds);
            out += "| variant | end | iterations | steps, cuts | J min | condition | balances | tightest check | |\n";
            out += "|---|---|---|---|---|---|---|---|---|\n";
            for line in lines {
                out += &line.row();
            }
            out.push('\n');
        }
        out
    }
}

impl Line {
    fn is_broken(&self) -> bool {
        matches!(self.end, End::Broken(_))
    }

    fn row(&self) -> String {
        let end = match &self.end {
            End::Converged => "converged".into(),
            End::Evaluated => "evaluated".into(),
            End::Refused(why) => format!("refused: *{}*", first_line(why)),
            End::Broken(what) => format!("**broken: {what}**"),
        };
        let number = |v: f64| if v.is_nan() { String::new() } else { format!("{v:.1e}") };
        let [iterations, steps, j, condition, balances] =
            self.hardness.as_ref().map_or_else(Default::default, |h| {
                [
                    h.newton_iterations.to_string(),
                    format!("{}, {}", h.steps, h.cuts),
                    format!("{:.4}", h.j_min),
                    number(h.condition_at_least),
                    number(h.balance_worst),
                ]
            });
        let check = self.tightest().map_or_else(String::new, comparison);
        let verdict = if self.kept { "kept" } else { "**broken**" };
        format!(
            "| {} | {} | {iterations} | {steps} | {j} | {condition} | {balances} | {} | {verdict} |\n",
            self.variant,
            end.replace('|', "\\|"),
            check.replace('|', "\\|"),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page is written by minutes of solving; its words are those of this file.
    #[test]
    fn the_committed_page_begins_as_a_new_one_would() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reports/stability.md");
        let page = std::fs::read_to_string(root).unwrap();
        assert!(page.starts_with(INTRODUCTION), "fe-datagen stability --markdown {root}");
        for case in CASES {
            let head = format!("## `{}`\n\n{} (", case.name, case.promise);
            assert!(page.contains(&head), "{head}");
        }
    }
}
