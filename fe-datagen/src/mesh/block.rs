//! A rectangular block of hexahedra, optionally mapped and in layers.

use super::{Block, FaceKind, Mesh, Surface, Tissue};
use crate::element::ElementKind;
use crate::element::reference::HEX27_LATTICE;

/// Lattice of a block: node coordinates along each axis, and the tissue of each
/// interval along `z`.
#[derive(Clone, Debug)]
pub struct BlockLattice {
    /// Increasing node coordinates along x, y, z, mm. Quadratic elements take
    /// them in pairs of intervals.
    pub axes: [Vec<f64>; 3],
    /// Tissue of each element layer along `z`, from the bottom.
    pub layers: Vec<Tissue>,
    /// `Hex8` or `Hex27`.
    pub kind: ElementKind,
}

/// `n + 1` evenly spaced coordinates from 0 to `length`.
#[must_use]
pub fn even(length: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| length * i as f64 / n as f64).collect()
}

/// Meshes the lattice, its nodes moved by `map`.
///
/// Node sets `x_min`, `x_max`, … and surfaces of the same names.
///
/// # Panics
/// If the lattice does not fit the element: a programming error.
#[must_use]
pub fn build(lattice: &BlockLattice, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let step = if lattice.kind == ElementKind::Hex27 { 2 } else { 1 };
    let count: [usize; 3] = std::array::from_fn(|i| lattice.axes[i].len());
    assert!(
        count.iter().all(|c| *c > step && (c - 1) % step == 0),
        "lattice does not fit the element"
    );
    assert_eq!(lattice.layers.len(), (count[2] - 1) / step, "one tissue a layer");
    let id = |i: usize, j: usize, k: usize| (i + count[0] * (j + count[1] * k)) as u32;
    let mut mesh = Mesh::default();
    for &z in &lattice.axes[2] {
        for &y in &lattice.axes[1] {
            mesh.nodes.extend(lattice.axes[0].iter().map(|&x| map([x, y, z])));
        }
    }
    let mut block = Block { kind: lattice.kind, connectivity: Vec::new(), tissue: Vec::new() };
    for k in (0..count[2] - 1).step_by(step) {
        for j in (0..count[1] - 1).step_by(step) {
            for i in (0..count[0] - 1).step_by(step) {
                for at in &HEX27_LATTICE[..lattice.kind.nodes()] {
                    let to = |c: i8| ((i64::from(c) + 1) * step as i64 / 2) as usize;
                    block.connectivity.push(id(i + to(at[0]), j + to(at[1]), k + to(at[2])));
                }
                block.tissue.push(lattice.layers[k / step]);
            }
        }
    }
    mesh.blocks.push(block);
    for axis in 0..3 {
        for (end, name) in [(0, "min"), (count[axis] - 1, "max")] {
            let name = format!("{}_{name}", ["x", "y", "z"][axis]);
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let node = |a: usize, b: usize| {
                let mut at = [0; 3];
                at[axis] = end;
                at[u] = a;
                at[v] = b;
                id(at[0], at[1], at[2])
            };
            let surface = side(count[u], count[v], step, end > 0, &node);
            mesh.node_sets.insert(name.clone(), surface.nodes());
            mesh.surfaces.insert(name, surface);
        }
    }
    mesh
}

/// Faces of a side; `outward` if `u x v` is the outward normal.
fn side(
    nu: usize,
    nv: usize,
    step: usize,
    outward: bool,
    node: &dyn Fn(usize, usize) -> u32,
) -> Surface {
    const ORDER: [[usize; 2]; 9] =
        [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]];
    let kind = if step == 1 { FaceKind::Quad4 } else { FaceKind::Quad9 };
    let mut connectivity = Vec::new();
    for b in (0..nv - 1).step_by(step) {
        for a in (0..nu - 1).step_by(step) {
            for p in &ORDER[..kind.nodes()] {
                let [mut du, mut dv] = p.map(|c| c * step / 2);
                if !outward {
                    std::mem::swap(&mut du, &mut dv);
                }
                connectivity.push(node(a + du, b + dv));
            }
        }
    }
    Surface { kind, connectivity }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_look_outward_and_have_the_right_area() {
        for kind in [ElementKind::Hex8, ElementKind::Hex27] {
            let step = if kind == ElementKind::Hex27 { 2 } else { 1 };
            let mesh = build(
                &BlockLattice {
                    axes: [even(1.0, 2), even(2.0, 2), even(3.0, 4)],
                    layers: vec![Tissue::Dermis; 4 / step],
                    kind,
                },
                |p| p,
            );
            for (name, s) in &mesh.surfaces {
                let mut total = [0.0; 3];
                s.integrate(&s.kind.quadrature(), &|n| mesh.nodes[n as usize], &mut |_, _, n| {
                    for i in 0..3 {
                        total[i] += n[i];
                    }
                });
                let axis = ["x", "y", "z"].iter().position(|a| name.starts_with(a)).unwrap();
                let area = 6.0 / (axis + 1) as f64;
                let sign = if name.ends_with("max") { 1.0 } else { -1.0 };
                assert!((total[axis] - sign * area).abs() < 1e-13, "{kind:?} {name} {total:?}");
            }
        }
    }
}
