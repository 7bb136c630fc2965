//! A few held-out indentations for the service's page, next to their FE truth.

use super::{Dataset, DatasetError, Field, IndentationEntry, Maps, ShardMaps, Split};
use crate::record::Pose;
use papilla_atlas::{MAP_LEN, Raster};
use papilla_output::{OutputError, atomic};
use serde::Serialize;
use std::path::Path;

/// One indentation of `replay.json`.
#[derive(Serialize)]
struct ReplayPress {
    name: String,
    pose: Pose,
    depth_mm: f32,
    /// At the pixels of the skin, in the raster's order.
    pressure_pa: Vec<f32>,
    /// At those of the interface.
    sed_j_per_m3: Vec<f32>,
}

/// The file's content.
#[derive(Serialize)]
struct Replay {
    atlas_hash: String,
    dataset_sha256: String,
    presses: Vec<ReplayPress>,
}

/// Writes `count` samples of held-out indentations, spread over the list of them and
/// over their depths, to `path`; returns their names.
///
/// # Errors
/// [`DatasetError`] when the dataset is damaged or `path` is not writable.
pub fn replay(folder: &Path, count: usize, path: &Path) -> Result<Vec<String>, DatasetError> {
    let dataset = Dataset::open(folder)?;
    let held_out: Vec<&IndentationEntry> = dataset.of_split(Split::Test).collect();
    let count = count.min(held_out.len());
    let maps = Maps::read(folder, dataset.atlas())?;
    let mut presses = Vec::with_capacity(count);
    for k in 0..count {
        let press = held_out[k * held_out.len() / count];
        let shard = dataset.shard(press)?;
        // Deepest first, then shallower ones.
        let sample = shard.len() - 1 - (2 * k) % shard.len();
        let depth_mm = shard.depth_mm[sample];
        let of_shard = maps.of(&shard);
        let drawn = |field: Field| shown(&of_shard, maps.raster(field.patch()), field, sample);
        presses.push(ReplayPress {
            name: format!(
                "{}: {depth_mm:.2} mm, pitch {:.0}°, roll {:.0}°",
                press.indenter, press.pose.pitch_deg, press.pose.roll_deg
            ),
            pose: press.pose,
            depth_mm,
            pressure_pa: drawn(Field::Pressure)?,
            sed_j_per_m3: drawn(Field::SedDermis)?,
        });
    }
    let names = presses.iter().map(|p| p.name.clone()).collect();
    let replay = Replay {
        atlas_hash: dataset.manifest().atlas_hash.clone(),
        dataset_sha256: dataset.manifest().dataset_sha256.clone(),
        presses,
    };
    // On one line: there are half a million numbers.
    let text = serde_json::to_vec(&replay)
        .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
    atomic::write(path, &text)?;
    Ok(names)
}

/// Values at the pixels of a patch, to the four digits that a map of 16 bits has.
fn shown(
    maps: &ShardMaps<'_>,
    raster: &Raster,
    field: Field,
    sample: usize,
) -> Result<Vec<f32>, DatasetError> {
    let mut map = vec![0.0; MAP_LEN];
    maps.draw(field, sample, &mut map)?;
    let short = |&pixel: &u32| match map[pixel as usize] {
        0.0 => 0.0,
        value => {
            let digits = 10f32.powi(3 - value.abs().log10().floor() as i32);
            (value * digits).round() / digits
        }
    };
    Ok(raster.indices().iter().map(short).collect())
}
