//! The atlas: two surface patches of the finger laid out in one map.
//!
//! A pressure map (on the skin) and a strain-energy-density map (on the
//! dermis-epidermis interface) are images of 224 x 224 pixels. The atlas says
//! which point of the finger each pixel is. It holds one triangle list and, for
//! each of the two patches, the vertex positions (mm) and their place in the image
//! (pixels). Vertex `i` of the skin lies over vertex `i` of the interface.
//!
//! Conventions:
//! - Positions: `x` along the finger, 0 at the tip, growing towards the base; `y`
//!   lateral; `z` towards the nail. The pad is where `z < 0`.
//! - `uv_px`: `u` to the right, `v` **down**; the centre of the pixel in row `r`
//!   and column `c` is `(c + 0.5, r + 0.5)`. The tip of the finger points up, and the
//!   pad is seen from outside. Both patches share one scale, `mm_per_px`.
//! - Triangles are wound counter-clockwise as the image shows them, so that their
//!   normals point out of the finger.
//!
//! The feature `flatten` adds what makes an atlas of two surfaces.
//!
//! ```
//! use papilla_atlas::{Atlas, Patch, PatchVertices, Raster};
//!
//! // Two flat squares, 10 mm wide, one 1 mm above the other.
//! let square = |z: f32| PatchVertices {
//!     positions_mm: [[0, 0], [0, 1], [1, 0], [1, 1]]
//!         .map(|[row, column]| [10.0 * row as f32, -10.0 * column as f32, z])
//!         .into(),
//!     uv_px: vec![[62.0, 62.0], [162.0, 62.0], [62.0, 162.0], [162.0, 162.0]],
//! };
//! let triangles = vec![[0, 2, 1], [1, 2, 3]];
//! let atlas = Atlas::new(0.1, triangles, square(-1.0), square(0.0))?;
//! assert_eq!(Raster::new(&atlas, Patch::Skin).pixel_count(), 100 * 100);
//! # Ok::<(), papilla_atlas::AtlasError>(())
//! ```
//!
//! An [`Atlas`] is valid by construction: [`Atlas::new`] and [`Atlas::from_json`] refuse
//! what breaks these rules. Its [hash](Atlas::hash) names it; datasets, models, server
//! and clients carry that hash, and mixing two atlases is an error.

mod error;
mod exact;
#[cfg(feature = "flatten")]
pub mod flatten;
mod glb;
mod obj;
mod raster;
mod validate;
mod vertices;

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

use papilla_json as json;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;

pub use error::AtlasError;
pub use raster::{Pixel, Raster};
pub use vertices::VertexSampler;

/// Side of every map, pixels.
pub const MAP_SIDE_PX: usize = 224;

/// Number of samples of a map.
pub const MAP_LEN: usize = MAP_SIDE_PX * MAP_SIDE_PX;

/// Greatest pressure of a map, Pa, below which its unit is in doubt: a map in kPa or MPa that is given as
/// one in Pa stays below, and of the contacts that people feel hardly any does. Clients ask about the
/// same.
pub const DOUBTED_BELOW_PA: f32 = 150.0;

/// Pa per MPa, and J/m3 per mJ/mm3: maps are told in Pa and J/m3, mechanics is solved in N and mm.
pub const PA_PER_MPA: f64 = 1e6;

/// Version of the atlas file format that this code reads and writes.
pub const ATLAS_VERSION: u32 = 1;

/// One of the two surfaces an atlas unwraps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Patch {
    /// Outer surface of the epidermis, where pressure acts.
    Skin,
    /// Dermis-epidermis interface, where strain energy density is read.
    Interface,
}

impl Patch {
    /// Both patches, skin first.
    pub const ALL: [Self; 2] = [Self::Skin, Self::Interface];

    /// The name used in files: `skin` or `interface`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Skin => "skin",
            Self::Interface => "interface",
        }
    }
}

impl fmt::Display for Patch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Vertices of one patch: where they lie in space and in the image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchVertices {
    /// Position of each vertex in the undeformed finger, mm.
    pub positions_mm: Vec<[f32; 3]>,
    /// Place of each vertex in the image, pixels (`u` right, `v` down).
    pub uv_px: Vec<[f32; 2]>,
}

/// Layout of `atlas.json`; checked before it becomes an [`Atlas`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AtlasFile {
    version: u32,
    hash: String,
    size_px: u32,
    mm_per_px: f32,
    triangles: Vec<[u32; 3]>,
    skin: PatchVertices,
    interface: PatchVertices,
}

/// A checked atlas (see the [module documentation](self) for the conventions).
///
/// `serde` reads and writes the same JSON as [`Atlas::from_json`] and
/// [`Atlas::to_json`], with the same checks.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "AtlasFile", into = "AtlasFile")]
pub struct Atlas {
    file: AtlasFile,
}

impl Atlas {
    /// Makes an atlas from its parts, computes its hash and checks it.
    ///
    /// `mm_per_px` is the length of one pixel on the finger (mm); `triangles` index
    /// the vertices of both patches.
    ///
    /// # Errors
    /// As [`Atlas::validate`].
    pub fn new(
        mm_per_px: f32,
        triangles: Vec<[u32; 3]>,
        skin: PatchVertices,
        interface: PatchVertices,
    ) -> Result<Self, AtlasError> {
        let mut file = AtlasFile {
            version: ATLAS_VERSION,
            hash: String::new(),
            size_px: MAP_SIDE_PX as u32,
            mm_per_px,
            triangles,
            skin,
            interface,
        };
        file.hash = file.computed_hash();
        Self::try_from(file)
    }

