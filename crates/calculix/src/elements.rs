//! CalculiX' element types against ours: names, node order, faces, printed points.

use papilla_fem::element::{ElementKind, extrapolate};
use papilla_fem::mesh::{FaceKind, Mesh, Surface};
use std::collections::HashMap;

/// Which CalculiX types stand for our hexahedra and quadrilaterals. None is an
/// equal near nu = 0.5: docs/reference/calculix.md says what each choice does there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ElementTypes {
    /// For `Hex8`.
    pub linear: LinearHex,
    /// For `Hex20`, `Hex27` without its face and centre nodes, and their likes
    /// in the plane.
    pub quadratic: QuadraticHex,
}

/// A CalculiX type with eight nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinearHex {
    /// Fully integrated displacement element; locks as nu nears 0.5.
    #[default]
    C3d8,
    /// With incompatible modes: bends and keeps its volume better.
    C3d8i,
    /// One point and hourglass control.
    C3d8r,
}

/// A CalculiX type with twenty nodes, or eight in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum QuadraticHex {
    /// Eight points (`CPE8R` in the plane): hardly locks. The one to compare with.
    #[default]
    C3d20r,
    /// 27 points (`CPE8`): locks as nu nears 0.5.
    C3d20,
}

/// One CalculiX element type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CcxElement {
    /// Name in `*ELEMENT, TYPE=`.
    pub name: &'static str,
    /// How many of our nodes it takes, from the first: the orders agree.
    pub nodes: usize,
    /// Corners of the faces `S1`, `S2`, ….
    faces: &'static [&'static [usize]],
    /// Our kind with the same integration points in the same order; `None`
    /// for a single one at the centre of a hexahedron. Planar types are bricks
    /// behind the scenes, of which the third coordinate does not matter.
    points_of: Option<ElementKind>,
}

const HEX_FACES: &[&[usize]] =
    &[&[0, 1, 2, 3], &[4, 7, 6, 5], &[0, 4, 5, 1], &[1, 5, 6, 2], &[2, 6, 7, 3], &[3, 7, 4, 0]];
const TET_FACES: &[&[usize]] = &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]];
const QUAD_EDGES: &[&[usize]] = &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]];

impl ElementTypes {
    /// The CalculiX type that takes elements of `kind`.
    #[must_use]
    pub const fn of(self, kind: ElementKind) -> CcxElement {
        let (name, nodes, faces, points_of) = match (kind, self.linear, self.quadratic) {
            (ElementKind::Hex8, LinearHex::C3d8, _) => {
                ("C3D8", 8, HEX_FACES, Some(ElementKind::Hex8))
            }
            (ElementKind::Hex8, LinearHex::C3d8i, _) => {
                ("C3D8I", 8, HEX_FACES, Some(ElementKind::Hex8))
            }
            (ElementKind::Hex8, LinearHex::C3d8r, _) => ("C3D8R", 8, HEX_FACES, None),
            (ElementKind::Hex20 | ElementKind::Hex27, _, QuadraticHex::C3d20r) => {
                ("C3D20R", 20, HEX_FACES, Some(ElementKind::Hex8))
            }
            (ElementKind::Hex20 | ElementKind::Hex27, _, QuadraticHex::C3d20) => {
                ("C3D20", 20, HEX_FACES, Some(ElementKind::Hex27))
            }
            (ElementKind::Quad4, ..) => ("CPE4", 4, QUAD_EDGES, Some(ElementKind::Hex8)),
            (ElementKind::Quad8 | ElementKind::Quad9, _, QuadraticHex::C3d20r) => {
                ("CPE8R", 8, QUAD_EDGES, Some(ElementKind::Hex8))
            }
            (ElementKind::Quad8 | ElementKind::Quad9, _, QuadraticHex::C3d20) => {
                ("CPE8", 8, QUAD_EDGES, Some(ElementKind::Hex27))
            }
            (ElementKind::Tet4, ..) => ("C3D4", 4, TET_FACES, Some(ElementKind::Tet4)),
            (ElementKind::Tet10, ..) => ("C3D10", 10, TET_FACES, Some(ElementKind::Tet10)),
        };
        CcxElement { name, nodes, faces, points_of }
    }
}

impl CcxElement {
    /// Weights of the values at [`Self::points`] that give the value at `xi`: the polynomial
    /// through them.
    #[must_use]
    pub fn extrapolation(self, xi: [f64; 3]) -> Vec<f64> {
        self.points_of.map_or_else(|| vec![1.0], |kind| extrapolate::weights(kind, xi))
    }

