//! Indenter `torus`: a ring of round section that lies flat, and its signed distance.

use super::beneath::tangents;
use super::revolved::{Flat, revolve};
use super::rules::{BadValue, length, require};
use super::{Distance, SignedDistance};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_SQRT_2;

/// A ring of round section that lies flat, centred at the origin: its top is at
/// `z = tube_radius_mm`, its hole along z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Torus {
    /// Radius of the circle in the middle of the tube, mm.
    pub radius_mm: f64,
    /// Radius of the tube, mm.
    pub tube_radius_mm: f64,
}

impl Default for Torus {
    fn default() -> Self {
        Self { radius_mm: 4.0, tube_radius_mm: 1.0 }
    }
}

impl Torus {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        length("radius_mm", self.radius_mm)?;
        require(
            self.tube_radius_mm > 0.0 && self.tube_radius_mm < self.radius_mm,
            "tube_radius_mm",
            &self.tube_radius_mm,
            "has to be positive and less than the radius",
        )
    }

    /// Distance in a half plane through the axis: that of a circle. At its very centre every
    /// direction is as good; `+z` is taken there.
    fn section(&self, [r, z]: [f64; 2]) -> Flat {
        let across = r - self.radius_mm;
        let length = across.hypot(z);
        let gap_mm = length - self.tube_radius_mm;
        if length == 0.0 {
            return Flat { gap_mm, normal: [0.0, 1.0], curvature_per_mm: 0.0 };
        }
        let normal = [across / length, z / length];
        Flat { gap_mm, normal, curvature_per_mm: 1.0 / length }
    }
}

impl SignedDistance for Torus {
    /// The axis is a kink, as far from the tube on every side.
    fn distance(&self, p: [f64; 3]) -> Distance {
        revolve(p, 2, |q| self.section(q))
    }

    fn cost(&self) -> f64 {
        2.0
    }

    /// What is round has no faces: eight planes round the tube that touch it beside `p`.
    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        const K: f64 = FRAC_1_SQRT_2;
        each(self.distance(p));
        for normal in
            [[1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [K, K], [K, -K], [-K, K], [-K, -K], [-1.0, 0.0]]
        {
            each(revolve(p, 2, |[r, z]| {
                let along = normal[0] * (r - self.radius_mm) + normal[1] * z;
                Flat { gap_mm: along - self.tube_radius_mm, normal, curvature_per_mm: 0.0 }
            }));
        }
        tangents(p, self.radius_mm + self.tube_radius_mm, &[0, 1], each);
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        self.radius_mm * direction[0].hypot(direction[1]) + self.tube_radius_mm
    }

    fn narrowest_mm(&self) -> f64 {
        2.0 * self.tube_radius_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};
    use crate::{Placed, Placement};
    use papilla_vector::{minus, norm};
    use proptest::prelude::*;
    use std::sync::Arc;

    distance_tests! {
        torus: Torus::default() => Exactness::Exact, detail_mm 1.0, mirrors [0, 1, 2]
    }
    distance_tests! {
        turned: Placed {
            part: Arc::new(Torus { radius_mm: 5.0, tube_radius_mm: 1.5 }),
            placement: Placement::turned(20.0, -35.0, 70.0, [0.3, -0.2, 0.1]),
        } => Exactness::Exact, detail_mm 1.5, mirrors []
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The distance from the nearest of many places of the circle, less the tube's radius.
        #[test]
        fn it_is_as_far_as_its_circle(
            p in prop::array::uniform3(-8.0..8.0f64), radius_mm in 1.0..5.0f64, part in 0.05..0.95f64,
        ) {
            let torus = Torus { radius_mm, tube_radius_mm: part * radius_mm };
            prop_assert!(torus.validate().is_ok());
            let turn = p[1].atan2(p[0]);
            let nearest = (-2000..=2000).map(|k| {
                let (sin, cos) = (turn + 1e-3 * f64::from(k)).sin_cos();
                norm(minus(p, [radius_mm * cos, radius_mm * sin, 0.0]))
            });
            let due = nearest.fold(f64::INFINITY, f64::min) - torus.tube_radius_mm;
            prop_assert!((torus.distance(p).gap_mm - due).abs() < 1e-12);
        }

        /// Twice as large, it is twice as far, and bends half as much.
        #[test]
        fn it_scales(p in prop::array::uniform3(-8.0..8.0f64), factor in 0.2..5.0f64) {
            let torus = Torus::default();
            let scaled = Torus { radius_mm: factor * 4.0, tube_radius_mm: factor };
            let [one, other] = [torus.distance(p), scaled.distance(p.map(|v| factor * v))];
            prop_assert!((factor * one.gap_mm - other.gap_mm).abs() < 1e-12 * (1.0 + factor));
            for i in 0..3 {
                prop_assert!((one.normal[i] - other.normal[i]).abs() < 1e-9);
                for j in 0..3 {
                    let size = one.hessian[i][j].abs().max(1.0);
                    prop_assert!((one.hessian[i][j] - factor * other.hessian[i][j]).abs() < 1e-6 * size * size);
                }
            }
        }
    }

    #[test]
    fn the_hole_is_a_hole_and_the_tube_is_round() {
        let torus = Torus::default();
        let axis = torus.distance([0.0; 3]);
        assert!((axis.gap_mm - 3.0).abs() < 1e-15);
        assert!(axis.hessian.iter().flatten().all(|v| v.is_finite()));
        let hole = torus.distance([2.0, 0.0, 0.0]);
        // Across the tube it bends outward, round the hole inward.
        assert!((hole.gap_mm - 1.0).abs() < 1e-15 && hole.normal[0] <= -1.0);
        assert!((hole.hessian[2][2] - 0.5).abs() < 1e-15);
        assert!((hole.hessian[1][1] + 0.5).abs() < 1e-15);
        let middle = torus.distance([0.0, 4.0, 0.0]);
        assert!((middle.gap_mm + 1.0).abs() < 1e-15 && middle.normal.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn a_tube_that_fills_the_hole_is_refused() {
        for tube_radius_mm in [0.0, 4.0, f64::NAN] {
            let error = Torus { tube_radius_mm, ..Torus::default() }.validate().unwrap_err();
            assert_eq!(error.field, "tube_radius_mm");
        }
    }
}
