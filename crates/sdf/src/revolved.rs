//! Solids of revolution: distance in a meridian plane, turned about an axis.

use super::Distance;
use std::f64::consts::FRAC_1_SQRT_2;

/// Distance in a plane with its derivatives. Its Hessian is the curvature times
/// the dyad of the unit tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Flat {
    /// Signed distance, mm.
    pub(super) gap_mm: f64,
    /// Outward unit normal.
    pub(super) normal: [f64; 2],
    /// Curvature of the level curve, 1/mm.
    pub(super) curvature_per_mm: f64,
}

/// A rectangle with rounded corners, centred at the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    /// Half lengths, mm.
    pub(super) half_mm: [f64; 2],
    /// Radius of the corners, mm; at most every half length.
    pub(super) radius_mm: f64,
}

impl Rectangle {
    pub(super) fn distance(&self, p: [f64; 2]) -> Flat {
        let q: [f64; 2] = std::array::from_fn(|i| p[i].abs() - (self.half_mm[i] - self.radius_mm));
        let sign = p.map(|v| if v < 0.0 { -1.0 } else { 1.0 });
        if q[0] > 0.0 && q[1] > 0.0 {
            let length = q[0].hypot(q[1]);
            return Flat {
                gap_mm: length - self.radius_mm,
                normal: [sign[0] * q[0] / length, sign[1] * q[1] / length],
                curvature_per_mm: 1.0 / length,
            };
        }
        let (normal, far) =
            if q[1] >= q[0] { ([0.0, sign[1]], q[1]) } else { ([sign[0], 0.0], q[0]) };
        Flat { gap_mm: far - self.radius_mm, normal, curvature_per_mm: 0.0 }
    }
}

impl Rectangle {
    /// The sides through which a place leaves it: the outer one, both ends, the middles of the
    /// rounded corners between these, and the same two corners and the side on the inner side.
    pub(super) fn sides(&self, p: [f64; 2]) -> [Flat; 8] {
        let side = |normal: [f64; 2]| {
            let inner: f64 =
                (0..2).map(|i| normal[i].abs() * (self.half_mm[i] - self.radius_mm)).sum();
            let along = normal[0] * p[0] + normal[1] * p[1];
            Flat { gap_mm: along - inner - self.radius_mm, normal, curvature_per_mm: 0.0 }
        };
        let k = FRAC_1_SQRT_2;
        [[1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [k, k], [k, -k], [-k, k], [-k, -k], [-1.0, 0.0]]
            .map(side)
    }
}

/// Distance of `p` from what `meridian` (a function of radius and height)
/// describes, turned about local axis `axis`.
///
/// On the axis itself the hoop curvature is the limit for a surface that is
/// smooth there; where the normal is not along the axis there, it takes one of
/// the radial directions that are all as good.
pub(super) fn revolve(
    p: [f64; 3],
    axis: usize,
    meridian: impl FnOnce([f64; 2]) -> Flat,
) -> Distance {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let r = p[i].hypot(p[j]);
    let flat = meridian([r, p[axis]]);
    let (mut radial, mut hoop) = ([0.0; 3], [0.0; 3]);
    let (c, s) = if r > 0.0 { (p[i] / r, p[j] / r) } else { (1.0, 0.0) };
    (radial[i], radial[j]) = (c, s);
    (hoop[i], hoop[j]) = (-s, c);
    let [nr, na] = flat.normal;
    let in_plane = |along_r: f64, along_axis: f64| {
        let mut v = radial.map(|c| along_r * c);
        v[axis] = along_axis;
        v
    };
    let (normal, tangent) = (in_plane(nr, na), in_plane(-na, nr));
    let bend = flat.curvature_per_mm;
    let bend_hoop = if r > 0.0 { nr / r } else { bend * na * na };
    Distance {
        gap_mm: flat.gap_mm,
        normal,
        hessian: std::array::from_fn(|a| {
            std::array::from_fn(|b| bend * tangent[a] * tangent[b] + bend_hoop * hoop[a] * hoop[b])
        }),
    }
}

/// How far a disc with rounded rim goes along `direction`: the disc of outer
/// `radius_mm` about `axis` from height `heights_mm[0]` to `[1]`.
pub(super) fn disc_reach_mm(
    direction: [f64; 3],
    axis: usize,
    radius_mm: f64,
    heights_mm: [f64; 2],
    rim_radius_mm: f64,
) -> f64 {
    let across = direction[(axis + 1) % 3].hypot(direction[(axis + 2) % 3]);
    let along = direction[axis];
    let end =
        if along > 0.0 { heights_mm[1] - rim_radius_mm } else { heights_mm[0] + rim_radius_mm };
    across * (radius_mm - rim_radius_mm) + along * end + rim_radius_mm
}
