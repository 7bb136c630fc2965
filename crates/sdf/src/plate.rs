//! Indenter `plate`: a flat plate with rounded edges, and its signed distance.

use super::rules::{BadValue, lengths, require};
use super::{Distance, SignedDistance};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_SQRT_2;

/// Thickness of what only has to be thick enough, mm beside its rounded edges.
pub(super) const THICKNESS_MM: f64 = 4.0;

/// A flat plate; the middle of its pressing face is at `z = 2 + edge_radius_mm`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Plate {
    /// Side lengths along x and y, mm.
    pub size_mm: [f64; 2],
    /// Radius of its edges, mm.
    pub edge_radius_mm: f64,
}

impl Default for Plate {
    fn default() -> Self {
        Self { size_mm: [20.0, 20.0], edge_radius_mm: 1.0 }
    }
}

impl Plate {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        lengths("size_mm", &self.size_mm)?;
        let most = 0.5 * self.size_mm[0].min(self.size_mm[1]);
        require(
            self.edge_radius_mm >= 0.0 && self.edge_radius_mm <= most,
            "edge_radius_mm",
            &self.edge_radius_mm,
            "has to be 0 to half the shorter side",
        )
    }
}

impl From<&Plate> for RoundedPlate {
    fn from(plate: &Plate) -> Self {
        let [x, y] = plate.size_mm;
        let half_z = 0.5 * THICKNESS_MM + plate.edge_radius_mm;
        Self { half_mm: [0.5 * x, 0.5 * y, half_z], edge_radius_mm: plate.edge_radius_mm }
    }
}

/// A box with edges and corners rounded, centred at the origin; the face that
/// presses is `z = +half_mm[2]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundedPlate {
    /// Half lengths along x, y, z, mm.
    pub half_mm: [f64; 3],
    /// Radius of the edges, mm; at most every half length.
    pub edge_radius_mm: f64,
}

impl SignedDistance for RoundedPlate {
    fn distance(&self, p: [f64; 3]) -> Distance {
        // Distance to the inner box, less the radius.
        let q: [f64; 3] =
            std::array::from_fn(|i| p[i].abs() - (self.half_mm[i] - self.edge_radius_mm));
        let sign: [f64; 3] = std::array::from_fn(|i| if p[i] < 0.0 { -1.0 } else { 1.0 });
        let outside = q.map(|v| v.max(0.0));
        let length = (outside[0].powi(2) + outside[1].powi(2) + outside[2].powi(2)).sqrt();
        let mut hessian = [[0.0; 3]; 3];
        if length > 0.0 {
            let normal: [f64; 3] = std::array::from_fn(|i| sign[i] * outside[i] / length);
            for i in 0..3 {
                for j in 0..3 {
                    if q[i] > 0.0 && q[j] > 0.0 {
                        let unit = if i == j { 1.0 } else { 0.0 };
                        hessian[i][j] = (unit - normal[i] * normal[j]) / length;
                    }
                }
            }
            Distance { gap_mm: length - self.edge_radius_mm, normal, hessian }
        } else {
            let axis = if q[2] >= q[0] && q[2] >= q[1] {
                2
            } else if q[0] >= q[1] {
                0
            } else {
                1
            };
            let mut normal = [0.0; 3];
            normal[axis] = sign[axis];
            Distance { gap_mm: q[axis] - self.edge_radius_mm, normal, hessian }
        }
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        let r = self.edge_radius_mm;
        (0..3).map(|i| (self.half_mm[i] - r) * direction[i].abs()).sum::<f64>() + r
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        each(self.distance(p));
        for i in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut normal = [0.0; 3];
                normal[i] = sign;
                let gap_mm = sign * p[i] - self.half_mm[i];
                each(Distance { gap_mm, normal, hessian: [[0.0; 3]; 3] });
            }
        }
        let r = self.edge_radius_mm;
        if r > 0.0 {
            // Along each rounded edge the plane that touches its middle.
            for [i, j] in [[0, 1], [0, 2], [1, 2]] {
                for [s, t] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
                    let mut normal = [0.0; 3];
                    normal[i] = s * FRAC_1_SQRT_2;
                    normal[j] = t * FRAC_1_SQRT_2;
                    let beyond = s * p[i] - self.half_mm[i] + t * p[j] - self.half_mm[j] + 2.0 * r;
                    let gap_mm = FRAC_1_SQRT_2 * beyond - r;
                    each(Distance { gap_mm, normal, hessian: [[0.0; 3]; 3] });
                }
            }
        }
    }

    fn narrowest_mm(&self) -> f64 {
        2.0 * self.half_mm[0].min(self.half_mm[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        plate: RoundedPlate::from(&Plate::default()) =>
            Exactness::Exact, detail_mm 1.0, mirrors [0, 1, 2]
    }
    distance_tests! {
        pill: RoundedPlate { half_mm: [3.0, 2.0, 2.0], edge_radius_mm: 2.0 } =>
            Exactness::Exact, detail_mm 2.0, mirrors [0, 1, 2]
    }

    #[test]
    fn a_face_an_edge_and_a_corner_are_where_they_should_be() {
        let plate = RoundedPlate::from(&Plate { size_mm: [10.0, 6.0], edge_radius_mm: 0.5 });
        let gap = |p| plate.distance(p).gap_mm;
        assert!((gap([1.0, 1.0, 3.0]) - 0.5).abs() < 1e-15);
        assert!((gap([6.0, 0.0, 0.0]) - 1.0).abs() < 1e-15);
        assert!((gap([4.5 + 3.0, 0.0, 2.0 + 4.0]) - 4.5).abs() < 1e-15);
        assert!((gap([4.5 + 2.0, 2.5 + 3.0, 2.0 + 6.0]) - 6.5).abs() < 1e-15);
        assert!((gap([0.0, 0.0, 2.0]) + 0.5).abs() < 1e-15);
    }
}
