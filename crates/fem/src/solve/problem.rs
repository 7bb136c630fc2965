//! What is solved: mesh, materials, constraints, contact surface, loads.

use super::history_layout::HistoryLayout;
use super::tension::{SurfaceTension, SurfaceTensionError};
use crate::biphasic::{FluidError, FluidPhase, FluidSpec, Solid};
use crate::contact::{ContactRule, ContactSurface, Support};
use crate::element::geometry::displacement_gradient;
use crate::element::{BlockGeometry, Materials, ShapeError};
use crate::linear::{SymbolicError, SymbolicSystem, SymmetricMatrix};
use crate::mesh::{Block, Mesh};
use papilla_solid::tensor::Kinematics;

/// A body ready to be loaded. Shared by every indentation of a campaign.
pub struct Problem {
    /// Undeformed mesh.
    pub mesh: Mesh,
    /// Undeformed element geometry, one a block.
    pub geometry: Vec<BlockGeometry>,
    /// What each region is made of.
    pub materials: Materials,
    /// Where each element's history variables are; `None` if no material has any.
    pub history_layout: Option<HistoryLayout>,
    /// Prescribed degrees of freedom, `3 node + component`.
    pub fixed: Vec<bool>,
    /// Sparsity pattern, ordering and symbolic factor.
    pub system: SymbolicSystem,
    /// Where contact may happen.
    pub contact: Option<ContactSurface>,
    /// Tension of a surface at rest; `None` of a body whose surfaces are slack.
    pub tension: Option<SurfaceTension>,
    /// What flows in it; `None` of a body without fluid.
    pub fluid: Option<FluidPhase>,
    /// Force that a volume of fluid too much amounts to, N/mm3; 0 without fluid.
    pub(super) surplus_n_per_mm3: f64,
}

