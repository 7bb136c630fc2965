//! Maps of a finger's equilibria as datasets hold them, whoever asks for them.

use super::body::Body;
use super::record::IncrementRecord;
use super::sample;
use crate::mesh::fingertip::Leaf;
use papilla_atlas::flatten::BuildAtlasError;
use papilla_atlas::{Atlas, MAP_LEN};
use papilla_dataset::{Cells, DatasetError, Field, Maps, Sample, Shard, TriangleOnLattice, fault};
use std::sync::Arc;

/// From now on records of the body hold what is known at the nodes of its cells, which come back;
/// `None` of a body whose nodes are the atlas' vertices, or that has no atlas.
pub fn read_at_cells(body: &mut Body) -> Option<Arc<Cells>> {
    let vertices = body.read_at_nodes()?;
    let place = |(leaf, _): &(Leaf, [u32; 9])| {
        let ([row, column], [rows, columns]) = (leaf.first, leaf.size);
        [leaf.side as u32, row, column, rows, columns]
    };
    Some(Arc::new(Cells {
        place: vertices.cells.iter().map(place).collect(),
        nodes: vertices.cells.iter().map(|(_, nodes)| *nodes).collect(),
    }))
}

/// Where the atlas' triangles lie on the lattice of a body's cells; `None` as of [`read_at_cells`].
#[must_use]
pub fn lattice(body: &Body) -> Option<Vec<TriangleOnLattice>> {
    let vertices = body.patch.as_ref()?.patch.vertices.as_ref()?;
    let on = |&(side, place): &_| TriangleOnLattice { side: side as u32, place };
    Some(vertices.corners.iter().map(on).collect())
}

/// Why there are no maps.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The skin cannot be flattened.
    #[error(transparent)]
    Atlas(#[from] BuildAtlasError),
    /// A record is of another body.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}

/// What turns records of one finger into maps.
pub struct FingerMaps {
    /// Where every pixel lies on the finger.
    pub atlas: Atlas,
    /// Draws the maps of [`Self::shard`].
    pub maps: Maps,
    cells: Option<Arc<Cells>>,
}

impl FingerMaps {
    /// Of a body, whose records hold from now on what [`read_at_cells`] says; `None` without an atlas.
    ///
    /// # Errors
    /// [`MapError::Atlas`].
    pub fn new(body: &mut Body) -> Result<Option<Self>, MapError> {
        let Some((atlas, _)) = body.atlas().transpose()? else { return Ok(None) };
        let maps = Maps::new(&atlas, lattice(body).as_deref());
        Ok(Some(Self { atlas, maps, cells: read_at_cells(body) }))
    }

    /// What a dataset holds of a record.
    #[must_use]
    pub fn sample(&self, record: &IncrementRecord) -> Sample {
        Sample { cells: self.cells.clone(), ..sample::of(record) }
    }

    /// Why a record must not enter a dataset; `None` when it is fit.
    #[must_use]
    pub fn fault(&self, record: &IncrementRecord) -> Option<String> {
        fault(&self.sample(record), self.atlas.vertex_count())
    }

    /// The records as a dataset holds them, those with a fault too.
    ///
    /// # Errors
    /// [`MapError::Dataset`].
    pub fn shard(&self, records: &[IncrementRecord]) -> Result<Shard, MapError> {
        let samples: Vec<Sample> = records.iter().map(|record| self.sample(record)).collect();
        Ok(Shard::of(&samples.iter().collect::<Vec<_>>(), self.atlas.vertex_count())?)
    }

    /// The maps of states, one state after the other, each 224 x 224: by name pressure (Pa), SED on
    /// both sides (J/m3) and, with friction, shear, which has three maps a state.
    ///
    /// # Errors
    /// [`MapError::Dataset`].
    pub fn drawn(
        &self,
        records: &[IncrementRecord],
    ) -> Result<Vec<(&'static str, Vec<f32>)>, MapError> {
        let shard = self.shard(records)?;
        let maps = self.maps.of(&shard);
        let draw = |fields: &[Field]| -> Result<Vec<f32>, MapError> {
            let mut pixels = vec![0.0; records.len() * fields.len() * MAP_LEN];
            for (i, map) in pixels.chunks_exact_mut(MAP_LEN).enumerate() {
                maps.draw(fields[i % fields.len()], i / fields.len(), map)?;
            }
            Ok(pixels)
        };
        let mut drawn = vec![
            ("pressure_pa", draw(&[Field::Pressure])?),
            ("sed_dermis_j_per_m3", draw(&[Field::SedDermis])?),
            ("sed_epidermis_j_per_m3", draw(&[Field::SedEpidermis])?),
        ];
        if shard.shear_pa.is_some() {
            drawn.push(("shear_pa", draw(&[0, 1, 2].map(Field::Shear))?));
        }
        Ok(drawn)
    }

    /// Pressure (Pa) and SED on the dermis side (J/m3) of a record, at the pixels of their patches.
    ///
    /// # Errors
    /// [`MapError::Dataset`].
    pub fn pressure_and_sed(&self, record: &IncrementRecord) -> Result<[Vec<f64>; 2], MapError> {
        let shard = self.shard(std::slice::from_ref(record))?;
        let of = |field: Field| -> Result<Vec<f64>, MapError> {
            let mut map = vec![0.0; MAP_LEN];
            self.maps.of(&shard).draw(field, 0, &mut map)?;
            let pixels = self.maps.raster(field.patch()).indices();
            Ok(pixels.iter().map(|&pixel| f64::from(map[pixel as usize])).collect())
        };
        Ok([of(Field::Pressure)?, of(Field::SedDermis)?])
    }
}
