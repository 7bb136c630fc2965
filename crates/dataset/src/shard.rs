//! Shards: the vertex values of one indentation in one archive.

use super::{DatasetError, fault, worst_checks};
use crate::lattice::{TriangleOnLattice, places};
use crate::record::{Cells, Checks, Sample};
use ndarray::{Array, Array1, Array2, Array3, Dimension, Ix1, Ix2, Ix3, StrideShape};
use papilla_atlas::{Atlas, PA_PER_MPA, Patch, Raster};
use papilla_output::npz::{NpzArrays, NpzBuilder};
use papilla_output::{OutputError, atomic};
use std::path::Path;

/// Columns of a shard's `checks` array, in the order of [`Checks`]' fields.
pub const CHECK_COLUMNS: [&str; 11] = [
    "residual_relative",
    "contact_force_vs_pressure_integral",
    "plate_vs_support_reaction",
    "energy_vs_work",
    "j_min",
    "penetration_mm_max",
    "newton_iterations",
    "step_cuts",
    "augmentations",
    "factorizations",
    "cg_iterations",
];

fn check_row(c: &Checks) -> [f64; 11] {
    [
        c.residual_relative,
        c.contact_force_vs_pressure_integral,
        c.plate_vs_support_reaction,
        c.energy_vs_work,
        c.j_min,
        c.penetration_mm_max,
        c.newton_iterations.into(),
        c.step_cuts.into(),
        c.augmentations.into(),
        c.factorizations.into(),
        c.cg_iterations.into(),
    ]
}

/// The arrays of one shard: D samples on V vertices, or nodes of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Shard {
    /// Cells whose nodes the values belong to; `None`: they belong to the atlas' vertices.
    pub cells: Option<Cells>,
    /// Pressure on the skin, Pa \[D, V\].
    pub pressure_pa: Array2<f32>,
    /// SED on the dermis side of the interface, J/m3 \[D, V\].
    pub sed_dermis_j_per_m3: Array2<f32>,
    /// SED on the epidermis side of the interface, J/m3 \[D, V\].
    pub sed_epidermis_j_per_m3: Array2<f32>,
    /// Depth, mm \[D\].
    pub depth_mm: Array1<f32>,
    /// Where the indenter has slid to, mm along its own x and y \[D, 2\]; only if it slides.
    pub slide_mm: Option<Array2<f32>>,
    /// Force of the plate on the finger, N \[D, 3\].
    pub force_n: Array2<f32>,
    /// Self-checks \[D, 11\], see [`CHECK_COLUMNS`].
    pub checks: Array2<f64>,
    /// Shear traction of the indenter on the skin in the finger's frame, Pa
    /// \[D, V, 3\]; only with friction.
    pub shear_pa: Option<Array3<f32>>,
    /// Share of the volume beyond the calibrated stretches of its law \[D\]; only if
    /// a sample has any.
    pub outside_calibration: Option<Array1<f32>>,
}

/// The nearest number of 11 significant bits (4.9e-4 off at most): the rest of a map is twice the
/// bytes and far below what a mesh resolves. What is not finite stays that.
fn stored(value: f32) -> f32 {
    const DROPPED: u32 = f32::MANTISSA_DIGITS - 11;
    if !value.is_finite() {
        return value;
    }
    let bits = value.to_bits() + (1 << (DROPPED - 1));
    f32::from_bits(bits & !((1 << DROPPED) - 1))
}

/// A shard ready to be written, and what the manifest says of it.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// The archive's bytes.
    pub bytes: Vec<u8>,
    /// Samples in it.
    pub samples: usize,
    /// The worst of each check over these samples.
    pub checks: Checks,
    /// Largest pressure, Pa.
    pub pressure_max_pa: f64,
    /// Largest SED on the dermis side, J/m3.
    pub sed_max_j_per_m3: f64,
    /// Depth (mm) and reason of each record that was left out.
    pub dropped: Vec<(f64, String)>,
}

