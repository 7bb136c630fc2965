//! Makes the manifest of a dataset from the records of all simulations.

use crate::CampaignError;
use crate::state::{IndentationState, Outcome, SOFTWARE};
use papilla_atlas::Atlas;
use papilla_dataset as dataset;
use papilla_dataset::{
    DroppedSample, FailedIndentation, IndentationEntry, Manifest, Split, Splits,
};
use papilla_fingertip::campaign::{CampaignSpec, HeldOut, Indentation, held_out};
use papilla_fingertip::scene::Pose;
use papilla_output::OutputError;

/// The manifest of all indentations, which stand in order of their ids.
pub(crate) fn manifest(
    spec: &CampaignSpec,
    atlas: &Atlas,
    states: &[IndentationState],
) -> Result<Manifest, CampaignError> {
    let all = held_out(spec);
    let (mut presses, mut failed, mut dropped) = (Vec::new(), Vec::new(), Vec::new());
    let (mut pressure_max, mut sed_max) = (0.0f64, 0.0f64);
    for IndentationState { press, outcome, .. } in states {
        let Indentation { id, indenter, shape, pose, offset_mm, .. } = press.clone();
        let Pose { pitch_deg, roll_deg, yaw_deg } = pose;
        let pose = dataset::Pose { pitch_deg, roll_deg, yaw_deg };
        match outcome {
            Outcome::Failed { error } => {
                failed.push(FailedIndentation {
                    id,
                    indenter,
                    shape,
                    pose,
                    offset_mm,
                    error: error.clone(),
                });
            }
            Outcome::Solved {
                sha256,
                samples,
                checks,
                pressure_max_pa,
                sed_max_j_per_m3,
                dropped: d,
            } => {
                pressure_max = pressure_max.max(*pressure_max_pa);
                sed_max = sed_max.max(*sed_max_j_per_m3);
                dropped.extend(d.iter().map(|(depth_mm, reason)| DroppedSample {
                    press: id,
                    depth_mm: *depth_mm,
                    reason: reason.clone(),
                }));
                presses.push(IndentationEntry {
                    id,
                    file: dataset::shard_file(id),
                    sha256: sha256.clone(),
                    split: split_of(&all, id),
                    samples: *samples,
                    indenter,
                    shape,
                    pose,
                    offset_mm,
                    checks: *checks,
                });
            }
        }
    }
    if let (true, Some(first)) = (presses.is_empty(), failed.first()) {
        let first = first.error.clone();
        return Err(CampaignError::NothingSolved { presses: spec.presses, first });
    }
    let campaign = serde_json::to_value(spec)
        .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
    let present = |ids: &[usize]| -> Vec<usize> {
        let is_there = |id: &usize| presses.binary_search_by_key(id, |p| p.id).is_ok();
        ids.iter().copied().filter(is_there).collect()
    };
    Ok(Manifest {
        format: dataset::FORMAT,
        atlas_hash: atlas.hash().to_string(),
        campaign,
        seed: spec.seed,
        software: SOFTWARE.to_string(),
        units: dataset::Units::default(),
        effects: spec.effects.iter().map(|e| e.as_str().into()).collect(),
        vertex_count: atlas.vertex_count(),
        pressure_max_pa: pressure_max,
        sed_max_j_per_m3: sed_max,
        check_columns: dataset::CHECK_COLUMNS.map(String::from).to_vec(),
        splits: Splits { train: present(&all.train), test: present(&all.test) },
        dataset_sha256: dataset::dataset_sha256(presses.iter().map(|p| p.sha256.as_str())),
        presses,
        failed,
        dropped,
    })
}

/// The split of one indentation.
fn split_of(all: &HeldOut, id: usize) -> Split {
    if all.test.binary_search(&id).is_ok() { Split::Test } else { Split::Train }
}
