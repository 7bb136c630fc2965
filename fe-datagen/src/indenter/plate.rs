//! Rectangular plate with rounded edges.

use super::{Distance, SignedDistance};

/// A box with edges and corners rounded, centred at the origin; the face that
/// presses is `z = +half_mm[2]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundedPlate {
    /// Half lengths along x, y, z, mm.
    pub half_mm: [f64; 3],
    /// Radius of the edges, mm; below every half length.
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
}
