//! A map in sixteen numbers: what a summary of an answer holds, with formulas and units.
//!
//! Sums run over the pixels `i` of a patch. `A_i` is the area of the undeformed finger that pixel
//! `i` shows (mm2): the unwrapping keeps angles, not areas, so every pixel has its own.
//! `p_i` is the pressure the client sent (Pa), `w_i` the SED (J/m3), `(u, v)_i` the pixel's
//! centre, `(column + 0.5, row + 0.5)`.
//!
//! | at | member | unit | formula |
//! |---|---|---|---|
//! | 0 | `force_n` | N | `1e-6 sum p_i A_i` over the skin |
//! | 4 | `contact_area_mm2` | mm2 | `sum A_i` where `p_i` is above `contact_pa` |
//! | 8 | `pressure_max_pa` | Pa | `max p_i` |
//! | 12 | `pressure_u_px` | px | `sum u_i p_i A_i / sum p_i A_i`: centre of pressure |
//! | 16 | `pressure_v_px` | px | likewise |
//! | 20 | `sed_max_j_per_m3` | J/m3 | `max w_i` |
//! | 24 | `sed_max_u_px` | px | place of that maximum (the first in row-major order) |
//! | 28 | `sed_max_v_px` | px | likewise |
//! | 32 | `sed_integral_uj_per_m` | uJ/m | `sum w_i A_i` over the interface: energy per metre of depth |
//! | 36 | `sed_u_px` | px | `sum u_i w_i A_i / sum w_i A_i`: centroid |
//! | 40 | `sed_v_px` | px | likewise |
//! | 44 | `sed_uu_px2` | px2 | `sum (u_i - sed_u)^2 w_i A_i / sum w_i A_i`: second central moment |
//! | 48 | `sed_uv_px2` | px2 | the same of `(u_i - sed_u) (v_i - sed_v)` |
//! | 52 | `sed_vv_px2` | px2 | the same of `(v_i - sed_v)^2` |
//! | 56 | `sed_mean_j_per_m3` | J/m3 | `sum w_i A_i / sum A_i` over the interface |
//! | 60 | `sa1_rate_hz` | Hz | `0.7 sum r_i A_i`: all SA1 units of the patch at 70 per cm2; 0 without `afferents` |
//!
//! `force_n` is a sum of magnitudes over undeformed area; pressure is per deformed area and skin
//! is curved, so it is not the indenter's reaction but near it. Without contact everything is 0.

/// Bytes of a summary on the wire: sixteen little-endian f32.
pub const SUMMARY_LEN: usize = 64;

/// The sixteen numbers; see the [module](self) for their formulas.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[allow(missing_docs)] // The module's table says it once.
pub struct Summary {
    pub force_n: f32,
    pub contact_area_mm2: f32,
    pub pressure_max_pa: f32,
    pub pressure_u_px: f32,
    pub pressure_v_px: f32,
    pub sed_max_j_per_m3: f32,
    pub sed_max_u_px: f32,
    pub sed_max_v_px: f32,
    pub sed_integral_uj_per_m: f32,
    pub sed_u_px: f32,
    pub sed_v_px: f32,
    pub sed_uu_px2: f32,
    pub sed_uv_px2: f32,
    pub sed_vv_px2: f32,
    pub sed_mean_j_per_m3: f32,
    pub sa1_rate_hz: f32,
}

impl Summary {
    /// The bytes on the wire.
    #[must_use]
    pub fn encode(&self) -> [u8; SUMMARY_LEN] {
        let members = [
            self.force_n,
            self.contact_area_mm2,
            self.pressure_max_pa,
            self.pressure_u_px,
            self.pressure_v_px,
            self.sed_max_j_per_m3,
            self.sed_max_u_px,
            self.sed_max_v_px,
            self.sed_integral_uj_per_m,
            self.sed_u_px,
            self.sed_v_px,
            self.sed_uu_px2,
            self.sed_uv_px2,
            self.sed_vv_px2,
            self.sed_mean_j_per_m3,
            self.sa1_rate_hz,
        ];
        let mut bytes = [0; SUMMARY_LEN];
        for (room, member) in bytes.chunks_exact_mut(4).zip(members) {
            room.copy_from_slice(&member.to_le_bytes());
        }
        bytes
    }

    /// Reads the first [`SUMMARY_LEN`] bytes; none if there are fewer.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.first_chunk::<SUMMARY_LEN>()?;
        let at = |i: usize| {
            f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
        };
        Some(Self {
            force_n: at(0),
            contact_area_mm2: at(1),
            pressure_max_pa: at(2),
            pressure_u_px: at(3),
            pressure_v_px: at(4),
            sed_max_j_per_m3: at(5),
            sed_max_u_px: at(6),
            sed_max_v_px: at(7),
            sed_integral_uj_per_m: at(8),
            sed_u_px: at(9),
            sed_v_px: at(10),
            sed_uu_px2: at(11),
            sed_uv_px2: at(12),
            sed_vv_px2: at(13),
            sed_mean_j_per_m3: at(14),
            sa1_rate_hz: at(15),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_lie_where_the_table_says() {
        let bytes: Vec<u8> = (1..=16u8).flat_map(|i| f32::from(i).to_le_bytes()).collect();
        let summary = Summary::decode(&bytes).unwrap();
        assert_eq!(summary.encode().to_vec(), bytes);
        let at = [
            (summary.force_n, 0),
            (summary.pressure_v_px, 16),
            (summary.sed_max_j_per_m3, 20),
            (summary.sed_integral_uj_per_m, 32),
            (summary.sed_uu_px2, 44),
            (summary.sa1_rate_hz, 60),
        ];
        for (member, at) in at {
            assert!((member - (at / 4 + 1) as f32).abs() < 1e-6, "at {at}");
        }
        assert_eq!(Summary::decode(&bytes[..63]), None);
    }
}
