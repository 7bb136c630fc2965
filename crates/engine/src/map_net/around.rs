//! The correction that looks at the eight neighbours of a block: convolutions over 3 x 3 blocks,
//! with fewer products than the sums as they are written.
//!
//! Winograd's method, F(4 x 4, 3 x 3): a tile of 4 x 4 sums depends on 6 x 6 values. A fixed linear
//! map turns the values into 36 numbers, and another one the weights. The products of these numbers
//! are summed over the inputs, and a third fixed map gives the sums of the tile. That takes 36
//! products for each input, where the plain sums take 144. Apart from rounding the result is the
//! same.
//!
//! A vector holds the same place of neighbouring tiles. So a map is stored as planes, one for each
//! place within a tile, and the transforms need no shuffling.

use super::gain::Gain;
use super::gated::{PAIRS, gated, padded, product};
use super::parts::CorrectionParts;
use super::sums::{GROUP, MARGIN, Sums, VECTORS, in_vectors, settled, vectors, vectors_mut};
use pulp::{Simd, WithSimd};

/// Width and height of a tile of sums.
const TILE: usize = 4;
/// Number of places within a tile.
const PLACES: usize = TILE * TILE;
/// Width and height of the square of values that a tile depends on.
const SPAN: usize = TILE + 2;
const POINTS: usize = SPAN * SPAN;
/// The most hidden channels at a time, so that their tiles stay in the cache.
const BATCH: usize = 2 * GROUP;

/// The polynomials of Winograd's method are evaluated at 0, `A`, `-A`, `B`, `-B` and infinity. The
/// usual points 1 and 2 lose one more digit. The powers of 3/4 and 3/2 are exact floats, and with
/// them the rounding error is between one and two times that of the plain sums.
const A: f32 = 0.75;
const B: f32 = 1.5;

/// One row of the 6 x 3 matrix that transforms three weights into six numbers.
fn weights(row: usize) -> [f64; 3] {
    let (a, b) = (f64::from(A), f64::from(B));
    let (of_a, of_b) = (2.0 * a * a * (a * a - b * b), 2.0 * b * b * (b * b - a * a));
    let at = |point: f64, divisor: f64| [1.0, point, point * point].map(|power| power / divisor);
    match row {
        0 => at(0.0, a * a * b * b),
        1 => at(a, of_a),
        2 => at(-a, of_a),
        3 => at(b, of_b),
        4 => at(-b, of_b),
        _ => [0.0, 0.0, 1.0],
    }
}

/// Transforms six values of a row into six numbers.
#[inline(always)]
fn forward<S: Simd>(simd: S, values: [S::f32s; SPAN]) -> [S::f32s; SPAN] {
    let [first, second, third, fourth, fifth, sixth] = values;
    let (minus_aa, minus_bb) = (simd.splat_f32s(-A * A), simd.splat_f32s(-B * B));
    let (product, minus_sum) = (simd.splat_f32s(A * A * B * B), simd.splat_f32s(-(A * A + B * B)));
    let near = simd.mul_add_e_f32s(minus_bb, third, fifth);
    let near_odd = simd.mul_add_e_f32s(minus_bb, second, fourth);
    let far = simd.mul_add_e_f32s(minus_aa, third, fifth);
    let far_odd = simd.mul_add_e_f32s(minus_aa, second, fourth);
    let (a, minus_a) = (simd.splat_f32s(A), simd.splat_f32s(-A));
    let (b, minus_b) = (simd.splat_f32s(B), simd.splat_f32s(-B));
    let even = simd.mul_add_e_f32s(minus_sum, third, fifth);
    let odd = simd.mul_add_e_f32s(minus_sum, fourth, sixth);
    [
        simd.mul_add_e_f32s(product, first, even),
        simd.mul_add_e_f32s(a, near_odd, near),
        simd.mul_add_e_f32s(minus_a, near_odd, near),
        simd.mul_add_e_f32s(b, far_odd, far),
        simd.mul_add_e_f32s(minus_b, far_odd, far),
        simd.mul_add_e_f32s(product, second, odd),
    ]
}

