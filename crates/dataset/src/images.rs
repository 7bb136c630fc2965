//! The surface-pressure study's image pairs: 224 x 224 gray PNG of pressure and SED.

use super::{Dataset, DatasetError, Field, IndentationEntry, Maps, Split};
use papilla_atlas::{MAP_LEN, Patch};
use papilla_output::map_image::{Bits, MapScale, MapView, Quantity};
use papilla_output::{OutputError, atomic};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What to write.
#[derive(Clone, Copy, Debug)]
pub struct ImageOptions {
    /// Bits per pixel: 16 keeps the far field, 8 is what the surface-pressure study used.
    pub bits: Bits,
}

/// One pair of images.
#[derive(Clone, Debug, Serialize)]
pub struct ImageEntry {
    /// Id of the indentation.
    pub press: usize,
    /// Depth, mm.
    pub depth_mm: f32,
    /// Training or held out.
    pub split: Split,
    /// File of the pressure map, relative to the index.
    pub pressure: String,
    /// File of the SED map.
    pub sed: String,
}

/// The report of `dataset images`, also written as `index.json`.
#[derive(Clone, Debug, Serialize)]
pub struct ImagesReport {
    /// Hash of the dataset that the images were drawn from.
    pub dataset_sha256: String,
    /// Hash of the atlas.
    pub atlas_hash: String,
    /// Scale of all pressure images: white is the greatest value or pixel of the dataset.
    pub pressure_scale: MapScale,
    /// Scale of all SED images (dermis side).
    pub sed_scale: MapScale,
    /// The pairs.
    pub samples: Vec<ImageEntry>,
    /// Where they were written.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// Draws one quantity of a dataset with one scale for all samples.
struct Painter<'a> {
    mask: &'a [bool],
    quantity: Quantity,
    white: f64,
    mm_per_px: f64,
    pixels: Vec<f32>,
}

impl<'a> Painter<'a> {
    fn new(dataset: &Dataset, mask: &'a [bool], quantity: Quantity, max: f64) -> Self {
        Self {
            mask,
            quantity,
            white: max,
            mm_per_px: f64::from(dataset.atlas().mm_per_px()),
            pixels: vec![0.0; MAP_LEN],
        }
    }

    fn view(&self) -> MapView<'_> {
        MapView {
            quantity: self.quantity,
            pixels: &self.pixels,
            mask: self.mask,
            mm_per_px: self.mm_per_px,
            // A dataset of zeros has no maximum to normalise by.
            white: if self.white > 0.0 { self.white } else { 1.0 },
        }
    }

    fn greatest(&self) -> f64 {
        self.pixels.iter().fold(0.0, |most, &pixel| f64::from(pixel).max(most))
    }

    fn write(&self, bits: Bits, path: &Path) -> Result<(), DatasetError> {
        // Not synced one by one: index.json, written last, says all are there.
        let bytes = self.view().encode_gray(bits)?;
        Ok(std::fs::write(path, bytes).map_err(OutputError::io("write", path))?)
    }
}

/// The maps of a dataset, drawn one sample after the other.
struct Drawing<'a> {
    dataset: &'a Dataset,
    maps: &'a Maps,
    /// Of pressure and SED.
    painters: [Painter<'a>; 2],
}

impl Drawing<'_> {
    /// Draws both maps of each sample, and has them looked at: its press, its depth in mm.
    fn each(
        &mut self,
        mut look: impl FnMut(&IndentationEntry, f32, &mut [Painter<'_>]) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        for press in &self.dataset.manifest().presses {
            let shard = self.dataset.shard(press)?;
            let maps = self.maps.of(&shard);
            for sample in 0..shard.len() {
                let fields = [Field::Pressure, Field::SedDermis];
                for (field, painter) in fields.into_iter().zip(&mut self.painters) {
                    maps.draw(field, sample, &mut painter.pixels)?;
                }
                look(press, shard.depth_mm[sample], &mut self.painters)?;
            }
        }
        Ok(())
    }
}

