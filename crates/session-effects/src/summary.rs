//! `summary`: a map in sixteen numbers. Their formulas: `papilla_proto::summary`.

use papilla_proto::{MAP_SIDE_PX, Summary};

use super::Geometry;

/// SA1 units per mm2 of fingertip: 70 per cm2.
const SA1_PER_MM2: f64 = 0.7;

/// Columns summed side by side; [`MAP_SIDE_PX`] is a multiple.
const LANES: usize = 16;

/// Where the finger is touched.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact<'a> {
    /// Pressure as it was sent, Pa.
    pub(super) pressure_pa: &'a [f32],
    /// Pressure above which a pixel is in contact, Pa.
    pub(super) above_pa: f32,
}

impl Contact<'_> {
    /// Area of what is touched, mm2.
    fn area_mm2(self, skin_mm2: &[f32]) -> f64 {
        let rows =
            self.pressure_pa.chunks_exact(MAP_SIDE_PX).zip(skin_mm2.chunks_exact(MAP_SIDE_PX));
        let row = |(pressures, areas): (&[f32], &[f32])| {
            let mut lanes = [0.0_f32; LANES];
            let chunks = pressures.as_chunks::<LANES>().0.iter().zip(areas.as_chunks::<LANES>().0);
            for (pressures, areas) in chunks {
                for ((lane, &pressure_pa), &area_mm2) in lanes.iter_mut().zip(pressures).zip(areas)
                {
                    *lane += if pressure_pa > self.above_pa { area_mm2 } else { 0.0 };
                }
            }
            lanes.iter().map(|&lane| f64::from(lane)).sum::<f64>()
        };
        rows.map(row).sum()
    }
}

/// Summary of one map.
pub(super) fn of(
    geometry: &Geometry,
    contact: Contact<'_>,
    sed_j_per_m3: &[f32],
    rate_hz: Option<&[f32]>,
) -> Summary {
    let pressure = Moments::of(contact.pressure_pa, &geometry.skin_mm2);
    let sed = Moments::of(sed_j_per_m3, &geometry.interface_mm2);
    let pressure_max_pa = peak(contact.pressure_pa);
    let (sed_max_j_per_m3, place) = greatest(sed_j_per_m3);
    let [pressure_u_px, pressure_v_px] = pressure.centroid_px();
    let [sed_u_px, sed_v_px] = sed.centroid_px();
    let [sed_uu_px2, sed_uv_px2, sed_vv_px2] = sed.central_px2();
    let [sed_max_u_px, sed_max_v_px] = place.map_or([0.0; 2], |index| {
        [(index % MAP_SIDE_PX) as f32 + 0.5, (index / MAP_SIDE_PX) as f32 + 0.5]
    });
    let contact_area_mm2 = contact.area_mm2(&geometry.skin_mm2) as f32;
    let rates = rate_hz.map(|rate_hz| Moments::of(rate_hz, &geometry.interface_mm2).sum);
    Summary {
        force_n: (1e-6 * pressure.sum) as f32,
        contact_area_mm2,
        pressure_max_pa,
        pressure_u_px,
        pressure_v_px,
        sed_max_j_per_m3,
        sed_max_u_px,
        sed_max_v_px,
        // J/m3 x mm2 = 1e-6 J/m.
        sed_integral_uj_per_m: sed.sum as f32,
        sed_u_px,
        sed_v_px,
        sed_uu_px2,
        sed_uv_px2,
        sed_vv_px2,
        sed_mean_j_per_m3: (sed.sum / geometry.interface_sum_mm2.max(f64::MIN_POSITIVE)) as f32,
        sa1_rate_hz: (SA1_PER_MM2 * rates.unwrap_or(0.0)) as f32,
    }
}

/// The greatest value, and its flat index; none if nothing is above zero.
fn greatest(map: &[f32]) -> (f32, Option<usize>) {
    let top = peak(map);
    let place = (top > 0.0).then(|| map.iter().position(|&value| value >= top)).flatten();
    (top, place)
}

/// The greatest value, 0 at least.
pub(super) fn peak(map: &[f32]) -> f32 {
    let mut lanes = [0.0_f32; LANES];
    for values in map.as_chunks::<LANES>().0 {
        for (top, &value) in lanes.iter_mut().zip(values) {
            *top = if value > *top { value } else { *top };
        }
    }
    lanes.iter().fold(0.0_f32, |top, &lane| top.max(lane))
}

/// Moments of a map about its middle, where centres lie at whole and a half pixels: that keeps
/// the digits that the central moments need.
#[derive(Debug, Default)]
struct Moments {
    sum: f64,
    u: f64,
    v: f64,
    uu: f64,
    uv: f64,
    vv: f64,
}

const MIDDLE_PX: f64 = MAP_SIDE_PX as f64 / 2.0;

impl Moments {
    fn of(map: &[f32], area_mm2: &[f32]) -> Self {
        let mut moments = Self::default();
        let rows = map.chunks_exact(MAP_SIDE_PX).zip(area_mm2.chunks_exact(MAP_SIDE_PX));
        for (row, (values, areas)) in rows.enumerate() {
            // Most rows of a pressure are empty.
            if values.iter().all(|&value| value <= 0.0) {
                continue;
            }
            let [sum, u, uu] = row_moments(values, areas);
            let v = row as f64 + 0.5 - MIDDLE_PX;
            moments.sum += sum;
            moments.u += u;
            moments.uu += uu;
            moments.v += v * sum;
            moments.uv += v * u;
            moments.vv += v * v * sum;
        }
        moments
    }

