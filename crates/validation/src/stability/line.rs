//! What became of one variant of a case.

use crate::verify::Check;
use papilla_fem::solve::StepReport;
use papilla_fingertip::simulation::record::IncrementRecord;
use serde::Serialize;
use std::fmt::Write;

/// How a variant ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// In equilibrium.
    Converged,
    /// Nothing was to be solved: formulas were evaluated.
    Evaluated,
    /// With a typed error.
    Refused(String),
    /// With what a case never promises: a panic, an error of the wrong kind, none at all.
    Broken(String),
}

/// How hard a solve was.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Hardness {
    /// Newton iterations.
    pub newton_iterations: u32,
    /// Equilibria on the way.
    pub steps: u32,
    /// Halved load steps.
    pub cuts: u32,
    /// Halved Newton steps.
    pub backtracks: u32,
    /// Iterations of conjugate gradients.
    pub cg_iterations: u32,
    /// Factorizations of the tangent, indefinite ones among them second.
    pub factorizations: [u32; 2],
    /// Smallest `J`.
    pub j_min: f64,
    /// Block and element where it is.
    pub j_min_at: [usize; 2],
    /// The tangent's condition number is at least this.
    pub condition_at_least: f64,
    /// Share of the volume beyond the calibrated stretches of its law.
    pub outside_calibration: f64,
    /// Worst of the force and energy balances, relative; not a number where none was taken.
    pub balance_worst: f64,
}

impl From<&StepReport> for Hardness {
    fn from(report: &StepReport) -> Self {
        let e = report.effort;
        Self {
            newton_iterations: e.newton_iterations,
            steps: e.steps,
            cuts: e.cuts,
            backtracks: e.backtracks,
            cg_iterations: e.cg_iterations,
            factorizations: [e.factorizations, e.indefinite_factorizations],
            j_min: report.j_min,
            j_min_at: report.j_min_at,
            condition_at_least: report.condition_at_least,
            outside_calibration: 0.0,
            balance_worst: f64::NAN,
        }
    }
}

impl Hardness {
    /// Of an indentation, with the balances of its last state.
    pub(super) fn of_press(record: &IncrementRecord, report: &StepReport) -> Self {
        let c = &record.checks;
        let worst = [c.plate_vs_support_reaction, c.energy_vs_work];
        // f64::max would drop a NaN.
        let worse = |a: f64, b: f64| if a.is_nan() || a >= b { a } else { b };
        Self {
            outside_calibration: record.outside_calibration,
            balance_worst: worst.into_iter().fold(0.0, worse),
            ..Self::from(report)
        }
    }
}

/// One variant of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Name of the case.
    pub case: &'static str,
    /// What is varied.
    pub variant: String,
    /// How it ended.
    pub end: End,
    /// How hard it was, where something was solved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness: Option<Hardness>,
    /// What was compared.
    pub checks: Vec<Check>,
    /// Whether the promise is kept.
    pub kept: bool,
    /// Wall time of the whole case, s.
    pub seconds: f64,
}

impl Line {
    fn new(variant: String, end: End, hardness: Option<Hardness>, checks: Vec<Check>) -> Self {
        // Nothing passes by having run.
        let compared = matches!(end, End::Refused(_)) || !checks.is_empty();
        let sound = !matches!(end, End::Broken(_));
        let kept = sound && compared && checks.iter().all(|c| c.pass);
        Self { case: "", variant, end, hardness, checks, kept, seconds: 0.0 }
    }

    /// An equilibrium that keeps its promise if all checks pass.
    pub(super) fn converged(
        variant: impl Into<String>,
        hardness: Hardness,
        checks: Vec<Check>,
    ) -> Self {
        Self::new(variant.into(), End::Converged, Some(hardness), checks)
    }

    /// Formulas that keep their promise if all checks pass.
    pub(super) fn evaluated(variant: impl Into<String>, checks: Vec<Check>) -> Self {
        Self::new(variant.into(), End::Evaluated, None, checks)
    }

