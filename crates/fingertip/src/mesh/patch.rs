//! The part of the skin that the atlas shows.

use super::half_cube::{Grid, GridSize};
use super::leaves::Leaf;
use papilla_fem::mesh::Mesh;

/// Fraction of the lateral sides that the atlas shows, from the palmar edge:
/// three quarters, about 112 degrees from the palmar line.
pub(super) const PATCH_SIDE_QUARTERS: u32 = 3;

/// The patch that the atlas shows, as indices into the mesh.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Skin nodes that are read: one a vertex, or those that `vertices` names.
    pub skin: Vec<u32>,
    /// Interface node straight below each.
    pub interface: Vec<u32>,
    /// Triangles of vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Where vertices are not nodes: how they are read off these.
    pub vertices: Option<Vertices>,
}

impl Patch {
    /// Undeformed places of the vertices on the skin and on the interface below, mm.
    #[must_use]
    pub fn places_mm(&self, mesh: &Mesh) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let at = |nodes: &[u32]| nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
        match &self.vertices {
            Some(v) => (v.skin_mm.clone(), v.interface_mm.clone()),
            None => (at(&self.skin), at(&self.interface)),
        }
    }
}

/// Values at the vertices of the atlas from those at nodes.
#[derive(Clone, Debug)]
pub struct Vertices {
    /// Undeformed places on the skin and on the interface below, mm.
    pub skin_mm: Vec<[f64; 3]>,
    /// See `skin_mm`.
    pub interface_mm: Vec<[f64; 3]>,
    /// Nine of [`Patch::skin`] a vertex, as indices into it.
    pub(super) nodes: Vec<[u32; 9]>,
    /// Their shape functions.
    pub(super) quadratic: Vec<[f64; 9]>,
    /// Functions that are linear between neighbouring nodes.
    pub(super) linear: Vec<[f64; 9]>,
    /// Where the corners of each of [`Patch::triangles`] lie among the cells: a side of the half cube,
    /// rows and columns.
    pub corners: Vec<(usize, [[f64; 2]; 3])>,
    /// Cells of the skin that hold them, with nodes as indices into [`Patch::skin`].
    pub cells: Vec<(Leaf, [u32; 9])>,
}

impl Vertices {
    /// SED at the vertices from its values below [`Patch::skin`].
    #[must_use]
    pub fn sed(&self, nodal: &[f64]) -> Vec<f64> {
        self.scalar(&self.quadratic, nodal)
    }

    /// Pressure, which is linear between nodes, at the vertices from its values at [`Patch::skin`].
    #[must_use]
    pub fn pressure(&self, nodal: &[f64]) -> Vec<f64> {
        self.scalar(&self.linear, nodal)
    }

    fn scalar(&self, functions: &[[f64; 9]], nodal: &[f64]) -> Vec<f64> {
        let sum = |(nodes, values): (&[u32; 9], &[f64; 9])| {
            nodes.iter().zip(values).map(|(&n, w)| w * nodal[n as usize]).sum::<f64>().max(0.0)
        };
        self.nodes.iter().zip(functions).map(sum).collect()
    }

    /// A vector field at the vertices from its values at [`Patch::skin`], or straight below.
    #[must_use]
    pub fn vector(&self, nodal: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let sum = |(nodes, values): (&[u32; 9], &[f64; 9])| {
            let of =
                |i: usize| nodes.iter().zip(values).map(|(&n, w)| w * nodal[n as usize][i]).sum();
            [of(0), of(1), of(2)]
        };
        self.nodes.iter().zip(&self.quadratic).map(sum).collect()
    }
}

/// Vertices and triangles of the palmar and lateral part of the grid. Quads are
/// cut so that the mirror image of the patch is cut alike.
pub(super) fn patch_of(grid: &Grid, size: GridSize, step: usize, interface_offset: u32) -> Patch {
    let side_max = size.side * PATCH_SIDE_QUARTERS / 4;
    let inside = |s: u32| grid.lattice[s as usize][1] <= side_max;
    let w = step + 1;
    let mut vertex = vec![u32::MAX; grid.parameters.len()];
    let mut skin = Vec::new();
    let mut triangles = Vec::new();
    for cell in &grid.cells {
        for r in 0..step {
            for c in 0..step {
                let corner = [
                    cell[r * w + c],
                    cell[(r + 1) * w + c],
                    cell[(r + 1) * w + c + 1],
                    cell[r * w + c + 1],
                ];
                if !corner.iter().all(|&s| inside(s)) {
                    continue;
                }
                let v = corner.map(|s| {
                    if vertex[s as usize] == u32::MAX {
                        vertex[s as usize] = skin.len() as u32;
                        skin.push(s);
                    }
                    vertex[s as usize]
                });
                let left: u32 = corner.iter().map(|&s| grid.lattice[s as usize][0]).sum();
                if left < 2 * size.across {
                    triangles.extend([[v[0], v[1], v[2]], [v[0], v[2], v[3]]]);
                } else {
                    triangles.extend([[v[0], v[1], v[3]], [v[1], v[2], v[3]]]);
                }
            }
        }
    }
    let interface = skin.iter().map(|s| s + interface_offset).collect();
    Patch { skin, interface, triangles, vertices: None }
}
