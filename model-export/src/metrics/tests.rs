use super::{Ground, NAIL_BASE_MM, SampleMetrics, quantile, ssim, summarise};
use papilla_proto::{MAP_LEN, MAP_SIDE_PX};

fn full() -> Vec<bool> {
    vec![true; MAP_LEN]
}

/// A flat finger: 0.1 mm a pixel, row 0 at the tip, all of it inside `mask`.
fn ground(mask: Vec<bool>) -> Ground {
    let position_mm: Vec<[f32; 3]> = (0..MAP_LEN)
        .map(|i| [0.1 * (i / MAP_SIDE_PX) as f32, 0.1 * (i % MAP_SIDE_PX) as f32, 0.0])
        .collect();
    let nail_base =
        (0..MAP_LEN).map(|i| mask[i] && NAIL_BASE_MM.contains(&position_mm[i][0])).collect();
    Ground { mask, nail_base, position_mm }
}

/// A disc of radius 40 px that is high, on a plain of 5 % of it.
fn truth() -> Vec<f32> {
    (0..MAP_LEN)
        .map(|i| {
            let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
            let r2 = (row - 112.0).powi(2) + (column - 112.0).powi(2);
            if r2 < 1600.0 { 2_000.0 } else { 100.0 }
        })
        .collect()
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{a}, not {b}");
}

#[test]
fn equal_maps_have_no_error() {
    let m = SampleMetrics::measure(&truth(), &truth(), &ground(full())).unwrap();
    close(m.relative_l2, 0.0);
    close(m.far_field_relative_l2.unwrap(), 0.0);
    close(m.peak_error, 0.0);
    close(m.total_energy_error, 0.0);
    close(m.ssim, 1.0);
}

#[test]
fn a_map_of_zero_is_wrong_by_all_of_it() {
    let m = SampleMetrics::measure(&vec![0.0; MAP_LEN], &truth(), &ground(full())).unwrap();
    close(m.relative_l2, 1.0);
    close(m.far_field_relative_l2.unwrap(), 1.0);
    close(m.peak_error, 1.0);
    close(m.total_energy_error, 1.0);
    assert!(m.ssim < 0.9, "{}", m.ssim);
}

#[test]
fn a_scaled_map_is_wrong_by_the_scale() {
    for scale in [0.75f32, 1.5] {
        let p: Vec<f32> = truth().iter().map(|t| scale * t).collect();
        let m = SampleMetrics::measure(&p, &truth(), &ground(full())).unwrap();
        let error = f64::from((scale - 1.0).abs());
        close(m.relative_l2, error);
        close(m.far_field_relative_l2.unwrap(), error);
        close(m.peak_error, error);
        close(m.total_energy_error, error);
    }
}

#[test]
fn the_far_field_is_seen_apart_from_the_peak() {
    // Twice the truth on the plain, exact on the disc.
    let p: Vec<f32> = truth().iter().map(|&t| if t < 200.0 { 2.0 * t } else { t }).collect();
    let m = SampleMetrics::measure(&p, &truth(), &ground(full())).unwrap();
    close(m.far_field_relative_l2.unwrap(), 1.0);
    close(m.peak_error, 0.0);
    let disc = truth().iter().filter(|&&t| t > 200.0).count() as f64;
    let plain = MAP_LEN as f64 - disc;
    let norm2 = disc * 2_000f64.powi(2) + plain * 100f64.powi(2);
    close(m.relative_l2, (plain * 100f64.powi(2) / norm2).sqrt());
    close(m.total_energy_error, plain * 100.0 / (disc * 2_000.0 + plain * 100.0));
}

#[test]
fn what_lies_outside_the_mask_does_not_count() {
    let mask: Vec<bool> = (0..MAP_LEN).map(|i| i % MAP_SIDE_PX < 112).collect();
    let mut p = truth();
    for i in (0..MAP_LEN).filter(|&i| !mask[i]) {
        p[i] = 1e6;
    }
    let m = SampleMetrics::measure(&p, &truth(), &ground(mask)).unwrap();
    close(m.relative_l2, 0.0);
    close(m.peak_error, 0.0);
    close(m.total_energy_error, 0.0);
}

#[test]
fn the_distance_of_the_peaks_is_taken_on_the_finger() {
    // One pixel each: 30 rows and 40 columns apart are 3 and 4 mm, so 5 mm.
    let spike = |row: usize, column: usize| {
        let mut map = vec![0.0; MAP_LEN];
        map[row * MAP_SIDE_PX + column] = 7.0;
        map
    };
    let ground = ground(full());
    let m = SampleMetrics::measure(&spike(70, 90), &spike(40, 50), &ground).unwrap();
    assert!((m.peak_distance_mm - 5.0).abs() < 1e-5, "{}", m.peak_distance_mm);
    close(m.relative_l2, 2f64.sqrt());
    close(m.peak_error, 0.0);
    let same = SampleMetrics::measure(&spike(40, 50), &spike(40, 50), &ground).unwrap();
    close(same.peak_distance_mm, 0.0);
    assert_eq!(same.nail_base_error, None, "no energy there");
}

