//! Assembling, factorizing and solving for every vertex of the skin.

use super::strain::{StrainMap, Weighted};
use super::{COMPONENTS, Faces, InfluenceError, InfluenceOperator, Quality};
use crate::mesh::fingertip::Patch;
use crate::simulation::body::{Body, RecordedPatch};
use papilla_atlas::Atlas;
use papilla_fem::linear::{Direct, DofMap, SymbolicSystem, SymmetricMatrix};
use papilla_fem::mesh::Surface;
use papilla_fem::solve::evaluate::{Evaluation, Trial, evaluate_body};
use papilla_fem::solve::{Loading, Problem};
use papilla_vector::norm;

/// Right-hand sides solved at a time: the factor is read once for all of them.
const COLUMNS: usize = 48;
/// Largest `|f - K u| / |f|` accepted.
const RESIDUAL_MAX: f64 = 1e-8;
/// sqrt(J/m3) per Pa in sqrt(MPa) per MPa: `sqrt(1e6) / 1e6`.
const SQRT_J_PER_M3_PER_PA: f64 = 1e-3;

/// A skin vertex under unit pressure.
#[derive(Clone, Copy)]
pub(super) struct Load {
    pub node: u32,
    pub area_mm2: f64,
    /// Force of 1 MPa, N.
    pub force_n: [f64; 3],
}

/// Builds the influence operator of `body`; `progress` is told how many vertices are done.
///
/// The load of unit pressure at a vertex is its area times the skin's inward normal there,
/// on the node alone: contact is at nodes, and what an indentation records at a vertex is
/// the node's force over its area.
///
/// # Errors
/// [`InfluenceError`] for a body that is no fingertip of small strain, or whose systems
/// could not be solved.
pub fn build(
    body: &Body,
    progress: &mut dyn FnMut(usize),
) -> Result<InfluenceOperator, InfluenceError> {
    let (problem, (patch, atlas)) = (&body.problem, small_strain_patch(body)?);
    let loads = loads(problem, &problem.mesh.surfaces[&body.contact], &patch.skin);
    let strain = StrainMap::new(problem, &patch.interface)?;
    let tangent = tangent_at_rest(problem)?;
    let mut solved = Columns::new(problem, &tangent, &loads)?;
    let vertices = loads.len();
    let mut g = vec![0f32; vertices * COMPONENTS * vertices];
    let mut of_faces = vec![0f32; strain.samples() * COMPONENTS * vertices];
    for first in (0..vertices).step_by(COLUMNS) {
        let last = (first + COLUMNS).min(vertices);
        for (j, u) in (first..last).zip(solved.solve(first..last)) {
            let at = |node: u32| displacement(&problem.system, u, node);
            let faces = strain.apply(at);
            put(&mut g, &strain.average(&faces), j, vertices);
            put(&mut of_faces, &faces, j, vertices);
        }
        progress(last);
    }
    let quality = solved.quality()?;
    let area_mm2 = loads.iter().map(|l| l.area_mm2).collect();
    let faces = Faces { g: of_faces, of_vertex: strain.terms().to_vec() };
    Ok(InfluenceOperator { atlas_hash: atlas.hash().to_owned(), g, faces, area_mm2, quality })
}

/// What is read off a fingertip of small strain, and its atlas.
pub(super) fn small_strain_patch(body: &Body) -> Result<(&Patch, Atlas), InfluenceError> {
    let Some(RecordedPatch { patch, .. }) = &body.patch else {
        return Err(InfluenceError::NoPatch);
    };
    if body.problem.materials.models().any(|m| m.is_finite_strain()) {
        return Err(InfluenceError::FiniteStrain);
    }
    let (atlas, _) = body.atlas().ok_or(InfluenceError::NoPatch)??;
    Ok((patch, atlas))
}

/// Puts strain under unit pressure at vertex `j` into its column.
fn put(g: &mut [f32], strain: &[Weighted], j: usize, vertices: usize) {
    let rows = g.chunks_exact_mut(vertices);
    for (row, value) in rows.zip(strain.as_flattened()) {
        row[j] = (SQRT_J_PER_M3_PER_PA * value) as f32;
    }
}

/// Loads of unit pressure at `nodes` of the surface.
pub(super) fn loads(problem: &Problem, surface: &Surface, nodes: &[u32]) -> Vec<Load> {
    let count = problem.mesh.nodes.len();
    let (mut area, mut vector) = (vec![0.0; count], vec![[0.0; 3]; count]);
    let rule = surface.kind.quadrature();
    surface.integrate(&rule, &|n| problem.mesh.nodes[n as usize], &mut |face, value, normal| {
        for (&n, v) in face.iter().zip(value) {
            area[n as usize] += v * norm(normal);
            for i in 0..3 {
                vector[n as usize][i] += v * normal[i];
            }
        }
    });
    let load = |&node: &u32| {
        let (area_mm2, v) = (area[node as usize], vector[node as usize]);
        Load { node, area_mm2, force_n: v.map(|x| -area_mm2 * x / norm(v)) }
    };
    nodes.iter().map(load).collect()
}

