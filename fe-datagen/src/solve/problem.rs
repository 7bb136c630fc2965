//! What is solved: mesh, materials, constraints, contact surface, loads.

use super::memory::MemoryLayout;
use crate::contact::{ContactRule, ContactSurface};
use crate::element::{BlockGeometry, ShapeError, Solid};
use crate::linear::{Structure, StructureError};
use crate::mesh::{Mesh, Tissue};
use std::sync::Arc;

/// What each tissue is made of, by [`Tissue::index`].
pub type Materials = [Arc<dyn Solid>; Tissue::ALL.len()];

/// A body ready to be loaded. Shared by every press of a campaign.
pub struct Problem {
    /// Undeformed mesh.
    pub mesh: Mesh,
    /// Undeformed element geometry, one a block.
    pub geometry: Vec<BlockGeometry>,
    /// What each tissue is made of, by [`Tissue::index`].
    pub materials: Materials,
    /// Where each element's memory is; `None` if no material has any.
    pub memory: Option<MemoryLayout>,
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
        let memory = MemoryLayout::new(&mesh, &geometry, &materials);
        Ok(Self { mesh, geometry, materials, memory, fixed, structure, contact })
    }

    /// Contact penalty from material and mesh, MPa/mm: a few hundred times the
    /// stiffest soft tissue's shear modulus over the contact nodes' spacing, so
    /// that extrapolated multipliers need one update. Larger values cost the
    /// preconditioned iterations more than they save. Where there are no multipliers
    /// it is ten times that, which leaves gaps of some micrometres.
    #[must_use]
    pub fn penalty_mpa_per_mm(&self, rule: ContactRule) -> f64 {
        let factor = if rule.has_multipliers() { 200.0 } else { 2000.0 };
        let Some(contact) = &self.contact else { return 1.0 };
        factor * self.soft_mpa() / contact.spacing_mm()
    }

    /// Largest shear modulus of the mesh's soft tissues, MPa; of its bone and nail
    /// if it has nothing else. What an indenter meets is measured by it: beside
    /// soft tissue, bone is 5e5 times stiffer and as good as held.
    pub(super) fn soft_mpa(&self) -> f64 {
        let used = |t: &Tissue| self.mesh.blocks.iter().any(|b| b.tissue.contains(t));
        let (hard, soft): (Vec<_>, Vec<_>) = Tissue::ALL
            .into_iter()
            .filter(used)
            .partition(|&t| t == Tissue::Nail || t == Tissue::Bone);
        let of = |tissues: &[Tissue]| {
            tissues
                .iter()
                .map(|t| self.materials[t.index()].shear_modulus_mpa())
                .fold(0.0, f64::max)
        };
        if soft.is_empty() { of(&hard) } else { of(&soft) }
    }
}
