//! Rigid sphere.

use super::{Distance, SignedDistance};

/// A sphere centred at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Radius, mm.
    pub radius_mm: f64,
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Normal and Hessian are derivatives of the distance, inside and out.
        #[test]
        fn derivatives_match_differences(
            x in -9.0f64..9.0, y in -9.0f64..9.0, z in 0.5f64..9.0,
        ) {
            let sphere = Sphere { radius_mm: 4.0 };
            let p = [x, y, z];
            let d = sphere.distance(p);
            let h = 1e-5;
            let at = |i: usize, s: f64| {
                let mut q = p;
                q[i] += s * h;
                sphere.distance(q)
            };
            for i in 0..3 {
                let (a, b) = (at(i, 1.0), at(i, -1.0));
                prop_assert!(((a.gap_mm - b.gap_mm) / (2.0 * h) - d.normal[i]).abs() < 1e-8);
                for j in 0..3 {
                    let difference = (a.normal[j] - b.normal[j]) / (2.0 * h);
                    prop_assert!((difference - d.hessian[i][j]).abs() < 1e-7, "{i}{j}");
                }
            }
        }
    }

    #[test]
    fn the_centre_is_a_radius_deep_and_finite() {
        let d = Sphere { radius_mm: 2.5 }.distance([0.0; 3]);
        assert!((d.gap_mm + 2.5).abs() < 1e-15 && d.normal.iter().all(|v| v.is_finite()));
    }
}
