//! Tables and charts of the reproduction.

use super::findings::{Finding, Points, findings};
use super::lines::DEPTHS_MM;
use super::reading::Reading;
use super::{Outcome, State, WedgeError};
use papilla_dataset::Checks;
use papilla_fem::solve::Effort;
use papilla_fingertip::tissue::Tissue;
use papilla_output::plot::{Axis, Chart, Mark, Series, write_svg};
use papilla_output::{OutputError, atomic};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// A state in `s2.json`.
#[derive(Clone, Debug, Serialize)]
pub struct StateSummary {
    /// Time since first touch, s.
    pub time_s: f64,
    /// Force on the whole finger per mm of length, N.
    pub force_n_per_mm: f64,
    /// SED at the named points, J/m3.
    pub sed_j_per_m3: Points,
    /// Points of the depth line left out, where the tip crushes the mesh.
    pub left_out: usize,
    /// What the paper states.
    pub findings: Vec<Finding>,
    /// Checks of the equilibrium.
    pub checks: Checks,
}

/// `s2.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// What of the paper was read how.
    pub reading: Reading,
    /// Unknowns.
    pub unknowns: usize,
    /// Elements.
    pub elements: usize,
    /// Depth of the bone under the pad's lowest point, mm.
    pub bone_depth_mm: f64,
    /// Mesh, ordering, symbolic factorization, s.
    pub setup_s: f64,
    /// Ramp and hold, s.
    pub solve_s: f64,
    /// Work.
    pub effort: Effort,
    /// From the end of the ramp to the end of the hold.
    pub states: Vec<StateSummary>,
}

impl From<&Outcome> for Summary {
    fn from(o: &Outcome) -> Self {
        let state = |s: &State| StateSummary {
            time_s: s.time_s,
            force_n_per_mm: s.force_n_per_mm,
            sed_j_per_m3: Points::of(s),
            left_out: s.left_out,
            findings: findings(s),
            checks: s.record.checks,
        };
        Self {
            reading: o.reading,
            unknowns: o.unknowns,
            elements: o.elements,
            bone_depth_mm: o.bone_depth_mm,
            setup_s: o.setup_s,
            solve_s: o.solve_s,
            effort: o.effort,
            states: o.states.iter().map(state).collect(),
        }
    }
}

impl Summary {
    /// Whether every finding that has to holds at the end of the hold, the state that the
    /// figures are taken to show.
    #[must_use]
    pub fn reproduces(&self) -> bool {
        let kept = |s: &StateSummary| s.findings.iter().all(|f| f.holds || !f.asserted);
        self.states.last().is_some_and(kept)
    }

    /// For people.
    #[must_use]
    pub fn human(&self) -> String {
        let mut text = format!(
            "reading {}: {} unknowns, {} elements; set-up {:.2} s, solve {:.1} s, {} Newton iterations\n",
            self.reading.name(),
            self.unknowns,
            self.elements,
            self.setup_s,
            self.solve_s,
            self.effort.newton_iterations
        );
        for s in &self.states {
            let _ = writeln!(text, "{} s: {:.4} N per mm", s.time_s, s.force_n_per_mm);
            for f in &s.findings {
                let verdict = match (f.holds, f.asserted) {
                    (true, _) => "holds",
                    (false, true) => "fails",
                    (false, false) => "not reproduced:",
                };
                let _ = writeln!(text, "  {verdict} {}: {}", f.statement, f.measured);
            }
        }
        text
    }
}

