//! The table `[geometry]` of a scene: which body is pressed, and how finely it is meshed.

use super::error::{SceneError, is_length, require};
use crate::geometry::fingertip::FingertipShape;
use crate::geometry::section::SectionShape;
use crate::mesh::fingertip::{Density, Order};
use crate::mesh::section::Extent;
use crate::tissue::Tissue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What is pressed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Geometry {
    /// The fingertip.
    Fingertip {
        /// Mesh density; medium if not given.
        #[serde(default)]
        density: Density,
        /// Elements and layout of the mesh; graded if not given.
        #[serde(default)]
        order: Order,
        /// Dimensions that differ from the default.
        #[serde(default)]
        shape: FingertipShape,
        /// A finger of one's own, in place of `shape`: the folder of its `finger.toml`, from the
        /// scene's folder or the current one, or its name in `fingers/` there.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        finger: Option<PathBuf>,
    },
    /// The fingertip's cross-section, for the effect `plane_strain`. Forces and
    /// energies are per mm of length.
    Section {
        /// Mesh density; medium if not given.
        #[serde(default)]
        density: Density,
        /// Element order: `Quad4` or `Quad9`, the default.
        #[serde(default = "quadratic")]
        order: Order,
        /// Half of it, for symmetric indentations, or the whole.
        #[serde(default)]
        extent: Extent,
        /// Dimensions that differ from the default.
        #[serde(default)]
        shape: SectionShape,
    },
    /// A block in layers, pressed from below (`z_min`) and held on top (`z_max`).
    Block {
        /// Lengths along x and y, mm; the layers give the height.
        size_mm: [f64; 2],
        /// Elements along x and y.
        elements: [usize; 2],
        /// Layers from the pressed side.
        layers: Vec<Layer>,
        /// Element order: `Hex8`, the default, or `Hex27`.
        #[serde(default = "linear")]
        order: Order,
    },
    /// A Gmsh 4.1 file with physical groups: volumes named by tissue, surfaces
    /// by what they are for.
    Mesh {
        /// The `.msh` file, relative to the scene.
        file: PathBuf,
        /// Surfaces whose nodes are held.
        fixed: Vec<String>,
        /// Surface that the indenter may touch.
        contact: String,
    },
}

fn quadratic() -> Order {
    Order::Quadratic
}

fn linear() -> Order {
    Order::Linear
}

/// One layer of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// What it is made of.
    pub tissue: Tissue,
    /// Its thickness, mm.
    pub thickness_mm: f64,
    /// Elements through it.
    pub elements: usize,
}

/// Beyond it a length in mm must have been meant in another unit.
const LENGTH_MAX_MM: f64 = 1000.0;
/// Most elements of a block along an axis or through a layer.
const ELEMENTS_MAX: usize = 1000;

impl Geometry {
    pub(super) fn validate(&self) -> Result<(), SceneError> {
        match self {
            Self::Fingertip { shape, .. } => Ok(shape.validate()?),
            Self::Block { size_mm, elements, layers, order } => {
                even_lattice(*order)?;
                validate_block(size_mm, elements, layers)
            }
            Self::Section { shape, order, .. } => {
                even_lattice(*order)?;
                Ok(shape.validate()?)
            }
            Self::Mesh { .. } => Ok(()),
        }
    }
}

/// Only the cells of the fingertip can be split.
fn even_lattice(order: Order) -> Result<(), SceneError> {
    let rule = "is for kind = \"fingertip\": take \"linear\" or \"quadratic\"";
    require(order != Order::Graded, "geometry.order", &"graded", rule)
}

fn validate_block(
    size_mm: &[f64; 2],
    elements: &[usize; 2],
    layers: &[Layer],
) -> Result<(), SceneError> {
    let length = |v: f64| is_length(v) && v <= LENGTH_MAX_MM;
    let count = |n: usize| (1..=ELEMENTS_MAX).contains(&n);
    let (a_length, a_count) = ("has to be above 0 and at most 1000 mm", "has to be 1 to 1000");
    require(size_mm.iter().all(|&v| length(v)), "geometry.size_mm", size_mm, a_length)?;
    require(elements.iter().all(|&n| count(n)), "geometry.elements", elements, a_count)?;
    require(!layers.is_empty(), "geometry.layers", &layers, "has to list a layer at least")?;
    for (i, layer) in layers.iter().enumerate() {
        let field = |name: &str| format!("geometry.layers[{i}].{name}");
        let thickness = layer.thickness_mm;
        require(length(thickness), field("thickness_mm"), &thickness, a_length)?;
        require(count(layer.elements), field("elements"), &layer.elements, a_count)?;
    }
    Ok(())
}
