//! Rigid indenters as signed distance functions.
//!
//! Distance is positive outside the indenter; its gradient is the outward unit
//! normal, which is the direction in which the indenter pushes the skin.

mod plate;
mod spec;
mod sphere;

pub use plate::RoundedPlate;
pub use spec::{IndenterError, IndenterSpec, first_touch_travel};
pub use sphere::Sphere;

/// Signed distance with its first two derivatives at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Gap, mm; negative inside.
    pub gap_mm: f64,
    /// Outward unit normal.
    pub normal: [f64; 3],
    /// Second derivative of the gap, 1/mm (the curvature of the level set).
    pub hessian: [[f64; 3]; 3],
}

/// A rigid body with a signed distance function, in its own frame.
pub trait SignedDistance: Send + Sync {
    /// Distance from `p` (mm).
    fn distance(&self, p: [f64; 3]) -> Distance;
}

/// A rotation and a translation: `world = rotation * local + origin`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Columns are the local axes in the world, `rotation[world][local]`.
    pub rotation: [[f64; 3]; 3],
    /// Local origin in the world, mm.
    pub origin_mm: [f64; 3],
}

impl Placement {
    /// Distance of a world point from a placed indenter, in world coordinates.
    #[must_use]
    pub fn distance(&self, indenter: &dyn SignedDistance, p: [f64; 3]) -> Distance {
        let r = &self.rotation;
        let d: [f64; 3] = std::array::from_fn(|i| p[i] - self.origin_mm[i]);
        let local = std::array::from_fn(|i| (0..3).map(|k| r[k][i] * d[k]).sum());
        let found = indenter.distance(local);
        let to_world = |v: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| (0..3).map(|k| r[i][k] * v[k]).sum())
        };
        // R H R^T, one side at a time.
        let half: [[f64; 3]; 3] = std::array::from_fn(|i| to_world(found.hessian[i]));
        let columns: [[f64; 3]; 3] =
            std::array::from_fn(|j| to_world([half[0][j], half[1][j], half[2][j]]));
        Distance {
            gap_mm: found.gap_mm,
            normal: to_world(found.normal),
            hessian: std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Normal and Hessian are derivatives of the distance, in any placement.
        #[test]
        fn derivatives_match_differences(
            x in -14.0f64..14.0, y in -14.0f64..14.0, z in -3.0f64..4.0, angle in 0.0f64..6.0,
        ) {
            let (s, c) = angle.sin_cos();
            let placement = Placement {
                rotation: [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
                origin_mm: [0.3, -0.2, 0.1],
            };
            let plate = RoundedPlate { half_mm: [10.0, 10.0, 2.0], edge_radius_mm: 1.0 };
            let p = [x, y, z];
            let d = placement.distance(&plate, p);
            let h = 1e-5;
            let at = |i: usize, s: f64| {
                let mut q = p;
                q[i] += s * h;
                placement.distance(&plate, q)
            };
            for i in 0..3 {
                let (a, b) = (at(i, 1.0), at(i, -1.0));
                // Skip the few samples that straddle a kink of the second derivative.
                let smooth = (0..3).all(|j| (0..3).all(|k| (a.hessian[j][k] - b.hessian[j][k]).abs() < 1e-2));
                prop_assume!(smooth);
                prop_assert!(((a.gap_mm - b.gap_mm) / (2.0 * h) - d.normal[i]).abs() < 1e-6);
                for j in 0..3 {
                    let difference = (a.normal[j] - b.normal[j]) / (2.0 * h);
                    prop_assert!((difference - d.hessian[i][j]).abs() < 1e-4, "{i}{j}");
                }
            }
        }
    }
}
