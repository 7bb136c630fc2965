//! Input statistics: what tells a map that no indentation makes, though every pressure in it is an
//! ordinary one.
//!
//! A network answers a checkerboard as readily as a contact, and its answer means nothing. Four
//! numbers tell such maps from contacts: skin under an indenter shares its load smoothly among
//! neighbours, no indentation carries much more than the hardest one a model has seen, what is
//! pressed hard is pressed by something wide, whose map is smooth, and no indentation presses on the
//! whole finger at once.

use serde::{Deserialize, Serialize};

use crate::{MAP_SIDE_PX, map::LANES};

/// Room above the greatest of the training, as a factor: quantisation and another raster of the
/// same contact move both numbers by less.
pub const TRAINED_HEADROOM: f32 = 1.05;

/// The same for the product: shapes that a model has not seen come to 1.3 times the greatest, the
/// least of the odd maps of the tests to 4.
pub const ROUGH_LOAD_HEADROOM: f32 = 2.0;

/// The same for the area: the hardest press of the widest plate comes to the greatest, random blocks
/// over the whole finger to 3.5 times as much.
pub const AREA_HEADROOM: f32 = 1.5;

/// Statistics of a pressure map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputStatistics {
    /// Squared steps between neighbours (in rows and in columns) over four times the squared
    /// pressures: 0 is flat, 1 a checkerboard of single pixels.
    pub roughness: f32,
    /// Sum of the pressures, MPa px: near the force, in another unit.
    pub load_mpa_px: f32,
    /// Their product, MPa px. Cards from before it was noted bound it not.
    #[serde(default = "unbounded")]
    pub rough_load_mpa_px: f32,
    /// Square of the sum of the pressures over the sum of their squares, px: the area that is pressed,
    /// exactly so where all of it is pressed alike. Cards from before it was noted bound it not.
    #[serde(default = "unbounded")]
    pub area_px: f32,
}

fn unbounded() -> f32 {
    f32::MAX
}

impl InputStatistics {
    /// The statistics of a map (224 x 224, finite, not negative, Pa). Pressures whose squares an f32
    /// cannot hold are as none.
    #[must_use]
    pub fn of(map_pa: &[f32]) -> Self {
        // Lanes of f32 along a row, f64 over the rows: in vectors, and exact enough for 1e-4.
        let (mut steps, mut squares, mut sum) = (0.0_f64, 0.0_f64, 0.0_f64);
        let rows = map_pa.as_chunks::<MAP_SIDE_PX>().0;
        for (y, row) in rows.iter().enumerate() {
            let below = rows.get(y + 1).unwrap_or(row);
            // The last pixel has no neighbour to its right: it is its own.
            let mut right = *row;
            right.copy_within(1.., 0);
            right[MAP_SIDE_PX - 1] = row[MAP_SIDE_PX - 1];
            let mut lanes = [[0.0_f32; LANES]; 3];
            let [row, below, right] = [row, below, &right].map(|row| row.as_chunks::<LANES>().0);
            for ((p, below), right) in row.iter().zip(below).zip(right) {
                for i in 0..LANES {
                    let (down, across) = (below[i] - p[i], right[i] - p[i]);
                    lanes[0][i] += down * down + across * across;
                    lanes[1][i] += p[i] * p[i];
                    lanes[2][i] += p[i];
                }
            }
            let [a, b, c] = lanes.map(|lanes| f64::from(lanes.iter().sum::<f32>()));
            (steps, squares, sum) = (steps + a, squares + b, sum + c);
        }
        let roughness = if squares > 0.0 { steps / (4.0 * squares) } else { 0.0 };
        let load_mpa_px = 1e-6 * sum;
        Self {
            roughness: roughness as f32,
            load_mpa_px: load_mpa_px as f32,
            rough_load_mpa_px: (roughness * load_mpa_px) as f32,
            area_px: if squares > 0.0 { (sum * sum / squares) as f32 } else { 0.0 },
        }
    }

