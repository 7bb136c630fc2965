//! Maps of the states of one shard.

use super::{MapReader, Maps};
use crate::{DatasetError, Shard};
use ndarray::{ArrayView1, s};
use papilla_atlas::Patch;
use std::cell::OnceCell;

/// A field of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Pressure on the skin, Pa.
    Pressure,
    /// SED on the dermis side of the interface, J/m3.
    SedDermis,
    /// SED on the epidermis side, J/m3.
    SedEpidermis,
    /// A component of the shear traction on the skin, Pa: 0 to 2 along x, y, z of the finger's frame.
    /// Zero everywhere in a shard without friction.
    Shear(usize),
}

impl Field {
    /// The patch that it is on.
    #[must_use]
    pub const fn patch(self) -> Patch {
        match self {
            Self::Pressure | Self::Shear(_) => Patch::Skin,
            Self::SedDermis | Self::SedEpidermis => Patch::Interface,
        }
    }
}

/// The maps of one shard's states.
pub struct ShardMaps<'a> {
    maps: &'a Maps,
    shard: &'a Shard,
    skin: OnceCell<MapReader<'a>>,
    interface: OnceCell<MapReader<'a>>,
}

impl<'a> ShardMaps<'a> {
    pub(super) const fn new(maps: &'a Maps, shard: &'a Shard) -> Self {
        Self { maps, shard, skin: OnceCell::new(), interface: OnceCell::new() }
    }

    /// Overwrites a map of 224 x 224 with a field of a state; 0 outside the patch.
    ///
    /// Pressure and SED are never negative, also where a quadratic overshoots.
    ///
    /// # Errors
    /// [`DatasetError::Output`] where a pixel lies in no cell of the shard, or the map or the shard
    /// have another length than the atlas.
    ///
    /// # Panics
    /// If the shard has no such state, or fewer values than nodes of its cells.
    pub fn draw(&self, field: Field, state: usize, map: &mut [f32]) -> Result<(), DatasetError> {
        let shard = self.shard;
        let values = match field {
            Field::Pressure => shard.pressure_pa.row(state),
            Field::SedDermis => shard.sed_dermis_j_per_m3.row(state),
            Field::SedEpidermis => shard.sed_epidermis_j_per_m3.row(state),
            Field::Shear(axis) => match &shard.shear_pa {
                Some(shear) => return self.draw_signed(&shear.slice(s![state, .., axis]), map),
                None => {
                    map.fill(0.0);
                    return Ok(());
                }
            },
        };
        self.reader(field.patch())?.draw(&values.to_vec(), map)
    }

    /// A field of either sign: what is above 0 less what is below.
    fn draw_signed(
        &self,
        values: &ArrayView1<'_, f32>,
        map: &mut [f32],
    ) -> Result<(), DatasetError> {
        let reader = self.reader(Patch::Skin)?;
        let mut below = vec![0.0; map.len()];
        for (sign, map) in [(1.0f32, &mut *map), (-1.0, &mut below)] {
            let part: Vec<f32> = values.iter().map(|v| (sign * v).max(0.0)).collect();
            reader.draw(&part, map)?;
        }
        map.iter_mut().zip(below).for_each(|(pixel, below)| *pixel -= below);
        Ok(())
    }

    fn reader(&self, patch: Patch) -> Result<&MapReader<'a>, DatasetError> {
        let known = match patch {
            Patch::Skin => &self.skin,
            Patch::Interface => &self.interface,
        };
        if let Some(reader) = known.get() {
            return Ok(reader);
        }
        let reader = self.maps.reader(patch, self.shard.cells.as_ref())?;
        Ok(known.get_or_init(|| reader))
    }
}
