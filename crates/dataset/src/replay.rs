//! A few held-out indentations for the service's page, next to their FE truth.

use super::{Dataset, DatasetError, IndentationEntry, Split};
use crate::record::Pose;
use papilla_output::atomic;
use serde::Serialize;
use std::path::Path;

/// One indentation of `replay.json`.
#[derive(Serialize)]
struct ReplayPress {
    name: String,
    pose: Pose,
    depth_mm: f32,
    pressure_pa: Vec<f32>,
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
    let held_out: Vec<&IndentationEntry> =
        dataset.manifest().presses.iter().filter(|p| p.split == Split::Test).collect();
    let count = count.min(held_out.len());
    let mut presses = Vec::with_capacity(count);
    for k in 0..count {
        let press = held_out[k * held_out.len() / count];
        let shard = dataset.shard(press)?;
        // Deepest first, then shallower ones.
        let sample = shard.len() - 1 - (2 * k) % shard.len();
        let depth_mm = shard.depth_mm[sample];
        presses.push(ReplayPress {
            name: format!(
                "press {}: pitch {:.0}°, roll {:.0}°, {depth_mm} mm",
                press.id, press.pose.pitch_deg, press.pose.roll_deg
            ),
            pose: press.pose,
            depth_mm,
            pressure_pa: shard.pressure_pa.row(sample).to_vec(),
            sed_j_per_m3: shard.sed_dermis_j_per_m3.row(sample).to_vec(),
        });
    }
    let names = presses.iter().map(|p| p.name.clone()).collect();
    let replay = Replay {
        atlas_hash: dataset.manifest().atlas_hash.clone(),
        dataset_sha256: dataset.manifest().dataset_sha256.clone(),
        presses,
    };
    atomic::write_json(path, &replay)?;
    Ok(names)
}
