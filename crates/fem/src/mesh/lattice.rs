//! Blocks of one region of any element, and how they are refined.

use super::block::{BlockLattice, build, even};
use super::{Block, FaceKind, Mesh, Region, Surface};
use crate::element::ElementKind;
use crate::element::reference::HEX27_LATTICE;
use crate::element::shape::TET10_EDGES;
use std::collections::{HashMap, HashSet};

/// Region of every element of a [`lattice`].
pub const REGION: Region = Region(0);

/// Meshes `axes` with elements of `kind`, all of one region, nodes moved by
/// `map`. Planar elements take the first two axes.
pub fn lattice(
    kind: ElementKind,
    mut axes: [Vec<f64>; 3],
    map: impl Fn([f64; 3]) -> [f64; 3],
) -> Mesh {
    if kind.is_planar() {
        axes[2] = vec![0.0];
    }
    let tetrahedral = kind.lattice().is_empty();
    let cells = if tetrahedral { ElementKind::Hex8 } else { kind };
    let layers = vec![REGION; (axes[kind.dimension() - 1].len() - 1) / cells.order()];
    let mesh = build(&BlockLattice { axes, layers, kind: cells }, map);
    if tetrahedral { tetrahedra(mesh, kind) } else { mesh }
}

/// Node intervals of a lattice along an edge of an element (tetrahedra get
/// their mid-edge nodes later).
pub fn intervals(kind: ElementKind) -> usize {
    if kind.lattice().is_empty() { 1 } else { kind.order() }
}

/// A unit cube of `cells^3` elements (tetrahedra: six a cell), or a unit square
/// of `cells^2` planar ones.
pub fn cube(kind: ElementKind, cells: usize, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let axis = even(1.0, intervals(kind) * cells);
    lattice(kind, [axis.clone(), axis.clone(), axis], map)
}

/// Cuts every hexahedron into six tetrahedra along its main diagonal, and the faces of
/// surfaces with them. Mid-edge nodes join the node sets that hold both ends.
pub fn tetrahedra(mut mesh: Mesh, kind: ElementKind) -> Mesh {
    const PATHS: [[usize; 3]; 6] =
        [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let hexes = mesh.blocks.remove(0);
    let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
    let mut connectivity = Vec::new();
    let mut region = Vec::new();
    for e in 0..hexes.len() {
        let corners = hexes.element(e);
        for (p, path) in PATHS.iter().enumerate() {
            let mut at = [-1i8; 3];
            let mut tet = [0; 4];
            for step in 0..4 {
                let a = HEX27_LATTICE[..8].iter().position(|c| *c == at).unwrap_or(0);
                tet[step] = corners[a];
                if step < 3 {
                    at[path[step]] = 1;
                }
            }
            if p >= 3 {
                tet.swap(1, 2);
            }
            connectivity.extend(tet);
            if kind == ElementKind::Tet10 {
                for [a, b] in TET10_EDGES {
                    let key = (tet[a].min(tet[b]), tet[a].max(tet[b]));
                    let next = mesh.nodes.len() as u32;
                    let id = *middle.entry(key).or_insert(next);
                    if id == next {
                        let (x, y) = (mesh.nodes[key.0 as usize], mesh.nodes[key.1 as usize]);
                        mesh.nodes.push(std::array::from_fn(|i| 0.5 * (x[i] + y[i])));
                    }
                    connectivity.push(id);
                }
            }
            region.push(hexes.region[e]);
        }
    }
    cut_surfaces(&mut mesh, &connectivity, kind, &middle);
    for set in mesh.node_sets.values_mut() {
        let both =
            |(a, b): &(u32, u32)| set.binary_search(a).is_ok() && set.binary_search(b).is_ok();
        let new: Vec<_> = middle.iter().filter(|(k, _)| both(k)).map(|(_, &m)| m).collect();
        set.extend(new);
        set.sort_unstable();
    }
    mesh.blocks.push(Block { kind, connectivity, region });
    mesh
}

/// Cuts every quadrangle into the two triangles that tetrahedra have there.
fn cut_surfaces(
    mesh: &mut Mesh,
    tetrahedra: &[u32],
    kind: ElementKind,
    middle: &HashMap<(u32, u32), u32>,
) {
    let key = |a: u32, b: u32| (a.min(b), a.max(b));
    let edges: HashSet<_> = tetrahedra
        .chunks_exact(kind.nodes())
        .flat_map(|tet| TET10_EDGES.map(|[a, b]| key(tet[a], tet[b])))
        .collect();
    for surface in mesh.surfaces.values_mut() {
        let mut connectivity = Vec::new();
        for face in surface.faces() {
            let [a, b, c, d] = [face[0], face[1], face[2], face[3]];
            let halves = match edges.contains(&key(a, c)) {
                true => [[a, b, c], [a, c, d]],
                false => [[b, c, d], [b, d, a]],
            };
            for half in halves {
                connectivity.extend(half);
                if kind == ElementKind::Tet10 {
                    connectivity.extend((0..3).map(|k| middle[&key(half[k], half[(k + 1) % 3])]));
                }
            }
        }
        *surface = Surface { kind: FaceKind::of(kind), connectivity };
    }
}

/// Coordinates from 0: steps of `h` up to `fine`, then growing by `ratio` up to
/// `end` exactly; an even number of intervals, as quadratic elements need.
pub fn graded(h: f64, fine: f64, ratio: f64, end: f64) -> Vec<f64> {
    let n = (fine / h).round() as usize;
    let mut axis: Vec<f64> = (0..=n).map(|i| h * i as f64).collect();
    let start = axis[n];
    let mut steps = 0;
    let mut length = 0.0;
    while length < end - start || (n + steps) % 2 == 1 {
        steps += 1;
        length += h * ratio.powi(steps as i32);
    }
    let scale = (end - start) / length;
    let mut x = start;
    for s in 1..=steps {
        x += scale * h * ratio.powi(s as i32);
        axis.push(x);
    }
    axis
}

/// Faces of which every node satisfies `keep`.
pub fn part(surface: &Surface, keep: impl Fn(u32) -> bool) -> Surface {
    let faces = surface.faces().filter(|f| f.iter().all(|&n| keep(n)));
    Surface { kind: surface.kind, connectivity: faces.flatten().copied().collect() }
}
