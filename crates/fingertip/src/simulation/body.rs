//! A body that is pressed, by an indenter or by a given pressure: its set-up, and the record of an
//! equilibrium.

use super::record::IncrementRecord;
use crate::geometry::fingertip::FingertipShapeError;
use crate::indenter::IndenterError;
use crate::mesh::Transfer;
use crate::mesh::fingertip::{Patch, Vertices};
use crate::mesh::grading::Contact;
use crate::mesh::section::SectionMeshError;
use crate::scene::cure::material_field;
use crate::scene::error::indenter_field;
use crate::scene::{Located, Pose, Scene, SceneError, TissueError};
use crate::tissue::{NoTissue, Tissue};
use papilla_atlas::Atlas;
use papilla_atlas::flatten::{AtlasReport, BuildAtlasError, build_atlas};
use papilla_dataset::Checks;
use papilla_fem::element::Inverted;
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::recovery::SedRecovery;
use papilla_fem::mesh::sample::Deformed;
use papilla_fem::solve::{
    Materials, Options, Problem, ProblemError, SnapshotError, SolveError, Solver, StepReport,
    SurfacePressure, SurfacePressureError,
};
use papilla_sdf::Placement;
use papilla_solid::tensor::product;
use papilla_vector::{minus, norm};
use std::path::PathBuf;
use std::sync::Arc;