/// Encodes the records that pass their own checks; `Err` holds the depth (mm)
/// and fault of each when none does.
///
/// # Errors
/// [`DatasetError::Output`] when the archive cannot be built.
pub fn encode(
    records: &[Sample],
    vertex_count: usize,
) -> Result<Result<Encoded, Vec<(f64, String)>>, DatasetError> {
    let (mut kept, mut dropped) = (Vec::new(), Vec::new());
    for record in records {
        match fault(record, vertex_count) {
            Some(reason) => dropped.push((record.depth_mm, reason)),
            None => kept.push(record),
        }
    }
    let Some(checks) = worst_checks(kept.iter().map(|r| &r.checks)) else {
        return Ok(Err(dropped));
    };
    let shard = Shard::of(&kept, vertex_count)?;
    let max = |values: &Array2<f32>| f64::from(values.iter().copied().fold(0.0, f32::max));
    Ok(Ok(Encoded {
        bytes: shard.to_npz()?,
        samples: shard.len(),
        checks,
        pressure_max_pa: max(&shard.pressure_pa),
        sed_max_j_per_m3: max(&shard.sed_dermis_j_per_m3),
        dropped,
    }))
}

fn read_cells(path: &Path, npz: &mut NpzArrays<'_>) -> Result<Cells, DatasetError> {
    let place = npz.get::<u32, Ix2>("cell_place")?;
    let nodes = npz.get::<u32, Ix2>("cell_nodes")?;
    Cells::from_arrays(&place, &nodes).ok_or_else(|| DatasetError::Mismatch {
        path: path.into(),
        what: "shapes of cell_place and cell_nodes",
        found: format!("{:?}, {:?}", place.dim(), nodes.dim()),
        expected: "(L, 5), (L, 9)".into(),
    })
}

impl Shard {
    /// What a dataset holds of these states: its units and its digits. Values are at the nodes of the
    /// first one's cells, or else at the `vertex_count` vertices of an atlas.
    ///
    /// # Errors
    /// [`DatasetError::Output`] where a state has another number of values.
    pub fn of(states: &[&Sample], vertex_count: usize) -> Result<Self, DatasetError> {
        let cells = states.first().and_then(|r| r.cells.as_deref());
        let (d, v) = (states.len(), cells.map_or(vertex_count, Cells::node_count));
        let field = |values: fn(&Sample) -> &[f64]| -> Vec<f32> {
            states.iter().flat_map(|r| values(r)).map(|v| stored((v * PA_PER_MPA) as f32)).collect()
        };
        let by_vertex = |values| shaped((d, v), values);
        let narrow = |values: Vec<f64>| values.into_iter().map(|x| x as f32).collect::<Vec<f32>>();
        let force = states.iter().flat_map(|r| r.force_n).collect();
        let slide = states.iter().flat_map(|r| r.slide_mm).collect();
        let share = states.iter().map(|r| r.outside_calibration).collect();
        let checks = states.iter().flat_map(|r| check_row(&r.checks)).collect();
        let rubs = states.iter().any(|r| !r.shear_mpa.is_empty());
        let slides = states.iter().any(|r| r.slide_mm.iter().any(|s| *s != 0.0));
        let flagged = states.iter().any(|r| r.outside_calibration > 0.0);
        Ok(Self {
            cells: cells.cloned(),
            pressure_pa: by_vertex(field(|r| &r.pressure_mpa))?,
            sed_dermis_j_per_m3: by_vertex(field(|r| &r.sed_dermis_mpa))?,
            sed_epidermis_j_per_m3: by_vertex(field(|r| &r.sed_epidermis_mpa))?,
            depth_mm: states.iter().map(|r| r.depth_mm as f32).collect(),
            slide_mm: slides.then(|| shaped((d, 2), narrow(slide))).transpose()?,
            force_n: shaped((d, 3), narrow(force))?,
            checks: shaped((d, CHECK_COLUMNS.len()), checks)?,
            shear_pa: rubs
                .then(|| shaped((d, v, 3), field(|r| r.shear_mpa.as_flattened())))
                .transpose()?,
            outside_calibration: flagged.then(|| narrow(share).into()),
        })
    }

    /// The archive that [`Self::decode`] reads.
    fn to_npz(&self) -> Result<Vec<u8>, DatasetError> {
        let mut npz = NpzBuilder::new();
        npz.add("pressure_pa", &self.pressure_pa)?;
        npz.add("sed_dermis_j_per_m3", &self.sed_dermis_j_per_m3)?;
        npz.add("sed_epidermis_j_per_m3", &self.sed_epidermis_j_per_m3)?;
        npz.add("depth_mm", &self.depth_mm)?;
        npz.add("force_n", &self.force_n)?;
        npz.add("checks", &self.checks)?;
        if let Some(cells) = &self.cells {
            let (places, nodes) = (cells.place.as_flattened(), cells.nodes.as_flattened());
            npz.add_slice("cell_place", &[cells.place.len(), 5], places)?;
            npz.add_slice("cell_nodes", &[cells.nodes.len(), 9], nodes)?;
        }
        if let Some(shear) = &self.shear_pa {
            npz.add("shear_pa", shear)?;
        }
        if let Some(slide) = &self.slide_mm {
            npz.add("slide_mm", slide)?;
        }
        if let Some(share) = &self.outside_calibration {
            npz.add("outside_calibration", share)?;
        }
        Ok(npz.finish()?)
    }

