//! Where the plate is in each press, and which presses are held out.

use super::{CampaignSpec, PoseRanges};
use crate::dataset::{Split, Splits};
use crate::press::record::Pose;
use sha2::{Digest, Sha256};

/// The poses of all presses by id: points of an Owen-scrambled Sobol sequence
/// (Burley, Practical Hash-based Owen Scrambling, JCGT 9(4), 2020), scaled to
/// the ranges. They fill the ranges far more evenly than random ones, and the
/// first n poses do not depend on how many follow.
pub fn poses(spec: &CampaignSpec) -> Vec<Pose> {
    // The sequence takes 32 bits: both halves of the seed count.
    let seed = (spec.seed ^ (spec.seed >> 32)) as u32;
    let PoseRanges { pitch_deg, roll_deg, yaw_deg } = &spec.pose;
    (0..spec.presses as u32)
        .map(|id| {
            let within = |dimension: u32, [low, high]: [f64; 2]| {
                low + (high - low) * f64::from(sobol_burley::sample(id, dimension, seed))
            };
            Pose {
                pitch_deg: within(0, *pitch_deg),
                roll_deg: within(1, *roll_deg),
                yaw_deg: within(2, *yaw_deg),
            }
        })
        .collect()
}

/// Divides the presses: the `test_fraction` (rounded; at least one, and never
/// all, when it is above 0) with the smallest SHA-256 of seed and id is held
/// out. Whole presses, since two depths of one press are near-copies.
pub fn splits(spec: &CampaignSpec) -> Splits {
    let mut order: Vec<usize> = (0..spec.presses).collect();
    order.sort_by_cached_key(|id| {
        let mut hash = Sha256::new();
        hash.update(b"papilla split\0");
        hash.update(spec.seed.to_le_bytes());
        hash.update((*id as u64).to_le_bytes());
        <[u8; 32]>::from(hash.finalize())
    });
    let held_out = match (spec.test_fraction * spec.presses as f64).round() as usize {
        count if spec.test_fraction > 0.0 && spec.presses > 1 => count.clamp(1, spec.presses - 1),
        _ => 0,
    };
    let mut test = order[..held_out].to_vec();
    let mut train = order[held_out..].to_vec();
    test.sort_unstable();
    train.sort_unstable();
    Splits { train, test }
}

/// The split of one press.
pub(super) fn split_of(splits: &Splits, id: usize) -> Split {
    if splits.test.binary_search(&id).is_ok() { Split::Test } else { Split::Train }
}