/// Why a body could not be set up or pressed.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The shape contradicts itself.
    #[error(transparent)]
    Shape(#[from] FingertipShapeError),
    /// The problem could not be set up.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The interface has no elements on one side.
    #[error(transparent)]
    Recovery(#[from] NoTissue),
    /// The scene contradicts itself.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A material is out of range.
    #[error(transparent)]
    Material(#[from] TissueError),
    /// The mesh file is bad.
    #[error(transparent)]
    Mesh(#[from] papilla_fem::mesh::gmsh::GmshError),
    /// The section was not meshed.
    #[error(transparent)]
    Section(#[from] SectionMeshError),
    /// A mesh file and the effects disagree about the plane.
    #[error(
        "{} {}", file.display(),
        if *planar { "is a plane section: name the effect 'plane_strain'" }
        else { "is a solid: leave out the effect 'plane_strain'" }
    )]
    Plane {
        /// The mesh file.
        file: PathBuf,
        /// Whether its elements are planar.
        planar: bool,
    },
    /// No equilibrium.
    #[error("at depth {depth_mm} mm: {source}")]
    Solve {
        /// Depth aimed at.
        depth_mm: f64,
        /// Why.
        source: SolveError,
    },
    /// No equilibrium under a given pressure.
    #[error("at {share:.3} of the pressure: {source}")]
    Share {
        /// Share aimed at.
        share: f64,
        /// Why.
        source: SolveError,
    },
    /// Pressure cannot act on the skin.
    #[error(transparent)]
    Pressure(SurfacePressureError),
    /// The skin cannot be flattened, so that no map has a place on it.
    #[error(transparent)]
    Atlas(BuildAtlasError),
    /// Nodes slipped off an edge of the indenter.
    #[error(
        "at depth {depth_mm} mm: {:.0} % of the contact force acts along the skin, not into it: nodes \
         {spacing_mm:.2} mm apart have slipped off an edge of the indenter, which now stands between \
         them, unseen. Take a finer mesh, or rounder edges", 100.0 * share
    )]
    Slipped {
        /// Depth of the state.
        depth_mm: f64,
        /// Share of the contact force along the skin.
        share: f64,
        /// Mean distance of the nodes in contact, mm.
        spacing_mm: f64,
    },
    /// An element is inside out where SED is wanted.
    #[error(transparent)]
    Inverted(#[from] Inverted),
    /// Depths, forces and times must be positive and rising.
    #[error("depths, forces and times must be positive, finite and rising; found {0} after {1}")]
    Rising(f64, f64),
    /// Nothing was stored.
    #[error("the motion has no state to store")]
    Empty,
    /// A prescribed force was not reached.
    #[error("the force of {wanted_n} N was not reached: {reached_n:.4} N after 6 mm or 60 tries")]
    Force {
        /// Force asked for, N.
        wanted_n: f64,
        /// Largest force below it, N.
        reached_n: f64,
    },
    /// Whoever watches the indentation wants no more of it now.
    #[error("stopped from outside, to be gone on with from its last stored state")]
    Halted,
    /// The indentation cannot go on from what was stored of it.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The indenter does not meet the body.
    #[error(transparent)]
    Indenter(#[from] IndenterError),
    /// Any of these, at the line of the scene that is to blame.
    #[error(transparent)]
    Located(Box<Located<Self>>),
}

impl SimulationError {
    /// The field of a scene that is to blame, dotted.
    #[must_use]
    pub fn field(&self) -> Option<String> {
        match self {
            Self::Shape(e) => Some(e.field()),
            Self::Scene(e) => e.field(),
            Self::Material(e) => Some(material_field(e)),
            Self::Indenter(e) => Some(indenter_field(e)),
            Self::Problem(ProblemError::Missing { kind: "node set", .. }) => {
                Some("geometry.fixed".into())
            }
            Self::Problem(ProblemError::Missing { .. } | ProblemError::ContactFaces { .. }) => {
                Some("geometry.contact".into())
            }
            Self::Problem(ProblemError::Tension(_)) => {
                Some("materials.skin_tension_n_per_mm".into())
            }
            Self::Mesh(_) => Some("geometry.file".into()),
            Self::Problem(_) | Self::Recovery(_) => Some("geometry".into()),
            Self::Slipped { .. } => Some("indenter".into()),
            Self::Rising(..) | Self::Empty => Some("motion".into()),
            Self::Solve { source: SolveError::RigidBodyMode(_), .. } => {
                Some("geometry.fixed".into())
            }
            Self::Located(e) => e.error.field(),
            _ => None,
        }
    }

    /// Why there is no equilibrium at a depth.
    pub(super) fn at_depth(depth_mm: f64, source: SolveError) -> Self {
        match source {
            SolveError::Stopped { .. } => Self::Halted,
            source => Self::Solve { depth_mm, source },
        }
    }

    /// The same with the line of `scene` that is to blame, if there is one.
    pub(super) fn at(self, scene: &Scene) -> Self {
        match self.field().and_then(|f| scene.place(&f)) {
            Some(place) => Self::Located(Box::new(Located { place, error: self })),
            None => self,
        }
    }
}

/// Pressure that acts on a body.
pub struct Under {
    /// As the solver takes it.
    pub pressure: Arc<SurfacePressure>,
    /// The whole of it at each node of the mesh, MPa.
    pub nodal_mpa: Vec<f64>,
    /// Whether any of it is on the skin.
    pub presses: bool,
}

/// A body ready to be pressed, shared by every indentation of a campaign.
pub struct Body {
    /// Mesh, materials, supports and contact surface.
    pub problem: Problem,
    /// Name of the surface that the indenter may touch.
    pub contact: String,
    /// The fingertip's atlas patch or the section's line; other bodies have none.
    pub patch: Option<RecordedPatch>,
    /// Whether the body is a plane section in x and y.
    pub plane: bool,
    /// Where the indenter first touches the undeformed finger, whatever the mesh; where none is given
    /// it is where it first touches the mesh.
    pub first_touch: Option<Contact>,
    /// Whether its cells are split under that contact.
    pub graded: bool,
    /// The pressure that acts in place of an indenter.
    pub under: Option<Under>,
    /// On which the way to each state is found first, if there is one.
    pub(super) guide: Option<Box<Guide>>,
}

/// A coarser mesh of a body, and its fields on that body's own.
pub(super) struct Guide {
    pub body: Body,
    pub transfer: Transfer,
}

/// What is read off a fingertip at each equilibrium.
pub struct RecordedPatch {
    /// Vertices and triangles; of a section the vertices along the skin and
    /// no triangles.
    pub patch: Patch,
    dermis: SedRecovery,
    epidermis: SedRecovery,
}

/// What the checks of an equilibrium compare, under an indenter or under a given pressure.
pub(super) struct Sides {
    /// Force of the pressure that is recorded, N.
    pub recorded_n: [f64; 3],
    /// Force that the solver says presses into the body, N.
    pub normal_n: [f64; 3],
    /// Work done on the body, and the greatest so far, mJ.
    pub work_mj: f64,
    pub work_mj_max: f64,
    /// Largest gap or overlap where there is contact, mm.
    pub gap_mm: f64,
}

impl Body {
    /// A body with layers, of which pressure and SED are read at vertices.
    pub(super) fn with_patch(
        mesh: Mesh,
        materials: Materials,
        fixed: Vec<bool>,
        patch: Patch,
        plane: bool,
    ) -> Result<Self, SimulationError> {
        let side = |tissue: Tissue| {
            SedRecovery::fitted(&mesh, "interface", tissue.region(), &patch.interface)
                .map_err(NoTissue::from)
        };
        let (dermis, epidermis) = (side(Tissue::Dermis)?, side(Tissue::Epidermis)?);
        let problem = Problem::new(mesh, materials, fixed, Some("skin"))?;
        let patch = Some(RecordedPatch { patch, dermis, epidermis });
        Ok(Self {
            problem,
            contact: "skin".into(),
            patch,
            plane,
            first_touch: None,
            graded: false,
            under: None,
            guide: None,
        })
    }

    /// Any mesh, held on the surfaces or node sets `held` and touched on the
    /// surface `contact`.
    ///
    /// # Errors
    /// [`SimulationError::Problem`] names a surface that the mesh lacks.
    pub fn from_mesh(
        mesh: Mesh,
        materials: Materials,
        held: &[String],
        contact: &str,
    ) -> Result<Self, SimulationError> {
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
        let plane = mesh.is_planar();
        let problem = Problem::new(mesh, materials, fixed, Some(contact))?;
        Ok(Self {
            problem,
            contact: contact.into(),
            patch: None,
            plane,
            first_touch: None,
            graded: false,
            under: None,
            guide: None,
        })
    }

    /// From now on records hold what is known at the nodes of the patch, not at the atlas' vertices;
    /// gives how vertices were read off them, if they are not nodes.
    pub fn read_at_nodes(&mut self) -> Option<Vertices> {
        self.patch.as_mut()?.patch.vertices.take()
    }

    /// Values of `nodes` as a field of all nodes of the mesh, NaN where none is given.
    #[must_use]
    pub fn at_nodes(&self, nodes: &[u32], values: &[f64]) -> Vec<f64> {
        let mut field = vec![f64::NAN; self.problem.mesh.nodes.len()];
        for (&node, value) in nodes.iter().zip(values) {
            field[node as usize] = *value;
        }
        field
    }

    /// The atlas of the body's patch; `None` for a body without one and for a section.
    ///
    /// # Errors
    /// [`BuildAtlasError`] if the patch cannot be flattened.
    pub fn atlas(&self) -> Option<Result<(Atlas, AtlasReport), BuildAtlasError>> {
        let patch = &self.patch.as_ref().filter(|_| !self.plane)?.patch;
        let (skin, interface) = patch.places_mm(&self.problem.mesh);
        Some(build_atlas(&skin, &interface, &patch.triangles))
    }

    /// Orientation of an indenter in `pose`: its own z axis is the direction in
    /// which it presses. A plane section is pressed in its plane, towards +y.
    #[must_use]
    pub fn rotation(&self, pose: Pose) -> [[f64; 3]; 3] {
        if self.plane {
            product(&[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]], &rotation(pose))
        } else {
            rotation(pose)
        }
    }

    /// Force of the pressure that is recorded, N: what the atlas patch does not
    /// show counts as none, so contact outside it shows in the balance.
    fn force_of_pressure_n(&self, solver: &Solver<'_>, pressure_mpa: &[f64]) -> [f64; 3] {
        let surface = &self.problem.mesh.surfaces[&self.contact];
        let Some(RecordedPatch { patch, .. }) = &self.patch else {
            return solver.force_of_pressure_n(surface, pressure_mpa);
        };
        let mut shown = vec![0.0; pressure_mpa.len()];
        for &n in &patch.skin {
            shown[n as usize] = pressure_mpa[n as usize];
        }
        solver.force_of_pressure_n(surface, &shown)
    }

    /// The body at the solver's equilibrium; `history` is the solver's
    /// [`Solver::history_of`].
    #[must_use]
    pub fn deformed<'a>(
        &'a self,
        solver: &'a Solver<'_>,
        history: &'a dyn Fn(usize, usize) -> &'a [f64],
    ) -> Deformed<'a> {
        Deformed {
            mesh: &self.problem.mesh,
            geometry: &self.problem.geometry,
            materials: &self.problem.materials,
            u: solver.displacement_mm(),
            history,
        }
    }

    /// Vertex values and checks of the solver's equilibrium.
    ///
    /// # Errors
    /// [`SimulationError::Slipped`] where the skin does not follow the indenter,
    /// [`SimulationError::Inverted`] where SED cannot be read.
    pub fn record(
        &self,
        solver: &Solver<'_>,
        depth_mm: f64,
        report: &StepReport,
    ) -> Result<IncrementRecord, SimulationError> {
        self.follows(solver, depth_mm)?;
        let skin = &self.problem.mesh.surfaces[&self.contact];
        let pressure = solver.pressure_mpa(skin);
        let values = self.at_vertices(solver, &pressure)?;
        let mut shear_mpa = Vec::new();
        if let Some(p) = &self.patch {
            shear_mpa = self.shear_mpa(solver, &p.patch.skin);
            if let (Some(vertices), false) = (&p.patch.vertices, shear_mpa.is_empty()) {
                shear_mpa = vertices.vector(&shear_mpa);
            }
        }
        let sides = Sides {
            recorded_n: self.force_of_pressure_n(solver, &pressure),
            normal_n: solver.balance().normal_force_n,
            work_mj: solver.indenter_work_mj(),
            work_mj_max: solver.indenter_work_mj_max(),
            gap_mm: report.gap_error_mm,
        };
        Ok(self.recorded(solver, report, depth_mm, values, shear_mpa, &sides))
    }

    /// The record of the solver's equilibrium with `values`, which are pressure and SED on both sides
    /// of the interface at vertices, MPa.
    pub(super) fn recorded(
        &self,
        solver: &Solver<'_>,
        report: &StepReport,
        depth_mm: f64,
        values: [Vec<f64>; 3],
        shear_mpa: Vec<[f64; 3]>,
        sides: &Sides,
    ) -> IncrementRecord {
        let [pressure_mpa, sed_dermis_mpa, sed_epidermis_mpa] = values;
        let balance = solver.balance();
        let force_n = balance.contact_force_n;
        let size_n = norm(force_n).max(solver.least_force_n());
        let difference = |a: [f64; 3], b: [f64; 3]| norm(minus(a, b)) / size_n;
        let energy_mj = report.stored_mj + report.dissipated_mj;
        let checks = Checks {
            residual_relative: report.residual_relative,
            contact_force_vs_pressure_integral: difference(sides.recorded_n, sides.normal_n),
            plate_vs_support_reaction: difference(balance.support_force_n.map(|v| -v), force_n),
            energy_vs_work: (energy_mj - sides.work_mj).abs()
                / sides.work_mj_max.max(f64::MIN_POSITIVE),
            j_min: report.j_min,
            penetration_mm_max: sides.gap_mm,
            newton_iterations: report.effort.newton_iterations,
            step_cuts: report.effort.cuts,
            augmentations: report.effort.augmentations,
            factorizations: report.effort.factorizations,
            cg_iterations: report.effort.cg_iterations,
        };
        IncrementRecord {
            depth_mm,
            time_s: 0.0,
            force_n,
            pressure_mpa,
            sed_dermis_mpa,
            sed_epidermis_mpa,
            shear_mpa,
            outside_calibration: self.outside_calibration(solver),
            contact: solver.contact_rule(),
            checks,
            seconds: 0.0,
        }
    }

    /// Pressure and SED on both sides of the interface at the vertices of the patch, of pressure at
    /// the nodes of the mesh, all MPa; empty without a patch.
    pub(super) fn at_vertices(
        &self,
        solver: &Solver<'_>,
        pressure_mpa: &[f64],
    ) -> Result<[Vec<f64>; 3], SimulationError> {
        let Some(p) = &self.patch else { return Ok(Default::default()) };
        let [pressure, dermis, epidermis] = self.nodal_fields(solver, p, pressure_mpa)?;
        Ok(match &p.patch.vertices {
            None => [pressure, dermis, epidermis],
            Some(vertices) => {
                [vertices.pressure(&pressure), vertices.sed(&dermis), vertices.sed(&epidermis)]
            }
        })
    }

    fn nodal_fields(
        &self,
        solver: &Solver<'_>,
        p: &RecordedPatch,
        pressure_mpa: &[f64],
    ) -> Result<[Vec<f64>; 3], SimulationError> {
        let history = |block, element| solver.history_of(block, element);
        let body = self.deformed(solver, &history);
        let pressure = p.patch.skin.iter().map(|&n| pressure_mpa[n as usize]).collect();
        Ok([pressure, p.dermis.sed_mpa(&body)?, p.epidermis.sed_mpa(&body)?])
    }

    /// A solver for this body.
    ///
    /// # Errors
    /// [`SimulationError::Solve`] if the factor does not fit in memory.
    pub fn solver(&self, options: Options) -> Result<Solver<'_>, SimulationError> {
        Solver::new(&self.problem, options)
            .map_err(|source| SimulationError::Solve { depth_mm: 0.0, source })
    }
}

/// Rotation of an indenter: at rest its pressing side looks along +z into the pad;
/// yaw about its normal, then pitch about y (tip first is positive), then roll
/// about x.
#[must_use]
pub fn rotation(pose: Pose) -> [[f64; 3]; 3] {
    Placement::turned(pose.pitch_deg, pose.roll_deg, pose.yaw_deg, [0.0; 3]).rotation
}
