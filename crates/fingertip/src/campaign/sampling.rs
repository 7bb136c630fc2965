//! What presses where and how deep, and which indentations are held out.

use super::spec::{CampaignSpec, Candidate, DepthRange, PoseRanges, SlideRange};
use crate::scene::{Motion, PathPoint, Pose};
use crate::simulation::drive::{Drive, DrivePoint};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::ops::Range;

/// One indentation of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Indentation {
    /// Number within the campaign.
    pub id: usize,
    /// Place of its indenter among [`CampaignSpec::candidates`].
    pub candidate: usize,
    /// Name of its indenter.
    pub indenter: String,
    /// Name of the indenter's shape.
    pub shape: String,
    /// Orientation.
    pub pose: Pose,
    /// Where the indenter's axis meets the skin, mm, see [`CampaignSpec::offset_mm`].
    pub offset_mm: [f64; 2],
    /// Depths that are stored, mm from first touch, rising.
    pub depths_mm: Vec<f64>,
    /// Where the indenter is in states that are stored after those, at the deepest of them: mm
    /// along its own x and y from its way in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub slide_mm: Vec<[f64; 2]>,
}

impl Indentation {
    /// The deepest state, mm.
    #[must_use]
    pub fn deepest_mm(&self) -> f64 {
        self.depths_mm.last().copied().unwrap_or_default()
    }

    /// Depth (mm) and place (mm along the indenter's own x and y) of every stored state.
    pub fn states(&self) -> impl Iterator<Item = (f64, [f64; 2])> + '_ {
        let straight = self.depths_mm.iter().map(|d| (*d, [0.0; 2]));
        straight.chain(self.slide_mm.iter().map(|s| (self.deepest_mm(), *s)))
    }

    /// Its motion as in a scene: the same way, with states as far apart as a list of depths has them
    /// on average.
    #[must_use]
    pub fn motion(&self) -> Motion {
        let straight = Motion {
            offset_mm: self.offset_mm,
            ..Motion::to_depth(self.deepest_mm(), self.depths_mm.len().max(1), self.pose)
        };
        let Drive::Path(points) = self.drive() else { return straight };
        let at =
            |DrivePoint { time_s, depth_mm, shift_mm }| PathPoint { time_s, depth_mm, shift_mm };
        Motion { depth_mm: None, path: Some(points.into_iter().map(at).collect()), ..straight }
    }

    /// How it is driven. One that slides takes a second from state to state: no effect of a campaign
    /// asks how long.
    #[must_use]
    pub fn drive(&self) -> Drive {
        if self.slide_mm.is_empty() {
            return Drive::Depths(self.depths_mm.clone());
        }
        let at = |((depth_mm, shift_mm), second): ((f64, [f64; 2]), u32)| DrivePoint {
            time_s: f64::from(second),
            depth_mm,
            shift_mm,
        };
        Drive::Path(self.states().zip(1..).map(at).collect())
    }
}

impl CampaignSpec {
    /// Samples in all.
    pub fn samples(&self) -> usize {
        let candidates = self.candidates();
        let states = |c: &Candidate| {
            let depths =
                c.depths.or(self.depths).map_or(self.depths_mm.len(), |range| range.states);
            depths + self.slide.map_or(0, |slide| slide.states)
        };
        turns(&candidates).take(self.presses).map(|(place, _)| states(&candidates[place])).sum()
    }
}

/// All indentations by id.
pub fn indentations(spec: &CampaignSpec) -> Vec<Indentation> {
    indentations_in(spec, 0..spec.presses)
}

/// The indentations of some ids; takes no memory for others.
///
/// Indenters take turns so that after any number of indentations each has had its share, to
/// less than one indentation. Pose, offset and depth of one indenter's indentations are points
/// of an Owen-scrambled Sobol sequence of its own (Burley, Practical Hash-based Owen
/// Scrambling, JCGT 9(4), 2020), scaled to the ranges: they fill the ranges far more
/// evenly than random ones. After 65 536 of them the sequence comes again, scrambled otherwise.
/// The first n presses do not depend on how many follow.
pub fn indentations_in(spec: &CampaignSpec, ids: Range<usize>) -> Vec<Indentation> {
    let candidates = spec.candidates();
    let own = turns(&candidates).enumerate().skip(ids.start).take(ids.len());
    own.map(|(id, (place, index))| press(spec, id, place, &candidates[place], index)).collect()
}

