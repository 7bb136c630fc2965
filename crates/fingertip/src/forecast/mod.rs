//! What a scene is going to cost, before it runs.
//!
//! Mesh, sparsity pattern and symbolic factorization are made (a second at the
//! campaigns' density); nothing is solved. Factor entries and operations are exact,
//! memory is the sum of the solver's arrays. Seconds are the product of
//! three things: how much iteration such an indentation takes ([`Work`]), how much one
//! iteration of this body takes (elements probed, the factor counted), and how fast
//! this machine is ([`Machine`]).

mod assembly;
mod census;
mod machine;
mod sed_error;
mod work;

pub use census::census;
pub use machine::Machine;
pub use sed_error::{SedError, better};
pub use work::Work;

use crate::scene::{Census, Scene};
use crate::simulation::Simulation;
use assembly::Pass;
use papilla_fem::linear::{FactorMemory, SaddleSolver};
use papilla_fem::solve::Problem;
use serde::Serialize;

/// What an indentation is going to cost.
#[derive(Clone, Debug, Serialize)]
pub struct Forecast {
    /// What is assembled and stored.
    pub census: Census,
    /// Entries of the factor.
    pub factor_entries: usize,
    /// Multiplications and additions of one factorization.
    pub factor_flops: f64,
    /// Memory of the process while it solves, bytes.
    pub memory_bytes: usize,
    /// HistoryVariables that one factorization of an indefinite tangent would add, bytes.
    pub memory_indefinite_bytes: usize,
    /// How much iteration the indentation takes.
    pub work: Work,
    /// Speed of this machine.
    pub machine: Machine,
    /// Predicted times on one core.
    pub seconds: Seconds,
}

/// Predicted times on one core, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Elements: forces and tangents.
    pub assembly: f64,
    /// Numeric factorizations.
    pub factorization: f64,
    /// Conjugate gradients.
    pub linear_solves: f64,
    /// Their sum.
    pub total: f64,
}

/// Share of the dense product's speed that the arithmetic of a sparse f32
/// factorization reaches, by least squares on nine meshes of 12 k to 72 k unknowns.
const FACTOR_EFFICIENCY: f64 = 0.75;
/// What the same factorizations move besides, bytes an entry of the factor.
const FACTOR_BYTES_PER_ENTRY: f64 = 180.0;
/// Share of the streaming speed that the triangular solves reach on those meshes.
const SOLVE_EFFICIENCY: f64 = 0.36;
/// Memory of the process without a scene, bytes.
const BASE_BYTES: usize = 8 << 20;

impl Forecast {
    /// Counts, probes and predicts.
    #[must_use]
    pub fn new(scene: &Scene, setup: &Simulation) -> Self {
        let problem = &setup.body.problem;
        let system = &problem.system;
        // Elements first: after the matrix product's wide registers the same code was
        // measured to run three times slower for a while.
        let pass = Pass::probe(problem);
        let (machine, work) = (Machine::here(), Work::new(setup));
        let fluid = problem.fluid.as_ref().map(|f| &f.system);
        // Forward and backward through the f32 factor, once through tangent and pattern; with fluid
        // twice through that of f64, one pass of refinement.
        let (entries, flops, cg_bytes) = match fluid {
            None => {
                let entries = system.factor_entries();
                (entries, system.factor_flops(), 8 * entries + 16 * system.row.len())
            }
            Some(s) => {
                let entries = s.factor_entries();
                (entries, s.factor_flops(), 32 * entries + 32 * s.entries())
            }
        };
        // A number of f64 takes twice the time and the room of one of f32.
        let width = if fluid.is_some() { 2.0 } else { 1.0 };
        let mut seconds = Seconds {
            assembly: work.newton_iterations * pass.tangent_s
                + work.force_evaluations * pass.forces_s,
            factorization: work.factorizations
                * width
                * (flops / (FACTOR_EFFICIENCY * machine.dense_flops_per_s)
                    + FACTOR_BYTES_PER_ENTRY * entries as f64 / machine.stream_bytes_per_s),
            linear_solves: work.cg_iterations * cg_bytes as f64
                / (SOLVE_EFFICIENCY * machine.stream_bytes_per_s),
            total: 0.0,
        };
        seconds.total = seconds.assembly + seconds.factorization + seconds.linear_solves;
        Self {
            census: census::census(scene, setup),
            factor_entries: entries,
            factor_flops: flops,
            memory_bytes: memory_bytes(problem),
            memory_indefinite_bytes: if fluid.is_some() { 0 } else { 8 * entries },
            work,
            machine,
            seconds,
        }
    }
}

/// Memory of the process while it solves, bytes.
fn memory_bytes(problem: &Problem) -> usize {
    let (mesh, system) = (&problem.mesh, &problem.system);
    let elements: usize = mesh
        .blocks
        .iter()
        .zip(&problem.geometry)
        .map(|(block, geometry)| {
            let (nodes, points) = (block.kind.nodes(), geometry.points);
            let modes = block.kind.dilatation_functions();
            let one = 24 * nodes * points + 8 * (points + modes * modes) + 4 * nodes + 1;
            block.len() * one
        })
        .sum();
    // Displacement of three states and a trial, two residuals, a handful of vectors.
    let vectors = 24 * 4 * mesh.nodes.len() + 8 * 2 * 3 * mesh.nodes.len();
    let iteration = 8 * 8 * system.dofs.count;
    let history = 8 * 4 * problem.history_layout.as_ref().map_or(0, |m| m.len);
    BASE_BYTES
        + elements
        + vectors
        + iteration
        + history
        + system.bytes()
        + 8 * system.row.len()
        + problem.fluid.as_ref().map_or_else(
            || FactorMemory::bytes(system),
            |f| SaddleSolver::bytes(&f.system) + f.system.bytes() + 8 * f.system.entries(),
        )
}

#[cfg(test)]
mod tests;
