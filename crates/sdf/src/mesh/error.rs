//! Why a mesh bounds no body.

use super::TRIANGLES_MAX;

/// Why a mesh bounds no body.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// Too few triangles to close, or too many.
    #[error("triangles: {found} are no mesh of 4 to {TRIANGLES_MAX}; simplify it")]
    Count {
        /// Found.
        found: usize,
    },
    /// A coordinate that is not finite or far off.
    #[error("vertices_mm[{vertex}] is not within 1000 mm of the mesh's origin")]
    Vertex {
        /// Which.
        vertex: usize,
    },
    /// An index beyond the list of corners.
    #[error("triangles[{triangle}] names a corner that vertices_mm does not list")]
    Index {
        /// Which.
        triangle: usize,
    },
    /// A triangle without area.
    #[error("triangles[{triangle}] has no area; take it out and join its neighbours")]
    Flat {
        /// Which.
        triangle: usize,
    },
    /// An edge that has not one triangle on either side.
    #[error(
        "triangles[{triangle}] has an edge that is not shared with exactly one other, turned the \
         same way round: the mesh is open, or more than two triangles meet there, as where bodies \
         touch. Close it; join bodies that touch into one (a boolean union), or send each as a mesh \
         of its own in the parts of a 'union'"
    )]
    Open {
        /// A triangle with this edge.
        triangle: usize,
    },
    /// Triangles that cross each other.
    #[error(
        "triangles[{}] and triangles[{}] cross each other: join bodies that overlap into one (a \
         boolean union), or send each as a mesh of its own in the parts of a 'union'",
        pair[0], pair[1]
    )]
    Crossing {
        /// Which.
        pair: [usize; 2],
    },
    /// Faces that lie upon each other, as where two bodies touch.
    #[error(
        "triangles[{}] and triangles[{}] lie upon each other, so that skin inside would see a face \
         that is covered: join the bodies into one (a boolean union), or send each as a mesh of its \
         own in the parts of a 'union'", pair[0], pair[1]
    )]
    Touching {
        /// Which.
        pair: [usize; 2],
    },
    /// A closed surface that lies inside of another one.
    #[error(
        "triangles[{triangle}] lies inside another body of the mesh (or is a cavity outside of all): \
         take it out, or turn it round if it is a cavity"
    )]
    Nested {
        /// A triangle of the inner one.
        triangle: usize,
    },
    /// So many triangles lie beside each other that it takes too long to tell whether they cross.
    #[error(
        "to see whether the triangles cross each other more than {most} boxes and triangles would \
         have to be looked at, since too many reach across each other: remesh the surface with \
         triangles that are less slender, or with fewer"
    )]
    TooTangled {
        /// How many are looked at.
        most: u64,
    },
    /// Whoever asked for the mesh waits no longer.
    #[error("the mesh was not read to its end, since nobody waits for it any more")]
    Stopped,
    /// Normals that point inward.
    #[error("the triangles are inside out; swap two corners of every one")]
    InsideOut,
    /// An open surface that goes round nothing, as a sheet.
    #[error(
        "the surface has no inside: it goes round no place by more than {percent} %, as its winding \
         number says. Close it, or give a sheet a thickness"
    )]
    NoInside {
        /// How far it goes round a place at most.
        percent: u32,
    },
}

impl MeshError {
    /// Whether the surface may mean a body all the same.
    pub(super) const fn can_be_mended(&self) -> bool {
        match self {
            Self::Flat { .. }
            | Self::Open { .. }
            | Self::Crossing { .. }
            | Self::Touching { .. }
            | Self::Nested { .. }
            | Self::InsideOut => true,
            Self::Count { .. }
            | Self::Vertex { .. }
            | Self::Index { .. }
            | Self::TooTangled { .. }
            | Self::Stopped
            | Self::NoInside { .. } => false,
        }
    }
}