/// Why a problem could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum ProblemError {
    /// An element's undeformed shape is bad.
    #[error("block {block}: {source}")]
    Shape {
        /// Mesh block.
        block: usize,
        /// What is wrong with it.
        source: ShapeError,
    },
    /// The system has no structure.
    #[error(transparent)]
    Structure(#[from] SymbolicError),
    /// The faces of the contact surface cannot carry contact at their nodes.
    #[error(
        "surface '{name}' has 8-node faces, whose corners would have to be pulled under an even \
         pressure: contact there gives wrong forces. Complete the mesh to 27-node hexahedra \
         (mesh::complete), or mesh with 8 or 27 nodes"
    )]
    ContactFaces {
        /// Surface.
        name: String,
    },
    /// A surface cannot be under tension.
    #[error(transparent)]
    Tension(#[from] SurfaceTensionError),
    /// The body cannot be full of fluid.
    #[error(transparent)]
    Fluid(#[from] FluidError),
    /// A surface or node set is missing.
    #[error("the mesh has no {kind} named '{name}'; it has: {known}")]
    Missing {
        /// "surface" or "node set".
        kind: &'static str,
        /// Name that was asked for.
        name: String,
        /// Names that exist.
        known: String,
    },
}

impl Problem {
    /// Sets up a body with prescribed degrees of freedom `fixed` and contact
    /// on the named surface. Plane-strain elements hold displacement along z.
    ///
    /// # Errors
    /// See [`ProblemError`].
    pub fn new(
        mesh: Mesh,
        materials: Materials,
        mut fixed: Vec<bool>,
        contact_surface: Option<&str>,
    ) -> Result<Self, ProblemError> {
        mesh.hold_out_of_plane(&mut fixed);
        let geometry = mesh
            .blocks
            .iter()
            .enumerate()
            .map(|(block, b)| {
                BlockGeometry::new(b.kind, &mesh.nodes, &b.connectivity)
                    .map_err(|source| ProblemError::Shape { block, source })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let system = SymbolicSystem::new(&mesh, &fixed)?;
        let contact = match contact_surface {
            None => None,
            Some(name) => {
                let surface = mesh.surfaces.get(name).ok_or_else(|| ProblemError::Missing {
                    kind: "surface",
                    name: name.into(),
                    known: mesh.surfaces.keys().cloned().collect::<Vec<_>>().join(", "),
                })?;
                if !surface.kind.carries_contact() {
                    return Err(ProblemError::ContactFaces { name: name.into() });
                }
                Some(ContactSurface::new(surface, &mesh.nodes, &fixed))
            }
        };
        let history_layout = HistoryLayout::new(&mesh, &geometry, &materials);
        let tension = materials
            .tension()
            .map(|(surface, n_per_mm)| SurfaceTension::new(&mesh, surface, n_per_mm))
            .transpose()?;
        Ok(Self {
            mesh,
            geometry,
            materials,
            history_layout,
            fixed,
            system,
            contact,
            tension,
            fluid: None,
            surplus_n_per_mm3: 0.0,
        })
    }

    /// The same body full of fluid, see [`crate::biphasic`].
    ///
    /// # Errors
    /// [`ProblemError::Fluid`].
    pub fn with_fluid(self, spec: FluidSpec) -> Result<Self, ProblemError> {
        let fluid = Some(FluidPhase::new(&self.mesh, &self.system, spec)?);
        Ok(Self { fluid, surplus_n_per_mm3: self.surplus_scale_n_per_mm3(), ..self })
    }

    /// Volume of the body, mm3 (of planar elements area times 1 mm), with its nodes displaced by
    /// `u`, mm.
    #[must_use]
    pub fn volume_mm3(&self, u: &[[f64; 3]]) -> f64 {
        let mut volume = 0.0;
        for (block, geometry) in self.mesh.blocks.iter().zip(&self.geometry) {
            let n = block.kind.nodes();
            for e in 0..block.len() {
                let local: Vec<_> = block.element(e).iter().map(|&a| u[a as usize]).collect();
                let g = geometry.element(e);
                for (gradients, weight) in g.gradients.chunks_exact(n).zip(g.weights) {
                    volume +=
                        weight * Kinematics::new(displacement_gradient(&local, gradients)).j();
                }
            }
        }
        volume
    }

    /// Side of a cube (square) as large as the mean element, mm.
    fn element_width_mm(&self) -> f64 {
        let weights = |(b, g): (&Block, &BlockGeometry)| -> f64 {
            (0..b.len()).flat_map(|e| g.element(e).weights).sum()
        };
        let volume: f64 = self.mesh.blocks.iter().zip(&self.geometry).map(weights).sum();
        let mean = volume / self.mesh.element_count() as f64;
        if self.mesh.is_planar() { mean.sqrt() } else { mean.cbrt() }
    }

    /// Force that a volume of fluid too much amounts to, N/mm3: over an element's width, with the
    /// solid's modulus.
    fn surplus_scale_n_per_mm3(&self) -> f64 {
        self.reference_modulus_mpa() / self.element_width_mm()
    }

    /// The solid, for what flows in it.
    pub(super) fn solid(&self) -> Solid<'_> {
        Solid { mesh: &self.mesh, geometry: &self.geometry, materials: &self.materials }
    }

    /// Adds `N_a N_b stiffness` (N/mm) between the unknowns that carry a point of the surface.
    pub(super) fn add_point(
        &self,
        tangent: &mut SymmetricMatrix,
        support: Support<'_>,
        stiffness: &[[f64; 3]; 3],
    ) {
        let free = self.mesh.free_support(support.nodes, support.values);
        self.system.add_point(tangent, &free, stiffness);
    }

    /// Contact penalty from material and mesh, MPa/mm: [`ContactRule::penalty_factor`] times the
    /// largest shear modulus of what is soft over the contact nodes' spacing. Larger values cost
    /// the preconditioned iterations more than they save.
    #[must_use]
    pub fn penalty_mpa_per_mm(&self, rule: ContactRule) -> f64 {
        let Some(contact) = &self.contact else { return 1.0 };
        rule.penalty_factor() * self.reference_modulus_mpa() / contact.spacing_mm()
    }

    /// Shear modulus, MPa, by which is measured what an indenter meets, see
    /// [`Materials::with_stiff`].
    pub(super) fn reference_modulus_mpa(&self) -> f64 {
        let blocks = &self.mesh.blocks;
        self.materials.reference_modulus_mpa(|r| blocks.iter().any(|b| b.region.contains(&r)))
    }
}
