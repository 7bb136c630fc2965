//! Indenter `wedge`: a blunt edge along y, and its signed distance.

use super::revolved::Flat;
use super::rules::{BadValue, length, require, rounding};
use super::{Distance, SignedDistance};
use serde::{Deserialize, Serialize};

/// A wedge along y, its tip at `z = 0`, its body below; symmetric about x = 0.
///
/// The default is the wedge of Chen, Shuai & Zhu, 0.05 mm wide at the tip,
/// 1.0 mm at the base and 2.0 mm high. Its widths are those of the sharp
/// section. All edges are rounded by `tip_radius_mm`, which leaves the height as
/// it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Wedge {
    /// Width at the tip, mm.
    pub tip_width_mm: f64,
    /// Width at the base, mm.
    pub base_width_mm: f64,
    /// Height, mm.
    pub height_mm: f64,
    /// Radius of the edges, mm.
    pub tip_radius_mm: f64,
    /// Length along y, mm.
    pub length_mm: f64,
}

impl Default for Wedge {
    fn default() -> Self {
        Self {
            tip_width_mm: 0.05,
            base_width_mm: 1.0,
            height_mm: 2.0,
            tip_radius_mm: 0.02,
            length_mm: 30.0,
        }
    }
}

/// The section, moved inward by the radius of the edges: half of a trapezoid
/// with its corners at `a` (tip) and `b` (base), x >= 0.
struct Inner {
    a: [f64; 2],
    b: [f64; 2],
    /// Unit normal of the flank.
    flank: [f64; 2],
}

impl Wedge {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        length("tip_width_mm", self.tip_width_mm)?;
        length("base_width_mm", self.base_width_mm)?;
        length("height_mm", self.height_mm)?;
        length("length_mm", self.length_mm)?;
        require(
            self.base_width_mm >= self.tip_width_mm,
            "base_width_mm",
            &self.base_width_mm,
            "has to be at least the width of the tip",
        )?;
        let [nx, nz] = self.inner().flank;
        // Beyond this radius the two roundings of the tip would cut its height.
        let tip = 0.5 * self.tip_width_mm * nx / (1.0 - nz);
        rounding(
            "tip_radius_mm",
            self.tip_radius_mm,
            tip.min(0.5 * self.height_mm).min(0.5 * self.length_mm),
            "has to be positive and fit into the tip, half the height and half the length",
        )
    }

    fn inner(&self) -> Inner {
        let r = self.tip_radius_mm;
        let tip = 0.5 * self.tip_width_mm;
        let run = 0.5 * (self.base_width_mm - self.tip_width_mm);
        let side = run.hypot(self.height_mm);
        let flank = [self.height_mm / side, run / side];
        // On the flank moved inward: n . (p - (tip, 0)) = -r.
        let at = |z: f64| [tip - (r + flank[1] * z) / flank[0], z];
        Inner { a: at(-r), b: at(r - self.height_mm), flank }
    }
}

impl Inner {
    /// Signed distance in the section's plane, `x >= 0`.
    fn distance(&self, [x, z]: [f64; 2]) -> Flat {
        let Self { a, b, flank: [nx, nz] } = *self;
        let (up, down) = (z - a[1], b[1] - z);
        let out = nx * (x - a[0]) + nz * up;
        let along = nz * (x - a[0]) - nx * up;
        let length = nz * (b[0] - a[0]) - nx * (b[1] - a[1]);
        let flat = |gap_mm, normal| Flat { gap_mm, normal, curvature_per_mm: 0.0 };
        if up <= 0.0 && down <= 0.0 && out <= 0.0 {
            return if up >= out && up >= down {
                flat(up, [0.0, 1.0])
            } else if out >= down {
                flat(out, [nx, nz])
            } else {
                flat(down, [0.0, -1.0])
            };
        }
        if up > 0.0 && x <= a[0] {
            return flat(up, [0.0, 1.0]);
        }
        if down > 0.0 && x <= b[0] {
            return flat(down, [0.0, -1.0]);
        }
        let corner = if along <= 0.0 {
            a
        } else if along >= length {
            b
        } else {
            return flat(out, [nx, nz]);
        };
        let (dx, dz) = (x - corner[0], z - corner[1]);
        let far = dx.hypot(dz);
        Flat { gap_mm: far, normal: [dx / far, dz / far], curvature_per_mm: 1.0 / far }
    }
}

