//! The surface-pressure study's image pairs: 224 x 224 gray PNG of pressure and SED.

use super::{Dataset, DatasetError, MapReader, Maps, Split};
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
    /// Scale of all pressure images: white is the dataset's maximum.
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
            // A dataset of zeros has no maximum to normalise by.
            white: if max > 0.0 { max } else { 1.0 },
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
            white: self.white,
        }
    }

    fn write(
        &mut self,
        reader: &MapReader<'_>,
        values: &[f32],
        bits: Bits,
        path: &Path,
    ) -> Result<(), DatasetError> {
        reader
            .draw(values, &mut self.pixels)
            .map_err(|source| DatasetError::Atlas { path: path.to_path_buf(), source })?;
        // Not synced one by one: index.json, written last, says all are there.
        let bytes = self.view().encode_gray(bits)?;
        Ok(std::fs::write(path, bytes).map_err(OutputError::io("write", path))?)
    }
}

/// Writes `press-00000-depth-0.25mm-pressure.png` and `...-sed.png` for every
/// sample of the dataset in `folder` into `out`, gray, normalised by the
/// dataset's maximum, and last `index.json` with the scales and splits.
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
    let mut pressure = Painter::new(&dataset, skin, Quantity::Pressure, manifest.pressure_max_pa);
    let mut sed = Painter::new(&dataset, interface, Quantity::Sed, manifest.sed_max_j_per_m3);
    let mut samples = Vec::new();
    for press in &manifest.presses {
        let shard = dataset.shard(press)?;
        let on_skin = maps.reader(Patch::Skin, shard.cells.as_ref())?;
        let below = maps.reader(Patch::Interface, shard.cells.as_ref())?;
        for sample in 0..shard.len() {
            let depth_mm = shard.depth_mm[sample];
            let name =
                |q: Quantity| format!("press-{:05}-depth-{depth_mm}mm-{}.png", press.id, q.name());
            let entry = ImageEntry {
                press: press.id,
                depth_mm,
                split: press.split,
                pressure: name(Quantity::Pressure),
                sed: name(Quantity::Sed),
            };
            let values = shard.pressure_pa.row(sample).to_vec();
            pressure.write(&on_skin, &values, options.bits, &out.join(&entry.pressure))?;
            let values = shard.sed_dermis_j_per_m3.row(sample).to_vec();
            sed.write(&below, &values, options.bits, &out.join(&entry.sed))?;
            samples.push(entry);
        }
    }
    let report = ImagesReport {
        dataset_sha256: manifest.dataset_sha256.clone(),
        atlas_hash: manifest.atlas_hash.clone(),
        pressure_scale: pressure.view().scale(options.bits),
        sed_scale: sed.view().scale(options.bits),
        samples,
        folder: out.to_path_buf(),
    };
    atomic::write_json(&out.join("index.json"), &report)?;
    Ok(report)
}
