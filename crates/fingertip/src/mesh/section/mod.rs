//! Structured all-quadrilateral mesh of the plane-strain section.
//!
//! Columns run inward from the skin, straight along its normal through epidermis
//! and dermis (or nail), then to the bone's point of the same eccentric angle. They
//! are narrowest at the pad's lowest point, where a wedge 0.05 mm wide presses, and
//! widen along the skin. An elastic bone goes on inward to a segment of its axis,
//! so all blocks share one grid: node `column * rows + row`. The whole section is
//! the half and its mirror image.
//!
//! What is held, by the [`Parts`] that deform:
//!
//! | bone | nail | held |
//! |---|---|---|
//! | rigid | rigid | tissue at bone and nail (default; what the 3-D finger does) |
//! | rigid | elastic | tissue at the bone, the nail's centre |
//! | elastic | rigid | tissue at the nail; the bone floats in the tissue |
//! | elastic | elastic | the nail's centre: **Chen, Shuai & Zhu** |
//!
//! They hold the nail's centre alone, so their bone floats, held through tissue
//! and nail: that is the elastic bone here, which at 17 000 MPa against 0.03 MPa is
//! rigid to five digits. A rigid one that floats would need constraint equations and
//! tell nothing else.

use super::fingertip::{Density, Parts};
use super::half_cube::geometric_fractions;
use super::mirror::mirrored;
use crate::geometry::section::{SectionShape, SectionShapeError};
use crate::tissue::Tissue;
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::{Block, FaceKind, Mesh, Surface};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// How much of the section is meshed.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// `x >= 0`, for what is symmetric about `x = 0`. Forces and energies are
    /// those of this half.
    #[default]
    Half,
    /// All of it.
    Whole,
}

/// Node intervals of a density; quadratic elements take them in pairs.
struct Resolution {
    /// Intervals through epidermis, dermis, fat and elastic bone, and the share of
    /// the layer that the outermost takes.
    layers: [(usize, f64); 4],
    /// Lateral size at the contact point, mm, and number of intervals of that size.
    first: (f64, usize),
    /// Ratio of a lateral interval to the last.
    growth: f64,
    /// Largest lateral interval on the skin, mm.
    largest_mm: f64,
}

impl Resolution {
    /// The epidermis' intervals are even: finer ones at the skin are crushed first
    /// under a tip that presses it to a fifth of its thickness.
    fn new(density: Density) -> Self {
        match density {
            Density::Coarse => Self {
                layers: [(4, 0.25), (4, 0.1), (8, 0.06), (2, 0.5)],
                first: (0.025, 4),
                growth: 1.3,
                largest_mm: 0.8,
            },
            Density::Medium => Self {
                layers: [(8, 0.125), (8, 0.05), (16, 0.03), (4, 0.25)],
                first: (0.025, 4),
                growth: 1.15,
                largest_mm: 0.4,
            },
            Density::Fine => Self {
                layers: [(16, 0.0625), (16, 0.025), (32, 0.015), (8, 0.125)],
                first: (0.0125, 8),
                growth: 1.075,
                largest_mm: 0.2,
            },
        }
    }

    /// Element boundaries along the skin from 0 to `length` mm.
    fn lateral_mm(&self, step: usize, length: f64) -> Vec<f64> {
        let (size, count) = (self.first.0 * step as f64, self.first.1 / step);
        let growth = self.growth.powi(step as i32);
        let largest = self.largest_mm * step as f64;
        let start = size * count as f64;
        let mut sizes = Vec::new();
        let (mut next, mut sum) = (size * growth, 0.0);
        while sum < length - start {
            sizes.push(next);
            sum += next;
            next = (next * growth).min(largest);
        }
        let scale = (length - start) / sum;
        let mut at: Vec<f64> = (0..=count).map(|k| size * k as f64).collect();
        let mut x = start;
        for s in sizes {
            x += scale * s;
            at.push(x);
        }
        let last = at.len() - 1;
        at[last] = length;
        at
    }
}

