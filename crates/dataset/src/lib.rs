//! The dataset's format: what a campaign leaves on disk and a trainer reads.
//!
//! ```text
//! DIR/manifest.json           campaign, units, scales, splits, hashes, checks
//! DIR/atlas.json              where every pixel lies on the finger
//! DIR/raster.npz              the atlas' pixel -> (vertices, weights) maps
//! DIR/shards/press-00000.npz  vertex values of all samples of one indentation
//! ```
//!
//! ```
//! use papilla_dataset::{RASTER_ARRAYS, SHARD_ARRAYS, schema};
//!
//! let always = SHARD_ARRAYS.iter().filter(|array| !array.optional);
//! assert!(always.clone().any(|a| a.name == "pressure_pa" && a.shape == ["D", "V"]));
//! assert_eq!(schema().raster, RASTER_ARRAYS);
//! ```
//!
//! The format in prose: `docs/reference/dataset.md`.

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

mod arrays;
mod error;
mod images;
mod lattice;
mod limits;
mod manifest;
mod maps;
mod reader;
mod record;
mod replay;
mod schema;
mod shard;
mod sheet;
mod stats;
mod table;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use arrays::{ArraysReport, arrays};
pub use error::DatasetError;
pub use images::{ImageEntry, ImageOptions, ImagesReport, images};
pub use lattice::TriangleOnLattice;
pub use limits::{
    BALANCE_RELATIVE_MAX, PENETRATION_MM_MAX, RESIDUAL_RELATIVE_MAX, fault, worst_checks,
};
pub use manifest::{
    DroppedSample, FORMAT, FORMATS, FailedIndentation, IndentationEntry, Manifest, Split, Splits,
    Units, UnknownSplit, dataset_sha256, sha256_hex,
};
pub use maps::{Field, Maps, ShardMaps};
pub use reader::{Dataset, VerifyReport, verify};
pub use record::{Cells, Checks, Pose, Sample};
pub use replay::replay;
pub use schema::{ArraySpec, FormatSchema, RASTER_ARRAYS, SHARD_ARRAYS, schema};
pub use shard::{CHECK_COLUMNS, Encoded, Shard, encode, raster_npz, write_atlas};
pub use sheet::contact_sheet;
pub use stats::{DepthStats, Range, StatsReport, stats};

/// File name of an indentation's shard, relative to the dataset's folder.
pub fn shard_file(id: usize) -> String {
    format!("shards/press-{id:05}.npz")
}