    /// Decodes an archive; `path` is only for messages.
    ///
    /// # Errors
    /// [`DatasetError::Output`] when an array is absent or of another type,
    /// [`DatasetError::Mismatch`] when the shapes do not fit together.
    pub fn decode(path: &Path, bytes: &[u8], vertex_count: usize) -> Result<Self, DatasetError> {
        let mut npz = NpzArrays::new(path, bytes)?;
        let (rubs, flagged) = (npz.has("shear_pa")?, npz.has("outside_calibration")?);
        let slides = npz.has("slide_mm")?;
        let cells = if npz.has("cell_place")? { Some(read_cells(path, &mut npz)?) } else { None };
        let vertex_count = cells.as_ref().map_or(vertex_count, Cells::node_count);
        let shard = Self {
            cells,
            pressure_pa: npz.get::<f32, Ix2>("pressure_pa")?,
            sed_dermis_j_per_m3: npz.get::<f32, Ix2>("sed_dermis_j_per_m3")?,
            sed_epidermis_j_per_m3: npz.get::<f32, Ix2>("sed_epidermis_j_per_m3")?,
            depth_mm: npz.get::<f32, Ix1>("depth_mm")?,
            slide_mm: slides.then(|| npz.get::<f32, Ix2>("slide_mm")).transpose()?,
            force_n: npz.get::<f32, Ix2>("force_n")?,
            checks: npz.get::<f64, Ix2>("checks")?,
            shear_pa: rubs.then(|| npz.get::<f32, Ix3>("shear_pa")).transpose()?,
            outside_calibration: flagged
                .then(|| npz.get::<f32, Ix1>("outside_calibration"))
                .transpose()?,
        };
        let d = shard.depth_mm.len();
        let by_sample = |a: &Array1<f32>| (a.len(), 1);
        let by_vertex = |a: &Array3<f32>| (a.dim().0, a.len() / d.max(1));
        let shapes = [
            ("shape of pressure_pa", shard.pressure_pa.dim(), (d, vertex_count)),
            ("shape of sed_dermis_j_per_m3", shard.sed_dermis_j_per_m3.dim(), (d, vertex_count)),
            (
                "shape of sed_epidermis_j_per_m3",
                shard.sed_epidermis_j_per_m3.dim(),
                (d, vertex_count),
            ),
            ("shape of slide_mm", shard.slide_mm.as_ref().map_or((d, 2), Array2::dim), (d, 2)),
            ("shape of force_n", shard.force_n.dim(), (d, 3)),
            ("shape of checks", shard.checks.dim(), (d, CHECK_COLUMNS.len())),
            (
                "shape of shear_pa",
                shard.shear_pa.as_ref().map_or((d, 3 * vertex_count), by_vertex),
                (d, 3 * vertex_count),
            ),
            (
                "shape of outside_calibration",
                shard.outside_calibration.as_ref().map_or((d, 1), by_sample),
                (d, 1),
            ),
        ];
        for (what, found, expected) in shapes {
            if found != expected {
                let (found, expected) = (format!("{found:?}"), format!("{expected:?}"));
                return Err(DatasetError::Mismatch { path: path.into(), what, found, expected });
            }
        }
        Ok(shard)
    }

    /// Where the indenter has slid to in a sample, mm along its own x and y.
    pub fn slid_mm(&self, sample: usize) -> [f64; 2] {
        let at = |s: &Array2<f32>| [0, 1].map(|k: usize| f64::from(s[[sample, k]]));
        self.slide_mm.as_ref().map_or([0.0; 2], at)
    }

    /// Samples D.
    pub fn len(&self) -> usize {
        self.depth_mm.len()
    }

    /// No sample at all?
    pub fn is_empty(&self) -> bool {
        self.depth_mm.is_empty()
    }
}

