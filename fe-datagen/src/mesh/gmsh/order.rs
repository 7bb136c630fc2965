//! Gmsh's element types and node orders against ours.

use crate::element::ElementKind;
use crate::mesh::FaceKind;

/// A solid element type of Gmsh.
pub(super) struct SolidType {
    /// Kind that it becomes.
    pub kind: ElementKind,
    /// Nodes in the file.
    pub nodes: usize,
    /// Position in the file of each of our nodes.
    pub from_gmsh: &'static [usize],
}

/// A surface element type of Gmsh; node orders agree with ours.
pub(super) struct SurfaceType {
    pub kind: FaceKind,
    pub nodes: usize,
}

/// Edges run along axes from the lowest corner in Gmsh, around the bottom, the
/// top and up the sides in VTK.
const HEX: [usize; 27] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25,
    26,
];
/// The last two mid-edge nodes are swapped.
const TET: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];

/// Solid element of a Gmsh type number.
pub(super) fn solid(element_type: u32) -> Option<SolidType> {
    let t = |kind, nodes, from_gmsh| Some(SolidType { kind, nodes, from_gmsh });
    match element_type {
        4 => t(ElementKind::Tet4, 4, &TET[..4]),
        5 => t(ElementKind::Hex8, 8, &HEX[..8]),
        11 => t(ElementKind::Tet10, 10, &TET),
        12 => t(ElementKind::Hex27, 27, &HEX),
        // Completed by its face and body nodes.
        17 => t(ElementKind::Hex27, 20, &HEX[..20]),
        _ => None,
    }
}

/// Surface element of a Gmsh type number.
pub(super) fn surface(element_type: u32) -> Option<SurfaceType> {
    let t = |kind, nodes| Some(SurfaceType { kind, nodes });
    match element_type {
        2 => t(FaceKind::Tri3, 3),
        3 => t(FaceKind::Quad4, 4),
        9 => t(FaceKind::Tri6, 6),
        10 => t(FaceKind::Quad9, 9),
        16 => t(FaceKind::Quad9, 8),
        _ => None,
    }
}

/// Corners of the sides, counter-clockwise from outside; for hexahedra in the
/// order of the face nodes of `Hex27`.
pub(super) const fn sides(kind: ElementKind) -> &'static [&'static [usize]] {
    match kind {
        ElementKind::Hex8 | ElementKind::Hex27 => &[
            &[0, 4, 7, 3],
            &[1, 2, 6, 5],
            &[0, 1, 5, 4],
            &[3, 7, 6, 2],
            &[0, 3, 2, 1],
            &[4, 5, 6, 7],
        ],
        ElementKind::Tet4 | ElementKind::Tet10 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
    }
}

/// Node order of a face seen from its other side.
pub(super) const fn flipped(kind: FaceKind) -> &'static [usize] {
    match kind {
        FaceKind::Quad4 => &[0, 3, 2, 1],
        FaceKind::Quad9 => &[0, 3, 2, 1, 7, 6, 5, 4, 8],
        FaceKind::Tri3 => &[0, 2, 1],
        FaceKind::Tri6 => &[0, 2, 1, 5, 4, 3],
    }
}

/// Number of corners.
pub(super) const fn corners(kind: FaceKind) -> usize {
    match kind {
        FaceKind::Quad4 | FaceKind::Quad9 => 4,
        FaceKind::Tri3 | FaceKind::Tri6 => 3,
    }
}
