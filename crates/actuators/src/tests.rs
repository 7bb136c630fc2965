//! Arrays on a plane finger: what made a map is found again, and what cannot be is refused.

use papilla_atlas::{Atlas, MAP_LEN, Patch, PatchVertices, Raster};
use proptest::prelude::*;

use super::*;

/// 18 mm either way, 0.1 mm a pixel.
fn array(pins: &[Pin]) -> Result<Array, ArrayError> {
    let uv_px = vec![[20.0, 20.0], [200.0, 20.0], [200.0, 200.0], [20.0, 200.0]];
    let positions_mm = uv_px.iter().map(|[u, v]| [0.1 * v, -0.1 * u, 0.0]).collect();
    let patch = PatchVertices { positions_mm, uv_px };
    let atlas = Atlas::new(0.1, vec![[0, 2, 1], [0, 3, 2]], patch.clone(), patch).unwrap();
    let [skin, interface] = [Patch::Skin, Patch::Interface].map(|of| Raster::new(&atlas, of));
    Array::new(&atlas, [&skin, &interface], pins, HalfSpace::SHIPPED)
}

fn pin(row: usize, column: usize) -> Pin {
    Pin { pixel: (224 * row + column) as u32, reach_mm: 0.8, max_pa: 1e9 }
}

/// `side` by `side` pins, 1.6 mm apart: they touch.
fn square(side: usize) -> Array {
    let at = |i: usize| pin(80 + 16 * (i / side), 80 + 16 * (i % side));
    array(&(0..side * side).map(at).collect::<Vec<_>>()).unwrap()
}

fn map_of(array: &Array, drive_pa: &[f32]) -> Vec<f32> {
    let mut map = vec![0.0; MAP_LEN];
    array.sed(drive_pa, &mut map);
    map
}

