//! All-hexahedral layered mesh of the fingertip.
//!
//! The skin's quad grid is extruded inward through epidermis, dermis and fat to
//! the bone. Node `layer * n + s` lies below skin node `s`, so skin and
//! epidermis-dermis interface share one topology: the atlas needs no search.

use super::half_cube::{Grid, GridSize};
use super::{Block, FaceKind, Mesh, Surface, Tissue};
use crate::element::ElementKind;
use crate::element::reference::HEX27_LATTICE;
use crate::geometry::fingertip::{FingertipShape, FingertipShapeError};
use serde::{Deserialize, Serialize};

/// Named mesh densities.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Density {
    /// About 10 thousand unknowns: for tests and a first look.
    Coarse,
    /// About 60 thousand unknowns: the campaigns' density.
    Medium,
    /// About 200 thousand unknowns: the reference.
    Fine,
}

/// Order of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// `Hex8` with mean dilatation.
    #[default]
    Linear,
    /// `Hex27` on the same nodes: a quarter of the cells on the skin.
    Quadratic,
}

/// x
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Parts {
    /// x
    pub bone: bool,
    /// x
    pub nail: bool,
}

/// Lattice sizes of a density: surface grid and intervals through each layer.
struct Resolution {
    grid: GridSize,
    /// Node positions through each layer as fractions from its outer side.
    epidermis: &'static [f64],
    dermis: &'static [f64],
    fat: &'static [f64],
}

impl Density {
    fn resolution(self, order: Order) -> Resolution {
        let (grid, dermis, fat): (_, &'static [f64], &'static [f64]) = match self {
            Self::Coarse => (
                GridSize { across: 12, side: 8, cap: 6, body: 6 },
                &[0.0, 0.35, 1.0],
                &[0.0, 0.2, 0.45, 0.7, 1.0],
            ),
            Self::Medium => (
                GridSize { across: 22, side: 16, cap: 12, body: 10 },
                &[0.0, 0.15, 0.35, 0.65, 1.0],
                &[0.0, 0.15, 0.35, 0.65, 1.0],
            ),
            Self::Fine => (
                GridSize { across: 32, side: 24, cap: 20, body: 16 },
                &[0.0, 0.1, 0.25, 0.45, 0.7, 1.0],
                &[0.0, 0.1, 0.2, 0.32, 0.47, 0.63, 0.81, 1.0],
            ),
        };
        match order {
            Order::Linear => Resolution { grid, epidermis: &[0.0, 1.0], dermis, fat },
            Order::Quadratic => Resolution {
                grid,
                epidermis: &[0.0, 0.5, 1.0],
                dermis: match self {
                    Self::Fine => &[0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0],
                    Self::Medium => &[0.0, 0.175, 0.35, 0.675, 1.0],
                    Self::Coarse => &[0.0, 0.5, 1.0],
                },
                fat: match self {
                    Self::Fine => &[0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0],
                    _ => &[0.0, 0.2, 0.4, 0.7, 1.0],
                },
            },
        }
    }
}

/// The patch that the atlas shows, as indices into the mesh.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Skin node of each vertex.
    pub skin: Vec<u32>,
    /// Interface node of each vertex, straight below.
    pub interface: Vec<u32>,
    /// Triangles of vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A meshed fingertip.
#[derive(Clone, Debug)]
pub struct FingertipMesh {
    /// The mesh. Node sets `bone`, `nail`, `base`; surfaces `skin`, `interface`.
    pub mesh: Mesh,
    /// What the atlas shows.
    pub patch: Patch,
}

/// Fraction of the lateral sides that the atlas shows, from the palmar edge:
/// three quarters, about 112 degrees from the palmar line.
const PATCH_SIDE_QUARTERS: u32 = 3;

/// Meshes a fingertip.
///
/// # Errors
/// Refuses a shape whose lengths contradict each other; see [`FingertipShapeError`].
pub fn build(
    shape: &FingertipShape,
    density: Density,
    order: Order,
    _parts: Parts,
) -> Result<FingertipMesh, FingertipShapeError> {
    shape.validate()?;
    let resolution = density.resolution(order);
    let size = resolution.grid;
    let step = if order == Order::Linear { 1 } else { 2 };
    let cap_row_mm = shape.cap_length_mm * std::f64::consts::FRAC_PI_4 / f64::from(size.cap);
    let first = cap_row_mm / (shape.length_mm - shape.cap_length_mm);
    let grid = size.build(step, first);
    let (nodes, layer_tissue) = extrude(shape, &grid, &resolution)?;
    let n = grid.parameters.len();
    let mut mesh = Mesh { nodes, ..Mesh::default() };
    mesh.blocks.push(solid_block(&grid, step as usize, &layer_tissue));
    let interface_layer = resolution.epidermis.len() - 1;
    let skin = surface(&grid, step as usize, 0);
    mesh.surfaces
        .insert("interface".into(), surface(&grid, step as usize, (interface_layer * n) as u32));
    mesh.surfaces.insert("skin".into(), skin);
    let layers = mesh.nodes.len() / n;
    let last = ((layers - 1) * n) as u32;
    mesh.node_sets.insert("bone".into(), (last..last + n as u32).collect());
    let nail = (0..n as u32).filter(|&s| shape.under_nail(mesh.nodes[s as usize])).collect();
    mesh.node_sets.insert("nail".into(), nail);
    let rows = size.cap + size.body;
    let base =
        (0..layers * n).filter(|i| grid.lattice[i % n][2] == rows).map(|i| i as u32).collect();
    mesh.node_sets.insert("base".into(), base);
    let patch = patch(&grid, size, step as usize, (interface_layer * n) as u32);
    Ok(FingertipMesh { mesh, patch })
}

