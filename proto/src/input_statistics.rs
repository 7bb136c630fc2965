//! Input statistics: what tells a map that no indentation makes, though every pressure in it is an
//! ordinary one.
//!
//! A network answers a checkerboard as readily as a contact, and its answer means nothing. These
//! numbers tell such maps from contacts: skin under an indenter shares its load smoothly among
//! neighbours, no indentation carries much more than the hardest one a model has seen, what is
//! pressed hard is pressed by something wide, whose map is smooth, no indentation presses on the
//! whole finger at once, and what was never pressed in the training is not known.

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

/// The same for the contrast: shapes that a model has not seen come to 1.13 times the greatest, random
/// blocks of 1 to 4 mm on 3000 px and more to 2 to 13 times.
pub const CONTRAST_HEADROOM: f32 = 1.5;

/// Share of the pressed cells that may lie where no indentation of the training pressed.
pub const STRANGE_CELLS_MAX: f32 = 0.25;

/// Side of a cell, px.
pub const CELL_PX: usize = 8;

/// Cells along a side of the map.
pub const CELLS: usize = MAP_SIDE_PX / CELL_PX;

/// Share of the load of the most loaded cell from which a cell counts as pressed.
const PRESSED_SHARE: f32 = 0.05;

/// Which cells of 8 x 8 pixels are pressed: those with at least 5 % of the load of the most loaded one.
///
/// A card has it as 28 rows of 28 characters, `#` for pressed, as the map lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<String>", into = "Vec<String>")]
pub struct PressedCells([u32; CELLS]);

impl Default for PressedCells {
    fn default() -> Self {
        Self([0; CELLS])
    }
}

impl PressedCells {
    /// Those of a finger that was pressed everywhere: nothing is strange to it.
    const EVERYWHERE: Self = Self([u32::MAX >> (32 - CELLS); CELLS]);

    fn of_loads(loads: &[[f32; CELLS]; CELLS]) -> Self {
        let most = loads.as_flattened().iter().fold(0.0_f32, |a, b| a.max(*b));
        if !(most > 0.0) {
            return Self::default();
        }
        let bits = |row: &[f32; CELLS]| {
            let is_pressed = |load: f32| u32::from(load >= PRESSED_SHARE * most);
            row.iter().enumerate().map(|(i, load)| is_pressed(*load) << i).sum()
        };
        Self(std::array::from_fn(|row| bits(&loads[row])))
    }

    /// Pressed in one or the other.
    fn or(self, other: Self) -> Self {
        Self(std::array::from_fn(|row| self.0[row] | other.0[row]))
    }

    /// Share of the pressed cells that are not pressed in `known`; 0 where nothing is pressed.
    #[must_use]
    pub fn share_beyond(self, known: Self) -> f32 {
        let strange = Self(std::array::from_fn(|row| self.0[row] & !known.0[row]));
        strange.count() as f32 / self.count().max(1) as f32
    }

    /// How deep inside `known` all pressed cells lie: so many cells, at least, are between them and
    /// the next cell that is not of `known`, sideways or along; 0 also where one is outside.
    #[must_use]
    pub fn depth_in(self, known: Self) -> u32 {
        let (mut inside, mut depth) = (known.inner(), 0);
        while self.count() > 0 && self.share_beyond(inside) <= 0.0 {
            (inside, depth) = (inside.inner(), depth + 1);
        }
        depth
    }

    /// Those whose four neighbours are pressed too; what lies off the map is not.
    fn inner(self) -> Self {
        let at = |row: Option<usize>| row.and_then(|row| self.0.get(row)).copied().unwrap_or(0);
        Self(std::array::from_fn(|row| {
            let along = at(row.checked_sub(1)) & at(row.checked_add(1));
            self.0[row] & (self.0[row] << 1) & (self.0[row] >> 1) & along
        }))
    }

    /// How many are pressed.
    #[must_use]
    pub fn count(self) -> u32 {
        self.0.iter().map(|row| row.count_ones()).sum()
    }
}

