//! The format as data: what the manifest and each archive hold, for readers in other languages.

use super::{FORMAT, Manifest};
use schemars::Schema;
use serde::Serialize;

/// One array of an archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ArraySpec {
    /// Name in the archive.
    pub name: &'static str,
    /// `f32`, `f64` or `u32`, little-endian.
    pub dtype: &'static str,
    /// Length of each axis: D samples, V vertices (or nodes, where there are cells), L cells, C check
    /// columns, N pixels, or a number.
    pub shape: &'static [&'static str],
    /// Unit, `1` for none.
    pub unit: &'static str,
    /// Whether an archive may lack it.
    pub optional: bool,
}

const fn array(
    name: &'static str,
    dtype: &'static str,
    shape: &'static [&'static str],
    unit: &'static str,
) -> ArraySpec {
    ArraySpec { name, dtype, shape, unit, optional: false }
}

/// Arrays of a shard.
pub const SHARD_ARRAYS: [ArraySpec; 11] = [
    array("pressure_pa", "f32", &["D", "V"], "Pa"),
    array("sed_dermis_j_per_m3", "f32", &["D", "V"], "J/m3"),
    array("sed_epidermis_j_per_m3", "f32", &["D", "V"], "J/m3"),
    array("depth_mm", "f32", &["D"], "mm"),
    array("force_n", "f32", &["D", "3"], "N"),
    array("checks", "f64", &["D", "C"], "1"),
    ArraySpec { optional: true, ..array("cell_place", "u32", &["L", "5"], "1") },
    ArraySpec { optional: true, ..array("cell_nodes", "u32", &["L", "9"], "1") },
    ArraySpec { optional: true, ..array("shear_pa", "f32", &["D", "V", "3"], "Pa") },
    ArraySpec { optional: true, ..array("slide_mm", "f32", &["D", "2"], "mm") },
    ArraySpec { optional: true, ..array("outside_calibration", "f32", &["D"], "1") },
];

/// Arrays of `raster.npz`.
pub const RASTER_ARRAYS: [ArraySpec; 10] = [
    array("skin_pixel", "u32", &["N"], "1"),
    array("skin_vertex", "u32", &["N", "3"], "1"),
    array("skin_weight", "f32", &["N", "3"], "1"),
    array("interface_pixel", "u32", &["N"], "1"),
    array("interface_vertex", "u32", &["N", "3"], "1"),
    array("interface_weight", "f32", &["N", "3"], "1"),
    ArraySpec { optional: true, ..array("skin_side", "u32", &["N"], "1") },
    ArraySpec { optional: true, ..array("skin_place", "f32", &["N", "2"], "1") },
    ArraySpec { optional: true, ..array("interface_side", "u32", &["N"], "1") },
    ArraySpec { optional: true, ..array("interface_place", "f32", &["N", "2"], "1") },
];

/// The whole format; `docs/reference/dataset.schema.json` is its JSON.
#[derive(Debug, Serialize)]
pub struct FormatSchema {
    /// [`FORMAT`].
    pub format: u32,
    /// JSON schema of `manifest.json`.
    pub manifest: Schema,
    /// Arrays of each shard.
    pub shard: [ArraySpec; 11],
    /// Arrays of `raster.npz`.
    pub raster: [ArraySpec; 10],
}

/// The format, from the types and tables that write it.
#[must_use]
pub fn schema() -> FormatSchema {
    let manifest = schemars::schema_for!(Manifest);
    FormatSchema { format: FORMAT, manifest, shard: SHARD_ARRAYS, raster: RASTER_ARRAYS }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{atlas, record, two_cells};
    use crate::{CHECK_COLUMNS, Sample, TriangleOnLattice, encode, raster_npz};
    use ndarray_npy::NpzReader;
    use std::collections::BTreeMap;
    use std::io::{Cursor, Read as _};
    use std::path::Path;
    use std::sync::Arc;

    /// Name, type and shape of each array, from the archive's own headers.
    fn headers(archive: &[u8]) -> BTreeMap<String, (String, Vec<usize>)> {
        let names = NpzReader::new(Cursor::new(archive)).unwrap().names().unwrap();
        let mut zip = zip::ZipArchive::new(Cursor::new(archive)).unwrap();
        let mut found = BTreeMap::new();
        for name in names {
            let name = name.trim_end_matches(".npy").to_owned();
            let mut bytes = Vec::new();
            zip.by_name(&format!("{name}.npy")).unwrap().read_to_end(&mut bytes).unwrap();
            let head = String::from_utf8_lossy(&bytes[..bytes.len().min(128)]).into_owned();
            let after = |key: &str| head.split_once(key).unwrap().1;
            let descr = after("'descr': '").split('\'').next().unwrap();
            let kind = ["<f4", "<f8", "<u4"].iter().position(|k| *k == descr).unwrap();
            let shape = after("'shape': (").split(')').next().unwrap();
            let shape = shape.split(',').filter_map(|n| n.trim().parse().ok()).collect();
            found.insert(name, (["f32", "f64", "u32"][kind].into(), shape));
        }
        found
    }

    fn assert_declared(
        found: &BTreeMap<String, (String, Vec<usize>)>,
        declared: &[ArraySpec],
        axes: &dyn Fn(&str) -> Option<usize>,
    ) {
        assert_eq!(found.len(), declared.len(), "{found:?}");
        for a in declared {
            let (dtype, shape) = &found[a.name];
            assert_eq!((dtype.as_str(), shape.len()), (a.dtype, a.shape.len()), "{}", a.name);
            for (&length, &axis) in shape.iter().zip(a.shape) {
                assert!(axes(axis).is_none_or(|due| due == length), "{}: {shape:?}", a.name);
            }
        }
    }

    #[test]
    fn archives_hold_the_arrays_that_are_declared() {
        let (d, v) = (2, two_cells().node_count());
        let samples: Vec<Sample> = [0.5, 1.0]
            .map(|depth| {
                let shear_mpa = vec![[0.0, 0.0, 0.1]; v];
                let cells = Some(Arc::new(two_cells()));
                Sample {
                    cells,
                    shear_mpa,
                    slide_mm: [0.1, 0.0],
                    outside_calibration: 0.1,
                    ..record(depth, v)
                }
            })
            .into();
        let whole = encode(&samples, v).unwrap().unwrap();
        let axes = |axis: &str| match axis {
            "D" => Some(d),
            "V" => Some(v),
            "C" => Some(CHECK_COLUMNS.len()),
            number => number.parse().ok(),
        };
        assert_declared(&headers(&whole.bytes), &SHARD_ARRAYS, &axes);
        let least = encode(&[record(0.5, v), record(1.0, v)], v).unwrap().unwrap();
        let always: Vec<_> = SHARD_ARRAYS.into_iter().filter(|a| !a.optional).collect();
        assert_declared(&headers(&least.bytes), &always, &axes);
        let atlas = atlas(4);
        let on = TriangleOnLattice { side: 1, place: [[0.0; 2]; 3] };
        let lattice = vec![on; atlas.triangles().len()];
        let raster = raster_npz(&atlas, Some(&lattice)).unwrap();
        assert_declared(&headers(&raster), &RASTER_ARRAYS, &|axis| axis.parse().ok());
    }

    #[test]
    fn the_committed_schema_is_this_one() {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/dataset.schema.json");
        let committed = std::fs::read_to_string(path).unwrap();
        let due = serde_json::to_string_pretty(&schema()).unwrap();
        assert_eq!(
            committed.trim_end(),
            due,
            "fe-datagen schema dataset > docs/reference/dataset.schema.json"
        );
    }
}
