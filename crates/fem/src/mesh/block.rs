//! A block of hexahedra, or a rectangle of quadrilaterals, on a lattice of
//! nodes, optionally mapped and in layers.

use super::surface::side_nodes;
use super::{Block, FaceKind, Mesh, Region, Surface};
use crate::element::ElementKind;

/// Node coordinates along each axis, and the region of each layer.
#[derive(Clone, Debug)]
pub struct BlockLattice {
    /// Increasing node coordinates along x, y, z, mm. Quadratic elements take
    /// them in pairs of intervals; planar ones have `[0.0]` along z.
    pub axes: [Vec<f64>; 3],
    /// Region of each layer of elements from the bottom: along z, in the plane
    /// along y.
    pub layers: Vec<Region>,
    /// Hexahedra or quadrilaterals.
    pub kind: ElementKind,
}

/// `n + 1` evenly spaced coordinates from 0 to `length`.
#[must_use]
pub fn even(length: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| length * i as f64 / n as f64).collect()
}

/// Meshes the lattice, its nodes moved by `map`.
///
/// Node sets `x_min`, `x_max`, … and surfaces of the same names; in the plane
/// those of x and y.
///
/// # Panics
/// If the lattice does not fit the element: a programming error.
#[must_use]
pub fn build(lattice: &BlockLattice, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let (kind, step) = (lattice.kind, lattice.kind.order());
    let dimension = kind.dimension();
    let count: [usize; 3] = std::array::from_fn(|i| lattice.axes[i].len());
    let fits = |c: usize| c > step && (c - 1).is_multiple_of(step);
    let flat = dimension == 3 || count[2] == 1;
    assert!(
        !kind.lattice().is_empty() && flat && count[..dimension].iter().all(|&c| fits(c)),
        "lattice does not fit the element"
    );
    let cells: [usize; 3] =
        std::array::from_fn(|i| if i < dimension { (count[i] - 1) / step } else { 1 });
    assert_eq!(lattice.layers.len(), cells[dimension - 1], "one region a layer");
    let mut mesh = Mesh::default();
    for &z in &lattice.axes[2] {
        for &y in &lattice.axes[1] {
            mesh.nodes.extend(lattice.axes[0].iter().map(|&x| map([x, y, z])));
        }
    }
    let mut block = Block { kind, connectivity: Vec::new(), region: Vec::new() };
    let mut sides = Sides::default();
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let cell = [i, j, k];
                let first = block.connectivity.len();
                for at in kind.lattice() {
                    let to = |axis: usize| {
                        let offset = (i64::from(at[axis]) + 1) as usize * step / 2;
                        if axis < dimension { cell[axis] * step + offset } else { 0 }
                    };
                    let id = to(0) + count[0] * (to(1) + count[1] * to(2));
                    block.connectivity.push(id as u32);
                }
                block.region.push(lattice.layers[cell[dimension - 1]]);
                sides.add(kind, &block.connectivity[first..], cell, cells);
            }
        }
    }
    mesh.blocks.push(block);
    for (name, surface) in sides.surfaces(kind) {
        mesh.node_sets.insert(name.clone(), surface.nodes());
        mesh.surfaces.insert(name, surface);
    }
    mesh.drop_unused_nodes();
    mesh
}

/// Faces on the outer sides: `-x, +x, -y, …`.
#[derive(Default)]
struct Sides([Vec<u32>; 6]);

impl Sides {
    /// Adds the sides of a cell that lie on the outside of the block.
    fn add(&mut self, kind: ElementKind, nodes: &[u32], cell: [usize; 3], cells: [usize; 3]) {
        for side in 0..kind.sides().len() {
            let (axis, up) = side_axis(kind, side);
            let outside = cell[axis] == if up { cells[axis] - 1 } else { 0 };
            if outside {
                let face = side_nodes(kind, side).into_iter().map(|a| nodes[a]);
                self.0[2 * axis + usize::from(up)].extend(face);
            }
        }
    }

    fn surfaces(self, kind: ElementKind) -> impl Iterator<Item = (String, Surface)> {
        self.0.into_iter().enumerate().filter(|(_, c)| !c.is_empty()).map(move |(i, c)| {
            let name = format!("{}_{}", ["x", "y", "z"][i / 2], ["min", "max"][i % 2]);
            (name, Surface { kind: FaceKind::of(kind), connectivity: c })
        })
    }
}

/// Axis that a side is normal to, and whether it is at the upper end.
fn side_axis(kind: ElementKind, side: usize) -> (usize, bool) {
    let corners = kind.sides()[side];
    let at = |c: usize, axis: usize| kind.lattice()[c][axis];
    let normal = |axis: &usize| corners.iter().all(|&c| at(c, *axis) == at(corners[0], *axis));
    let axis = (0..kind.dimension()).find(normal).unwrap_or_default();
    (axis, at(corners[0], axis) > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::BlockGeometry;
    use crate::testing::LATTICE_KINDS;

    /// 1 x 2 x 3 mm in 2 x 2 x 4 node intervals; in the plane 1 x 2 mm.
    fn mesh(kind: ElementKind) -> Mesh {
        let last = if kind.is_planar() { vec![0.0] } else { even(3.0, 4) };
        let axes = [even(1.0, 2), even(2.0, 2), last];
        let layers = (axes[kind.dimension() - 1].len() - 1) / kind.order();
        build(&BlockLattice { axes, layers: vec![Region(1); layers], kind }, |p| p)
    }

    #[test]
    fn sides_look_outward_and_have_the_right_area() {
        for kind in LATTICE_KINDS {
            let mesh = mesh(kind);
            assert_eq!(mesh.surfaces.len(), 2 * kind.dimension());
            for (name, s) in &mesh.surfaces {
                let mut total = [0.0; 3];
                s.integrate(&s.kind.quadrature(), &|n| mesh.nodes[n as usize], &mut |_, _, n| {
                    for i in 0..3 {
                        total[i] += n[i];
                    }
                });
                let axis = ["x", "y", "z"].iter().position(|a| name.starts_with(a)).unwrap();
                let volume = if kind.is_planar() { 2.0 } else { 6.0 };
                let area = volume / (axis + 1) as f64;
                let sign = if name.ends_with("max") { 1.0 } else { -1.0 };
                assert!((total[axis] - sign * area).abs() < 1e-13, "{kind:?} {name} {total:?}");
                let set = &mesh.node_sets[name];
                let at = if name.ends_with("max") { (axis + 1) as f64 } else { 0.0 };
                assert!(set.iter().all(|&n| (mesh.nodes[n as usize][axis] - at).abs() < 1e-15));
            }
        }
    }

    #[test]
    fn elements_fill_the_block_and_use_every_node() {
        for kind in LATTICE_KINDS {
            let mesh = mesh(kind);
            let block = &mesh.blocks[0];
            let geometry = BlockGeometry::new(kind, &mesh.nodes, &block.connectivity).unwrap();
            let volume: f64 =
                (0..block.len()).map(|e| geometry.element(e).weights.iter().sum::<f64>()).sum();
            let expected = if kind.is_planar() { 2.0 } else { 6.0 };
            assert!((volume - expected).abs() < 1e-13, "{kind:?} {volume}");
            let mut used = block.connectivity.clone();
            used.sort_unstable();
            used.dedup();
            assert_eq!(used.len(), mesh.nodes.len(), "{kind:?}");
        }
    }
}