#[test]
fn the_nail_base_is_seen_apart() {
    // Rows 120 to 159 are the zone: there 3 is due and 4 is answered, so 1/3 is wrong.
    let zone = |i: &usize| (120..160).contains(&(i / MAP_SIDE_PX));
    let map = |in_zone: f32| -> Vec<f32> {
        (0..MAP_LEN).map(|i| if zone(&i) { in_zone } else { 50.0 }).collect()
    };
    let ground = ground(full());
    assert_eq!(ground.nail_base.iter().filter(|z| **z).count(), 40 * MAP_SIDE_PX);
    let m = SampleMetrics::measure(&map(4.0), &map(3.0), &ground).unwrap();
    close(m.nail_base_error.unwrap(), 1.0 / 3.0);
    // 40 rows of 224 are off by 1: sqrt(40 / (40 x 9 + 184 x 2500)).
    close(m.relative_l2, (40.0f64 / (40.0 * 9.0 + 184.0 * 2_500.0)).sqrt());
}

#[test]
fn no_energy_no_figures_and_no_far_field_no_figure() {
    assert!(SampleMetrics::measure(&truth(), &vec![0.0; MAP_LEN], &ground(full())).is_none());
    assert!(SampleMetrics::measure(&truth(), &truth(), &ground(vec![false; MAP_LEN])).is_none());
    let disc_only: Vec<f32> = truth().iter().map(|&t| if t < 200.0 { 0.0 } else { t }).collect();
    let m = SampleMetrics::measure(&truth(), &disc_only, &ground(full())).unwrap();
    assert!(m.far_field_relative_l2.is_none());
}

#[test]
fn ssim_of_constants_is_the_luminance_term() {
    // Without structure SSIM is (2ab + C1) / (a^2 + b^2 + C1), away from the border.
    let mask: Vec<bool> = (0..MAP_LEN)
        .map(|i| [i / MAP_SIDE_PX, i % MAP_SIDE_PX].iter().all(|x| (6..218).contains(x)))
        .collect();
    let (a, b, c1) = (0.8, 0.5, 1e-4);
    let found = ssim(&vec![400.0; MAP_LEN], &vec![250.0; MAP_LEN], &mask, 500.0);
    close(found, (2.0 * a * b + c1) / (a * a + b * b + c1));
}

#[test]
fn ssim_of_stripes_and_their_opposite_is_negative() {
    let stripes = |phase: usize| -> Vec<f32> {
        (0..MAP_LEN).map(|i| if (i / 2 + phase).is_multiple_of(2) { 1.0 } else { 0.0 }).collect()
    };
    let opposite = ssim(&stripes(0), &stripes(1), &full(), 1.0);
    assert!(opposite < -0.5, "{opposite}");
    close(ssim(&stripes(0), &stripes(0), &full(), 1.0), 1.0);
}

#[test]
fn quantiles_are_numpys() {
    // numpy.quantile([4, 1, 3, 2], [0, .25, .5, .95, 1]) = [1, 1.75, 2.5, 3.85, 4]
    let values = [4.0, 1.0, 3.0, 2.0];
    for (q, expected) in [(0.0, 1.0), (0.25, 1.75), (0.5, 2.5), (0.95, 3.85), (1.0, 4.0)] {
        close(quantile(&values, q).unwrap(), expected);
    }
    assert_eq!(quantile(&[], 0.5), None);
    close(quantile(&[7.0], 0.95).unwrap(), 7.0);
}

#[test]
fn summaries_take_the_bad_end_of_each_figure() {
    let samples: Vec<SampleMetrics> = (0..=100)
        .map(|i| {
            let x = f64::from(i) / 100.0;
            SampleMetrics {
                relative_l2: x,
                far_field_relative_l2: (i < 50).then_some(x),
                peak_error: 2.0 * x,
                peak_distance_mm: 4.0 * x,
                nail_base_error: (i >= 50).then_some(x),
                total_energy_error: 3.0 * x,
                ssim: 1.0 - x,
                closest_factor: Some(1.0),
            }
        })
        .collect();
    let metrics = summarise("test", &samples).unwrap();
    assert_eq!((metrics.split.as_str(), metrics.samples), ("test", 101));
    close(metrics.relative_l2.median, 0.5);
    close(metrics.relative_l2.p95, 0.95);
    close(metrics.far_field_relative_l2.unwrap().median, 0.245);
    close(metrics.peak_error.p95, 1.9);
    close(metrics.peak_distance_mm.unwrap().p95, 3.8);
    close(metrics.nail_base_error.unwrap().median, 0.75);
    close(metrics.total_energy_error.p95, 2.85);
    close(metrics.ssim.p5, 0.05);
    assert!(summarise("test", &[]).is_none());
}