/// Transforms six products of a row into four sums.
#[inline(always)]
fn back<S: Simd>(simd: S, products: [S::f32s; SPAN]) -> [S::f32s; TILE] {
    let [zero, a, minus_a, b, minus_b, infinity] = products;
    let (even_a, odd_a) = (simd.add_f32s(a, minus_a), simd.sub_f32s(a, minus_a));
    let (even_b, odd_b) = (simd.add_f32s(b, minus_b), simd.sub_f32s(b, minus_b));
    let second = simd.mul_f32s(simd.splat_f32s(B), odd_b);
    let third = simd.mul_f32s(simd.splat_f32s(B * B), even_b);
    let fourth = simd.mul_add_e_f32s(simd.splat_f32s(B * B * B), odd_b, infinity);
    [
        simd.add_f32s(zero, simd.add_f32s(even_a, even_b)),
        simd.mul_add_e_f32s(simd.splat_f32s(A), odd_a, second),
        simd.mul_add_e_f32s(simd.splat_f32s(A * A), even_a, third),
        simd.mul_add_e_f32s(simd.splat_f32s(A * A * A), odd_a, fourth),
    ]
}

/// How the tiles of a map lie in memory.
#[derive(Clone, Copy, Debug)]
struct Tiles {
    /// Number of tiles in a row.
    across: usize,
}

impl Tiles {
    fn new(side: usize) -> Self {
        Self { across: side.div_ceil(TILE) }
    }

    /// Positions from one row of tiles to the next: one more than there are tiles, for what the
    /// last tile of a row reads.
    fn stride(self) -> usize {
        self.across + 1
    }

    fn positions(self) -> usize {
        self.across * self.stride()
    }

    /// Length of a plane that is written, rounded up to whole vectors.
    fn plane_len(self) -> usize {
        self.positions().next_multiple_of(MARGIN)
    }

    /// Length of a plane that is read. It has one more row of tiles.
    fn read_len(self) -> usize {
        self.stride() * self.stride()
    }

    /// The plane of a pixel and its position in it.
    fn at(self, row: usize, column: usize) -> (usize, usize) {
        (row % TILE * TILE + column % TILE, row / TILE * self.stride() + column / TILE)
    }
}

#[derive(Debug)]
pub(super) struct Around {
    tiles: Tiles,
    inputs: usize,
    /// Transformed weights `[hidden / 2, POINTS, inputs]`, each of two values and two gates.
    gated: Vec<[f32; GROUP]>,
    gain: Gain,
    /// The sums that each batch of hidden channels adds to the output.
    out: Vec<Sums>,
}

/// The working memory of a correction.
#[derive(Debug)]
pub(super) struct Space {
    /// Components and pressures, `[inputs, PLACES, read_len]`, with a row and a column of zeros
    /// before the map.
    map: Vec<f32>,
    /// `[POINTS, inputs, plane]`.
    points: Vec<f32>,
    /// `[POINTS, GROUP, V]` vectors.
    products: Vec<f32>,
    /// `[BATCH, PLACES, plane]`.
    hidden: Vec<f32>,
    /// `[channels, PLACES, plane]`.
    added: Vec<f32>,
}

impl Around {
    pub(super) fn new(parts: &CorrectionParts, side: usize) -> Self {
        let CorrectionParts { hidden, inputs, out, over_finger, place, .. } = parts;
        let (hidden, inputs, tiles) = (*hidden, *inputs, Tiles::new(side));
        let groups = padded(hidden) / PAIRS;
        let mut weights = vec![[0.0; GROUP]; groups * POINTS * inputs];
        for (place, weights) in weights.iter_mut().enumerate() {
            let (group, point, input) =
                (place / inputs / POINTS, place / inputs % POINTS, place % inputs);
            let (down, along) = (self::weights(point / SPAN), self::weights(point % SPAN));
            for (channel, weight) in weights.iter_mut().enumerate() {
                let of = |tap| gated(parts, group * GROUP + channel, 9 * input + tap);
                let terms = (0..9).map(|tap| f64::from(of(tap)) * down[tap / 3] * along[tap % 3]);
                *weight = settled(terms.sum::<f64>() as f32);
            }
        }
        let plane_len = tiles.plane_len();
        let at = |row, column| tiles.at(row, column);
        let gain = Gain::of_parts(over_finger, place, side, (PLACES, plane_len), at);
        let channels = out.len() / hidden;
        let out = (0..hidden).step_by(BATCH).map(|first| {
            let count = (hidden - first).min(BATCH);
            let taps: Vec<_> = (0..count).map(|channel| channel * PLACES * plane_len).collect();
            Sums::new(&taps, channels, |channel, tap| out[channel * hidden + first + tap])
        });
        Self { tiles, inputs, gated: weights, gain, out: out.collect() }
    }

