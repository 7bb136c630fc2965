//! The nail plate as hexahedra on the skin.

use super::extrude::Cells;
use super::half_cube::Grid;
use crate::geometry::fingertip::{FingertipShape, FingertipShapeError};
use crate::tissue::Tissue;
use papilla_fem::mesh::{Block, HangingNode, Mesh, Surface};
use std::collections::BTreeMap;

/// Intervals through the plate: two `Hex8` or one `Hex27`.
const INTERVALS: usize = 2;

/// What a solid nail plate adds to a mesh.
pub(super) struct Nail {
    /// The plate's elements; their inner faces are faces of the skin.
    pub block: Block,
    /// What is outside now: skin that the plate leaves bare, its top, its rim.
    pub outside: Surface,
}

/// Extrudes the skin faces all of whose nodes are in the node set `nail`
/// outward along the skin's normals and appends the new nodes to the mesh, the
/// top layer first. Above skin nodes that hang, those of the plate do.
///
/// # Errors
/// [`FingertipShapeError::NailTooSmall`] if no face is covered.
pub(super) fn attach(
    mesh: &mut Mesh,
    shape: &FingertipShape,
    grid: &Grid,
    step: usize,
    hanging: &[HangingNode],
) -> Result<Nail, FingertipShapeError> {
    let under = |s: &u32| mesh.node_sets["nail"].binary_search(s).is_ok();
    let (covered, bare): (Vec<_>, Vec<_>) =
        grid.cells.iter().cloned().partition(|cell| cell.iter().all(under));
    if covered.is_empty() {
        return Err(FingertipShapeError::NailTooSmall);
    }
    let mut local: BTreeMap<u32, u32> = covered.iter().flatten().map(|&s| (s, 0)).collect();
    for (i, index) in local.values_mut().enumerate() {
        *index = i as u32;
    }
    let (first, n) = (mesh.nodes.len() as u32, local.len() as u32);
    for layer in 0..INTERVALS {
        let height_mm = shape.nail_thickness_mm * (1.0 - layer as f64 / INTERVALS as f64);
        for &s in local.keys() {
            let p = mesh.nodes[s as usize];
            let normal = shape.skin_normal(p);
            mesh.nodes.push(std::array::from_fn(|i| p[i] + height_mm * normal[i]));
        }
    }
    for layer in 0..INTERVALS as u32 {
        let own = |s: u32| local.get(&s).map(|at| first + layer * n + at);
        for h in hanging {
            let [a, b, c] = h.masters.map(own);
            if let (Some(node), Some(a), Some(b), Some(c)) = (own(h.node), a, b, c) {
                mesh.hanging.push(HangingNode { node, masters: [a, b, c] });
            }
        }
    }
    // Layer INTERVALS is the skin itself.
    let node = |layer: usize, s: u32| {
        if layer == INTERVALS { s } else { first + layer as u32 * n + local[&s] }
    };
    let plate = Cells { cells: &covered, step };
    let mut outside = Cells { cells: &bare, step }.faces(|s| s);
    outside.connectivity.extend(plate.faces(|s| node(0, s)).connectivity);
    // Rows of the rim's cells run along it, columns from the skin to the top.
    let rim: Vec<Vec<u32>> = plate
        .rim()
        .iter()
        .flat_map(|side| (0..INTERVALS).step_by(step).map(move |low| (side, low)))
        .map(|(side, low)| {
            let column = |s: u32| (low..=low + step).map(move |height| (INTERVALS - height, s));
            side.iter().flat_map(|&s| column(s)).map(|(layer, s)| node(layer, s)).collect()
        })
        .collect();
    outside.connectivity.extend(Cells { cells: &rim, step }.faces(|a| a).connectivity);
    Ok(Nail { block: plate.hexahedra(&[Tissue::Nail; INTERVALS], node), outside })
}
