//! All-hexahedral layered mesh of the fingertip.
//!
//! The skin's quad grid is extruded inward through epidermis, dermis and fat to
//! the bone, and through the bone's cortex where the bone is solid. Node
//! `layer * n + s` lies below skin node `s`, so skin and epidermis-dermis
//! interface share one topology: the atlas needs no search. A solid nail's nodes
//! come last. Soft tissue has the same nodes and elements, in the same order,
//! whatever else is solid.

mod blame;
mod soundness;
mod unfolded;

use super::extrude::Cells;
use super::grading::{Closeness, Contact, Spacing};
use super::half_cube::{Grid, GridSize, MEDIUM};
use super::nail;
use super::patch::patch_of;
use super::refined::{self, Refined};
use super::transfer::Transfer;
use crate::geometry::fingertip::{FingertipShape, FingertipShapeError};
use crate::indenter::IndenterError;
use crate::tissue::Tissue;
use papilla_fem::mesh::Mesh;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) use blame::blame;
pub use soundness::check_elements;

pub use super::leaves::Leaf;
pub use super::patch::{Patch, Vertices};

/// Named mesh densities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Density {
    /// About 12 thousand unknowns: for tests and a first look.
    Coarse,
    /// About 54 thousand unknowns: the campaigns' density.
    #[default]
    Medium,
    /// About 185 thousand unknowns: the reference.
    Fine,
}

/// Order of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// `Hex8` with mean dilatation.
    Linear,
    /// `Hex27` on the same nodes: a quarter of the cells on the skin.
    Quadratic,
    /// `Hex27` in layers that are thin beside the interface, cells split where the indenter
    /// touches: for SED that a finer mesh changes less.
    #[default]
    Graded,
}

impl Order {
    /// Whether it is [`Order::Linear`].
    #[must_use]
    pub const fn is_linear(&self) -> bool {
        matches!(self, Self::Linear)
    }

    /// Lattice intervals along an edge of an element.
    const fn step(self) -> u32 {
        match self {
            Self::Linear => 1,
            Self::Quadratic | Self::Graded => 2,
        }
    }
}

/// Which parts are meshed as solids. What is not is rigid: its surface is there,
/// as a node set, to be held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Parts {
    /// The distal phalanx: a cortex around an empty marrow cavity. A box lattice
    /// inside would be no cheaper (medium: 20 k unknowns against 12 k) and fold
    /// along its edges, where two of its faces meet at 180 degrees on the
    /// bone's smooth section.
    pub bone: bool,
    /// The nail plate, on the skin, held by the skin alone.
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

/// Node positions through the bone's cortex: two `Hex8` or one `Hex27`.
const CORTEX: &[f64] = &[0.0, 0.5, 1.0];