impl From<PressedCells> for Vec<String> {
    fn from(cells: PressedCells) -> Self {
        let sign = |row: u32, i: usize| if row >> i & 1 == 1 { '#' } else { '.' };
        cells.0.iter().map(|row| (0..CELLS).map(|i| sign(*row, i)).collect()).collect()
    }
}

impl TryFrom<Vec<String>> for PressedCells {
    type Error = String;

    fn try_from(rows: Vec<String>) -> Result<Self, String> {
        let is_row =
            |row: &String| row.len() == CELLS && row.bytes().all(|c| c == b'#' || c == b'.');
        if rows.len() != CELLS || !rows.iter().all(is_row) {
            return Err(format!("cells are {CELLS} rows of {CELLS} characters, '#' or '.'"));
        }
        let bits =
            |row: &String| row.bytes().enumerate().map(|(i, c)| u32::from(c == b'#') << i).sum();
        Ok(Self(std::array::from_fn(|row| bits(&rows[row]))))
    }
}

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
    /// Squared steps between neighbours that are both pressed, over four times the squared pressures,
    /// times the area, px: how much the pressure changes inside contact. Cards as above.
    #[serde(default = "unbounded")]
    pub contrast_px: f32,
    /// Where it presses. Cards from before it was noted know every place.
    #[serde(default = "everywhere")]
    pub cells: PressedCells,
}

fn everywhere() -> PressedCells {
    PressedCells::EVERYWHERE
}

fn unbounded() -> f32 {
    f32::MAX
}

impl InputStatistics {
    /// The statistics of a map (224 x 224, finite, not negative, Pa). Pressures whose squares an f32
    /// cannot hold are as none.
    #[must_use]
    pub fn of(map_pa: &[f32]) -> Self {
        Look::of(map_pa).statistics
    }

    /// The greater of each, and every cell that is pressed in one of them.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self {
            roughness: self.roughness.max(other.roughness),
            load_mpa_px: self.load_mpa_px.max(other.load_mpa_px),
            rough_load_mpa_px: self.rough_load_mpa_px.max(other.rough_load_mpa_px),
            area_px: self.area_px.max(other.area_px),
            contrast_px: self.contrast_px.max(other.contrast_px),
            cells: self.cells.or(other.cells),
        }
    }

    /// Whether a map with these statistics is rougher, heavier, rougher for its load, wider or richer
    /// in contrast than all whose greatest are `trained`, or presses where none of them did.
    #[must_use]
    pub fn is_out_of_distribution(self, trained: Self) -> bool {
        self.roughness > TRAINED_HEADROOM * trained.roughness
            || self.load_mpa_px > TRAINED_HEADROOM * trained.load_mpa_px
            || self.rough_load_mpa_px > ROUGH_LOAD_HEADROOM * trained.rough_load_mpa_px
            || self.area_px > AREA_HEADROOM * trained.area_px
            || self.contrast_px > CONTRAST_HEADROOM * trained.contrast_px
            || self.cells.share_beyond(trained.cells) > STRANGE_CELLS_MAX
    }
}

/// What one pass over a pressure map tells: its statistics, and where and how widely it presses.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Look {
    /// Statistics.
    pub statistics: InputStatistics,
    /// Column and row of the centre of pressure, px; the middle of a map without pressure.
    pub centre_px: [f32; 2],
    /// Standard deviations of the pressure's places along and across the longest way of the contact,
    /// px; 0 without pressure.
    pub spread_px: [f32; 2],
}

/// Sums of what lies along one side of the map, for its mean place and variance.
#[derive(Debug, Clone, Copy, Default)]
struct Along {
    sum: f64,
    first: f64,
    second: f64,
}

impl Along {
    fn add(&mut self, at: usize, load: f64) {
        let from_middle = at as f64 - MIDDLE_PX;
        self.sum += load;
        self.first += load * from_middle;
        self.second += load * from_middle * from_middle;
    }

