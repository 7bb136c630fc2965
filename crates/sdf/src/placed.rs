//! A shape in its place: the rotation and translation from its own axes to those of the finger.

use super::{Distance, SignedDistance};
use std::sync::Arc;

/// A rotation and a translation: `world = rotation * local + origin`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Columns are the local axes in the world, `rotation[world][local]`.
    pub rotation: [[f64; 3]; 3],
    /// Local origin in the world, mm.
    pub origin_mm: [f64; 3],
}

impl Placement {
    /// Turned by `yaw` about z, then `pitch` about y, then `roll` about x
    /// (degrees), then moved.
    #[must_use]
    pub fn turned(pitch_deg: f64, roll_deg: f64, yaw_deg: f64, origin_mm: [f64; 3]) -> Self {
        let (sp, cp) = pitch_deg.to_radians().sin_cos();
        let (sr, cr) = roll_deg.to_radians().sin_cos();
        let (sy, cy) = yaw_deg.to_radians().sin_cos();
        let pitch = [[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]];
        let roll = [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]];
        let yaw = [[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]];
        let rotation = product(&roll, &product(&pitch, &yaw));
        Self { rotation, origin_mm }
    }

    /// Distance of a world point from a placed indenter, in world coordinates.
    #[must_use]
    pub fn distance(&self, indenter: &dyn SignedDistance, p: [f64; 3]) -> Distance {
        self.turned_back(&indenter.distance(self.inside(p)))
    }

    /// A world point in the local frame.
    fn inside(&self, p: [f64; 3]) -> [f64; 3] {
        self.to_local(std::array::from_fn(|i| p[i] - self.origin_mm[i]))
    }

    /// A distance in the local frame as the world sees it.
    fn turned_back(&self, found: &Distance) -> Distance {
        // R H R^T, one side at a time.
        let half: [[f64; 3]; 3] = std::array::from_fn(|i| self.to_world(found.hessian[i]));
        let columns: [[f64; 3]; 3] =
            std::array::from_fn(|j| self.to_world([half[0][j], half[1][j], half[2][j]]));
        Distance {
            gap_mm: found.gap_mm,
            normal: self.to_world(found.normal),
            hessian: std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i])),
        }
    }

    /// How far a placed indenter goes along a unit vector of the world, mm from
    /// the world's origin.
    #[must_use]
    pub fn reach_mm(&self, indenter: &dyn SignedDistance, direction: [f64; 3]) -> f64 {
        self.along_mm(direction, |d| indenter.reach_mm(d))
    }

    /// The same of anything that knows its `reach` along a local unit vector.
    pub(super) fn along_mm(&self, direction: [f64; 3], reach: impl Fn([f64; 3]) -> f64) -> f64 {
        let o = self.origin_mm;
        reach(self.to_local(direction))
            + (o[0] * direction[0] + o[1] * direction[1] + o[2] * direction[2])
    }

    /// [`SignedDistance::clearance_mm`] of a world point from a placed indenter.
    #[must_use]
    pub fn clearance_mm(&self, indenter: &dyn SignedDistance, p: [f64; 3]) -> f64 {
        indenter.clearance_mm(self.inside(p))
    }

    /// [`SignedDistance::side_mm`] of a world point from a placed indenter.
    #[must_use]
    pub fn side_mm(&self, indenter: &dyn SignedDistance, p: [f64; 3]) -> f64 {
        indenter.side_mm(self.inside(p))
    }

    /// [`SignedDistance::exits`] of a world point from a placed indenter, in world coordinates.
    pub fn exits(
        &self,
        indenter: &dyn SignedDistance,
        p: [f64; 3],
        each: &mut dyn FnMut(Distance) -> f64,
    ) {
        indenter.exits(self.inside(p), &mut |face| each(self.turned_back(&face)));
    }

    fn to_local(self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| (0..3).map(|k| self.rotation[k][i] * v[k]).sum())
    }

    fn to_world(self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| (0..3).map(|k| self.rotation[i][k] * v[k]).sum())
    }
}

/// Matrix product.
fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// An indenter moved and turned, as a part of another one.
#[derive(Clone)]
pub struct Placed {
    /// What is placed.
    pub part: Arc<dyn SignedDistance>,
    /// Where.
    pub placement: Placement,
}

impl SignedDistance for Placed {
    fn distance(&self, p: [f64; 3]) -> Distance {
        self.placement.distance(self.part.as_ref(), p)
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        self.placement.reach_mm(self.part.as_ref(), direction)
    }

    fn clearance_mm(&self, p: [f64; 3]) -> f64 {
        self.placement.clearance_mm(self.part.as_ref(), p)
    }

    fn side_mm(&self, p: [f64; 3]) -> f64 {
        self.placement.side_mm(self.part.as_ref(), p)
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        self.placement.exits(self.part.as_ref(), p, each);
    }

    fn cost(&self) -> f64 {
        self.part.cost()
    }

    fn mended(&self) -> Vec<String> {
        self.part.mended()
    }

    fn narrowest_mm(&self) -> f64 {
        self.part.narrowest_mm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};
    use crate::{Plate, RoundedPlate};

    distance_tests! {
        turned_plate: Placed {
            part: Arc::new(RoundedPlate::from(&Plate { size_mm: [12.0, 9.0], edge_radius_mm: 1.0 })),
            placement: Placement::turned(20.0, -35.0, 70.0, [0.3, -0.2, 0.1]),
        } => Exactness::Exact, detail_mm 1.0, mirrors []
    }

    #[test]
    fn a_turn_is_yaw_then_pitch_then_roll() {
        let world = |p: Placement, v: [f64; 3]| p.to_world(v);
        let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-15);
        let o = [0.0; 3];
        assert!(close(
            world(Placement::turned(0.0, 0.0, 90.0, o), [1.0, 0.0, 0.0]),
            [0.0, 1.0, 0.0]
        ));
        assert!(close(
            world(Placement::turned(90.0, 0.0, 0.0, o), [0.0, 0.0, 1.0]),
            [1.0, 0.0, 0.0]
        ));
        assert!(close(
            world(Placement::turned(0.0, 90.0, 0.0, o), [0.0, 1.0, 0.0]),
            [0.0, 0.0, 1.0]
        ));
        // x to y by yaw, y untouched by pitch, y to z by roll.
        assert!(close(
            world(Placement::turned(90.0, 90.0, 90.0, o), [1.0, 0.0, 0.0]),
            [0.0, 0.0, 1.0]
        ));
        let r = Placement::turned(20.0, -35.0, 70.0, o).rotation;
        for i in 0..3 {
            for j in 0..3 {
                let dot: f64 = (0..3).map(|k| r[k][i] * r[k][j]).sum();
                assert!((dot - if i == j { 1.0 } else { 0.0 }).abs() < 1e-15);
            }
        }
    }
}