impl Density {
    fn resolution(self, order: Order) -> Resolution {
        let (grid, dermis, fat): (_, &'static [f64], &'static [f64]) = match self {
            Self::Coarse => (
                GridSize { across: 12, side: 8, cap: 6, body: 6 },
                &[0.0, 0.35, 1.0],
                &[0.0, 0.2, 0.45, 0.7, 1.0],
            ),
            Self::Medium => (MEDIUM, &[0.0, 0.15, 0.35, 0.65, 1.0], &[0.0, 0.15, 0.35, 0.65, 1.0]),
            Self::Fine => (
                GridSize { across: 32, side: 24, cap: 20, body: 16 },
                &[0.0, 0.1, 0.25, 0.45, 0.7, 1.0],
                &[0.0, 0.1, 0.2, 0.32, 0.47, 0.63, 0.81, 1.0],
            ),
        };
        match order {
            Order::Linear => Resolution { grid, epidermis: &[0.0, 1.0], dermis, fat },
            Order::Graded => self.graded(),
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

impl FingertipMesh {
    /// What an indenter wants that the smallest cells do not give; `None` where they do.
    #[must_use]
    pub fn unresolved(&self, density: Density) -> Option<IndenterError> {
        let [wanted_mm, spacing_mm] = self.refined.as_ref()?.unresolved_mm()?;
        let radius_mm = (spacing_mm / density.closeness().of_radius_mm).powi(2);
        Some(IndenterError::FinerThanCells { wanted_mm, spacing_mm, radius_mm })
    }
}

impl Density {
    /// Two elements through the epidermis and a dermis whose first is .08 mm thick: SED at
    /// the interface of a plane section is then within 1 to 3 % of that of many more layers.
    fn graded(self) -> Resolution {
        let (dermis, fat): (&'static [f64], &'static [f64]) = match self {
            Self::Fine => (
                &[0.0, 0.03, 0.06, 0.13, 0.2, 0.35, 0.5, 0.75, 1.0],
                &[0.0, 0.12, 0.25, 0.4, 0.6, 0.8, 1.0],
            ),
            _ => (&[0.0, 0.04, 0.08, 0.2, 0.35, 0.65, 1.0], &[0.0, 0.2, 0.4, 0.7, 1.0]),
        };
        Resolution { grid: refined::BASE, epidermis: &[0.0, 0.25, 0.5, 0.75, 1.0], dermis, fat }
    }

    /// How close nodes are under an indenter.
    const fn closeness(self) -> Closeness {
        let (of_radius_mm, flat_mm, edge_mm, growth) = match self {
            Self::Coarse => (0.24, 0.8, 0.8, 0.8),
            Self::Medium => (0.14, 0.6, 0.2, 0.6),
            Self::Fine => (0.075, 0.35, 0.12, 0.45),
        };
        Closeness { of_radius_mm, flat_mm, edge_mm, growth }
    }
}

/// A meshed fingertip.
///
/// Node sets: `bone`, the bone's outer surface, and `nail`, the skin under the
/// nail plate, for holding a rigid bone and nail; `base`, the soft tissue's base
/// plane; with a solid bone also `bone_base`, its section in that plane, which
/// then is the finger's support.
///
/// Surfaces: `skin`, all that an indenter may touch, and `interface`, between
/// epidermis and dermis. A solid nail plate is part of `skin`, with its top and
/// its rim, and the skin below it is not; an indenter under the pad meets
/// neither, and the patch is the same.
#[derive(Clone, Debug)]
pub struct FingertipMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// What the atlas shows.
    pub patch: Patch,
    /// Its cells, where they are split.
    pub(super) refined: Option<Refined>,
}

/// Meshes a fingertip; of [`Order::Graded`] with cells as small as `contact` wants them.
///
/// # Errors
/// Refuses a shape whose lengths contradict each other; see [`FingertipShapeError`].
pub fn build(
    shape: &FingertipShape,
    density: Density,
    order: Order,
    parts: Parts,
    contact: Option<&Contact>,
) -> Result<FingertipMesh, FingertipShapeError> {
    shape.validate()?;
    let resolution = density.resolution(order);
    if order != Order::Graded {
        return layered(shape, &resolution, order, parts, None);
    }
    match contact {
        None => layered(shape, &resolution, order, parts, Some(Refined::new(shape, None))),
        Some(contact) => {
            let spacing = Spacing::new(shape, contact, density.closeness());
            unfolded::layered(shape, &resolution, parts, Refined::new(shape, Some(spacing)))
        }
    }
}

/// Meshes a fingertip in [`Order::Graded`] for a given pressure: `pressed` says of a point of the skin
/// whether the pressure's edge passes there, or `None` where nothing presses.
///
/// # Errors
/// As [`build`].
pub fn build_pressed(
    shape: &FingertipShape,
    density: Density,
    parts: Parts,
    pressed: &dyn Fn([f64; 3]) -> Option<bool>,
) -> Result<FingertipMesh, FingertipShapeError> {
    shape.validate()?;
    let spacing = Spacing::of_pressure(shape, pressed, density.closeness());
    let refined = Refined::new(shape, Some(spacing));
    unfolded::layered(shape, &density.resolution(Order::Graded), parts, refined)
}

/// The mesh `fine`, of [`build`] in [`Order::Graded`], with cells as large as those of
/// [`Density::Coarse`], and what reads its displacement at the nodes of `fine`; `None` where it
/// would be that mesh, no contact splits cells, or a solid nail has nodes of its own.
///
/// # Errors
/// As [`build`].
pub fn build_guide(
    shape: &FingertipShape,
    density: Density,
    parts: Parts,
    fine: &FingertipMesh,
) -> Result<Option<(FingertipMesh, Transfer)>, FingertipShapeError> {
    let leads = density != Density::Coarse && !parts.nail;
    let Some(to) = fine.refined.as_ref().filter(|_| leads) else { return Ok(None) };
    let Some(spacing) = &to.spacing else { return Ok(None) };
    let guide = Refined::new(shape, Some(spacing.with(Density::Coarse.closeness())));
    let mesh = unfolded::layered(shape, &density.resolution(Order::Graded), parts, guide)?;
    let transfer = mesh.refined.as_ref().map(|guide| Transfer::new(guide, to));
    Ok(transfer.map(|transfer| (mesh, transfer)))
}

/// Extrudes the skin's grid through the layers.
fn layered(
    shape: &FingertipShape,
    resolution: &Resolution,
    order: Order,
    parts: Parts,
    refined: Option<Refined>,
) -> Result<FingertipMesh, FingertipShapeError> {
    let step = order.step();
    let lattice;
    let (grid, size, hanging) = match &refined {
        Some(r) => (&r.grid, r.size, &r.hanging[..]),
        None => {
            let size = resolution.grid;
            lattice = size.build(step, &size.body_fractions(shape));
            (&lattice, size, &[][..])
        }
    };
    let step = step as usize;
    let n = grid.parameters.len();
    let under_nail = (0..n as u32)
        .filter(|&s| shape.under_nail(shape.skin(grid.parameters[s as usize])))
        .collect();
    let (nodes, tissue) = extrude(shape, grid, resolution, parts.bone)?;
    let mut mesh = Mesh { nodes, ..Mesh::default() };
    let cells = Cells { cells: &grid.cells, step };
    mesh.blocks.push(cells.hexahedra(&tissue, |layer, s| (layer * n) as u32 + s));
    let interface = ((resolution.epidermis.len() - 1) * n) as u32;
    mesh.surfaces.insert("interface".into(), cells.faces(|s| interface + s));
    mesh.surfaces.insert("skin".into(), cells.faces(|s| s));
    let bone_layer = tissue.iter().filter(|&&t| t != Tissue::Bone).count();
    let bone = (bone_layer * n) as u32;
    mesh.node_sets.insert("bone".into(), (bone..bone + n as u32).collect());
    mesh.node_sets.insert("nail".into(), under_nail);
    let rows = size.cap + size.body;
    let in_base_plane = |layers: std::ops::Range<usize>| {
        let nodes = layers.start * n..layers.end * n;
        nodes.filter(|i| grid.lattice[i % n][2] == rows).map(|i| i as u32).collect()
    };
    mesh.node_sets.insert("base".into(), in_base_plane(0..bone_layer + 1));
    if parts.bone {
        let layers = bone_layer..tissue.len() + 1;
        mesh.node_sets.insert("bone_base".into(), in_base_plane(layers));
    }
    refined::hang(&mut mesh, hanging, n);
    if parts.nail {
        let plate = nail::attach(&mut mesh, shape, grid, step, hanging)?;
        mesh.blocks.push(plate.block);
        mesh.surfaces.insert("skin".into(), plate.outside);
    }
    let patch = match &refined {
        Some(r) => r.patch(shape, interface)?,
        None => patch_of(grid, size, step, interface),
    };
    Ok(FingertipMesh { mesh, patch, refined })
}

/// Node positions layer by layer from the skin, and the tissue of each interval.
fn extrude(
    shape: &FingertipShape,
    grid: &Grid,
    resolution: &Resolution,
    bone: bool,
) -> Result<(Vec<[f64; 3]>, Vec<Tissue>), FingertipShapeError> {
    let bounds = grid.parameters.iter().map(|&s| shape.layers(s)).collect::<Result<Vec<_>, _>>()?;
    let mut nodes: Vec<[f64; 3]> = bounds.iter().map(|b| b[0]).collect();
    let mut tissue = Vec::new();
    let mut layer = |name, fractions: &[f64], ends: &dyn Fn(usize) -> [[f64; 3]; 2]| {
        for &t in &fractions[1..] {
            nodes.extend((0..bounds.len()).map(|s| -> [f64; 3] {
                let [outer, inner] = ends(s);
                std::array::from_fn(|i| outer[i] + t * (inner[i] - outer[i]))
            }));
            tissue.push(name);
        }
    };
    let soft = [
        (Tissue::Epidermis, resolution.epidermis),
        (Tissue::Dermis, resolution.dermis),
        (Tissue::Subcutaneous, resolution.fat),
    ];
    for (l, (name, fractions)) in soft.into_iter().enumerate() {
        layer(name, fractions, &|s| [bounds[s][l], bounds[s][l + 1]]);
    }
    if bone {
        shape.validate_cortex()?;
        layer(Tissue::Bone, CORTEX, &|s| [bounds[s][3], shape.marrow(grid.parameters[s])]);
    }
    Ok((nodes, tissue))
}

#[cfg(test)]
mod tests;
