//! SED's limit at an interface, from values at the points where CalculiX prints.

use papilla_calculix::ElementTypes;
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::{Block, FaceKind, Mesh, Surface};
use papilla_fingertip::tissue::Tissue;
use papilla_vector::norm;
use std::collections::HashSet;

/// A face between two tissues, seen from the first one's element.
#[derive(Debug)]
pub(super) struct LimitFace {
    /// Element, in the numbering of the mesh.
    pub element: usize,
    /// Undeformed area, mm2, that one of its points stands for.
    pub point_mm2: f64,
    /// Weights of the element's printed points at each point of the face.
    weights: Vec<Vec<f64>>,
}

impl LimitFace {
    /// Values at the points of the face, from those at the element's printed points.
    pub(super) fn values(&self, printed: &[f64]) -> Vec<f64> {
        self.weights.iter().map(|w| w.iter().zip(printed).map(|(w, v)| w * v).sum()).collect()
    }
}

/// Faces that hexahedra of the first tissue share with the second. Their points lie above the
/// printed ones, and take the polynomial through those of the element.
pub(super) fn limit_faces(
    mesh: &Mesh,
    types: ElementTypes,
    [side, other]: [Tissue; 2],
) -> Vec<LimitFace> {
    let mut others = HashSet::new();
    let mut number = 0..;
    let mut of_side = Vec::new();
    for block in &mesh.blocks {
        for (e, element) in (0..block.len()).zip(&mut number) {
            let tissue = Tissue::of(block.region[e]);
            for s in 0..block.kind.sides().len() {
                if tissue == other {
                    others.insert(sorted_corners(block, e, s));
                } else if tissue == side && types.of(block.kind).nodes == 20 {
                    of_side.push((block, e, s, element));
                }
            }
        }
    }
    of_side.retain(|&(block, e, s, _)| others.contains(&sorted_corners(block, e, s)));
    let face = |(block, e, s, element): (&Block, usize, usize, usize)| {
        let weights = side_weights(block.kind, types, s);
        let point_mm2 = area_mm2(mesh, corners(block, e, s)) / weights.len() as f64;
        LimitFace { element, point_mm2, weights }
    };
    of_side.into_iter().map(face).collect()
}

fn corners(block: &Block, element: usize, side: usize) -> Vec<u32> {
    let nodes = block.element(element);
    block.kind.sides()[side].iter().map(|&c| nodes[c]).collect()
}

fn sorted_corners(block: &Block, element: usize, side: usize) -> Vec<u32> {
    let mut corners = corners(block, element, side);
    corners.sort_unstable();
    corners
}

/// For every printed point that is nearest to the side: weights of all of them above it.
fn side_weights(kind: ElementKind, types: ElementTypes, side: usize) -> Vec<Vec<f64>> {
    let (ccx, centre) = (types.of(kind), kind.side_centre(side));
    let towards = |xi: &[f64; 3]| (0..3).map(|i| xi[i] * centre[i]).sum::<f64>();
    let points = ccx.points();
    let nearest = points.iter().map(towards).fold(0.0, f64::max);
    let is_near = |xi: &&[f64; 3]| towards(xi) > (1.0 - 1e-9) * nearest;
    let above = |xi: &[f64; 3]| {
        let at = |i: usize| if centre[i] == 0.0 { xi[i] } else { centre[i] };
        ccx.extrapolation(std::array::from_fn(at))
    };
    points.iter().filter(is_near).map(above).collect()
}

/// Area between four corners.
fn area_mm2(mesh: &Mesh, corners: Vec<u32>) -> f64 {
    let face = Surface { kind: FaceKind::Quad4, connectivity: corners };
    let mut area = 0.0;
    face.integrate(&FaceKind::Quad4.contact_points(), &|n| mesh.nodes[n as usize], &mut {
        |_, _, normal| area += norm(normal)
    });
    area
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fem::mesh::block::{BlockLattice, build, even};

    /// Two layers that are sheared: a linear field is had exactly at the interface, from the side
    /// asked for, and the points stand for its area.
    #[test]
    fn a_linear_field_has_its_value_at_the_interface() {
        let axes = [even(3.0, 4), even(2.0, 2), vec![0.0, 0.5, 1.0, 1.4, 1.8]];
        let layers = vec![Tissue::Dermis.region(), Tissue::Epidermis.region()];
        let mesh = build(&BlockLattice { axes, layers, kind: ElementKind::Hex27 }, |[x, y, z]| {
            [x + 0.3 * z, y, z]
        });
        let types = ElementTypes::default();
        let faces = limit_faces(&mesh, types, [Tissue::Dermis, Tissue::Epidermis]);
        assert_eq!(faces.len(), 2);
        let area: f64 = faces.iter().map(|f| f.point_mm2 * f.weights.len() as f64).sum();
        assert!((area - 6.0).abs() < 1e-12, "{area}");
        let points = types.of(ElementKind::Hex27).points();
        for face in &faces {
            assert!(Tissue::of(mesh.blocks[0].region[face.element]) == Tissue::Dermis);
            // From 0 below to 1 at the interface, and along x.
            let printed: Vec<_> = points.iter().map(|p| 0.5 * (1.0 + p[2]) + 7.0 * p[0]).collect();
            let x: Vec<_> = face.values(&printed).iter().map(|v| (v - 1.0) / 7.0).collect();
            let due = [-1.0, 1.0, -1.0, 1.0].map(|s: f64| s / 3f64.sqrt());
            assert!(x.iter().zip(due).all(|(x, d)| (x - d).abs() < 1e-12), "{x:?}");
        }
    }
}