    /// Reads `atlas.json`.
    ///
    /// # Errors
    /// [`AtlasError::Json`] when the text is not an atlas file; else as
    /// [`Atlas::validate`], a wrong hash included.
    pub fn from_json(text: &str) -> Result<Self, AtlasError> {
        let file: AtlasFile = json::read(text.as_bytes()).map_err(AtlasError::Json)?;
        Self::try_from(file)
    }

    /// Text of `atlas.json`: one line, with floats in their shortest form that reads
    /// back to the same `f32`.
    ///
    /// # Errors
    /// [`AtlasError::Json`] if the serialiser fails (out of memory apart, it does not).
    pub fn to_json(&self) -> Result<String, AtlasError> {
        serde_json::to_string(&self.file).map_err(|error| AtlasError::Json(error.into()))
    }

    /// Checks everything again: version, size, scale, counts, indices, finite numbers,
    /// uv inside the image, no flipped or empty triangle, no pixel covered twice, hash.
    ///
    /// # Errors
    /// The first rule that is broken, and where.
    pub fn validate(&self) -> Result<(), AtlasError> {
        validate::check(&self.file)
    }

    /// SHA-256 over the canonical bytes of everything but the hash itself, 64
    /// lower-case hexadecimal digits.
    #[must_use]
    pub fn hash(&self) -> &str {
        &self.file.hash
    }

    /// Version of the file format.
    #[must_use]
    pub fn version(&self) -> u32 {
        self.file.version
    }

    /// Pixels along one side of the image (224).
    #[must_use]
    pub fn size_px(&self) -> u32 {
        self.file.size_px
    }

    /// Length of one pixel on the finger, mm, the same for both patches.
    #[must_use]
    pub fn mm_per_px(&self) -> f32 {
        self.file.mm_per_px
    }

    /// Triangles of both patches, as vertex indices.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.file.triangles
    }

    /// Vertices of one patch.
    #[must_use]
    pub fn patch(&self, patch: Patch) -> &PatchVertices {
        self.file.patch(patch)
    }

    /// Number of vertices of each patch.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.file.skin.positions_mm.len()
    }

    /// Both patches as Wavefront OBJ text: objects `skin` and `interface`, positions in
    /// mm, texture coordinates 0..1 with the origin at the lower left of the image.
    #[must_use]
    pub fn to_obj(&self) -> String {
        obj::write(self)
    }

    /// Both patches as binary glTF 2.0; `masks` are their pixels as PNG, in the order of
    /// [`Patch::ALL`].
    #[must_use]
    pub fn to_glb(&self, masks: &[Vec<u8>; 2]) -> Vec<u8> {
        glb::write(self, masks)
    }

    /// Refuses the atlas of somebody else.
    ///
    /// # Errors
    /// [`AtlasError::Mismatch`] when `hash` is not this atlas's.
    pub fn require_hash(&self, hash: &str) -> Result<(), AtlasError> {
        if self.hash() == hash {
            return Ok(());
        }
        Err(AtlasError::Mismatch { expected: self.hash().to_owned(), found: hash.to_owned() })
    }
}

impl PartialEq for Atlas {
    fn eq(&self, other: &Self) -> bool {
        self.hash() == other.hash()
    }
}

impl Eq for Atlas {}

impl TryFrom<AtlasFile> for Atlas {
    type Error = AtlasError;

    fn try_from(file: AtlasFile) -> Result<Self, AtlasError> {
        validate::check(&file)?;
        Ok(Self { file })
    }
}

impl From<Atlas> for AtlasFile {
    fn from(atlas: Atlas) -> Self {
        atlas.file
    }
}

impl AtlasFile {
    fn patch(&self, patch: Patch) -> &PatchVertices {
        match patch {
            Patch::Skin => &self.skin,
            Patch::Interface => &self.interface,
        }
    }

    /// The hash that belongs to the rest of the file.
    ///
    /// Bytes, all little-endian: the 16 bytes `papilla-atlas\0\0\0`; version, size,
    /// vertex count, triangle count (`u32`); `mm_per_px` (`f32`); triangles (`u32`);
    /// then skin positions, skin uv, interface positions, interface uv (`f32`).
    /// Minus zero counts as zero, since not every JSON writer keeps its sign.
    fn computed_hash(&self) -> String {
        let mut hasher = Sha256::new();
        hasher.update(b"papilla-atlas\0\0\0");
        let counts = [self.skin.positions_mm.len() as u32, self.triangles.len() as u32];
        for number in [self.version, self.size_px].into_iter().chain(counts) {
            hasher.update(number.to_le_bytes());
        }
        update_floats(&mut hasher, &[self.mm_per_px]);
        for index in self.triangles.as_flattened() {
            hasher.update(index.to_le_bytes());
        }
        for patch in Patch::ALL {
            update_floats(&mut hasher, self.patch(patch).positions_mm.as_flattened());
            update_floats(&mut hasher, self.patch(patch).uv_px.as_flattened());
        }
        let digest = hasher.finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

fn update_floats(hasher: &mut Sha256, values: &[f32]) {
    for value in values {
        // -0 + 0 = +0: the sum drops the sign of zero and changes nothing else.
        hasher.update((value + 0.0).to_le_bytes());
    }
}