    /// The greater of each.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self {
            roughness: self.roughness.max(other.roughness),
            load_mpa_px: self.load_mpa_px.max(other.load_mpa_px),
            rough_load_mpa_px: self.rough_load_mpa_px.max(other.rough_load_mpa_px),
            area_px: self.area_px.max(other.area_px),
        }
    }

    /// Whether a map with these statistics is rougher, heavier, rougher for its load, or wider than
    /// all whose greatest are `trained`.
    #[must_use]
    pub fn is_out_of_distribution(self, trained: Self) -> bool {
        self.roughness > TRAINED_HEADROOM * trained.roughness
            || self.load_mpa_px > TRAINED_HEADROOM * trained.load_mpa_px
            || self.rough_load_mpa_px > ROUGH_LOAD_HEADROOM * trained.rough_load_mpa_px
            || self.area_px > AREA_HEADROOM * trained.area_px
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::MAP_LEN;

    fn drawn(at: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        (0..MAP_LEN).map(|i| at(i / MAP_SIDE_PX, i % MAP_SIDE_PX)).collect()
    }

    /// As the formulas say, in f64, one pixel after another.
    fn by_the_formula(map_pa: &[f32]) -> (f64, f64) {
        let at = |y: usize, x: usize| f64::from(map_pa[y * MAP_SIDE_PX + x]);
        let (mut steps, mut squares, mut sum) = (0.0, 0.0, 0.0);
        for y in 0..MAP_SIDE_PX {
            for x in 0..MAP_SIDE_PX {
                let next =
                    |y: usize, x: usize| (y < MAP_SIDE_PX && x < MAP_SIDE_PX).then(|| at(y, x));
                for neighbour in [next(y + 1, x), next(y, x + 1)].into_iter().flatten() {
                    steps += (neighbour - at(y, x)).powi(2);
                }
                (squares, sum) = (squares + at(y, x).powi(2), sum + at(y, x));
            }
        }
        (steps / (4.0 * squares), 1e-6 * sum)
    }

    #[test]
    fn a_flat_map_is_smooth_and_a_checkerboard_is_as_rough_as_can_be() {
        let flat = InputStatistics::of(&drawn(|_, _| 2e4));
        assert_eq!(flat.roughness.to_bits(), 0.0_f32.to_bits());
        assert!((flat.load_mpa_px / (2e-2 * MAP_LEN as f32) - 1.0).abs() < 1e-5, "{flat:?}");
        let board = InputStatistics::of(&drawn(|y, x| if (x + y) % 2 == 0 { 1e4 } else { 0.0 }));
        // 1, less the steps that the rim does not have.
        let due = (2.0 * 224.0 * 223.0) / (4.0 * 0.5 * 224.0 * 224.0);
        assert!((board.roughness - due).abs() < 1e-5, "{board:?}");
    }

    #[test]
    fn nothing_and_next_to_nothing_have_no_pattern() {
        for pressure_pa in [0.0, -0.0, 1e-40] {
            let found =
                InputStatistics::of(&drawn(
                    |y, x| if (x + y) % 2 == 0 { pressure_pa } else { 0.0 },
                ));
            assert!(!found.is_out_of_distribution(statistics([1e-3; 4])));
        }
    }

    fn statistics(numbers: [f32; 4]) -> InputStatistics {
        let [roughness, load_mpa_px, rough_load_mpa_px, area_px] = numbers;
        InputStatistics { roughness, load_mpa_px, rough_load_mpa_px, area_px }
    }

    #[test]
    fn each_number_tells() {
        let trained = statistics([0.1, 50.0, 0.5, 1000.0]);
        for (numbers, is_out_of_distribution) in [
            ([0.1, 50.0, 0.5, 1000.0], false),
            ([0.104, 52.0, 0.9, 1400.0], false),
            ([0.106, 1.0, 0.1, 10.0], true),
            ([0.01, 53.0, 0.5, 10.0], true),
            ([0.05, 30.0, 1.1, 10.0], true),
            ([0.05, 30.0, 0.5, 1600.0], true),
        ] {
            let found = statistics(numbers).is_out_of_distribution(trained);
            assert_eq!(found, is_out_of_distribution, "{numbers:?}");
        }
        let both = statistics([0.2, 1.0, 0.2, 2000.0]).max(trained);
        assert_eq!(both, statistics([0.2, 50.0, 0.5, 2000.0]));
    }

    /// Blocks of 4 mm (29 px), each of some pressure up to 15 kPa, on as many pixels as show skin: the
    /// limits are those of the shipped cards, and the three older ones pass the lighter of them.
    #[test]
    fn random_blocks_over_the_whole_finger_are_no_contact() {
        let trained = statistics([0.339_482_9, 251.855_94, 2.713_591_3, 7_016.265]);
        for (seed, most_pa) in [(1, 5e3), (2, 10e3), (3, 15e3), (4, 1e3)] {
            let mut random = fastrand::Rng::with_seed(seed);
            let blocks: Vec<f32> = (0..64).map(|_| most_pa * random.f32()).collect();
            let is_skin = |y: usize, x: usize| (y as f32 - 112.0).hypot(x as f32 - 112.0) < 109.0;
            let map = drawn(|y, x| if is_skin(y, x) { blocks[y / 29 * 8 + x / 29] } else { 0.0 });
            let found = InputStatistics::of(&map);
            assert!(found.is_out_of_distribution(trained), "{found:?} up to {most_pa} Pa");
            let older = InputStatistics { area_px: 0.0, ..found };
            assert!(most_pa > 12e3 || !older.is_out_of_distribution(trained), "{found:?}");
        }
    }

    #[test]
    fn a_card_without_product_and_area_bounds_neither() {
        let trained: InputStatistics =
            serde_json::from_str(r#"{"roughness": 0.5, "load_mpa_px": 50.0}"#).unwrap();
        assert!(!statistics([0.5, 50.0, 25.0, 5e4]).is_out_of_distribution(trained));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn lanes_do_what_the_formulas_say(seed: u64, peak_pa in 1e-3f32..1e6) {
            let mut random = fastrand::Rng::with_seed(seed);
            let map: Vec<f32> = (0..MAP_LEN).map(|_| peak_pa * random.f32().powi(3)).collect();
            let (roughness, load) = by_the_formula(&map);
            let found = InputStatistics::of(&map);
            prop_assert!((f64::from(found.roughness) / roughness - 1.0).abs() < 1e-4);
            prop_assert!((f64::from(found.load_mpa_px) / load - 1.0).abs() < 1e-4);
            let product = f64::from(found.rough_load_mpa_px);
            prop_assert!((product / (roughness * load) - 1.0).abs() < 2e-4);
        }
    }
}
