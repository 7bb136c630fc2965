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

use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_output::atomic;
use solution::Solution;
use std::path::Path;
use target::Target;

/// One mesh of the finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshChoice {
    /// Its name on the command line.
    pub name: &'static str,
    /// Density.
    pub density: Density,
    /// Elements and layout.
    pub order: Order,
    /// What it is.
    pub about: &'static str,
}

/// Every mesh, from cheap to dear within a layout; the last is the reference.
pub const MESHES: [MeshChoice; 7] = [
    MeshChoice {
        name: "medium-linear",
        density: Density::Medium,
        order: Order::Linear,
        about: "even lattice, Hex8",
    },
    MeshChoice {
        name: "medium-quadratic",
        density: Density::Medium,
        order: Order::Quadratic,
        about: "even lattice, Hex27",
    },
    MeshChoice {
        name: "fine-linear",
        density: Density::Fine,
        order: Order::Linear,
        about: "even lattice, Hex8",
    },
    MeshChoice {
        name: "fine-quadratic",
        density: Density::Fine,
        order: Order::Quadratic,
        about: "even lattice, Hex27",
    },
    MeshChoice {
        name: "coarse-graded",
        density: Density::Coarse,
        order: Order::Graded,
        about: "cells split under the indenter, graded layers, Hex27",
    },
    MeshChoice {
        name: "medium-graded",
        density: Density::Medium,
        order: Order::Graded,
        about: "the same, nodes .14 mm apart under a radius of 1 mm: the teacher",
    },
    MeshChoice {
        name: "fine-graded",
        density: Density::Fine,
        order: Order::Graded,
        about: "the same, .075 mm apart, more layers: the reference",
    },
];

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
