//! Force that falls while an object moves further in.

use super::Sides;
use papilla_vector::dot;

/// Fall of the force on a straight way in that is flagged, as part of it and N, and what is straight.
const FADE: f64 = 0.05;
const FADE_N: f64 = 8e-3;
const ASIDE: f64 = 0.4;
/// Farther in one frame an object was not followed on its way in, mm.
const FOLLOWED_MM: f64 = 2.0;
/// How far from the middle of a contact an object that turns moves skin aside, mm: half of a contact's
/// width.
const LEVER_MM: f64 = 5.0;

/// Where an object pressed hardest on a straight way in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardest {
    /// Where it was, reference mm.
    pub origin_mm: [f64; 3],
    /// How it was turned.
    pub rotation: [[f64; 3]; 3],
    /// Its force against the way out, N.
    pub force_n: f64,
}

impl Hardest {
    pub(super) fn is_finite(&self) -> bool {
        let all = self.origin_mm.iter().chain(self.rotation.as_flattened()).chain([&self.force_n]);
        all.into_iter().all(|value| value.is_finite())
    }

    /// Whether a straight way in leads from here to another place.
    fn leads_to(&self, other: &Self, way: [f64; 3]) -> bool {
        let by: [f64; 3] = std::array::from_fn(|i| other.origin_mm[i] - self.origin_mm[i]);
        let along = -dot(by, way);
        let aside = (dot(by, by) - along * along).max(0.0).sqrt();
        let rows = self.rotation.as_flattened().iter().zip(other.rotation.as_flattened());
        // The size of the difference of two rotations is that of the turn times the square root of two.
        let turn = (0.5 * rows.map(|(a, b)| (a - b).powi(2)).sum::<f64>()).sqrt();
        along >= 0.0 && aside + LEVER_MM * turn <= ASIDE * along
    }
}

impl Sides {
    /// Whether the force `force_n` of the only object, which is turned so, has fallen on a straight way in:
    /// below the greatest on this way. One that has not settled tells nothing, neither now nor later.
    pub(in super::super) fn has_faded(
        &mut self,
        rotation: [[f64; 3]; 3],
        force_n: [f64; 3],
        is_settled: bool,
    ) -> bool {
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
        let (Some(way), Some(origin_mm)) = (side.way, side.origin_mm) else { return false };
        let now = Hardest { origin_mm, rotation, force_n: -dot(force_n, way) };
        let hardest = past.filter(|past| past.leads_to(&now, way) && past.force_n > now.force_n);
        side.hardest = hardest.or((now.force_n > 0.0).then_some(now));
        hardest.is_some_and(|hardest| now.force_n < hardest.force_n * (1.0 - FADE) - FADE_N)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::Side;
    use papilla_sdf::Placement;

    /// Frames of an object that goes so far in and aside, and turns so far (degrees), in each; its force falls
    /// by 2 mN in each. How many were told.
    fn told(in_mm: f64, aside_mm: f64, turn_deg: f64) -> usize {
        let mut sides = Sides::new(false);
        let frame = |step: i32| {
            let by = f64::from(step);
            let origin_mm = Some([aside_mm * by, 0.0, in_mm * by]);
            sides.now.clear();
            sides.now.push(Side { way: Some([0.0, 0.0, -1.0]), origin_mm, ..Side::default() });
            let rotation = Placement::turned(turn_deg * by, 0.0, 0.0, [0.0; 3]).rotation;
            let is_told = sides.has_faded(rotation, [0.0, 0.0, 1.0 - 2e-3 * by], true);
            sides.keep();
            is_told
        };
        (0..60).map(frame).filter(|is_told| *is_told).count()
    }

    #[test]
    fn a_slow_fall_is_told_on_a_straight_way_in_alone() {
        // From a fall by 58 mN on.
        assert_eq!(told(0.01, 0.0, 0.0), 30);
        assert_eq!(told(0.01, 0.002, 0.0), 30);
        // It rests.
        assert_eq!(told(0.0, 0.0, 0.0), 30);
        // It goes out, slides, or rolls.
        assert_eq!([told(-0.01, 0.0, 0.0), told(0.01, 0.02, 0.0), told(0.01, 0.0, 0.2)], [0; 3]);
    }

    #[test]
    fn what_has_not_settled_tells_nothing() {
        let mut sides = Sides::new(false);
        let mut frame = |z_mm: f64, force_n: f64, is_settled: bool| {
            let side = Side { way: Some([0.0, 0.0, -1.0]), ..Side::default() };
            sides.now.clear();
            sides.now.push(Side { origin_mm: Some([0.0, 0.0, z_mm]), ..side });
            let rotation = Placement::turned(0.0, 0.0, 0.0, [0.0; 3]).rotation;
            let is_told = sides.has_faded(rotation, [0.0, 0.0, force_n], is_settled);
            sides.keep();
            is_told
        };
        assert!(!frame(0.0, 1.0, true));
        assert!(!frame(0.1, 3.0, false));
        assert!(!frame(0.2, 1.1, true));
        assert!(frame(0.3, 0.9, true));
        // Anew from the air.
        assert!(!frame(9.0, 0.1, true));
    }
}