/// Writes `press-00000-depth-0.25mm-pressure.png` and `...-sed.png` for every
/// sample of the dataset in `folder` into `out`, gray, and last `index.json` with the scales and
/// splits.
///
/// White is the dataset's maximum, or the greatest pixel: the quadratic that SED is read on may
/// exceed the values at its nodes.
///
/// # Errors
/// [`DatasetError`] when the dataset is damaged or `out` is not writable.
pub fn images(
    folder: &Path,
    out: &Path,
    options: &ImageOptions,
) -> Result<ImagesReport, DatasetError> {
    let dataset = Dataset::open(folder)?;
    let manifest = dataset.manifest();
    atomic::create_folder(out)?;
    let maps = Maps::read(folder, dataset.atlas())?;
    let [skin, interface] = Patch::ALL.map(|patch| maps.raster(patch).mask());
    let mut drawing = Drawing {
        dataset: &dataset,
        maps: &maps,
        painters: [
            Painter::new(&dataset, skin, Quantity::Pressure, manifest.pressure_max_pa),
            Painter::new(&dataset, interface, Quantity::Sed, manifest.sed_max_j_per_m3),
        ],
    };
    drawing.each(|_, _, painters| {
        for painter in painters {
            painter.white = painter.white.max(painter.greatest());
        }
        Ok(())
    })?;
    let mut samples = Vec::new();
    drawing.each(|press, depth_mm, painters| {
        let name =
            |q: Quantity| format!("press-{:05}-depth-{depth_mm}mm-{}.png", press.id, q.name());
        let entry = ImageEntry {
            press: press.id,
            depth_mm,
            split: press.split,
            pressure: name(Quantity::Pressure),
            sed: name(Quantity::Sed),
        };
        for (painter, file) in painters.iter().zip([&entry.pressure, &entry.sed]) {
            painter.write(options.bits, &out.join(file))?;
        }
        samples.push(entry);
        Ok(())
    })?;
    let [pressure_scale, sed_scale] =
        drawing.painters.each_ref().map(|p| p.view().scale(options.bits));
    let report = ImagesReport {
        dataset_sha256: manifest.dataset_sha256.clone(),
        atlas_hash: manifest.atlas_hash.clone(),
        pressure_scale,
        sed_scale,
        samples,
        folder: out.to_path_buf(),
    };
    atomic::write_json(&out.join("index.json"), &report)?;
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{atlas, entry, manifest, record, two_cells};
    use crate::{Sample, TriangleOnLattice, encode, write_atlas};
    use papilla_atlas::Atlas;
    use std::sync::Arc;

    /// Two cells that cover the whole atlas.
    fn lattice(atlas: &Atlas) -> Vec<TriangleOnLattice> {
        let uv = |v: u32| atlas.patch(Patch::Skin).uv_px[v as usize].map(f64::from);
        let place = |v: u32| [(uv(v)[1] - 20.0) / 184.0 * 128.0, (uv(v)[0] - 20.0) / 184.0 * 256.0];
        let on = |t: &[u32; 3]| TriangleOnLattice { side: 1, place: t.map(place) };
        atlas.triangles().iter().map(on).collect()
    }

    /// A dataset of one sample: SED in MPa at the nodes of two cells.
    fn dataset(folder: &Path, sed_dermis_mpa: Vec<f64>) {
        let (atlas, cells) = (atlas(6), two_cells());
        let count = cells.node_count();
        let sample = Sample { cells: Some(Arc::new(cells)), sed_dermis_mpa, ..record(0.5, count) };
        let shard = encode(&[sample], atlas.vertex_count()).unwrap().unwrap();
        let press = entry(0, Split::Train, 1, &shard.bytes);
        let most = [shard.pressure_max_pa, shard.sed_max_j_per_m3];
        atomic::create_folder(&folder.join("shards")).unwrap();
        std::fs::write(folder.join(&press.file), &shard.bytes).unwrap();
        write_atlas(folder, &atlas, Some(&lattice(&atlas))).unwrap();
        let manifest = manifest(&atlas, vec![press], most);
        atomic::write_json(&folder.join("manifest.json"), &manifest).unwrap();
    }

    #[test]
    fn white_is_the_greatest_pixel_where_a_quadratic_exceeds_its_nodes() {
        let folder = tempfile::tempdir().unwrap();
        // 0, 1, 1 at the first cell's nodes: its quadratic's greatest value is 9/8, in between.
        let row = [0.0, 1e-3, 1e-3, 1e-3, 1e-3];
        dataset(folder.path(), [row; 3].concat());
        let out = folder.path().join("images");
        let report = images(folder.path(), &out, &ImageOptions { bits: Bits::Sixteen }).unwrap();
        let white = report.sed_scale.white;
        assert!((white / 1125.0 - 1.0).abs() < 1e-3, "{white}");
        let png = image::open(out.join(&report.samples[0].sed)).unwrap().to_luma16();
        assert_eq!(png.pixels().map(|p| p.0[0]).max(), Some(u16::MAX));
    }
}
