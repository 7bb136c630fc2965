//! The pressure that contact on pixels finds for the states of a dataset, for the trainer.

use super::{Models, Placed, Rung, pixel_contact};
use crate::ExportError;
use crate::dataset::Dataset;
use papilla_contact::{Contact, Object, PixelContact, PixelSpacing, Solver};
use papilla_dataset::{IndentationEntry, Split};
use papilla_engine::MAP_SIDE_PX;
use papilla_output::{OutputError, npz::NpzBuilder};

/// Maps of pressure, one for each state that settled within the range.
#[derive(Debug, Default)]
pub struct ContactMaps {
    /// Indentation of each map.
    pub press: Vec<i64>,
    /// State of that indentation.
    pub state: Vec<i64>,
    /// Pressure, Pa; `[N, 224, 224]`, row by row.
    pub pressure_pa: Vec<f32>,
    /// States without a map: unsettled, out of range or never touched.
    pub left_out: usize,
}

/// Solves an object on pixels from nothing; whether it touches, settles and is within the range.
pub(super) fn settles_from_nothing(
    object: Option<Object>,
    (solver, pixels, out): (&mut Solver, &mut PixelContact, &mut Contact),
) -> bool {
    solver.reset();
    pixels.reset();
    object.is_some_and(|object| solver.solve_on_pixels(&[object], pixels, out).is_ok())
        && out.quality.settled
        && !out.quality.out_of_range
}

impl ContactMaps {
    /// Solves every state of both splits on pixels, each from nothing.
    ///
    /// # Errors
    /// [`ExportError`] of the dataset, or where the contact model knows no pixels of it.
    pub fn of(models: &Models, dataset: &Dataset) -> Result<Self, ExportError> {
        let [train, test] = [Split::Train, Split::Test].map(|split| dataset.indentations(split));
        Self::of_indentations(models, dataset, train?.into_iter().chain(test?))
    }

    /// The same for some indentations, in their order.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub(crate) fn of_indentations<'a>(
        models: &Models,
        dataset: &'a Dataset,
        indentations: impl IntoIterator<Item = &'a IndentationEntry>,
    ) -> Result<Self, ExportError> {
        let mut maps = Self::default();
        let pixels = pixel_contact(models, dataset, PixelSpacing::One);
        let (Some(mut solver), Some(mut pixels)) = (models.solver(Rung::Pixels), pixels) else {
            let reason = "the contact model has no layers, or other vertices than this atlas; \
                write it anew with `fe-datagen contact` (skin under tension has no layers)";
            let path = dataset.folder().join("atlas.json");
            return Err(ExportError::DatasetFile { path, reason: reason.to_owned() });
        };
        let mut out = Contact::new(models.finger.vertices());
        for indentation in indentations {
            let shard = dataset.shard(indentation)?;
            let placed = Placed::at_first_touch(dataset, indentation, &shard)?;
            for state in 0..indentation.samples {
                let depth_mm = f64::from(shard.depth_mm[state]);
                let object = placed.as_ref().map(|p| p.at(depth_mm, shard.slid_mm(state)));
                if !settles_from_nothing(object, (&mut solver, &mut pixels, &mut out)) {
                    maps.left_out += 1;
                    continue;
                }
                maps.press.push(indentation.id as i64);
                maps.state.push(state as i64);
                maps.pressure_pa.extend_from_slice(pixels.map_pa());
            }
        }
        Ok(maps)
    }

    /// The archive: `press` and `state` (i64 `[N]`), `pressure_pa` (f32 `[N, 224, 224]`) and the
    /// `dataset_sha256` of the dataset (u8 `[64]`, hexadecimal).
    ///
    /// # Errors
    /// [`OutputError`] of an archive past the format's limits.
    pub fn npz(&self, dataset: &Dataset) -> Result<Vec<u8>, OutputError> {
        let count = self.press.len();
        let mut npz = NpzBuilder::new();
        npz.add_slice("dataset_sha256", &[dataset.sha256().len()], dataset.sha256().as_bytes())?;
        npz.add_slice("press", &[count], &self.press)?;
        npz.add_slice("state", &[count], &self.state)?;
        npz.add_slice("pressure_pa", &[count, MAP_SIDE_PX, MAP_SIDE_PX], &self.pressure_pa)?;
        npz.finish()
    }
}
