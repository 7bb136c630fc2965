//! A body pressed by a rigid plate: set-up, pose, and vertex values.

use super::record::{Checks, IncrementRecord, Pose};
use crate::atlas::{AtlasReport, BuildAtlasError, build_atlas};
use crate::element::Inverted;
use crate::geometry::fingertip::{FingertipShape, FingertipShapeError};
use crate::indenter::{Placement, RoundedPlate};
use crate::material::{ElasticConstants, Material, MaterialError};
use crate::mesh::fingertip::{Density, FingertipMesh, Order, Parts, Patch, build};
use crate::mesh::recovery::{NoElement, SedRecovery};
use crate::mesh::surface::norm;
use crate::mesh::{Mesh, Tissue};
use crate::solve::{
    Effort, Loading, MovingIndenter, Options, Problem, ProblemError, SolveError, Solver, StepReport,
};
use papilla_proto::atlas::Atlas;
use std::sync::Arc;
use std::time::Instant;

/// Elastic constants of the soft tissues.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TissueConstants {
    /// Epidermis (Chen, Shuai & Zhu).
    pub epidermis: ElasticConstants,
    /// Dermis (Maeno 1998).
    pub dermis: ElasticConstants,
    /// Subcutaneous tissue (Maeno 1998).
    pub subcutaneous: ElasticConstants,
}

impl Default for TissueConstants {
    fn default() -> Self {
        let c = |youngs_modulus_mpa| ElasticConstants { youngs_modulus_mpa, poissons_ratio: 0.48 };
        Self { epidermis: c(0.136), dermis: c(0.080), subcutaneous: c(0.034) }
    }
}

impl TissueConstants {
    /// Material of each tissue, by [`Tissue::index`]. Nail and bone are rigid:
    /// no element is made of them, their entry repeats the subcutaneous one.
    fn materials(&self) -> Result<[Material; Tissue::ALL.len()], PressError> {
        let material = |tissue: Tissue, c| {
            Material::neo_hookean(c)
                .map_err(|source| PressError::Material { tissue: tissue.name(), source })
        };
        let fat = material(Tissue::Subcutaneous, self.subcutaneous)?;
        let epidermis = material(Tissue::Epidermis, self.epidermis)?;
        let dermis = material(Tissue::Dermis, self.dermis)?;
        Ok([epidermis, dermis, fat, fat, fat])
    }
}

/// The rigid plate that presses.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlateSpec {
    /// Side lengths, mm.
    pub size_mm: [f64; 2],
    /// Radius of its edges, mm.
    pub edge_radius_mm: f64,
}

impl Default for PlateSpec {
    fn default() -> Self {
        Self { size_mm: [20.0, 20.0], edge_radius_mm: 1.0 }
    }
}