    /// What has to be refused with an error that says all `words`.
    pub(super) fn refused<T, E: std::fmt::Display>(
        variant: impl Into<String>,
        result: Result<T, E>,
        words: &[&str],
    ) -> Self {
        let variant = variant.into();
        let Err(error) = result else { return Self::broken(variant, "was not refused") };
        let text = error.to_string();
        match words.iter().find(|w| !text.contains(**w)) {
            Some(word) => Self::broken(variant, format!("does not say '{word}': {text}")),
            None => Self::new(variant, End::Refused(text), None, Vec::new()),
        }
    }

    /// What must never be.
    pub(super) fn broken(variant: impl Into<String>, what: impl Into<String>) -> Self {
        Self::new(variant.into(), End::Broken(what.into()), None, Vec::new())
    }

    /// The check that is nearest to its tolerance, or farthest past it.
    #[must_use]
    pub fn tightest(&self) -> Option<&Check> {
        self.checks.iter().max_by(|a, b| a.strain().total_cmp(&b.strain()))
    }

    /// The line for a terminal.
    #[must_use]
    pub fn text(&self) -> String {
        let verdict = if self.kept { "ok" } else { "FAIL" };
        let mut out = format!("{verdict:<4} {:<16} {:<34} ", self.case, self.variant);
        match &self.end {
            End::Converged => out += "converged",
            End::Evaluated => out += "evaluated",
            End::Refused(why) => {
                let _ = write!(out, "refused: {}", first_line(why));
            }
            End::Broken(what) => {
                let _ = write!(out, "BROKEN: {what}");
            }
        }
        if let Some(h) = &self.hardness {
            let _ = write!(
                out,
                "  it {} steps {} cuts {} J {:.4} cond {:.0e}",
                h.newton_iterations, h.steps, h.cuts, h.j_min, h.condition_at_least
            );
            if !h.balance_worst.is_nan() {
                let _ = write!(out, " balances {:.1e}", h.balance_worst);
            }
            if h.outside_calibration > 0.0 {
                let _ = write!(out, " uncalibrated {:.1} %", 100.0 * h.outside_calibration);
            }
        }
        for check in self.checks.iter().filter(|c| !c.pass) {
            let _ = write!(out, "  PAST: {}", comparison(check));
        }
        if let (Some(check), true) = (self.tightest(), self.kept) {
            let _ = write!(out, "  {}", comparison(check));
        }
        out
    }
}

/// What a refusal says, without the lines of the scene that it points at.
pub(super) fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or("")
}

/// A check in words.
pub(super) fn comparison(c: &Check) -> String {
    if c.tolerance == 0.0 {
        format!("{}: {:.6e} ({})", c.quantity, c.value, c.source)
    } else {
        format!("{}: {:.1e} of {:e} ({})", c.quantity, c.difference, c.tolerance, c.source)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_passes_by_having_run() {
        assert!(!Line::evaluated("a", Vec::new()).kept);
        assert!(!Line::converged("a", (&StepReport::default()).into(), Vec::new()).kept);
        let near = |v| vec![Check::vanishes("x", v, 1e-3, "zero")];
        assert!(Line::evaluated("a", near(1e-4)).kept);
        assert!(!Line::evaluated("a", near(1e-2)).kept);
        assert!(!Line::evaluated("a", near(f64::NAN)).kept);
    }

    #[test]
    fn a_refusal_has_to_say_why() {
        let refusal = Err::<(), _>("element 7 is inverted");
        assert!(Line::refused("a", refusal, &["element 7", "inverted"]).kept);
        assert!(!Line::refused("a", refusal, &["line"]).kept);
        assert!(!Line::refused("a", Ok::<(), String>(()), &[]).kept);
        assert!(Line::broken("a", "x").text().contains("BROKEN"));
    }
}
