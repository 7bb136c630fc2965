//! Tissues: the regions of a fingertip's mesh.

use papilla_fem::mesh::Region;
use papilla_fem::mesh::recovery::NoElement;

/// What an element is made of.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Tissue {
    /// Outermost layer.
    Epidermis,
    /// Below the epidermis.
    Dermis,
    /// Fat between dermis and bone.
    Subcutaneous,
    /// Nail plate.
    Nail,
    /// Distal phalanx.
    Bone,
}

impl Tissue {
    /// Every tissue, from outside inward, nail and bone last.
    pub const ALL: [Self; 5] =
        [Self::Epidermis, Self::Dermis, Self::Subcutaneous, Self::Nail, Self::Bone];

    /// Regions so stiff beside soft tissue that they are as good as held.
    pub const STIFF: [Region; 2] = [Self::Nail.region(), Self::Bone.region()];

    /// Its region in meshes.
    #[must_use]
    pub const fn region(self) -> Region {
        Region(self as u8)
    }

    /// The tissue of a region of a fingertip's mesh.
    ///
    /// # Panics
    /// For a region that is none of [`Tissue::ALL`]: a programming error.
    #[must_use]
    pub fn of(region: Region) -> Self {
        Self::ALL[region.index()]
    }

    /// Position in [`Tissue::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Name as scenes and mesh files spell it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Epidermis => "epidermis",
            Self::Dermis => "dermis",
            Self::Subcutaneous => "subcutaneous",
            Self::Nail => "nail",
            Self::Bone => "bone",
        }
    }
}

/// A layer that does not reach an interface where strain is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "node {node} of the surface touches no element of {}; the layer does not reach the surface there",
    tissue.name()
)]
pub struct NoTissue {
    /// Node of the surface.
    pub node: u32,
    /// Tissue that was looked for.
    pub tissue: Tissue,
}

impl From<NoElement> for NoTissue {
    fn from(error: NoElement) -> Self {
        Self { node: error.node, tissue: Tissue::of(error.region) }
    }
}