    /// Reference coordinates of the points at which `*EL PRINT` gives values.
    #[must_use]
    pub fn points(self) -> Vec<[f64; 3]> {
        self.points_of
            .map_or_else(|| vec![[0.0; 3]], |k| k.quadrature().into_iter().map(|q| q.xi).collect())
    }
}

/// Whether CalculiX' node-to-face contact suits a surface. It takes wrong nodal
/// weights on quadratic faces, which need face-to-face contact. Edges are faces
/// of bricks with their layers tied to each other, where a node's share is that of
/// the edge; face-to-face contact there does not find out what touches.
pub(super) const fn takes_node_contact(kind: FaceKind) -> bool {
    matches!(kind, FaceKind::Line2 | FaceKind::Line3 | FaceKind::Quad4 | FaceKind::Tri3)
}

/// `(element number, face number)` of every face of a surface, both from 1;
/// `Err` holds the first face of which no element has all corners.
pub(super) fn element_faces(
    mesh: &Mesh,
    types: ElementTypes,
    surface: &Surface,
) -> Result<Vec<(usize, usize)>, Vec<u32>> {
    let mut owner: HashMap<Vec<u32>, (usize, usize)> = HashMap::new();
    let key = |face: &mut dyn Iterator<Item = u32>| {
        let mut key: Vec<u32> = face.collect();
        key.sort_unstable();
        key
    };
    let mut number = 0;
    for block in &mesh.blocks {
        let faces = types.of(block.kind).faces;
        for e in 0..block.len() {
            number += 1;
            let nodes = block.element(e);
            for (f, face) in faces.iter().enumerate() {
                owner.insert(key(&mut face.iter().map(|&c| nodes[c])), (number, f + 1));
            }
        }
    }
    let find = |face: &[u32]| {
        let corners = &face[..surface.kind.corners()];
        owner.get(&key(&mut corners.iter().copied())).copied().ok_or_else(|| face.to_vec())
    };
    surface.faces().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fem::mesh::block::{BlockLattice, build, even};
    use papilla_fingertip::tissue::Tissue;

    /// CalculiX numbers the faces of a brick bottom, top, then around from the
    /// side between corners 1 and 2.
    #[test]
    fn faces_are_numbered_as_calculix_does() {
        let (axes, layers) =
            ([even(1.0, 1), even(1.0, 1), even(1.0, 1)], vec![Tissue::Dermis.region()]);
        let mesh = build(&BlockLattice { axes, layers, kind: ElementKind::Hex8 }, |p| p);
        let sides = ["z_min", "z_max", "y_min", "x_max", "y_max", "x_min"];
        for (i, side) in sides.iter().enumerate() {
            let found = element_faces(&mesh, ElementTypes::default(), &mesh.surfaces[*side]);
            assert_eq!(found, Ok(vec![(1, i + 1)]), "{side}");
        }
    }

    #[test]
    fn sides_of_quadrilaterals_are_numbered_around() {
        let (axes, layers) =
            ([even(1.0, 2), even(1.0, 2), vec![0.0]], vec![Tissue::Dermis.region()]);
        for kind in [ElementKind::Quad8, ElementKind::Quad9] {
            let mesh =
                build(&BlockLattice { axes: axes.clone(), layers: layers.clone(), kind }, |p| p);
            for (i, side) in ["y_min", "x_max", "y_max", "x_min"].iter().enumerate() {
                let found = element_faces(&mesh, ElementTypes::default(), &mesh.surfaces[*side]);
                assert_eq!(found, Ok(vec![(1, i + 1)]), "{kind:?} {side}");
            }
        }
    }

    #[test]
    fn a_face_without_an_element_is_reported() {
        let (axes, layers) =
            ([even(1.0, 1), even(1.0, 1), even(1.0, 1)], vec![Tissue::Dermis.region()]);
        let mesh = build(&BlockLattice { axes, layers, kind: ElementKind::Hex8 }, |p| p);
        let loose = Surface { kind: FaceKind::Tri3, connectivity: vec![0, 1, 2] };
        let found = element_faces(&mesh, ElementTypes::default(), &loose);
        assert_eq!(found, Err(vec![0, 1, 2]));
    }

    #[test]
    fn printed_points_are_the_points_of_the_type() {
        let count = |linear, kind| {
            ElementTypes { linear, ..ElementTypes::default() }.of(kind).points().len()
        };
        assert_eq!(count(LinearHex::C3d8, ElementKind::Hex8), 8);
        assert_eq!(count(LinearHex::C3d8r, ElementKind::Hex8), 1);
        assert_eq!(count(LinearHex::C3d8, ElementKind::Hex27), 8);
        assert_eq!(count(LinearHex::C3d8, ElementKind::Quad8), 8);
        assert_eq!(count(LinearHex::C3d8, ElementKind::Tet10), 4);
    }
}
