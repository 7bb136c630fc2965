//! How far SED at the interface and pressure are from what a finer mesh gives: the same
//! indentations of the solid finger on meshes that differ in spacing, layers and element, each read
//! at the same undeformed points.
//!
//! One solution is one file, so that a study goes on where it was stopped. No mesh shares a
//! node with another, and the first touch is that of the undeformed skin, not of a mesh.

mod cases;
mod error;
mod report;
mod solution;
mod target;

pub use cases::{CASES, Case};
pub use error::ConvergenceError;
pub use report::{Comparison, Report, Row};

use papilla_fingertip::mesh::named::MeshChoice;
use papilla_output::atomic;
use solution::Solution;
use std::path::Path;
use target::Target;

/// How far a study is: what is solved now, and solutions done of all.
pub type Progress<'a> = &'a mut dyn FnMut(&str, usize, usize);

/// Solves each case on each mesh, `states` stored states each, or goes on where an earlier
/// run was stopped, and compares every mesh with the last of `meshes`. Writes a file a
/// solution, `convergence.json` and `convergence.svg` into `folder`.
///
/// # Errors
/// [`ConvergenceError`]; a case that a mesh cannot solve is in the report instead.
pub fn run(
    cases: &[&Case],
    meshes: &[MeshChoice],
    states: usize,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<Report, ConvergenceError> {
    atomic::create_folder(folder)?;
    let all = cases.len() * meshes.len();
    let mut done = 0;
    let mut report = Report::new(meshes, states);
    for case in cases {
        let target = Target::new(case)?;
        let mut solutions = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            progress(&format!("{} on {}", case.name, mesh.name), done, all);
            let found = Solution::found_or_solved(case, *mesh, states, &target, folder)?;
            solutions.push((*mesh, found));
            done += 1;
        }
        report.add(case, &solutions);
        report.write(folder)?;
    }
    progress("done", done, all);
    Ok(report)
}
