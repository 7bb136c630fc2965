//! What is pressed.

use super::error::{SceneError, is_length, require};
use crate::geometry::fingertip::FingertipShape;
use crate::geometry::section::SectionShape;
use crate::mesh::Tissue;
use crate::mesh::fingertip::{Density, Order};
use crate::mesh::section::Extent;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What is pressed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Geometry {
    /// The fingertip.
    Fingertip {
        /// Mesh density.
        density: Density,
        /// Element order.
        #[serde(default)]
        order: Order,
        /// Dimensions that differ from the default.
        #[serde(default)]
        shape: FingertipShape,
    },
    /// The fingertip's cross-section, for the effect `plane_strain`. Forces and
    /// energies are per mm of length.
    Section {
        /// Mesh density.
        density: Density,
        /// Element order: `Quad4` or `Quad9`.
        #[serde(default = "quadratic")]
        order: Order,
        /// Half of it, for symmetric presses, or the whole.
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
        /// Element order.
        #[serde(default)]
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

/// One layer of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// What it is made of.
    pub tissue: Tissue,
    /// Its thickness, mm.
    pub thickness_mm: f64,
    /// Elements through it.
    pub elements: usize,
}

/// Most elements of a block along an axis or through a layer.
const ELEMENTS_MAX: usize = 1000;

impl Geometry {
    pub(super) fn validate(&self) -> Result<(), SceneError> {
        if let Self::Section { shape, .. } = self {
            shape.validate()?;
        }
        let Self::Block { size_mm, elements, layers, .. } = self else { return Ok(()) };
        require(
            size_mm.iter().all(|&v| is_length(v)),
            "geometry.size_mm",
            size_mm,
            "has to be positive",
        )?;
        let count = |n: usize| (1..=ELEMENTS_MAX).contains(&n);
        require(
            elements.iter().all(|&n| count(n)),
            "geometry.elements",
            elements,
            "has to be 1 to 1000",
        )?;
        let good = |l: &Layer| is_length(l.thickness_mm) && count(l.elements);
        require(
            !layers.is_empty() && layers.iter().all(good),
            "geometry.layers",
            layers,
            "has to list layers of positive thickness with 1 to 1000 elements",
        )
    }
}
