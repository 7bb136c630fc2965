//! Strain below a pin on an elastic half-space.

use std::f64::consts::PI;

/// Rings of the quadrature over a contact, two to an interval, and sectors over half of it.
const RINGS: usize = 64;
const SECTORS: usize = 48;
/// Steps of the table over the distance from the axis.
const STEPS: usize = 160;

/// An elastic half-space, and how deep in it SED is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Young's modulus, Pa.
    pub youngs_modulus_pa: f64,
    /// Poisson's ratio.
    pub poissons_ratio: f64,
    /// Depth of the interface below the skin, mm.
    pub depth_mm: f64,
}

impl HalfSpace {
    /// That of the shipped model `half-space`: the dermis.
    pub const SHIPPED: Self = Self { youngs_modulus_pa: 80e3, poissons_ratio: 0.48, depth_mm: 0.2 };

    /// Stress rr, hoop, zz, rz at `r` from a point load, times `mm2` (Boussinesq; Johnson, Contact
    /// Mechanics, 1985, eq. 3.19). Tension is positive, z points into the tissue.
    fn point(&self, r_mm: f64) -> [f64; 4] {
        let (z, nu) = (self.depth_mm, self.poissons_ratio);
        let rho = r_mm.hypot(z);
        let lateral = (1.0 - 2.0 * nu) / (rho * (rho + z));
        let radial = lateral - 3.0 * r_mm * r_mm * z / rho.powi(5);
        let hoop = (1.0 - 2.0 * nu) * z / rho.powi(3) - lateral;
        let axial = -3.0 * z.powi(3) / rho.powi(5);
        let shear = -3.0 * z * z * r_mm / rho.powi(5);
        [radial, hoop, axial, shear].map(|stress| stress / (2.0 * PI))
    }

    /// Stress rr, hoop, zz, rz at `r` from the axis of a pin whose greatest pressure is 1.
    fn pin(&self, reach_mm: f64, r_mm: f64) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for ring in 0..RINGS {
            // With d = R sin t the root of the pressure is smooth: p d dd = R^2 cos^2 t sin t dt.
            // Gauss' two points of each interval: the kernel is as narrow as it is deep.
            let offset =
                if ring % 2 == 0 { -(1.0_f64 / 3.0).sqrt() } else { (1.0_f64 / 3.0).sqrt() };
            let t = ((ring / 2 * 2) as f64 + 1.0 + offset) * 0.5 * PI / RINGS as f64;
            let d_mm = reach_mm * t.sin();
            let ring_mm2 = reach_mm * reach_mm * t.cos().powi(2) * t.sin() * PI * PI / RINGS as f64;
            let load = ring_mm2 / SECTORS as f64;
            for sector in 0..SECTORS {
                let angle = (sector as f64 + 0.5) * PI / SECTORS as f64;
                let [x, y] = [r_mm - d_mm * angle.cos(), -d_mm * angle.sin()];
                let off_mm = x.hypot(y).max(1e-9);
                let [c, s] = [x / off_mm, y / off_mm];
                let [radial, hoop, axial, shear] = self.point(off_mm);
                sum[0] += load * (radial * c * c + hoop * s * s);
                sum[1] += load * (radial * s * s + hoop * c * c);
                sum[2] += load * axial;
                sum[3] += load * shear * c;
            }
        }
        sum
    }

    /// The strain below pins of one reach, up to `end_mm` from their axis.
    pub(crate) fn profile(&self, reach_mm: f64, end_mm: f64) -> Profile {
        let step_mm = end_mm / STEPS as f64;
        let rows = (0..=STEPS).map(|i| self.pin(reach_mm, i as f64 * step_mm)).collect();
        let shear_pa = self.youngs_modulus_pa / (2.0 * (1.0 + self.poissons_ratio));
        let bulk_pa = self.youngs_modulus_pa / (3.0 * (1.0 - 2.0 * self.poissons_ratio));
        Profile { rows, step_mm, deviator: (4.0 * shear_pa).sqrt(), volume: (2.0 * bulk_pa).sqrt() }
    }
}