fn shaped<T, D: Dimension>(
    shape: impl Into<StrideShape<D>>,
    values: Vec<T>,
) -> Result<Array<T, D>, DatasetError> {
    let found = values.len();
    let shape = shape.into();
    let expected = shape.size();
    Array::from_shape_vec(shape, values).map_err(|_| {
        let what = "the values of a dataset's states".into();
        OutputError::Length { what, found, expected }.into()
    })
}

/// The bytes of `raster.npz`: for `skin` and `interface` the arrays `_pixel`
/// u32 \[N\] (row * 224 + column), `_vertex` u32 \[N, 3\] and `_weight` f32 \[N, 3\]; where
/// the atlas' triangles lie on a lattice also `_side` u32 \[N\] and `_place` f32 \[N, 2\].
///
/// # Errors
/// [`DatasetError::Output`] when the archive cannot be built.
pub fn raster_npz(
    atlas: &Atlas,
    lattice: Option<&[TriangleOnLattice]>,
) -> Result<Vec<u8>, DatasetError> {
    let mut npz = NpzBuilder::new();
    for patch in Patch::ALL {
        let raster = Raster::new(atlas, patch);
        let (name, n) = (patch.name(), raster.pixel_count());
        let vertices: Vec<u32> = raster.pixels().iter().flat_map(|p| p.vertices).collect();
        let weights: Vec<f32> = raster.pixels().iter().flat_map(|p| p.weights).collect();
        npz.add_slice(&format!("{name}_pixel"), &[n], raster.indices())?;
        npz.add_slice(&format!("{name}_vertex"), &[n, 3], &vertices)?;
        npz.add_slice(&format!("{name}_weight"), &[n, 3], &weights)?;
        let Some(lattice) = lattice else { continue };
        let (sides, places): (Vec<u32>, Vec<[f32; 2]>) = places(&raster, lattice).unzip();
        npz.add_slice(&format!("{name}_side"), &[n], &sides)?;
        npz.add_slice(&format!("{name}_place"), &[n, 2], places.as_flattened())?;
    }
    Ok(npz.finish()?)
}