/// Why a body could not be set up or pressed.
#[derive(Debug, thiserror::Error)]
pub enum PressError {
    /// The shape contradicts itself.
    #[error(transparent)]
    Shape(#[from] FingertipShapeError),
    /// A material is out of range.
    #[error("materials.{tissue}: {source}")]
    Material {
        /// Tissue.
        tissue: &'static str,
        /// What is wrong.
        source: MaterialError,
    },
    /// The problem could not be set up.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The interface has no elements on one side.
    #[error(transparent)]
    Recovery(#[from] NoElement),
    /// No equilibrium.
    #[error("at depth {depth_mm} mm: {source}")]
    Solve {
        /// Depth aimed at.
        depth_mm: f64,
        /// Why.
        source: SolveError,
    },
    /// An element is inside out where SED is wanted.
    #[error(transparent)]
    Inverted(#[from] Inverted),
    /// Depths must be positive and increasing.
    #[error("depths_mm must be positive, finite and increasing; found {0} after {1}")]
    Depths(f64, f64),
}

/// A body ready to be pressed, shared by every press of a campaign.
pub struct Body {
    /// Mesh, materials, supports and contact surface.
    pub problem: Problem,
    /// Name of the surface that the indenter may touch.
    pub contact: String,
    /// The fingertip's atlas patch; other bodies have none.
    pub patch: Option<PressedPatch>,
}

/// What is read off a fingertip at each equilibrium.
pub struct PressedPatch {
    /// Vertices and triangles.
    pub patch: Patch,
    dermis: SedRecovery,
    epidermis: SedRecovery,
}

impl Body {
    /// Meshes a fingertip with its bone, its nail plate and the axial
    /// displacement of its base held.
    ///
    /// # Errors
    /// See [`PressError`].
    pub fn fingertip(
        shape: &FingertipShape,
        constants: &TissueConstants,
        density: Density,
        order: Order,
    ) -> Result<Self, PressError> {
        let FingertipMesh { mesh, patch } = build(shape, density, order, Parts::default())?;
        let mut fixed = vec![false; 3 * mesh.nodes.len()];
        for &n in mesh.node_sets["bone"].iter().chain(&mesh.node_sets["nail"]) {
            fixed[3 * n as usize..3 * n as usize + 3].fill(true);
        }
        for &n in &mesh.node_sets["base"] {
            fixed[3 * n as usize] = true;
        }
        let side = |tissue| SedRecovery::new(&mesh, "interface", tissue, &patch.interface);
        let (dermis, epidermis) = (side(Tissue::Dermis)?, side(Tissue::Epidermis)?);
        let problem = Problem::new(mesh, constants.materials()?, fixed, Some("skin"))?;
        let patch = Some(PressedPatch { patch, dermis, epidermis });
        Ok(Self { problem, contact: "skin".into(), patch })
    }

    /// Any mesh, held on the surfaces or node sets `held` and touched on the
    /// surface `contact`.
    ///
    /// # Errors
    /// [`PressError::Problem`] names a surface that the mesh lacks.
    pub fn from_mesh(
        mesh: Mesh,
        constants: &TissueConstants,
        held: &[String],
        contact: &str,
    ) -> Result<Self, PressError> {
        let mut fixed = vec![false; 3 * mesh.nodes.len()];
        for name in held {
            let nodes = mesh.node_sets.get(name).ok_or_else(|| ProblemError::Missing {
                kind: "node set",
                name: name.clone(),
                known: mesh.node_sets.keys().cloned().collect::<Vec<_>>().join(", "),
            })?;
            for &n in nodes {
                fixed[3 * n as usize..3 * n as usize + 3].fill(true);
            }
        }
        let problem = Problem::new(mesh, constants.materials()?, fixed, Some(contact))?;
        Ok(Self { problem, contact: contact.into(), patch: None })
    }

    /// The atlas of the body's patch; `None` for a body without one.
    ///
    /// # Errors
    /// [`BuildAtlasError`] if the patch cannot be flattened.
    pub fn atlas(&self) -> Option<Result<(Atlas, AtlasReport), BuildAtlasError>> {
        let patch = &self.patch.as_ref()?.patch;
        let at = |nodes: &[u32]| -> Vec<[f64; 3]> {
            nodes.iter().map(|&n| self.problem.mesh.nodes[n as usize]).collect()
        };
        Some(build_atlas(&at(&patch.skin), &at(&patch.interface), &patch.triangles))
    }

    /// The plate at first touch in `pose`, set to go `depth_mm` along its normal.
    ///
    /// The plate's centre starts at the skin point that it touches first.
    #[must_use]
    pub fn plate(&self, pose: Pose, plate: PlateSpec, depth_mm: f64) -> MovingIndenter {
        let rotation = rotation(pose);
        let normal = [rotation[0][2], rotation[1][2], rotation[2][2]];
        let along = |p: &[f64; 3]| p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2];
        let first = first_touch(&self.problem.mesh, &self.contact, along);
        let half = [0.5 * plate.size_mm[0], 0.5 * plate.size_mm[1], 2.0 + plate.edge_radius_mm];
        MovingIndenter {
            shape: Arc::new(RoundedPlate { half_mm: half, edge_radius_mm: plate.edge_radius_mm }),
            start: Placement {
                rotation,
                origin_mm: std::array::from_fn(|i| first[i] - half[2] * normal[i]),
            },
            travel_mm: normal.map(|v| v * depth_mm),
        }
    }

    /// Presses to each depth in turn and calls `visit` with the solver at each
    /// equilibrium and its record. There are more equilibria than depths, for
    /// the work integral; `refinement` 2 halves their distance, and so on. The
    /// stored states do not depend on it.
    ///
    /// # Errors
    /// [`PressError::Solve`] names the depth that found no equilibrium; records
    /// up to it have been visited.
    pub fn press(
        &self,
        solver: &mut Solver<'_>,
        pose: Pose,
        plate: PlateSpec,
        depths_mm: &[f64],
        refinement: u32,
        visit: &mut dyn FnMut(&Solver<'_>, &IncrementRecord, &StepReport),
    ) -> Result<(), PressError> {
        let mut last = 0.0;
        for &d in depths_mm {
            if !(d.is_finite() && d > last) {
                return Err(PressError::Depths(d, last));
            }
            last = d;
        }
        let indenter = self.plate(pose, plate, last);
        solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
        for (i, &depth_mm) in depths_mm.iter().enumerate() {
            let clock = Instant::now();
            let at = |source| PressError::Solve { depth_mm, source };
            let mut effort = Effort::default();
            for between in path_mm(depths_mm, i, refinement) {
                effort = effort.plus(&solver.advance_to(between / last).map_err(at)?.effort);
            }
            let mut report = solver.advance_to(depth_mm / last).map_err(at)?;
            report.effort = report.effort.plus(&effort);
            let mut record = self.record(solver, depth_mm, &report)?;
            record.seconds = clock.elapsed().as_secs_f64();
            visit(solver, &record, &report);
        }
        Ok(())
    }

    /// Integral of the true pressure over the deformed skin, N (a scalar: on a
    /// plate all of it acts along one normal). Taken as a reader of the maps
    /// would: linear on the triangles of the atlas patch, so that contact outside
    /// the patch shows; on the contact surface where there is no patch.
    fn pressure_integral_n(&self, solver: &Solver<'_>, pressure_mpa: &[f64]) -> f64 {
        let Some(PressedPatch { patch, .. }) = &self.patch else {
            let surface = &self.problem.mesh.surfaces[&self.contact];
            return solver.integrate_pressure_n(surface, pressure_mpa);
        };
        let x = solver.deformed();
        let mut total = 0.0;
        for t in &patch.triangles {
            let n = t.map(|v| patch.skin[v as usize] as usize);
            let edge = |k: usize| -> [f64; 3] { std::array::from_fn(|i| x[n[k]][i] - x[n[0]][i]) };
            let area = 0.5 * norm(cross(edge(1), edge(2)));
            total += area * n.iter().map(|&k| pressure_mpa[k]).sum::<f64>() / 3.0;
        }
        total
    }

    /// Vertex values and checks of the solver's equilibrium.
    fn record(
        &self,
        solver: &Solver<'_>,
        depth_mm: f64,
        report: &StepReport,
    ) -> Result<IncrementRecord, PressError> {
        let Problem { mesh, geometry, materials, .. } = &self.problem;
        let skin = &mesh.surfaces[&self.contact];
        let pressure = solver.pressure_mpa(skin);
        let integral = self.pressure_integral_n(solver, &pressure);
        let balance = solver.balance();
        let force = balance.contact_force_n;
        let size = norm(force).max(f64::MIN_POSITIVE);
        let difference =
            |a: [f64; 3], b: [f64; 3]| norm(std::array::from_fn(|i| a[i] - b[i])) / size;
        let work = solver.indenter_work_mj();
        let u = solver.displacement_mm();
        let (mut pressure_mpa, mut sed_dermis_mpa, mut sed_epidermis_mpa) = Default::default();
        if let Some(p) = &self.patch {
            pressure_mpa = p.patch.skin.iter().map(|&n| pressure[n as usize]).collect();
            sed_dermis_mpa = p.dermis.sed_mpa(mesh, geometry, materials, u)?;
            sed_epidermis_mpa = p.epidermis.sed_mpa(mesh, geometry, materials, u)?;
        }
        Ok(IncrementRecord {
            depth_mm,
            force_n: force,
            pressure_mpa,
            sed_dermis_mpa,
            sed_epidermis_mpa,
            checks: Checks {
                residual_relative: report.residual_relative,
                contact_force_vs_pressure_integral: (integral - norm(force)).abs() / size,
                plate_vs_support_reaction: difference(balance.support_force_n.map(|v| -v), force),
                energy_vs_work: (report.stored_mj - work).abs() / work.abs().max(f64::MIN_POSITIVE),
                j_min: report.j_min,
                penetration_mm_max: report.gap_error_mm,
                newton_iterations: report.effort.newton_iterations,
                step_cuts: report.effort.cuts,
                augmentations: report.effort.augmentations,
                factorizations: report.effort.factorizations,
                cg_iterations: report.effort.cg_iterations,
            },
            seconds: 0.0,
        })
    }

    /// A solver for this body.
    ///
    /// # Errors
    /// [`PressError::Solve`] if the factor does not fit in memory.
    pub fn solver(&self, options: Options) -> Result<Solver<'_>, PressError> {
        Solver::new(&self.problem, options)
            .map_err(|source| PressError::Solve { depth_mm: 0.0, source })
    }
}

/// Depths between stored depth `i` and the one before it at which to find
/// equilibrium too, mm. Force turns fast after first touch, and with it the
/// work integral.
fn path_mm(depths_mm: &[f64], i: usize, refinement: u32) -> Vec<f64> {
    let to = depths_mm[i];
    let from = if i == 0 { 0.0 } else { depths_mm[i - 1] };
    let coarse: &[f64] = match i {
        0 => &[0.0, 0.1, 0.25, 0.5, 0.75, 1.0],
        1 => &[0.0, 0.5, 1.0],
        _ => &[0.0, 1.0],
    };
    let at = |part: f64| from + part * (to - from);
    let mut path = Vec::new();
    for pair in coarse.windows(2) {
        for k in 1..=refinement {
            path.push(at(pair[0] + (pair[1] - pair[0]) * f64::from(k) / f64::from(refinement)));
        }
    }
    path.pop();
    path
}

/// Rotation of a plate: at rest its pressing face looks along +z into the pad;
/// yaw about its normal, then pitch about y (tip first is positive), then roll
/// about x.
#[must_use]
pub fn rotation(pose: Pose) -> [[f64; 3]; 3] {
    let (sp, cp) = pose.pitch_deg.to_radians().sin_cos();
    let (sr, cr) = pose.roll_deg.to_radians().sin_cos();
    let (sy, cy) = pose.yaw_deg.to_radians().sin_cos();
    let pitch = [[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]];
    let roll = [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]];
    let yaw = [[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]];
    product(&roll, &product(&pitch, &yaw))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Skin point with the smallest `along`; where several tie (a flat plate on a
/// symmetric finger), their mean, so that a mirrored pose touches at the mirror
/// image.
fn first_touch(mesh: &Mesh, contact: &str, along: impl Fn(&[f64; 3]) -> f64) -> [f64; 3] {
    let nodes = mesh.surfaces[contact].nodes();
    let points: Vec<_> = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
    let least = points.iter().map(&along).fold(f64::INFINITY, f64::min);
    let scale = points.iter().map(|p| norm(*p)).fold(0.0, f64::max);
    let touching: Vec<_> = points.iter().filter(|p| along(p) <= least + 1e-12 * scale).collect();
    let count = touching.len() as f64;
    std::array::from_fn(|i| touching.iter().map(|p| p[i]).sum::<f64>() / count)
}