    fn channels(&self) -> usize {
        GROUP * self.out[0].groups()
    }

    pub(super) fn space(&self) -> Space {
        let plane_len = self.tiles.plane_len();
        Space {
            // Longer, for vectors that reach beyond the end of the last plane.
            map: vec![0.0; self.inputs * PLACES * self.tiles.read_len() + 2 * MARGIN],
            points: vec![0.0; POINTS * self.inputs * plane_len],
            products: vec![0.0; POINTS * GROUP * VECTORS * MARGIN],
            hidden: vec![0.0; BATCH * PLACES * plane_len],
            added: vec![0.0; self.channels() * PLACES * plane_len],
        }
    }

    /// Stores a row of a channel. The correction is computed when all rows are stored.
    pub(super) fn keep(&self, row: usize, channel: usize, values: &[f32], space: &mut Space) {
        for first in 0..TILE {
            let place = self.kept_at(row, channel, first);
            let to = space.map[place..].iter_mut();
            to.zip(values.iter().skip(first).step_by(TILE)).for_each(|(to, value)| *to = *value);
        }
    }

    /// Writes a stored row of a channel plus what the correction adds to it.
    pub(super) fn sum_up(&self, row: usize, channel: usize, values: &mut [f32], space: &Space) {
        for first in 0..TILE {
            let kept = &space.map[self.kept_at(row, channel, first)..];
            let (plane, at) = self.tiles.at(row, first);
            let added = &space.added[(channel * PLACES + plane) * self.tiles.plane_len() + at..];
            let values = values.iter_mut().skip(first).step_by(TILE);
            values.zip(kept).zip(added).for_each(|((value, kept), added)| *value = kept + added);
        }
    }

    fn kept_at(&self, row: usize, channel: usize, column: usize) -> usize {
        let (plane, at) = self.tiles.at(row + 1, column + 1);
        (channel * PLACES + plane) * self.tiles.read_len() + at
    }

    /// Computes what the correction adds to all stored rows.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&self, simd: S, space: &mut Space) {
        let around = self;
        simd.vectorize(Forward { around, space });
        for (batch, out) in self.out.iter().enumerate() {
            let groups = BATCH / PAIRS;
            let last = self.gated.len() / (POINTS * self.inputs);
            for group in batch * groups..((batch + 1) * groups).min(last) {
                simd.vectorize(Multiply { around, group, space });
            }
            simd.vectorize(Out { around, batch, out, space });
        }
    }
}

/// Transforms all values, tile by tile.
struct Forward<'a> {
    around: &'a Around,
    space: &'a mut Space,
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { around: Around { tiles, inputs, .. }, space } = self;
        let (plane_len, read_len, stride) = (tiles.plane_len(), tiles.read_len(), tiles.stride());
        let zero = simd.splat_f32s(0.0);
        for input in 0..*inputs {
            let map = &space.map[input * PLACES * read_len..];
            in_vectors!(S, 0, tiles.positions(), at, V => for v in 0..V {
                let at = at + v * S::F32_LANES;
                let mut halves = [[zero; SPAN]; SPAN];
                for row in 0..SPAN {
                    let mut values = [zero; SPAN];
                    for column in 0..SPAN {
                        let plane = row % TILE * TILE + column % TILE;
                        let from = plane * read_len + row / TILE * stride + column / TILE + at;
                        values[column] = vectors::<S>(&map[from..], 1)[0];
                    }
                    halves[row] = forward(simd, values);
                }
                for column in 0..SPAN {
                    let values = [
                        halves[0][column], halves[1][column], halves[2][column],
                        halves[3][column], halves[4][column], halves[5][column],
                    ];
                    let values = forward(simd, values);
                    for row in 0..SPAN {
                        let place = ((row * SPAN + column) * inputs + input) * plane_len + at;
                        vectors_mut::<S>(&mut space.points[place..], 1)[0] = values[row];
                    }
                }
            });
        }
    }
}

/// Computes the products of a group of channels and from them its hidden values, still without the
/// gain.
struct Multiply<'a> {
    around: &'a Around,
    group: usize,
    space: &'a mut Space,
}

impl WithSimd for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        in_vectors!(S, 0, self.around.tiles.positions(), at, V => {
            self.multiply::<S, V>(simd, at);
            for pair in 0..PAIRS {
                for v in 0..V {
                    self.back::<S, V>(simd, at, pair, v);
                }
            }
        });
    }
}