/// Writes `atlas.json` and `raster.npz` into a dataset's folder, if they are not there.
///
/// # Errors
/// [`DatasetError::Output`] when the folder is not writable.
pub fn write_atlas(
    folder: &Path,
    atlas: &Atlas,
    lattice: Option<&[TriangleOnLattice]>,
) -> Result<(), DatasetError> {
    let path = folder.join("atlas.json");
    let mut text =
        atlas.to_json().map_err(|source| DatasetError::Atlas { path: path.clone(), source })?;
    text.push('\n');
    atomic::write_changed(&path, text.as_bytes())?;
    atomic::write_changed(&folder.join("raster.npz"), &raster_npz(atlas, lattice)?)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{atlas, record, two_cells};
    use papilla_atlas::MAP_LEN;
    use std::sync::Arc;

    #[test]
    fn values_come_back_in_outside_units() {
        let mut bad = record(0.5, 4);
        bad.checks.j_min = -1.0;
        let records = [record(0.25, 4), bad, record(1.0, 4)];
        let encoded = encode(&records, 4).unwrap().unwrap();
        assert_eq!((encoded.samples, encoded.dropped.len()), (2, 1));
        let shard = Shard::decode(Path::new("x"), &encoded.bytes, 4).unwrap();
        assert_eq!(shard.depth_mm.to_vec(), [0.25, 1.0]);
        let due = (records[2].pressure_mpa[3] * 1e6) as f32;
        assert!((shard.pressure_pa[[1, 3]] / due - 1.0).abs() <= 0.5f32.powi(11));
        assert_eq!(shard.checks[[0, 4]].to_bits(), records[0].checks.j_min.to_bits());
        assert!(Shard::decode(Path::new("x"), &encoded.bytes, 5).is_err());
    }

    /// Of linear and graded meshes, with friction and a slide: what is decoded and written again is the
    /// file, so that datasets stay what they are.
    #[test]
    fn shipped_shards_are_written_as_they_are_read() {
        for name in ["rungs/medium-linear", "heldout-graded", "friction-graded", "sliding-graded"] {
            let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data").join(name);
            let dataset = crate::Dataset::open(&data).unwrap();
            let press = &dataset.manifest().presses[0];
            let bytes = std::fs::read(dataset.shard_path(press)).unwrap();
            let shard = dataset.shard(press).unwrap();
            assert!(shard.to_npz().unwrap() == bytes, "{name}");
        }
    }

    #[test]
    fn maps_keep_eleven_bits() {
        let exact = [0.0, 1.0, -1024.0, 2047.0];
        assert_eq!(exact.map(stored), exact);
        assert!(stored(f32::NAN).is_nan() && stored(f32::INFINITY).is_infinite());
        for value in [4097.0f32, 0.3, -1.7e-12, 3.3e30, 1.999_999_9] {
            let kept = stored(value);
            assert!((kept / value - 1.0).abs() <= 0.5f32.powi(11), "{value} {kept}");
            assert_eq!(kept.to_bits() & 0x1fff, 0);
        }
    }

    #[test]
    fn cells_come_back_with_the_values_at_their_nodes() {
        let cells = two_cells();
        let n = cells.node_count();
        let with = |r: Sample| Sample { cells: Some(Arc::new(cells.clone())), ..r };
        let encoded = encode(&[with(record(0.5, n))], 4).unwrap().unwrap();
        let shard = Shard::decode(Path::new("x"), &encoded.bytes, 4).unwrap();
        assert_eq!((shard.cells, shard.pressure_pa.dim()), (Some(cells.clone()), (1, n)));
        let short = encode(&[with(record(0.5, n - 1))], 4).unwrap();
        assert!(short.is_err_and(|dropped| dropped[0].1.contains("values")));
    }

    #[test]
    fn further_arrays_are_there_only_with_their_effects() {
        let plain = encode(&[record(1.0, 4)], 4).unwrap().unwrap();
        let plain = Shard::decode(Path::new("x"), &plain.bytes, 4).unwrap();
        assert_eq!((plain.shear_pa, plain.slide_mm, plain.outside_calibration), (None, None, None));
        let mut records = [record(0.5, 4), record(1.0, 4)];
        for r in &mut records {
            r.shear_mpa = vec![[1e-3, -2e-3, 0.0]; 4];
        }
        records[1].slide_mm = [0.5, -0.25];
        records[1].outside_calibration = 0.125;
        let encoded = encode(&records, 4).unwrap().unwrap();
        let shard = Shard::decode(Path::new("x"), &encoded.bytes, 4).unwrap();
        assert_eq!(shard.outside_calibration.unwrap().to_vec(), [0.0, 0.125]);
        assert_eq!(shard.slide_mm.unwrap().as_slice().unwrap(), [0.0, 0.0, 0.5, -0.25]);
        let shear = shard.shear_pa.unwrap();
        assert_eq!((shear.dim(), shear[[1, 3, 1]].to_bits()), ((2, 4, 3), (-2000f32).to_bits()));
    }

    #[test]
    fn columns_are_the_fields_of_checks() {
        let json = serde_json::to_value(Checks::default()).unwrap();
        let fields = json.as_object().unwrap();
        assert_eq!(fields.len(), CHECK_COLUMNS.len());
        assert!(CHECK_COLUMNS.iter().all(|c| fields.contains_key(*c)));
    }

    #[test]
    fn the_stored_raster_draws_what_the_code_draws() {
        let atlas = atlas(6);
        let bytes = raster_npz(&atlas, None).unwrap();
        let mut npz = NpzArrays::new(Path::new("raster.npz"), &bytes).unwrap();
        let values: Vec<f32> = (0..atlas.vertex_count()).map(|i| (i as f32).sin().abs()).collect();
        for patch in Patch::ALL {
            let mut expected = vec![0.0; MAP_LEN];
            Raster::new(&atlas, patch).rasterise(&values, &mut expected).unwrap();
            let name = |part: &str| format!("{}_{part}", patch.name());
            let pixel = npz.get::<u32, Ix1>(&name("pixel")).unwrap();
            let vertex = npz.get::<u32, Ix2>(&name("vertex")).unwrap();
            let weight = npz.get::<f32, Ix2>(&name("weight")).unwrap();
            let mut map = vec![0.0f32; MAP_LEN];
            for (n, p) in pixel.iter().enumerate() {
                map[*p as usize] =
                    (0..3).map(|k| values[vertex[[n, k]] as usize] * weight[[n, k]]).sum();
            }
            assert!(pixel.len() > 1000);
            let worst = map.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-6, "{worst}");
        }
    }
}
