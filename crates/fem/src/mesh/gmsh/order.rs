//! Gmsh's element types and node orders against ours.

use crate::element::ElementKind;
use crate::mesh::FaceKind;

/// A solid element type of Gmsh.
pub(super) struct SolidType {
    /// Kind that it becomes.
    pub kind: ElementKind,
    /// Position in the file of each of our nodes.
    pub from_gmsh: &'static [usize],
}

/// Edges run along axes from the lowest corner in Gmsh, around the bottom, the
/// top and up the sides in VTK.
const HEX: [usize; 27] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25,
    26,
];
/// The last two mid-edge nodes are swapped.
const TET: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
/// In the plane both agree.
const QUAD: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];

/// Solid element of a Gmsh type number: of three dimensions, or of the plane.
pub(super) fn solid(element_type: u32, planar: bool) -> Option<SolidType> {
    let t = |kind, from_gmsh| Some(SolidType { kind, from_gmsh });
    match (element_type, planar) {
        (4, false) => t(ElementKind::Tet4, &TET[..4]),
        (5, false) => t(ElementKind::Hex8, &HEX[..8]),
        (11, false) => t(ElementKind::Tet10, &TET),
        (12, false) => t(ElementKind::Hex27, &HEX),
        (17, false) => t(ElementKind::Hex20, &HEX[..20]),
        (3, true) => t(ElementKind::Quad4, &QUAD[..4]),
        (10, true) => t(ElementKind::Quad9, &QUAD),
        (16, true) => t(ElementKind::Quad8, &QUAD[..8]),
        _ => None,
    }
}

/// Surface element of a Gmsh type number; node orders agree with ours.
pub(super) fn surface(element_type: u32, planar: bool) -> Option<FaceKind> {
    match (element_type, planar) {
        (1, true) => Some(FaceKind::Line2),
        (8, true) => Some(FaceKind::Line3),
        (2, false) => Some(FaceKind::Tri3),
        (3, false) => Some(FaceKind::Quad4),
        (9, false) => Some(FaceKind::Tri6),
        (10, false) => Some(FaceKind::Quad9),
        (16, false) => Some(FaceKind::Quad8),
        _ => None,
    }
}

/// Node order of a quadrilateral turned the other way round: first 4, 8 or 9.
pub(super) const QUAD_TURNED: [usize; 9] = [0, 3, 2, 1, 7, 6, 5, 4, 8];

/// Node order of a face seen from its other side.
pub(super) const fn flipped(kind: FaceKind) -> &'static [usize] {
    match kind {
        FaceKind::Line2 => &[1, 0],
        FaceKind::Line3 => &[1, 0, 2],
        FaceKind::Quad4 | FaceKind::Quad8 | FaceKind::Quad9 => QUAD_TURNED.split_at(kind.nodes()).0,
        FaceKind::Tri3 => &[0, 2, 1],
        FaceKind::Tri6 => &[0, 2, 1, 5, 4, 3],
    }
}