    /// From the middle of the map, px; 0 without a load.
    fn mean(&self) -> f64 {
        if self.sum > 0.0 { self.first / self.sum } else { 0.0 }
    }

    fn variance(&self) -> f64 {
        let mean = self.mean();
        if self.sum > 0.0 { (self.second / self.sum - mean * mean).max(0.0) } else { 0.0 }
    }
}

/// Of the pixels' numbers.
const MIDDLE_PX: f64 = (MAP_SIDE_PX - 1) as f64 / 2.0;

impl Look {
    /// Looks at a map as [`InputStatistics::of`] does, in the same pass.
    #[must_use]
    pub fn of(map_pa: &[f32]) -> Self {
        // Lanes of f32 along a row, f64 over the rows: in vectors, and exact enough for 1e-4.
        let (mut steps, mut inner, mut squares, mut sum) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        let mut loads = [[0.0_f32; CELLS]; CELLS];
        let mut columns = [0.0_f32; MAP_SIDE_PX];
        let mut totals = [0.0_f32; MAP_SIDE_PX];
        let (mut along_rows, mut along_columns) = (Along::default(), Along::default());
        let rows = map_pa.as_chunks::<MAP_SIDE_PX>().0;
        for (y, row) in rows.iter().enumerate() {
            let below = rows.get(y + 1).unwrap_or(row);
            // The last pixel has no neighbour to its right: it is its own.
            let mut right = *row;
            right.copy_within(1.., 0);
            right[MAP_SIDE_PX - 1] = row[MAP_SIDE_PX - 1];
            columns.iter_mut().zip(row).for_each(|(sum, p)| *sum += p);
            if y % CELL_PX == CELL_PX - 1 {
                let row_of_cells = &mut loads[y / CELL_PX];
                for (load, columns) in row_of_cells.iter_mut().zip(columns.chunks(CELL_PX)) {
                    *load = columns.iter().sum();
                }
                totals.iter_mut().zip(&columns).for_each(|(total, sum)| *total += sum);
                columns.fill(0.0);
            }
            let mut lanes = [[0.0_f32; LANES]; 4];
            let [row, below, right] = [row, below, &right].map(|row| row.as_chunks::<LANES>().0);
            for ((p, below), right) in row.iter().zip(below).zip(right) {
                for i in 0..LANES {
                    let (down, across) = (below[i] - p[i], right[i] - p[i]);
                    let (down, across) = (down * down, across * across);
                    lanes[0][i] += down + across;
                    lanes[1][i] += p[i] * p[i];
                    lanes[2][i] += p[i];
                    let down = if below[i] > 0.0 { down } else { 0.0 };
                    let across = if right[i] > 0.0 { across } else { 0.0 };
                    lanes[3][i] += if p[i] > 0.0 { down + across } else { 0.0 };
                }
            }
            let [a, b, c, d] = lanes.map(|lanes| f64::from(lanes.iter().sum::<f32>()));
            along_rows.add(y, c);
            (steps, squares, sum, inner) = (steps + a, squares + b, sum + c, inner + d);
        }
        totals.iter().enumerate().for_each(|(x, total)| along_columns.add(x, f64::from(*total)));
        let over = |part: f64| if squares > 0.0 { part / squares } else { 0.0 };
        let (roughness, area_px) = (0.25 * over(steps), over(sum * sum));
        let load_mpa_px = 1e-6 * sum;
        let statistics = InputStatistics {
            roughness: roughness as f32,
            load_mpa_px: load_mpa_px as f32,
            rough_load_mpa_px: (roughness * load_mpa_px) as f32,
            area_px: area_px as f32,
            contrast_px: (0.25 * over(inner) * area_px) as f32,
            cells: PressedCells::of_loads(&loads),
        };
        Self { statistics, ..Self::placed(along_columns, along_rows, &loads) }
    }

