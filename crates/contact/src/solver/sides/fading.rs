//! Force that falls while an object moves further in.

use super::Sides;
use papilla_vector::dot;

/// Fall of the force on a straight way in that is flagged, as part of it and N, and what is straight.
const FADE: f64 = 0.05;
const FADE_N: f64 = 8e-3;
const ASIDE: f64 = 0.4;
/// Farther in one frame an object was not followed on its way in, mm.
const FOLLOWED_MM: f64 = 2.0;

impl Sides {
    /// Whether the force `force_n` of the only object has fallen on a straight way in. One that has not
    /// settled tells nothing, neither now nor later.
    pub(in super::super) fn has_faded(&mut self, force_n: [f64; 3], is_settled: bool) -> bool {
        let [side] = &mut self.now[..] else { return false };
        let last = self.kept.first().copied().unwrap_or_default();
        let is_followed = |place: [f64; 3]| {
            let by = |was: [f64; 3]| (0..3).map(|i| (place[i] - was[i]).powi(2)).sum::<f64>();
            last.origin_mm.is_some_and(|was| by(was) <= FOLLOWED_MM * FOLLOWED_MM)
        };
        let past = last.hardest.filter(|_| side.origin_mm.is_some_and(is_followed));
        if !is_settled {
            side.hardest = past;
            return false;
        }
        let (Some(way), Some(place)) = (side.way, side.origin_mm) else { return false };
        let force = -dot(force_n, way);
        let Some([x, y, z, hardest]) = past else {
            side.hardest = (force > 0.0).then_some([place[0], place[1], place[2], force]);
            return false;
        };
        let by: [f64; 3] = std::array::from_fn(|i| place[i] - [x, y, z][i]);
        let along = -dot(by, way);
        let aside = (dot(by, by) - along * along).max(0.0).sqrt();
        if along >= 0.0 && aside <= ASIDE * along && force < hardest * (1.0 - FADE) - FADE_N {
            side.hardest = past;
            return true;
        }
        side.hardest = (force > 0.0).then_some([place[0], place[1], place[2], force]);
        false
    }
}