    fn centroid_px(&self) -> [f32; 2] {
        if self.sum > 0.0 {
            [self.u, self.v].map(|moment| (moment / self.sum + MIDDLE_PX) as f32)
        } else {
            [0.0; 2]
        }
    }

    fn central_px2(&self) -> [f32; 3] {
        if self.sum > 0.0 {
            let [u, v] = [self.u / self.sum, self.v / self.sum];
            [self.uu / self.sum - u * u, self.uv / self.sum - u * v, self.vv / self.sum - v * v]
                .map(|moment| moment as f32)
        } else {
            [0.0; 3]
        }
    }
}

/// Sum, first and second moment of a row about its middle. Sixteen columns side by side in f32,
/// fourteen additions each; all that follows is f64.
fn row_moments(values: &[f32], areas_mm2: &[f32]) -> [f64; 3] {
    let mut lanes = [[0.0_f32; LANES]; 3];
    let chunks = values.as_chunks::<LANES>().0.iter().zip(areas_mm2.as_chunks::<LANES>().0);
    for (chunk, (values, areas)) in chunks.enumerate() {
        let first = (chunk * LANES) as f32 + 0.5 - MIDDLE_PX as f32;
        for lane in 0..LANES {
            let u = first + lane as f32;
            let weight = values[lane] * areas[lane];
            lanes[0][lane] += weight;
            lanes[1][lane] += u * weight;
            lanes[2][lane] += u * u * weight;
        }
    }
    lanes.map(|lanes| lanes.iter().map(|&lane| f64::from(lane)).sum())
}

#[cfg(test)]
mod tests {
    use papilla_proto::MAP_LEN;

    use super::{super::tests::plane, *};

    fn summary(map: &[f32], above_pa: f32) -> Summary {
        let contact = Contact { pressure_pa: map, above_pa };
        of(&plane(), contact, map, None)
    }

    #[track_caller]
    fn near(found: f32, due: f64, tolerance: f64) {
        let error = (f64::from(found) - due).abs();
        assert!(error <= tolerance * due.abs().max(1.0), "{found}, not {due}");
    }

    #[test]
    fn a_rectangle_has_the_moments_of_the_books() {
        // Columns 40..=79, rows 100..=119, 3000 on 0.01 mm2 each.
        let mut map = vec![0.0; MAP_LEN];
        for i in 0..MAP_LEN {
            let (row, column) = (i / MAP_SIDE_PX, i % MAP_SIDE_PX);
            if (40..80).contains(&column) && (100..120).contains(&row) {
                map[i] = 3000.0;
            }
        }
        map[105 * MAP_SIDE_PX + 60] = 3001.0;
        let s = summary(&map, 2999.0);
        near(s.force_n, 1e-6 * 3000.0 * 800.0 * 0.01, 1e-5);
        near(s.contact_area_mm2, 8.0, 1e-4);
        near(s.sed_integral_uj_per_m, 24_000.0, 1e-5);
        near(s.sed_mean_j_per_m3, 3000.0 * 800.0 / (180.0 * 180.0), 1e-4);
        near(s.sed_u_px, 60.0, 1e-4);
        near(s.sed_v_px, 110.0, 1e-4);
        near(s.pressure_u_px, 60.0, 1e-4);
        // n pixels side by side: (n^2 - 1) / 12.
        near(s.sed_uu_px2, (1600.0 - 1.0) / 12.0, 1e-4);
        near(s.sed_vv_px2, (400.0 - 1.0) / 12.0, 1e-4);
        near(s.sed_uv_px2, 0.0, 1e-2);
        near(s.sed_max_j_per_m3, 3001.0, 0.0);
        assert_eq!((s.sed_max_u_px.to_bits(), s.sed_max_v_px), (60.5_f32.to_bits(), 105.5));
        near(summary(&map, 3000.0).contact_area_mm2, 0.01, 1e-4);
    }

    #[test]
    fn a_tilted_pair_of_spots_has_a_mixed_moment() {
        let mut map = vec![0.0; MAP_LEN];
        map[90 * MAP_SIDE_PX + 80] = 1.0;
        map[110 * MAP_SIDE_PX + 110] = 3.0;
        let s = summary(&map, 0.0);
        // Weights 1/4 and 3/4, 30 columns and 20 rows apart.
        near(s.sed_u_px, 103.0, 1e-5);
        near(s.sed_v_px, 105.5, 1e-5);
        near(s.sed_uu_px2, 3.0 / 16.0 * 900.0, 1e-4);
        near(s.sed_uv_px2, 3.0 / 16.0 * 600.0, 1e-4);
        near(s.sed_vv_px2, 3.0 / 16.0 * 400.0, 1e-4);
    }

    #[test]
    fn nothing_sums_up_to_nothing() {
        assert_eq!(summary(&vec![0.0; MAP_LEN], 0.0), Summary::default());
    }

    #[test]
    fn a_rate_everywhere_is_every_units() {
        let map = vec![0.0; MAP_LEN];
        let contact = Contact { pressure_pa: &map, above_pa: 0.0 };
        let s = of(&plane(), contact, &map, Some(&vec![10.0; MAP_LEN]));
        // 18 mm x 18 mm of patch, 0.7 units per mm2, 10 Hz each.
        near(s.sa1_rate_hz, 324.0 * 0.7 * 10.0, 1e-3);
    }
}