    /// Centre and spread of what lies along the columns and the rows; how the two go together is
    /// told by the cells.
    fn placed(columns: Along, rows: Along, loads: &[[f32; CELLS]; CELLS]) -> Self {
        let [x, y] = [columns, rows].map(|along| along.mean());
        let mut together = 0.0;
        let place =
            |cell: usize| (CELL_PX * cell) as f64 + (CELL_PX as f64 - 1.0) / 2.0 - MIDDLE_PX;
        for (row, loads) in loads.iter().enumerate() {
            let along: f64 =
                loads.iter().enumerate().map(|(i, load)| f64::from(*load) * (place(i) - x)).sum();
            together += along * (place(row) - y);
        }
        let together = if rows.sum > 0.0 { together / rows.sum } else { 0.0 };
        let [xx, yy] = [columns, rows].map(|along| along.variance());
        let (mean, apart) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(together));
        Self {
            centre_px: [x + MIDDLE_PX, y + MIDDLE_PX].map(|at| at as f32),
            spread_px: [mean + apart, mean - apart].map(|of| of.max(0.0).sqrt() as f32),
            ..Self::default()
        }
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
        let (contrast_px, cells) = (unbounded(), everywhere());
        InputStatistics { roughness, load_mpa_px, rough_load_mpa_px, area_px, contrast_px, cells }
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
            let older = InputStatistics { area_px: 0.0, contrast_px: 0.0, ..found };
            assert!(most_pa > 12e3 || !older.is_out_of_distribution(trained), "{found:?}");
        }
    }

    /// What the shipped networks saw at most where contact is wide, and which cells.
    fn pad() -> InputStatistics {
        let cells = [PressedCells::default(), PressedCells::EVERYWHERE];
        let rows =
            (0..CELLS).map(|row| cells[usize::from((5..27).contains(&row))].0[row] & 0x1f_ff00);
        let mut known = PressedCells::default();
        known.0.iter_mut().zip(rows).for_each(|(to, from)| *to = from);
        InputStatistics {
            contrast_px: 54.0,
            cells: known,
            ..statistics([0.34, 252.0, 2.7, 7016.0])
        }
    }

    /// Blocks of 1 to 4 mm of some pressure each, on a part of the pad no wider than a hard contact.
    #[test]
    fn random_blocks_on_a_part_of_the_finger_are_no_contact() {
        for (seed, block_px, half_px) in [(1, 8, 45), (2, 8, 60), (3, 15, 45), (4, 15, 60)] {
            let mut random = fastrand::Rng::with_seed(seed);
            let blocks: Vec<f32> = (0..1024).map(|_| 15e3 * random.f32()).collect();
            let is_in = |y: usize, x: usize| y.abs_diff(112).max(x.abs_diff(120)) < half_px;
            let block = |y: usize, x: usize| blocks[y / block_px * 32 + x / block_px];
            let map = drawn(|y, x| if is_in(y, x) { block(y, x) } else { 0.0 });
            let found = InputStatistics::of(&map);
            assert!(found.is_out_of_distribution(pad()), "{found:?}");
            let older = InputStatistics { contrast_px: 0.0, ..found };
            assert!(half_px > 50 || !older.is_out_of_distribution(pad()), "{found:?}");
        }
    }

    /// A ball, as it is pressed on the pad and on the side of the finger, where no training pressed.
    #[test]
    fn what_presses_beside_the_training_is_told() {
        let ball = |middle: [f32; 2]| {
            let off = move |y: usize, x: usize| (y as f32 - middle[0]).hypot(x as f32 - middle[1]);
            InputStatistics::of(&drawn(|y, x| 2e4 * (1.0 - off(y, x) / 20.0).max(0.0).sqrt()))
        };
        assert!(!ball([112.0, 110.0]).is_out_of_distribution(pad()));
        for side in [[112.0, 40.0], [112.0, 196.0], [20.0, 112.0]] {
            assert!(ball(side).is_out_of_distribution(pad()), "{side:?}");
        }
    }

    #[test]
    fn cells_are_a_picture_in_the_card() {
        let found = InputStatistics::of(&drawn(|y, x| if y < 8 && x >= 216 { 1.0 } else { 0.0 }));
        let rows: Vec<String> = found.cells.into();
        assert_eq!((rows.len(), rows[0].find('#'), rows[1].find('#')), (CELLS, Some(27), None));
        let text = serde_json::to_string(&found).unwrap();
        assert_eq!(serde_json::from_str::<InputStatistics>(&text).unwrap(), found);
        let short = text.replacen("\"....", "\"...", 1);
        let error = serde_json::from_str::<InputStatistics>(&short).unwrap_err().to_string();
        assert!(error.contains("28 rows of 28"), "{error}");
    }

    #[test]
    fn a_card_without_product_and_area_bounds_neither() {
        let trained: InputStatistics =
            serde_json::from_str(r#"{"roughness": 0.5, "load_mpa_px": 50.0}"#).unwrap();
        assert!(!statistics([0.5, 50.0, 25.0, 5e4]).is_out_of_distribution(trained));
    }

    /// A bar of 60 x 12 px, turned by a third of a right angle: evenly spread, a side has a standard
    /// deviation of its length over the root of 12.
    #[test]
    fn a_look_finds_the_centre_and_the_sides_of_a_bar() {
        let bar = |degrees: f32, [x0, y0]: [f32; 2]| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            drawn(move |y, x| {
                let (x, y) = (x as f32 - x0, y as f32 - y0);
                let (along, across) = (x * cos + y * sin, y * cos - x * sin);
                if along.abs() < 30.0 && across.abs() < 6.0 { 2e4 } else { 0.0 }
            })
        };
        for (degrees, centre) in
            [(0.0, [110.0, 120.0]), (30.0, [110.3, 120.2]), (90.0, [60.0, 80.0])]
        {
            let look = Look::of(&bar(degrees, centre));
            for (found, due) in look.centre_px.into_iter().zip(centre) {
                assert!((found - due).abs() < 0.5, "{look:?} at {degrees} degrees");
            }
            for (found, side) in look.spread_px.into_iter().zip([60.0_f32, 12.0]) {
                let due = side / 12.0_f32.sqrt();
                // A side is drawn up to a pixel too short.
                assert!((found - due).abs() < 0.35, "{look:?} at {degrees} degrees, {due} is due");
            }
            assert_eq!(look.statistics, InputStatistics::of(&bar(degrees, centre)));
        }
        let nothing = Look::of(&drawn(|_, _| 0.0));
        assert_eq!(nothing.spread_px.map(f32::to_bits), [0; 2]);
    }

    #[test]
    fn how_deep_cells_lie_in_others_is_counted_in_cells() {
        let cells = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| {
            let map = drawn(|y, x| {
                f32::from(rows.contains(&(y / CELL_PX)) && columns.contains(&(x / CELL_PX)))
            });
            InputStatistics::of(&map).cells
        };
        let known = cells(5..15, 5..15);
        for (pressed, depth) in [
            (cells(5..6, 8..9), 0),
            (cells(8..9, 8..9), 3),
            (cells(9..11, 9..11), 4),
            (cells(8..9, 12..16), 0),
            (cells(20..21, 20..21), 0),
        ] {
            assert_eq!(pressed.depth_in(known), depth);
        }
        assert_eq!(PressedCells::default().depth_in(known), 0);
        assert_eq!(cells(13..15, 13..15).depth_in(PressedCells::EVERYWHERE), 13);
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
            // All is pressed: every step is one inside of contact.
            let contrast = f64::from(found.contrast_px) / f64::from(found.area_px);
            prop_assert!((contrast / roughness - 1.0).abs() < 1e-3);
            let product = f64::from(found.rough_load_mpa_px);
            prop_assert!((product / (roughness * load) - 1.0).abs() < 2e-4);
        }
    }
}