impl Multiply<'_> {
    #[inline(always)]
    fn multiply<S: Simd, const V: usize>(&mut self, simd: S, at: usize) {
        let (inputs, plane_len) = (self.around.inputs, self.around.tiles.plane_len());
        let weights = &self.around.gated[self.group * POINTS * inputs..][..POINTS * inputs];
        let Space { points, products, .. } = &mut *self.space;
        let products = vectors_mut::<S>(products, POINTS * GROUP * V);
        for point in 0..POINTS {
            let weights = &weights[point * inputs..(point + 1) * inputs];
            let points = &points[point * inputs * plane_len..(point + 1) * inputs * plane_len];
            let mut sums = [[simd.splat_f32s(0.0); V]; GROUP];
            for input in 0..inputs {
                let values = vectors::<S>(&points[input * plane_len + at..], V);
                for channel in 0..GROUP {
                    let weight = simd.splat_f32s(weights[input][channel]);
                    for v in 0..V {
                        sums[channel][v] = simd.mul_add_e_f32s(weight, values[v], sums[channel][v]);
                    }
                }
            }
            for channel in 0..GROUP {
                for v in 0..V {
                    products[(point * GROUP + channel) * V + v] = sums[channel][v];
                }
            }
        }
    }

    #[inline(always)]
    fn back<S: Simd, const V: usize>(&mut self, simd: S, at: usize, pair: usize, v: usize) {
        let Space { products, hidden, .. } = &mut *self.space;
        let plane_len = self.around.tiles.plane_len();
        let products = vectors::<S>(products, POINTS * GROUP * V);
        let zero = simd.splat_f32s(0.0);
        let mut halves = [[[zero; SPAN]; TILE]; 2];
        for (of, channel) in [pair, PAIRS + pair].into_iter().enumerate() {
            for column in 0..SPAN {
                let mut values = [zero; SPAN];
                for row in 0..SPAN {
                    values[row] = products[((row * SPAN + column) * GROUP + channel) * V + v];
                }
                let values = back(simd, values);
                for row in 0..TILE {
                    halves[of][row][column] = values[row];
                }
            }
        }
        let channel = self.group % (BATCH / PAIRS) * PAIRS + pair;
        for row in 0..TILE {
            let (values, gates) = (back(simd, halves[0][row]), back(simd, halves[1][row]));
            for column in 0..TILE {
                let plane = channel * PLACES + row * TILE + column;
                let place = plane * plane_len + at + v * S::F32_LANES;
                vectors_mut::<S>(&mut hidden[place..], 1)[0] =
                    product(simd, values[column], gates[column]);
            }
        }
    }
}

/// Adds what a batch of hidden channels contributes to the output.
struct Out<'a> {
    around: &'a Around,
    batch: usize,
    out: &'a Sums,
    space: &'a mut Space,
}

impl WithSimd for Out<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for place in 0..PLACES {
            in_vectors!(S, 0, self.around.tiles.positions(), at, V => {
                self.at::<S, V>(simd, place, at);
            });
        }
    }
}

impl Out<'_> {
    #[inline(always)]
    fn at<S: Simd, const V: usize>(&mut self, simd: S, place: usize, at: usize) {
        let Self { around: Around { tiles, gain, .. }, batch, out, space } = self;
        let Space { hidden, added, .. } = &mut **space;
        let plane_len = tiles.plane_len();
        let groups = BATCH / GROUP;
        for group in 0..groups.min(gain.groups() - *batch * groups) {
            let gains = gain.of_group::<S, V>(simd, *batch * groups + group, place, at);
            for channel in 0..GROUP {
                let plane = (group * GROUP + channel) * PLACES + place;
                let hidden = vectors_mut::<S>(&mut hidden[plane * plane_len + at..], V);
                for v in 0..V {
                    hidden[v] = simd.mul_f32s(hidden[v], gains[channel][v]);
                }
            }
        }
        let hidden = &hidden[place * plane_len + at..];
        for group in 0..out.groups() {
            let sums = out.of_group::<S, V>(simd, group, hidden);
            for channel in 0..GROUP {
                let plane = (group * GROUP + channel) * PLACES + place;
                let added = vectors_mut::<S>(&mut added[plane * plane_len + at..], V);
                for v in 0..V {
                    let before = if *batch == 0 { simd.splat_f32s(0.0) } else { added[v] };
                    added[v] = simd.add_f32s(before, sums[channel][v]);
                }
            }
        }
    }
}