pub(super) fn tangent_at_rest(problem: &Problem) -> Result<SymmetricMatrix, InfluenceError> {
    let mut tangent = problem.system.zeros();
    let rest = vec![[0.0; 3]; problem.mesh.nodes.len()];
    let multipliers = vec![0.0; problem.contact.as_ref().map_or(0, |c| c.nodes().len())];
    let trial = Trial {
        u: &rest,
        independent: &[],
        multipliers_mpa: &multipliers,
        penalty: 1.0,
        load_fraction: 0.0,
        variables: Default::default(),
        friction: None,
        fluid: None,
    };
    let mut out = Evaluation::default();
    evaluate_body(problem, &Loading::default(), &trial, Some(&mut tangent), &mut out)?;
    Ok(tangent)
}

/// Displacement of a node of a solution over the unknowns.
fn displacement(system: &SymbolicSystem, u: &[f64], node: u32) -> [f64; 3] {
    std::array::from_fn(|i| match system.dofs.of_dof[3 * node as usize + i] {
        DofMap::FIXED => 0.0,
        e => u[e as usize],
    })
}

/// Solutions for all loads, block by block, and what checks them.
pub(super) struct Columns<'a> {
    system: &'a SymbolicSystem,
    tangent: &'a SymmetricMatrix,
    loads: &'a [Load],
    direct: Direct<'a>,
    right: Vec<f64>,
    solution: Vec<f64>,
    product: Vec<f64>,
    residual_relative: f64,
    /// Work of load `i` on the displacement of load `j`, mJ, `[j][i]`.
    work: Vec<f64>,
}

impl<'a> Columns<'a> {
    pub(super) fn new(
        problem: &'a Problem,
        tangent: &'a SymmetricMatrix,
        loads: &'a [Load],
    ) -> Result<Self, InfluenceError> {
        let system = &problem.system;
        let n = system.dofs.count;
        Ok(Self {
            system,
            tangent,
            loads,
            direct: Direct::new(system, tangent, COLUMNS)?,
            right: Vec::new(),
            solution: Vec::new(),
            product: vec![0.0; n],
            residual_relative: 0.0,
            work: Vec::with_capacity(loads.len() * loads.len()),
        })
    }

    /// Solutions for a range of loads.
    fn solve(&mut self, range: std::ops::Range<usize>) -> impl Iterator<Item = &[f64]> {
        let n = self.system.dofs.count;
        self.right.clear();
        self.right.resize(n * range.len(), 0.0);
        for (load, column) in self.loads[range].iter().zip(self.right.chunks_exact_mut(n)) {
            for i in 0..3 {
                let equation = self.system.dofs.of_dof[3 * load.node as usize + i];
                if equation != DofMap::FIXED {
                    column[equation as usize] = load.force_n[i];
                }
            }
        }
        self.solution.clear();
        self.solution.extend_from_slice(&self.right);
        self.direct.solve(&mut self.solution);
        for (f, u) in self.right.chunks_exact(n).zip(self.solution.chunks_exact(n)) {
            self.system.multiply(self.tangent, u, &mut self.product);
            let (mut miss, mut size) = (0.0, 0.0);
            for (f, p) in f.iter().zip(&self.product) {
                miss += (f - p).powi(2);
                size += f * f;
            }
            // A vertex that is held takes no load.
            let relative = if size > 0.0 { (miss / size).sqrt() } else { 0.0 };
            // NaN must not hide behind a maximum.
            if !(relative <= self.residual_relative) {
                self.residual_relative = relative;
            }
            self.work.extend(self.loads.iter().map(|load| {
                let d = displacement(self.system, u, load.node);
                (0..3).map(|i| d[i] * load.force_n[i]).sum::<f64>()
            }));
        }
        self.solution.chunks_exact(n)
    }

    /// Solves for all loads, keeping their work alone.
    pub(super) fn solve_all(&mut self, progress: &mut dyn FnMut(usize)) {
        for first in (0..self.loads.len()).step_by(COLUMNS) {
            let last = (first + COLUMNS).min(self.loads.len());
            let _ = self.solve(first..last);
            progress(last);
        }
    }

    /// Work of load `i` on the displacement of load `j`, mJ, `[j][i]`.
    pub(super) fn work_mj(&self) -> &[f64] {
        &self.work
    }

    pub(super) fn quality(&self) -> Result<Quality, InfluenceError> {
        let found = self.residual_relative;
        if !(found <= RESIDUAL_MAX) {
            return Err(InfluenceError::Residual { found, accepted: RESIDUAL_MAX });
        }
        let n = self.loads.len();
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for i in 0..n {
            for j in 0..i {
                worst = worst.max((self.work[i * n + j] - self.work[j * n + i]).abs());
            }
            largest = largest.max(self.work[i * n + i]);
        }
        Ok(Quality {
            unknowns: self.system.dofs.count,
            residual_relative: found,
            reciprocity_relative: worst / largest,
        })
    }
}