/// Writes figures 2(a), 2(b) and 3 as `.svg` and `.csv`, and `s2.json`.
///
/// # Errors
/// [`OutputError`] if a file cannot be written.
pub fn write(folder: &Path, outcome: &Outcome, summary: &Summary) -> Result<(), OutputError> {
    let mut depth = String::from("time_s,depth_mm,tissue,sed_j_per_m3\n");
    let mut lateral = String::from("time_s,depth_mm,tissue,x_mm,sed_j_per_m3\n");
    for s in &outcome.states {
        for p in &s.depth_line {
            let (tissue, sed) = (p.tissue.name(), p.sed_j_per_m3);
            let _ = writeln!(depth, "{},{:.4},{tissue},{sed:.4}", s.time_s, p.depth_mm);
        }
        for l in &s.lateral {
            for [x, sed] in &l.points {
                let (d, tissue) = (l.depth_mm, l.tissue.name());
                let _ = writeln!(lateral, "{},{d},{tissue},{x:.5},{sed:.4}", s.time_s);
            }
        }
    }
    atomic::write(&folder.join("figure-2a.csv"), depth.as_bytes())?;
    atomic::write(&folder.join("figure-2b-3.csv"), lateral.as_bytes())?;
    write_svg(&folder.join("figure-2a.svg"), &depth_chart(outcome))?;
    let interface = "Figure 2(b): SED on both sides of the epidermis-dermis interface";
    let two = lateral_chart(outcome, interface, &|depth, _| depth < 1.5 * DEPTHS_MM[0]);
    write_svg(&folder.join("figure-2b.svg"), &two)?;
    let depths = "Figure 3: SED in the dermis, 0.20, 0.70 and 1.20 mm deep";
    let three = lateral_chart(outcome, depths, &|_, tissue| tissue == Tissue::Dermis);
    write_svg(&folder.join("figure-3.svg"), &three)?;
    atomic::write_json(&folder.join("s2.json"), summary)
}

/// The states that are drawn: the end of the ramp and the end of the hold.
fn drawn(outcome: &Outcome) -> impl Iterator<Item = &State> {
    let last = outcome.states.len().saturating_sub(1);
    outcome.states.iter().enumerate().filter(move |(k, _)| *k == 0 || *k == last).map(|(_, s)| s)
}

/// A curve for every layer at every drawn state, broken at the interfaces.
fn depth_chart(outcome: &Outcome) -> Chart {
    let mut series = Vec::new();
    for s in drawn(outcome) {
        for tissue in [Tissue::Epidermis, Tissue::Dermis, Tissue::Subcutaneous] {
            let own = s.depth_line.iter().filter(|p| p.tissue == tissue);
            series.push(Series {
                name: format!("{}, {} s", tissue.name(), s.time_s),
                points: own.map(|p| (p.depth_mm, p.sed_j_per_m3)).collect(),
                mark: Mark::Line,
            });
        }
    }
    Chart {
        title: "Figure 2(a): SED under the wedge, from the skin (A) to the bone".into(),
        x: Axis::linear("depth, mm"),
        y: Axis::log("SED, J/m3"),
        series,
    }
}

/// SED against x of the lines that `wanted` takes, with their mirror images.
fn lateral_chart(outcome: &Outcome, title: &str, wanted: &dyn Fn(f64, Tissue) -> bool) -> Chart {
    let series = drawn(outcome).flat_map(|s| {
        let lines = s.lateral.iter().filter(|l| wanted(l.depth_mm, l.tissue));
        lines.map(|l| {
            let left = l.points.iter().rev().map(|p| (-p[0], p[1]));
            Series {
                name: format!("{:.2} mm, {}, {} s", l.depth_mm, l.tissue.name(), s.time_s),
                points: left.chain(l.points.iter().map(|p| (p[0], p[1]))).collect(),
                mark: Mark::Line,
            }
        })
    });
    Chart {
        title: title.into(),
        x: Axis::linear("x, mm"),
        y: Axis::linear("SED, J/m3"),
        series: series.collect(),
    }
}

/// Table of readings, Markdown; a reading without equilibrium says so.
#[must_use]
pub fn readings_table(rows: &[(Reading, Result<Summary, WedgeError>)]) -> String {
    let mut text = String::from(
        "| reading | time, s | force, N/mm | B, epidermis | B, dermis | C | D, dermis | D, fat | bone \
         | does not hold |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (reading, row) in rows {
        let summary = match row {
            Ok(s) => s,
            Err(e) => {
                let _ = writeln!(text, "| {} | {e} | | | | | | | | |", reading.name());
                continue;
            }
        };
        for s in &summary.states {
            let p = &s.sed_j_per_m3;
            let missed: Vec<_> = s.findings.iter().filter(|f| !f.holds).map(|f| f.name).collect();
            let _ = writeln!(
                text,
                "| {} | {} | {:.4} | {:.0} | {:.0} | {:.0} | {:.0} | {:.0} | {:.0} | {} |",
                reading.name(),
                s.time_s,
                s.force_n_per_mm,
                p.b[0],
                p.b[1],
                p.c,
                p.d[0],
                p.d[1],
                p.bone,
                missed.join(", ")
            );
        }
    }
    text
}