/// A meshed section.
#[derive(Clone, Debug)]
pub struct SectionMesh {
    /// The mesh. Node sets `symmetry` (x = 0), `bone` (the bone's outline),
    /// `nail_centre` (through the nail's thickness at x = 0) and, if the nail is
    /// rigid, `nail` (where tissue meets it); surfaces `skin` (edges that may be
    /// touched, up to the nail) and `interface` (between epidermis and dermis), edges
    /// in the order in which the skin is walked with the body on the left.
    pub mesh: Mesh,
    /// Held node sets and components; displacement along z is held by the solver.
    pub supports: Vec<(&'static str, [bool; 3])>,
}

impl SectionMesh {
    /// The supports as one flag a degree of freedom, `3 node + component`.
    #[must_use]
    pub fn fixed(&self) -> Vec<bool> {
        let mut fixed = vec![false; 3 * self.mesh.nodes.len()];
        for (set, components) in &self.supports {
            for &n in &self.mesh.node_sets[*set] {
                for i in 0..3 {
                    fixed[3 * n as usize + i] |= components[i];
                }
            }
        }
        fixed
    }
}

/// Why a section was not meshed.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SectionMeshError {
    /// The shape is bad.
    #[error(transparent)]
    Shape(#[from] SectionShapeError),
    /// Not an element of the plane.
    #[error("a section is meshed with Quad4, Quad8 or Quad9, not {0:?}")]
    Kind(ElementKind),
}

/// Meshes a section.
///
/// # Errors
/// See [`SectionMeshError`].
pub fn build(
    shape: &SectionShape,
    parts: Parts,
    density: Density,
    kind: ElementKind,
    extent: Extent,
) -> Result<SectionMesh, SectionMeshError> {
    if !kind.is_planar() {
        return Err(SectionMeshError::Kind(kind));
    }
    shape.validate()?;
    let grid = Grid::new(shape, parts, &Resolution::new(density), kind);
    let mut mesh = Mesh { nodes: grid.nodes(shape), ..Mesh::default() };
    mesh.blocks.push(grid.block());
    for (name, row) in [("skin", 0), ("interface", grid.row_of[1])] {
        mesh.surfaces.insert(name.into(), grid.edges(row));
    }
    let mut set = |name: &str, inside: &dyn Fn(usize, usize) -> bool| {
        let nodes = (0..mesh.nodes.len() as u32).filter(|&n| {
            let n = n as usize;
            inside(n / grid.rows(), n % grid.rows())
        });
        mesh.node_sets.insert(name.into(), nodes.collect());
    };
    let (last, inner, bone) = (grid.angles.len() - 1, grid.row_of[2], grid.row_of[3]);
    set("symmetry", &|c, r| c == 0 || c == last || (r > bone && r == grid.rows() - 1));
    set("bone", &|_, r| r == bone);
    set("nail_centre", &|c, r| c == last && r <= inner);
    if !parts.nail {
        let edge = grid.nail_column;
        set("nail", &|c, r| (c >= edge && r == inner) || (c == edge && r <= inner));
    }
    mesh.drop_unused_nodes();
    let mut supports = Vec::new();
    match extent {
        Extent::Half => supports.push(("symmetry", [true, false, false])),
        Extent::Whole => mesh = mirrored(&mesh, "symmetry"),
    }
    if !parts.bone {
        supports.push(("bone", [true, true, false]));
    }
    supports.push((if parts.nail { "nail_centre" } else { "nail" }, [true, true, false]));
    Ok(SectionMesh { mesh, supports })
}

/// Columns and rows of nodes.
struct Grid {
    kind: ElementKind,
    parts: Parts,
    /// Eccentric angle of each column, from the pad's lowest point to the nail's centre.
    angles: Vec<f64>,
    /// Column of the nail's edge.
    nail_column: usize,
    /// Fractions of each row through its layer; the layers share their end rows.
    fractions: Vec<Vec<f64>>,
    /// First row of each layer: epidermis, dermis, fat, bone.
    row_of: [usize; 4],
}

/// Tissue of each layer of rows.
const LAYERS: [Tissue; 4] = [Tissue::Epidermis, Tissue::Dermis, Tissue::Subcutaneous, Tissue::Bone];

impl Grid {
    fn new(shape: &SectionShape, parts: Parts, resolution: &Resolution, kind: ElementKind) -> Self {
        let step = kind.order();
        let edge_mm = shape.arc_mm(shape.nail_angle());
        let nail_mm = shape.arc_mm(PI) - edge_mm;
        let mut at = resolution.lateral_mm(step, edge_mm);
        let nail_column = step * (at.len() - 1);
        // Along the nail even, as on the skin beside it.
        let count = (nail_mm / (step as f64 * resolution.largest_mm)).ceil().max(1.0);
        at.extend((1..=count as u32).map(|k| edge_mm + nail_mm * f64::from(k) / count));
        let at = subdivide(&at, step);
        let mut angles: Vec<f64> = at.iter().map(|&s| shape.angle_at_arc(s)).collect();
        let last = angles.len() - 1;
        (angles[0], angles[last]) = (0.0, PI);
        angles[nail_column] = shape.nail_angle();
        let layers = if parts.bone { 4 } else { 3 };
        let mut fractions = Vec::new();
        let mut row_of = [0; 4];
        for (l, (intervals, first)) in resolution.layers[..layers].iter().enumerate() {
            let elements = (intervals / step) as u32;
            let through = if elements == 1 {
                vec![0.0, 1.0]
            } else {
                geometric_fractions(elements, first * step as f64)
            };
            fractions.push(subdivide(&through, step));
            if l < 3 {
                row_of[l + 1] = row_of[l] + intervals;
            }
        }
        Self { kind, parts, angles, nail_column, fractions, row_of }
    }

