//! What is solved: mesh, materials, constraints, contact surface, loads.

use crate::contact::ContactSurface;
use crate::element::{BlockGeometry, ShapeError};
use crate::indenter::{Distance, Placement, SignedDistance};
use crate::linear::{Structure, StructureError};
use crate::material::Material;
use crate::mesh::{Mesh, Tissue};
use std::sync::Arc;

/// A body ready to be loaded. Shared by every press of a campaign.
pub struct Problem {
    /// Undeformed mesh.
    pub mesh: Mesh,
    /// Undeformed element geometry, one a block.
    pub geometry: Vec<BlockGeometry>,
    /// Material of each tissue, by [`Tissue::index`].
    pub materials: Vec<Material>,
    /// Prescribed degrees of freedom, `3 node + component`.
    pub fixed: Vec<bool>,
    /// Sparsity pattern, ordering and symbolic factor.
    pub structure: Structure,
    /// Where contact may happen.
    pub contact: Option<ContactSurface>,
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
    Structure(#[from] StructureError),
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
        materials: [Material; Tissue::ALL.len()],
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
        let structure = Structure::new(&mesh, &fixed)?;
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
        Ok(Self { mesh, geometry, materials: materials.to_vec(), fixed, structure, contact })
    }

    /// Contact penalty from material and mesh, MPa/mm: a few hundred times the
    /// stiffest soft tissue's shear modulus over the contact nodes' spacing, so
    /// that extrapolated multipliers need one update. Larger values cost the
    /// preconditioned iterations more than they save.
    #[must_use]
    pub fn penalty_mpa_per_mm(&self) -> f64 {
        const FACTOR: f64 = 200.0;
        let Some(contact) = &self.contact else { return 1.0 };
        let mean_area = contact.area_mm2.iter().sum::<f64>() / contact.area_mm2.len().max(1) as f64;
        let used = |t: &Tissue| self.mesh.blocks.iter().any(|b| b.tissue.contains(t));
        let mu = Tissue::ALL
            .iter()
            .filter(|t| used(t))
            .map(|t| self.materials[t.index()].isochoric.mu_mpa)
            .fold(0.0, f64::max);
        FACTOR * mu / mean_area.sqrt()
    }
}

/// An indenter that moves along a straight line.
#[derive(Clone)]
pub struct MovingIndenter {
    /// Its shape.
    pub shape: Arc<dyn SignedDistance>,
    /// Where it is at load fraction 0.
    pub start: Placement,
    /// Displacement at load fraction 1, mm.
    pub travel_mm: [f64; 3],
}

impl MovingIndenter {
    /// Placement at load fraction `t`.
    #[must_use]
    pub fn placement(&self, t: f64) -> Placement {
        let mut p = self.start;
        for i in 0..3 {
            p.origin_mm[i] += t * self.travel_mm[i];
        }
        p
    }

    /// Distance of `x` at load fraction `t`.
    #[must_use]
    pub fn distance(&self, t: f64, x: [f64; 3]) -> Distance {
        self.placement(t).distance(self.shape.as_ref(), x)
    }
}

/// Loads, all proportional to the load fraction in `[0, 1]`.
#[derive(Clone, Default)]
pub struct Loading {
    /// Dead nodal forces at fraction 1, N; empty if there are none.
    pub dead_n: Vec<[f64; 3]>,
    /// Prescribed displacements at fraction 1: `(degree of freedom, mm)`; the
    /// other prescribed degrees of freedom stay 0.
    pub prescribed_mm: Vec<(usize, f64)>,
    /// Indenter.
    pub indenter: Option<MovingIndenter>,
}