/// Whose turn it is, without end: the indenter, and how many indentations it has had.
fn turns(candidates: &[Candidate]) -> impl Iterator<Item = (usize, u32)> + '_ {
    let mut had = vec![0u32; candidates.len()];
    let all: u64 = candidates.iter().map(|c| u64::from(c.share)).sum();
    (1u64..).map(move |turn| {
        // The one that its presses lag most behind its share.
        let lag = |k: usize| {
            let due = u64::from(candidates[k].share) * turn;
            due as i64 - (u64::from(had[k]) * all) as i64
        };
        let next = (0..candidates.len()).rev().max_by_key(|&k| lag(k)).unwrap_or(0);
        had[next] += 1;
        (next, had[next] - 1)
    })
}

/// Points that the Sobol sequence of `sobol_burley` has.
const POINTS: u32 = 1 << 16;

/// Press `id`, the `index`-th of a candidate.
fn press(spec: &CampaignSpec, id: usize, place: usize, c: &Candidate, index: u32) -> Indentation {
    // The sequence takes 32 bits: both halves of the seed count.
    let seed = (spec.seed ^ (spec.seed >> 32)) as u32;
    let (round, point) = (index / POINTS, index % POINTS);
    let own = seed
        .wrapping_add((place as u32).wrapping_mul(0x9e37_79b9))
        .wrapping_add(round.wrapping_mul(0x85eb_ca6b));
    let within = |dimension: u32, [low, high]: [f64; 2]| {
        low + (high - low) * f64::from(sobol_burley::sample(point, dimension, own))
    };
    let PoseRanges { pitch_deg, roll_deg, yaw_deg } = c.pose.unwrap_or(spec.pose);
    let [x, y] = c.offset_mm.unwrap_or(spec.offset_mm);
    let depths_mm = match c.depths.or(spec.depths) {
        None => spec.depths_mm.clone(),
        Some(DepthRange { deepest_mm, states }) => {
            let deepest = within(5, deepest_mm);
            (1..=states).map(|i| deepest * i as f64 / states as f64).collect()
        }
    };
    let slide_mm =
        spec.slide.map_or_else(Vec::new, |SlideRange { length_mm, direction_deg, states }| {
            let (length, direction) = (within(6, length_mm), within(7, direction_deg).to_radians());
            let at = |i| length * i as f64 / states as f64;
            (1..=states).map(|i| [at(i) * direction.cos(), at(i) * direction.sin()]).collect()
        });
    Indentation {
        id,
        candidate: place,
        indenter: c.name.clone(),
        shape: c.indenter.name().into(),
        pose: Pose {
            pitch_deg: within(0, pitch_deg),
            roll_deg: within(1, roll_deg),
            yaw_deg: within(2, yaw_deg),
        },
        offset_mm: [within(3, x), within(4, y)],
        depths_mm,
        slide_mm,
    }
}

/// Ids of the indentations that a model is trained with and tested on, rising.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HeldOut {
    /// Seen in training.
    pub train: Vec<usize>,
    /// Held out.
    pub test: Vec<usize>,
}

/// Divides the indentations: the `test_fraction` (rounded; at least one, and never
/// all, when it is above 0) with the smallest SHA-256 of seed and id is held
/// out. Whole indentations, since two depths of one indentation are near-copies.
///
/// With `test_one_in` it is the one with the smallest SHA-256 of each so many in their order, so that
/// an indentation stays on its side when more are asked for.
pub fn held_out(spec: &CampaignSpec) -> HeldOut {
    let by_hash = |id: &usize| {
        let mut hash = Sha256::new();
        hash.update(b"papilla split\0");
        hash.update(spec.seed.to_le_bytes());
        hash.update((*id as u64).to_le_bytes());
        <[u8; 32]>::from(hash.finalize())
    };
    let mut order: Vec<usize> = (0..spec.presses).collect();
    if let Some(block) = spec.test_one_in {
        // What is left of a block at the end is trained on.
        let test: Vec<usize> = order
            .chunks_exact(block.max(1))
            .filter_map(|block| block.iter().copied().min_by_key(by_hash))
            .collect();
        order.retain(|id| test.binary_search(id).is_err());
        return HeldOut { train: order, test };
    }
    order.sort_by_cached_key(by_hash);
    let share = spec.test_fraction.unwrap_or_default();
    let held_out = match (share * spec.presses as f64).round() as usize {
        count if share > 0.0 && spec.presses > 1 => count.clamp(1, spec.presses - 1),
        _ => 0,
    };
    let mut test = order[..held_out].to_vec();
    let mut train = order[held_out..].to_vec();
    test.sort_unstable();
    train.sort_unstable();
    HeldOut { train, test }
}