    /// Rows of nodes.
    fn rows(&self) -> usize {
        self.fractions.iter().map(|f| f.len() - 1).sum::<usize>() + 1
    }

    /// Node positions, column by column from the skin inward.
    fn nodes(&self, shape: &SectionShape) -> Vec<[f64; 3]> {
        let mut nodes = Vec::with_capacity(self.angles.len() * self.rows());
        for &angle in &self.angles {
            let [skin, interface, inner, bone] = shape.layers(angle);
            let bounds = [skin, interface, inner, bone, bone_axis(shape, angle)];
            nodes.push([skin[0], skin[1], 0.0]);
            for (l, fractions) in self.fractions.iter().enumerate() {
                let (p, q) = (bounds[l], bounds[l + 1]);
                nodes.extend(
                    fractions[1..]
                        .iter()
                        .map(|t| [(1.0 - t) * p[0] + t * q[0], (1.0 - t) * p[1] + t * q[1], 0.0]),
                );
            }
        }
        nodes
    }

    /// The elements; those of a rigid nail are left out.
    fn block(&self) -> Block {
        let step = self.kind.order();
        let rows = self.rows();
        let mut block = Block { kind: self.kind, connectivity: Vec::new(), region: Vec::new() };
        for column in (0..self.angles.len() - 1).step_by(step) {
            for row in (0..rows - 1).step_by(step) {
                let layer = self.row_of.iter().rposition(|&r| r <= row).unwrap_or_default();
                let nail = column >= self.nail_column && row < self.row_of[2];
                if nail && !self.parts.nail {
                    continue;
                }
                // xi along the skin, eta inward.
                for at in self.kind.lattice() {
                    let to = |c: i8| (i64::from(c) + 1) as usize * step / 2;
                    let node = (column + to(at[0])) * rows + row + to(at[1]);
                    block.connectivity.push(node as u32);
                }
                block.region.push(if nail { Tissue::Nail } else { LAYERS[layer] }.region());
            }
        }
        block
    }

    /// Edges along a row from the pad's lowest point to the nail, body on the left.
    fn edges(&self, row: usize) -> Surface {
        let kind = FaceKind::of(self.kind);
        let step = self.kind.order();
        let order: &[usize] = if step == 1 { &[0, 1] } else { &[0, 2, 1] };
        let connectivity = (0..self.nail_column)
            .step_by(step)
            .flat_map(|c| order.iter().map(move |o| ((c + o) * self.rows() + row) as u32))
            .collect();
        Surface { kind, connectivity }
    }
}

/// Where a column ends inside an elastic bone: on a segment of the axis of
/// symmetry half as long as the bone is high, evenly by angle. Rows then run from
/// the bone's outline to the segment without a pole.
fn bone_axis(shape: &SectionShape, angle: f64) -> [f64; 2] {
    let half = 0.25 * shape.bone_mm[1];
    [0.0, shape.bone_offset_mm - half * (1.0 - 2.0 * angle / PI)]
}

/// Cuts every interval into `step` even ones.
fn subdivide(at: &[f64], step: usize) -> Vec<f64> {
    let mut out = vec![at[0]];
    for pair in at.windows(2) {
        for k in 1..=step {
            let t = k as f64 / step as f64;
            out.push((1.0 - t) * pair[0] + t * pair[1]);
        }
    }
    out
}

#[cfg(test)]
mod tests;
