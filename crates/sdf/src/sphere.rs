//! Indenter `sphere`: a ball, and its signed distance.

use super::beneath::tangents;
use super::rules::{BadValue, length};
use super::{Distance, SignedDistance};
use serde::{Deserialize, Serialize};

/// A sphere centred at the origin; its top is at `z = radius_mm`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Sphere {
    /// Radius, mm.
    pub radius_mm: f64,
}

impl Default for Sphere {
    fn default() -> Self {
        Self { radius_mm: 5.0 }
    }
}

impl Sphere {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        length("radius_mm", self.radius_mm)
    }
}

impl SignedDistance for Sphere {
    /// At the very centre every direction is as good; `+z` is taken there.
    fn distance(&self, p: [f64; 3]) -> Distance {
        let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        if length == 0.0 {
            return Distance {
                gap_mm: -self.radius_mm,
                normal: [0.0, 0.0, 1.0],
                hessian: [[0.0; 3]; 3],
            };
        }
        let normal = p.map(|v| v / length);
        let hessian = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let unit = if i == j { 1.0 } else { 0.0 };
                (unit - normal[i] * normal[j]) / length
            })
        });
        Distance { gap_mm: length - self.radius_mm, normal, hessian }
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        each(self.distance(p));
        tangents(p, self.radius_mm, &[0, 1, 2], each);
    }

    fn reach_mm(&self, _direction: [f64; 3]) -> f64 {
        self.radius_mm
    }

    fn narrowest_mm(&self) -> f64 {
        2.0 * self.radius_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        sphere: Sphere { radius_mm: 4.0 } => Exactness::Exact, detail_mm 4.0, mirrors [0, 1, 2]
    }

    #[test]
    fn the_centre_is_a_radius_deep_and_finite() {
        let d = Sphere { radius_mm: 2.5 }.distance([0.0; 3]);
        assert!((d.gap_mm + 2.5).abs() < 1e-15 && d.normal.iter().all(|v| v.is_finite()));
    }
}