impl SignedDistance for Wedge {
    /// Deeper inside than half the width the nearest surface is a flank, which
    /// pushes sideways.
    fn distance(&self, p: [f64; 3]) -> Distance {
        let r = self.tip_radius_mm;
        let side = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
        let flat = self.inner().distance([p[0].abs(), p[2]]);
        let (d, [nx, nz], bend) = (flat.gap_mm, flat.normal, flat.curvature_per_mm);
        let section = [side(p[0]) * nx, 0.0, nz];
        let tangent = [-nz, 0.0, side(p[0]) * nx];
        let q = p[1].abs() - (0.5 * self.length_mm - r);
        let end = [0.0, side(p[1]), 0.0];
        if d > 0.0 && q > 0.0 {
            let length = d.hypot(q);
            let normal: [f64; 3] = std::array::from_fn(|i| (d * section[i] + q * end[i]) / length);
            let hessian = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let dyads = section[i] * section[j] + end[i] * end[j] - normal[i] * normal[j]
                        + d * bend * tangent[i] * tangent[j];
                    dyads / length
                })
            });
            return Distance { gap_mm: length - r, normal, hessian };
        }
        if q > d {
            return Distance { gap_mm: q - r, normal: end, hessian: [[0.0; 3]; 3] };
        }
        let hessian = tangent.map(|s| tangent.map(|t| bend * s * t));
        Distance { gap_mm: d - r, normal: section, hessian }
    }

    fn cost(&self) -> f64 {
        2.0
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        let r = self.tip_radius_mm;
        let Inner { a, b, flank: [nx, nz] } = self.inner();
        each(self.distance(p));
        let mut face = |normal: [f64; 3], gap_mm: f64| {
            each(Distance { gap_mm, normal, hessian: [[0.0; 3]; 3] });
        };
        face([0.0, 0.0, 1.0], p[2] - a[1] - r);
        face([0.0, 0.0, -1.0], b[1] - p[2] - r);
        for sign in [-1.0, 1.0] {
            face([sign * nx, 0.0, nz], nx * (sign * p[0] - a[0]) + nz * (p[2] - a[1]) - r);
            face([0.0, sign, 0.0], sign * p[1] - 0.5 * self.length_mm);
        }
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        let r = self.tip_radius_mm;
        let Inner { a, b, .. } = self.inner();
        let corner = |c: [f64; 2]| direction[0].abs() * c[0] + direction[2] * c[1];
        corner(a).max(corner(b)) + direction[1].abs() * (0.5 * self.length_mm - r) + r
    }

    fn narrowest_mm(&self) -> f64 {
        self.tip_width_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Placement;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        wedge: Wedge::default() => Exactness::Exact, detail_mm 0.02, mirrors [0, 1]
    }
    // Wider than high, and short: every other branch of the section.
    distance_tests! {
        ramp: Wedge {
            tip_width_mm: 4.0, base_width_mm: 20.0, height_mm: 2.0, tip_radius_mm: 0.5, length_mm: 6.0,
        } => Exactness::Exact, detail_mm 0.5, mirrors [0, 1]
    }

    #[test]
    fn the_section_is_that_of_the_paper() {
        let wedge = Wedge::default();
        let gap = |x: f64, z: f64| wedge.distance([x, 0.0, z]).gap_mm;
        // Flat tip, then the flanks on the lines through (0.025, 0) and (0.5, -2).
        assert!((gap(0.0, 0.3) - 0.3).abs() < 1e-15);
        for z in [-0.3, -1.0, -1.9] {
            let x = 0.025 + 0.475 * -z / 2.0;
            assert!(gap(x, z).abs() < 1e-15, "{x} {z}");
            assert!(gap(x + 1e-3, z) > 0.0 && gap(x - 1e-3, z) < 0.0);
        }
        assert!((gap(0.0, -2.5) - 0.5).abs() < 1e-15);
        // The rounded corner lies inside the sharp one.
        assert!(gap(0.025, 0.0) > 0.0);
    }

    #[test]
    fn turned_into_a_section_it_stays_in_the_plane() {
        // Local z presses along the body's y, local y is along its z.
        let r = [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        let placement = Placement { rotation: r, origin_mm: [0.1, -6.5, 0.0] };
        let wedge = Wedge::default();
        for p in [[0.1, -6.4, 0.0], [0.14, -6.48, 0.0], [0.4, -7.0, 0.0], [-0.3, -8.6, 0.0]] {
            let d = placement.distance(&wedge, p);
            assert!(d.normal[2] == 0.0);
            assert!((0..3).all(|i| d.hessian[i][2] == 0.0 && d.hessian[2][i] == 0.0));
        }
        assert!((placement.distance(&wedge, [0.1, -6.4, 0.0]).gap_mm - 0.1).abs() < 1e-12);
    }
}
