//! Errors against the reference, and what each mesh costs.

use super::solution::Solution;
use super::{Case, ConvergenceError};
use papilla_fingertip::mesh::named::MeshChoice;
use papilla_output::plot::{Axis, Chart, Mark, Series, write_svg};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// Bytes of an entry of the f32 factor.
const FACTOR_BYTES: usize = 4;

/// One state of one case on one mesh against the reference, relative.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Comparison {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Relative L2 difference of SED on the dermis side.
    pub sed_l2: f64,
    /// Difference of the greatest SED over the greatest.
    pub sed_peak: f64,
    /// Relative L2 difference of pressure.
    pub pressure_l2: f64,
    /// Difference of force over force.
    pub force: f64,
}

/// One case on one mesh.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Case.
    pub case: &'static str,
    /// Mesh.
    pub mesh: &'static str,
    /// Unknowns.
    pub unknowns: usize,
    /// Memory of the factor, MiB.
    pub factor_mib: f64,
    /// Processor time of mesh and symbolic factorization, s.
    pub setup_s: f64,
    /// Processor time of the indentation, s.
    pub solve_s: f64,
    /// Stored states against the reference's.
    pub states: Vec<Comparison>,
    /// Checks that states did not pass, and why states are missing.
    pub faults: Vec<String>,
}

/// A study.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Mesh that the others are compared with.
    pub reference: &'static str,
    /// Stored states of each case.
    pub states: usize,
    /// A row a case and mesh.
    pub rows: Vec<Row>,
}

impl Report {
    pub(super) fn new(meshes: &[MeshChoice], states: usize) -> Self {
        Self { reference: meshes.last().map_or("", |m| m.name), states, rows: Vec::new() }
    }

    /// Takes a case's solutions, one a mesh, the reference's last.
    pub(super) fn add(&mut self, case: &Case, solutions: &[(MeshChoice, Solution)]) {
        let Some((_, reference)) = solutions.last() else { return };
        for (mesh, found) in solutions {
            let states = found.record.depth_mm.len().min(reference.record.depth_mm.len());
            let compare = |k: usize| {
                let sed = difference(&found.sed_j_per_m3[k], &reference.sed_j_per_m3[k]);
                let pressure = difference(&found.pressure_pa[k], &reference.pressure_pa[k]);
                Comparison {
                    depth_mm: found.record.depth_mm[k],
                    sed_l2: sed.0,
                    sed_peak: sed.1,
                    pressure_l2: pressure.0,
                    force: found.record.force_n[k] / reference.record.force_n[k] - 1.0,
                }
            };
            let faults = found.record.faults.iter().flatten().chain(&found.record.error);
            self.rows.push(Row {
                case: case.name,
                mesh: mesh.name,
                unknowns: found.record.unknowns,
                factor_mib: (FACTOR_BYTES * found.record.factor_entries) as f64 / 1_048_576.0,
                setup_s: found.record.setup_s,
                solve_s: found.record.solve_s,
                states: (0..states).map(compare).collect(),
                faults: faults.cloned().collect(),
            });
        }
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), ConvergenceError> {
        papilla_output::atomic::write_json(&folder.join("convergence.json"), self)?;
        let mut series: Vec<Series> = Vec::new();
        for row in self.rows.iter().filter(|r| r.mesh != self.reference) {
            let Some(last) = row.states.last() else { continue };
            let point = (row.solve_s / self.states as f64, 100.0 * last.sed_l2);
            match series.iter_mut().find(|s| s.name == row.mesh) {
                Some(s) => s.points.push(point),
                None => series.push(Series {
                    name: row.mesh.into(),
                    points: vec![point],
                    mark: Mark::Dots,
                }),
            }
        }
        let chart = Chart {
            title: format!("SED at the interface against {}", self.reference),
            x: Axis::log("processor time of a state, s"),
            y: Axis::log("relative L2 of SED at the deepest state, %"),
            series,
        };
        Ok(write_svg(&folder.join("convergence.svg"), &chart)?)
    }

    /// A table for people.
    #[must_use]
    pub fn human(&self) -> String {
        let mut text = format!(
            "against {}; the deepest state, and the worst of {}\n{:9} {:17} {:>8} {:>7} {:>8} \
             {:>15} {:>7} {:>15} {:>7}\n",
            self.reference,
            self.states,
            "case",
            "mesh",
            "unknowns",
            "MiB",
            "s",
            "SED %",
            "peak %",
            "pressure %",
            "force %"
        );
        for row in &self.rows {
            let worst = |pick: fn(&Comparison) -> f64| {
                100.0 * row.states.iter().map(pick).fold(0.0, f64::max)
            };
            let last = row.states.last();
            let at = |pick: fn(&Comparison) -> f64| last.map_or(f64::NAN, |c| 100.0 * pick(c));
            let _ = writeln!(
                text,
                "{:9} {:17} {:8} {:7.0} {:8.1} {:7.2} {:7.2} {:7.2} {:7.2} {:7.2} {:7.2}{}",
                row.case,
                row.mesh,
                row.unknowns,
                row.factor_mib,
                row.solve_s,
                at(|c| c.sed_l2),
                worst(|c| c.sed_l2),
                at(|c| c.sed_peak),
                at(|c| c.pressure_l2),
                worst(|c| c.pressure_l2),
                at(|c| c.force),
                if row.faults.is_empty() { String::new() } else { format!("  {}", row.faults[0]) }
            );
        }
        text
    }
}

/// Relative L2 difference, and that of the greatest values, over the points that both have.
fn difference(found: &[f32], reference: &[f32]) -> (f64, f64) {
    let both = || {
        found
            .iter()
            .zip(reference)
            .filter(|(f, r)| !f.is_nan() && !r.is_nan())
            .map(|(f, r)| (f64::from(*f), f64::from(*r)))
    };
    let square: f64 = both().map(|(_, r)| r * r).sum();
    let miss: f64 = both().map(|(f, r)| (f - r).powi(2)).sum();
    let greatest = both().fold((0.0f64, 0.0f64), |m, (f, r)| (m.0.max(f), m.1.max(r)));
    ((miss / square).sqrt(), greatest.0 / greatest.1 - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_leave_out_what_one_mesh_does_not_show() {
        let (l2, peak) = difference(&[1.0, f32::NAN, 2.2, 0.0], &[1.0, 7.0, 2.0, f32::NAN]);
        assert!((l2 - (0.04f64 / 5.0).sqrt()).abs() < 1e-7, "{l2}");
        assert!((peak - 0.1).abs() < 1e-7, "{peak}");
    }
}