/// Node positions layer by layer from the skin, and the tissue of each interval.
fn extrude(
    shape: &FingertipShape,
    grid: &Grid,
    resolution: &Resolution,
) -> Result<(Vec<[f64; 3]>, Vec<Tissue>), FingertipShapeError> {
    let bounds = grid.parameters.iter().map(|&s| shape.layers(s)).collect::<Result<Vec<_>, _>>()?;
    let mut nodes: Vec<[f64; 3]> = bounds.iter().map(|b| b[0]).collect();
    let mut tissue = Vec::new();
    let layers = [
        (Tissue::Epidermis, resolution.epidermis),
        (Tissue::Dermis, resolution.dermis),
        (Tissue::Subcutaneous, resolution.fat),
    ];
    for (l, (name, fractions)) in layers.into_iter().enumerate() {
        for &t in &fractions[1..] {
            nodes.extend(bounds.iter().map(|b| -> [f64; 3] {
                std::array::from_fn(|i| b[l][i] + t * (b[l + 1][i] - b[l][i]))
            }));
            tissue.push(name);
        }
    }
    Ok((nodes, tissue))
}

/// Hexahedra between the layers; `zeta` points outward.
fn solid_block(grid: &Grid, step: usize, layer_tissue: &[Tissue]) -> Block {
    let n = grid.parameters.len();
    let kind = if step == 1 { ElementKind::Hex8 } else { ElementKind::Hex27 };
    let half = step as i64;
    let mut block = Block { kind, connectivity: Vec::new(), tissue: Vec::new() };
    for top in (0..layer_tissue.len()).step_by(step) {
        for cell in &grid.cells {
            for at in &HEX27_LATTICE[..kind.nodes()] {
                // -1, 0, 1 to 0 .. step; xi runs along rows, eta along columns.
                let to = |c: i8| ((i64::from(c) + 1) * half / 2) as usize;
                let (r, c, depth) = (to(at[0]), to(at[1]), step - to(at[2]));
                block.connectivity.push(((top + depth) * n) as u32 + cell[r * (step + 1) + c]);
            }
            block.tissue.push(layer_tissue[top]);
        }
    }
    block
}

/// The grid's cells as faces of a layer, counter-clockwise from outside.
fn surface(grid: &Grid, step: usize, offset: u32) -> Surface {
    let w = step + 1;
    let order: &[usize] = if step == 1 { &[0, 2, 3, 1] } else { &[0, 6, 8, 2, 3, 7, 5, 1, 4] };
    debug_assert!(order.len() == w * w);
    let kind = if step == 1 { FaceKind::Quad4 } else { FaceKind::Quad9 };
    let connectivity =
        grid.cells.iter().flat_map(|cell| order.iter().map(move |&i| offset + cell[i])).collect();
    Surface { kind, connectivity }
}

/// Vertices and triangles of the palmar and lateral part of the grid. Quads are
/// cut so that the mirror image of the patch is cut alike.
fn patch(grid: &Grid, size: GridSize, step: usize, interface_offset: u32) -> Patch {
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
    Patch { skin, interface, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::BlockGeometry;

    #[test]
    fn every_density_and_order_meshes_without_a_fold() {
        let shape = FingertipShape::default();
        for density in [Density::Coarse, Density::Medium, Density::Fine] {
            for order in [Order::Linear, Order::Quadratic] {
                let finger = build(&shape, density, order, Parts::default()).unwrap();
                let block = &finger.mesh.blocks[0];
                let geometry =
                    BlockGeometry::new(block.kind, &finger.mesh.nodes, &block.connectivity);
                assert!(geometry.is_ok(), "{density:?} {order:?}: {:?}", geometry.err());
            }
        }
    }

    #[test]
    fn skin_faces_look_outward() {
        let finger = build(&FingertipShape::default(), Density::Coarse, Order::Linear, Parts::default()).unwrap();
        let skin = &finger.mesh.surfaces["skin"];
        let centre = [15.0, 0.0, 0.0];
        let position = |n: u32| finger.mesh.nodes[n as usize];
        skin.integrate(&skin.kind.quadrature(), &position, &mut |face, value, normal| {
            let x: [f64; 3] = std::array::from_fn(|i| {
                face.iter().zip(value).map(|(&n, v)| v * position(n)[i]).sum()
            });
            let outward: f64 = (0..3).map(|i| normal[i] * (x[i] - centre[i])).sum();
            assert!(outward > 0.0, "{x:?} {normal:?}");
        });
    }

    #[test]
    fn the_mesh_mirrors_left_to_right_exactly() {
        let finger = build(&FingertipShape::default(), Density::Coarse, Order::Linear, Parts::default()).unwrap();
        let key = |p: [f64; 3]| p.map(f64::to_bits);
        let set: std::collections::HashSet<_> =
            finger.mesh.nodes.iter().map(|&p| key([p[0], p[1] + 0.0, p[2]])).collect();
        let missing =
            finger.mesh.nodes.iter().filter(|p| !set.contains(&key([p[0], -p[1] + 0.0, p[2]])));
        assert_eq!(missing.count(), 0);
    }

    #[test]
    fn the_patch_is_a_disc() {
        let finger = build(&FingertipShape::default(), Density::Coarse, Order::Linear, Parts::default()).unwrap();
        let p = &finger.patch;
        let mut edges = std::collections::HashSet::new();
        for t in &p.triangles {
            for e in 0..3 {
                assert!(edges.insert((t[e], t[(e + 1) % 3])), "edge twice in one direction");
            }
        }
        let boundary = edges.iter().filter(|(a, b)| !edges.contains(&(*b, *a))).count();
        let undirected = (edges.len() + boundary) / 2;
        let euler = p.skin.len() as i64 - undirected as i64 + p.triangles.len() as i64;
        assert_eq!(euler, 1, "V - E + F of a disc");
    }
}