/// What the fit makes least, `sum_x (SED(x) - wanted(x))^2`.
fn cost(array: &Array, drive_pa: &[f32], wanted: &[f32]) -> f64 {
    let map = map_of(array, drive_pa);
    map.iter().zip(wanted).map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

#[test]
fn pressure_is_that_of_a_smooth_round_contact() {
    let array = array(&[pin(100, 100), Pin { reach_mm: 2.0, ..pin(160, 100) }]).unwrap();
    let mut pressure_pa = vec![1.0; MAP_LEN];
    array.pressure(&[3e3, 5e3], &mut pressure_pa);
    assert!((pressure_pa[100 * 224 + 100] - 3e3).abs() < 1e-2);
    assert!(pressure_pa[20 * 224 + 20].abs() < 1e-9, "what was there is gone");
    // 2/3 pi R^2 a each; pixels at the rim leave some percent.
    let due_n = 2.0 / 3.0 * std::f32::consts::PI * (0.64 * 3e3 + 4.0 * 5e3) * 1e-6;
    let found_n: f32 = pressure_pa.iter().sum::<f32>() * 0.01 * 1e-6;
    assert!((found_n / due_n - 1.0).abs() < 0.01, "{found_n} for {due_n}");
}

#[test]
fn the_drive_that_made_a_map_is_found_again() {
    // Gauss-Newton converges where the residual vanishes, down to what the least squares leave:
    // they stop where a sweep moves no drive by more than 1e-5 of the greatest, and a sweep of
    // touching pins takes away some percent of what is left, so 1e-3 of the greatest remain.
    let array = square(5);
    let mut random = fastrand::Rng::with_seed(7);
    for _ in 0..8 {
        let drive_pa: Vec<f32> =
            (0..25).map(|_| if random.bool() { 2e4 * random.f32() + 1e3 } else { 0.0 }).collect();
        let wanted = map_of(&array, &drive_pa);
        let mut inverse = Inverse::new(square(5));
        let found_pa = inverse.fit(&wanted, 40);
        for (found, due) in found_pa.iter().zip(&drive_pa) {
            assert!((found - due).abs() < 20.0, "{found} for {due} Pa: 1e-3 of the greatest");
        }
    }
}

#[test]
fn a_zero_map_takes_no_drive_and_every_step_makes_the_fit_better() {
    let mut inverse = Inverse::new(square(4));
    assert!(inverse.fit(&vec![0.0; MAP_LEN], Inverse::STEPS).iter().all(|a| a.to_bits() == 0));
    // A map that no drive gives.
    let wanted: Vec<f32> = (0..MAP_LEN).map(|i| (i % 224) as f32).collect();
    let mut last = f64::INFINITY;
    for steps in 0..6 {
        let drive_pa = inverse.fit(&wanted, steps).to_vec();
        assert!(drive_pa.iter().all(|a| *a >= 0.0));
        let found = cost(inverse.array(), &drive_pa, &wanted);
        assert!(found <= last * (1.0 + 1e-4), "{found} after {last}, {steps} steps");
        last = found;
    }
}

#[test]
fn a_network_that_is_a_half_space_of_another_stiffness_is_met_by_one_correction() {
    let drive_pa = [5e3, 0.0, 9e3, 2e3, 7e3, 1e3, 0.0, 0.0, 4e3];
    let softer = |map: Vec<f32>| -> Vec<f32> { map.iter().map(|sed| 3.0 * sed).collect() };
    let mut inverse = Inverse::new(square(3));
    let wanted = softer(map_of(inverse.array(), &drive_pa));
    let first = inverse.fit(&wanted, 20).to_vec();
    assert!((first[2] / 9e3 - 3.0_f32.sqrt()).abs() < 1e-2, "{first:?}");
    let answered = softer(map_of(inverse.array(), &first));
    for (found, due) in inverse.correct(&wanted, &answered, 20).iter().zip(drive_pa) {
        assert!((found - due).abs() < 0.02 * 9e3, "{found} for {due}");
    }
}

#[test]
fn no_drive_is_above_the_greatest() {
    let strong = array(&[Pin { max_pa: 2e3, ..pin(100, 100) }, pin(100, 130)]).unwrap();
    let wanted = map_of(&strong, &[5e3, 5e3]);
    let mut inverse = Inverse::new(strong);
    let found = inverse.fit(&wanted, 20);
    assert!((found[0] - 2e3).abs() < 1e-2 && found[1] > 4e3, "{found:?}");
}

#[test]
fn what_cannot_be_is_refused() {
    let refused = |pins: &[Pin]| array(pins).unwrap_err();
    assert_eq!(refused(&[]), ArrayError::Count { found: 0 });
    assert_eq!(refused(&[pin(100, 100); 257]), ArrayError::Count { found: 257 });
    let off = refused(&[pin(100, 100), pin(1, 1)]);
    assert_eq!(off, ArrayError::Pixel { pin: 1, pixel: 225 });
    for pixel in [50_176, u32::MAX] {
        let off = refused(&[Pin { pixel, ..pin(0, 0) }]);
        assert_eq!(off, ArrayError::Pixel { pin: 0, pixel });
    }
    for reach_mm in [0.0, 0.24, 2.6, f32::NAN, f32::INFINITY] {
        let reach = refused(&[Pin { reach_mm, ..pin(100, 100) }]);
        assert!(reach.to_string().contains("'radius_mm' of pin 0"), "{reach}");
    }
    let many: Vec<Pin> =
        (0..9).map(|i| Pin { reach_mm: 0.5 + 0.1 * i as f32, ..pin(100, 100) }).collect();
    assert_eq!(refused(&many), ArrayError::Reaches { found: 9 });
    for max_pa in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let max = refused(&[Pin { max_pa, ..pin(100, 100) }]);
        assert!(matches!(max, ArrayError::Max { pin: 0, .. }), "{max}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Four times the SED takes twice the drive, to the bit: all tolerances are relative.
    #[test]
    fn scale_does_not_matter(power in -6..7_i32, values in prop::collection::vec(0.0_f32..4e3, 9)) {
        let array = square(3);
        let wanted: Vec<f32> = (0..MAP_LEN).map(|i| values[i % 9]).collect();
        let more: Vec<f32> = wanted.iter().map(|w| w * 4.0_f32.powi(power)).collect();
        let mut inverse = Inverse::new(array);
        let one = inverse.fit(&wanted, Inverse::STEPS).to_vec();
        let other = inverse.fit(&more, Inverse::STEPS);
        for (one, other) in one.iter().zip(other) {
            prop_assert_eq!((one * 2.0_f32.powi(power)).to_bits(), other.to_bits());
        }
    }

    /// Of two pins, no drive of a grid is closer to any map by more than what the grid cannot tell.
    #[test]
    fn no_drive_of_a_grid_is_closer(near in 0.0_f32..8e3, far in 0.0_f32..8e3, apart in 8..30_usize,
        bend in 0.0_f32..2.0) {
        let array = array(&[pin(100, 90), pin(100, 90 + apart)]).unwrap();
        let mut wanted = map_of(&array, &[near, far]);
        wanted.iter_mut().enumerate().for_each(|(i, w)| *w *= 1.0 + bend * (i % 3) as f32);
        let mut inverse = Inverse::new(array);
        let found = inverse.fit(&wanted, 20).to_vec();
        let least = cost(inverse.array(), &found, &wanted);
        let none = wanted.iter().map(|w| f64::from(*w).powi(2)).sum::<f64>();
        for at in 0..441 {
            let grid = [at % 21, at / 21].map(|k| 800.0 * k as f32);
            let other = cost(inverse.array(), &grid, &wanted);
            prop_assert!(least <= other + 1e-6 * none, "{found:?} {least}; {grid:?} {other}");
        }
    }
}