/// Stress below a pin against the distance from its axis.
#[derive(Debug)]
pub(crate) struct Profile {
    rows: Vec<[f64; 4]>,
    step_mm: f64,
    deviator: f64,
    volume: f64,
}

impl Profile {
    /// Six numbers whose squares sum to SED, sqrt(J/m3) a Pa of drive, at `r` from the axis towards
    /// the unit vector (c, s); none beyond the table.
    pub(crate) fn strain(&self, r_mm: f64, [c, s]: [f64; 2]) -> Option<[f32; 6]> {
        let place = r_mm / self.step_mm;
        let row = place as usize;
        let (near, far) = (self.rows.get(row)?, self.rows.get(row + 1)?);
        let part = place - row as f64;
        let [rr, hoop, zz, rz] = [0, 1, 2, 3].map(|k| near[k] + part * (far[k] - near[k]));
        let xx = rr * c * c + hoop * s * s;
        let yy = rr * s * s + hoop * c * c;
        let sqrt = f64::sqrt;
        let six = [
            (xx - yy) / (sqrt(2.0) * self.deviator),
            (xx + yy - 2.0 * zz) / (sqrt(6.0) * self.deviator),
            (xx + yy + zz) / (3.0 * self.volume),
            (rr - hoop) * c * s * sqrt(2.0) / self.deviator,
            rz * c * sqrt(2.0) / self.deviator,
            rz * s * sqrt(2.0) / self.deviator,
        ];
        Some(six.map(|value| value as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stress_on_the_axis_is_hertz() {
        // Johnson, Contact Mechanics, 1985, eq. 3.45.
        let space = HalfSpace::SHIPPED;
        for reach_mm in [0.3, 1.0, 2.0] {
            let z = space.depth_mm / reach_mm;
            let axial = -1.0 / (1.0 + z * z);
            let radial = -(1.0 + space.poissons_ratio) * (1.0 - z * (1.0 / z).atan()) - 0.5 * axial;
            let found = space.pin(reach_mm, 0.0);
            for (found, due) in found.iter().zip([radial, radial, axial, 0.0]) {
                assert!((found - due).abs() < 5e-3, "{found} for {due}, reach {reach_mm}");
            }
        }
    }

    #[test]
    fn far_away_a_pin_is_a_point_load() {
        let (space, reach_mm) = (HalfSpace::SHIPPED, 0.5);
        let force = 2.0 / 3.0 * PI * reach_mm * reach_mm;
        let [pin, point] = [space.pin(reach_mm, 20.0), space.point(20.0)];
        assert!((pin[0] / (force * point[0]) - 1.0).abs() < 1e-2, "{pin:?} {point:?}");
    }

    #[test]
    fn strain_squares_to_the_energy_of_hookes_law_whatever_the_direction() {
        let space = HalfSpace::SHIPPED;
        let [rr, tt, zz, rz] = space.pin(1.0, 0.5);
        let nu = space.poissons_ratio;
        let twice = rr * rr + tt * tt + zz * zz - 2.0 * nu * (rr * tt + tt * zz + zz * rr)
            + 2.0 * (1.0 + nu) * rz * rz;
        let due = twice / (2.0 * space.youngs_modulus_pa);
        let profile = space.profile(1.0, 4.0);
        for angle in [0.0_f64, 0.7, 2.0, 4.0] {
            let six = profile.strain(0.5, [angle.cos(), angle.sin()]).unwrap();
            let sed: f64 = six.iter().map(|s| f64::from(*s).powi(2)).sum();
            assert!((sed / due - 1.0).abs() < 1e-5, "{sed} for {due}");
        }
        assert!(profile.strain(4.1, [1.0, 0.0]).is_none());
    }
}
