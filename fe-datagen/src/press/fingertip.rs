//! The fingertip pressed by a rigid plate: set-up, pose, and vertex values.

use super::record::{Checks, IncrementRecord, Pose};
use crate::element::Inverted;
use crate::geometry::fingertip::{FingertipShape, FingertipShapeError};
use crate::indenter::{Placement, RoundedPlate};
use crate::material::{ElasticConstants, Material, MaterialError};
use crate::mesh::fingertip::{Density, Order, Patch, build};
use crate::mesh::recovery::{NoElement, SedRecovery};
use crate::mesh::surface::norm;
use crate::mesh::{Mesh, Tissue};
use crate::solve::{
    Effort, Loading, MovingIndenter, Options, Problem, ProblemError, SolveError, Solver, StepReport,
};
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

/// A plate and how far it goes.
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

/// Why a fingertip could not be set up or pressed.
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

/// A fingertip ready to be pressed, shared by every press of a campaign.
pub struct Fingertip {
    /// The body: bone, nail plate and the base's axial displacement held.
    pub problem: Problem,
    /// Patch that the atlas shows.
    pub patch: Patch,
    dermis: SedRecovery,
    epidermis: SedRecovery,
}

impl Fingertip {
    /// Meshes and sets up a fingertip.
    ///
    /// # Errors
    /// See [`PressError`].
    pub fn new(
        shape: &FingertipShape,
        constants: &TissueConstants,
        density: Density,
        order: Order,
    ) -> Result<Self, PressError> {
        let finger = build(shape, density, order)?;
        let mut fixed = vec![false; 3 * finger.mesh.nodes.len()];
        for &n in finger.mesh.node_sets["bone"].iter().chain(&finger.mesh.node_sets["nail"]) {
            fixed[3 * n as usize..3 * n as usize + 3].fill(true);
        }
        for &n in &finger.mesh.node_sets["base"] {
            fixed[3 * n as usize] = true;
        }
        let material = |tissue: Tissue, c: ElasticConstants| {
            Material::neo_hookean(c)
                .map_err(|source| PressError::Material { tissue: tissue.name(), source })
        };
        let epidermis = material(Tissue::Epidermis, constants.epidermis)?;
        let dermis = material(Tissue::Dermis, constants.dermis)?;
        let fat = material(Tissue::Subcutaneous, constants.subcutaneous)?;
        // Nail and bone are rigid: no element is made of them.
        let materials = [epidermis, dermis, fat, fat, fat];
        let interface = &finger.patch.interface;
        let dermis_side = SedRecovery::new(&finger.mesh, "interface", Tissue::Dermis, interface)?;
        let epidermis_side =
            SedRecovery::new(&finger.mesh, "interface", Tissue::Epidermis, interface)?;
        let problem = Problem::new(finger.mesh, materials, fixed, Some("skin"))?;
        Ok(Self { problem, patch: finger.patch, dermis: dermis_side, epidermis: epidermis_side })
    }

    /// Undeformed positions of the patch's skin and interface vertices, mm.
    #[must_use]
    pub fn patch_positions(&self) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let at =
            |nodes: &[u32]| nodes.iter().map(|&n| self.problem.mesh.nodes[n as usize]).collect();
        (at(&self.patch.skin), at(&self.patch.interface))
    }

    /// The plate at first touch in `pose`, set to go `depth_mm` along its normal.
    ///
    /// The plate's centre starts at the skin point that it touches first.
    #[must_use]
    pub fn plate(&self, pose: Pose, plate: PlateSpec, depth_mm: f64) -> MovingIndenter {
        let rotation = rotation(pose);
        let normal = [rotation[0][2], rotation[1][2], rotation[2][2]];
        let along = |p: &[f64; 3]| p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2];
        let first = first_touch(&self.problem.mesh, along);
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
    /// equilibrium and its record.
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
        // Small steps first: the work integral starts where force does, and
        // force turns fast there.
        let first = depths_mm.first().copied().unwrap_or(0.0);
        let lead = [0.1, 0.25, 0.5, 0.75].map(|part| part * first / last);
        for (i, &depth_mm) in depths_mm.iter().enumerate() {
            let clock = Instant::now();
            let at = |source| PressError::Solve { depth_mm, source };
            let mut effort = Effort::default();
            let between = match i {
                0 => lead.to_vec(),
                1 => vec![0.5 * (first + depth_mm) / last],
                _ => Vec::new(),
            };
            for fraction in between {
                effort = effort.plus(&solver.advance_to(fraction).map_err(at)?.effort);
            }
            let mut report = solver.advance_to(depth_mm / last).map_err(at)?;
            report.effort = report.effort.plus(&effort);
            let mut record = self.record(solver, depth_mm, &report)?;
            record.seconds = clock.elapsed().as_secs_f64();
            visit(solver, &record, &report);
        }
        Ok(())
    }

    /// Vertex values and checks of the solver's equilibrium.
    fn record(
        &self,
        solver: &Solver<'_>,
        depth_mm: f64,
        report: &StepReport,
    ) -> Result<IncrementRecord, PressError> {
        let Problem { mesh, geometry, materials, .. } = &self.problem;
        let skin = &mesh.surfaces["skin"];
        let pressure = solver.pressure_mpa(skin);
        let integral = solver.integrate_pressure_n(skin, &pressure);
        let balance = solver.balance();
        let force = balance.contact_force_n;
        let size = norm(force).max(f64::MIN_POSITIVE);
        let difference =
            |a: [f64; 3], b: [f64; 3]| norm(std::array::from_fn(|i| a[i] - b[i])) / size;
        let work = solver.indenter_work_mj();
        let u = solver.displacement_mm();
        Ok(IncrementRecord {
            depth_mm,
            force_n: force,
            pressure_mpa: self.patch.skin.iter().map(|&n| pressure[n as usize]).collect(),
            sed_dermis_mpa: self.dermis.sed_mpa(mesh, geometry, materials, u)?,
            sed_epidermis_mpa: self.epidermis.sed_mpa(mesh, geometry, materials, u)?,
            checks: Checks {
                residual_relative: report.residual_relative,
                contact_force_vs_pressure_integral: difference(integral, force),
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

    /// A solver for this fingertip.
    ///
    /// # Errors
    /// [`PressError::Solve`] if the factor does not fit in memory.
    pub fn solver(&self, options: Options) -> Result<Solver<'_>, PressError> {
        Solver::new(&self.problem, options)
            .map_err(|source| PressError::Solve { depth_mm: 0.0, source })
    }
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

fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Skin point with the smallest `along`; where several tie (a flat plate on a
/// symmetric finger), their mean, so that a mirrored pose touches at the mirror
/// image.
fn first_touch(mesh: &Mesh, along: impl Fn(&[f64; 3]) -> f64) -> [f64; 3] {
    let nodes = mesh.surfaces["skin"].nodes();
    let points: Vec<_> = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
    let least = points.iter().map(&along).fold(f64::INFINITY, f64::min);
    let scale = points.iter().map(|p| norm(*p)).fold(0.0, f64::max);
    let touching: Vec<_> = points.iter().filter(|p| along(p) <= least + 1e-12 * scale).collect();
    let count = touching.len() as f64;
    std::array::from_fn(|i| touching.iter().map(|p| p[i]).sum::<f64>() / count)
}
