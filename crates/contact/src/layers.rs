//! The compliance of layered skin under waves of pressure: plane layers, for one wave number at a
//! time.

use crate::layer::Layer;
use std::f64::consts::TAU;

/// Waves that are tabulated, by length, mm.
const LONGEST_MM: f64 = 130.0;
const SHORTEST_MM: f64 = 0.05;
const ENTRIES: usize = 64;
/// Thickest part of a layer that is taken at once, in wave lengths over 2 pi and in mm.
const PART: f64 = 0.5;
const PART_MM: f64 = 0.05;

/// Numbers by wave number, linear in its logarithm between entries.
#[derive(Clone, Debug)]
pub(crate) struct WaveTable<const N: usize> {
    first: f64,
    step: f64,
    entries: Vec<[f64; N]>,
}

impl<const N: usize> WaveTable<N> {
    /// `entries` (two at least) of them, between waves of these lengths, mm.
    pub(crate) fn new(
        lengths_mm: [f64; 2],
        entries: usize,
        of_wave: impl Fn(f64) -> [f64; N],
    ) -> Self {
        let [first, last] = lengths_mm.map(|length_mm| (TAU / length_mm).ln());
        let step = (last - first) / (entries - 1) as f64;
        let entry = |i| of_wave((first + step * i as f64).exp());
        Self { first, step, entries: (0..entries).map(entry).collect() }
    }

    /// At a wave number, 1/mm; beyond the table's ends as at the end.
    pub(crate) fn at(&self, wave_number: f64) -> [f64; N] {
        let last = self.entries.len() - 1;
        let place = (wave_number.max(f64::MIN_POSITIVE).ln() - self.first) / self.step;
        let place = place.clamp(0.0, last as f64);
        let low = (place as usize).min(last - 1);
        let part = place - low as f64;
        let [a, b] = [self.entries[low], self.entries[low + 1]];
        std::array::from_fn(|i| a[i] + part * (b[i] - a[i]))
    }
}

/// Displacement along the normal for a wave of pressure on a plane surface, mm/MPa, by wave number:
/// its logarithms are tabulated.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceCompliance(WaveTable<1>);

impl SurfaceCompliance {
    /// Of layers from the surface down, held by something rigid.
    pub(crate) fn new(layers: &[Layer]) -> Self {
        let entry = |k| [of_wave(k, layers).ln()];
        Self(WaveTable::new([LONGEST_MM, SHORTEST_MM], ENTRIES, entry))
    }

    /// At a wave number, 1/mm; beyond the table's ends as at the end.
    pub(crate) fn at(&self, wave_number: f64) -> f64 {
        self.0.at(wave_number)[0].exp()
    }

    /// The largest, mm/MPa.
    pub(crate) fn largest(&self) -> f64 {
        self.0.entries.as_flattened().iter().copied().fold(f64::NEG_INFINITY, f64::max).exp()
    }
}

pub(crate) type Block = [[f64; 2]; 2];
type Square = [[f64; 4]; 4];

/// Normal displacement over pressure at one wave number `k`.
///
/// `u_x = U sin kx`, `u_z = W cos kx`, tractions `T sin kx`, `S cos kx` on planes `z`: elasticity is
/// `y' = A y` of `y = (U, W, T, S)`. Displacement is a multiple `F` of traction on every plane, 0
/// at the bottom; through a part with the transfer `[a b; c d]` it becomes
/// `(a F + b)(c F + d)^-1`.
fn of_wave(k: f64, layers: &[Layer]) -> f64 {
    let mut compliance: Block = [[0.0; 2]; 2];
    for layer in layers.iter().rev() {
        let (transfer, parts) = part_of(k, layer);
        for _ in 0..parts {
            compliance = transfer.up(compliance).0;
        }
    }
    compliance[1][1]
}

/// What a part of a layer makes of displacement and traction below it, both above it.
pub(crate) struct Transfer {
    blocks: [Block; 4],
}

impl Transfer {
    /// Compliance above a part from that below it, and the traction below it over that above it.
    pub(crate) fn up(&self, compliance: Block) -> (Block, Block) {
        let [aa, ab, ba, bb] = self.blocks;
        let above = sum(times(aa, compliance), ab);
        let below = inverse(sum(times(ba, compliance), bb));
        (times(above, below), below)
    }
}

/// The transfer through a part of a layer at a wave number, and how many parts the layer has.
pub(crate) fn part_of(k: f64, layer: &Layer) -> (Transfer, usize) {
    let Layer { thickness_mm, .. } = *layer;
    let [lambda, mu] = layer.lame_mpa();
    let m = lambda + 2.0 * mu;
    let a: Square = [
        [0.0, k, 1.0 / mu, 0.0],
        [-lambda * k / m, 0.0, 0.0, 1.0 / m],
        [k * k * (m - lambda * lambda / m), 0.0, 0.0, lambda * k / m],
        [0.0, 0.0, -k, 0.0],
    ];
    let parts = (thickness_mm / PART_MM.min(PART / k)).ceil().max(1.0);
    let transfer = exponential(&a, thickness_mm / parts);
    let blocks = [[0, 0], [0, 2], [2, 0], [2, 2]].map(|[r, column]| block(&transfer, r, column));
    (Transfer { blocks }, parts as usize)
}

/// `exp(a h)` by its series; `a h` is small.
fn exponential(a: &Square, h: f64) -> Square {
    const TERMS: usize = 14;
    let mut term: Square = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    let mut sum = term;
    for n in 1..TERMS {
        let product = |i: usize, j: usize| (0..4).map(|l| term[i][l] * a[l][j]).sum::<f64>();
        term = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j) * h / n as f64));
        for (sum, term) in sum.as_flattened_mut().iter_mut().zip(term.as_flattened()) {
            *sum += term;
        }
    }
    sum
}

fn block(of: &Square, row: usize, column: usize) -> Block {
    std::array::from_fn(|i| std::array::from_fn(|j| of[row + i][column + j]))
}

pub(crate) fn times(a: Block, b: Block) -> Block {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

fn sum(a: Block, b: Block) -> Block {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

pub(crate) fn inverse([[a, b], [c, d]]: Block) -> Block {
    let determinant = a * d - b * c;
    [[d / determinant, -b / determinant], [-c / determinant, a / determinant]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(young_mpa: f64, thickness_mm: f64) -> Layer {
        Layer { young_mpa, poisson: 0.48, thickness_mm }
    }

    /// Half-space: `2 (1 - nu^2) / (E k)` (Johnson, Contact Mechanics, 13.1).
    fn half_space(young_mpa: f64, k: f64) -> f64 {
        2.0 * (1.0 - 0.48 * 0.48) / (young_mpa * k)
    }

    #[test]
    fn a_thick_layer_is_a_half_space() {
        let table = SurfaceCompliance::new(&[layer(0.1, 40.0)]);
        for k in [0.5, 2.0, 9.0, 40.0] {
            let due = half_space(0.1, k);
            assert!((of_wave(k, &[layer(0.1, 40.0)]) / due - 1.0).abs() < 1e-6, "{k}");
            // Logarithms, and so powers of k, are interpolated without an error.
            assert!((table.at(k) / due - 1.0).abs() < 1e-6, "{k}");
        }
    }

    #[test]
    fn alike_layers_are_one() {
        let one = of_wave(1.3, &[layer(0.1, 3.0)]);
        let three = of_wave(1.3, &[layer(0.1, 0.2), layer(0.1, 1.0), layer(0.1, 1.8)]);
        assert!((one / three - 1.0).abs() < 1e-9);
    }

    #[test]
    fn short_waves_feel_the_first_layer_and_long_ones_the_bottom() {
        let layers = [layer(0.136, 0.2), layer(0.08, 1.0), layer(0.034, 3.0)];
        assert!((of_wave(60.0, &layers) / half_space(0.136, 60.0) - 1.0).abs() < 1e-3);
        let between = of_wave(1.5, &layers);
        assert!(half_space(0.136, 1.5) < between && between < half_space(0.034, 1.5));
        // A wave that is long against the thickness: uniaxial strain, `sum h / m`.
        let oedometer = |l: &Layer| {
            let Layer { young_mpa: e, poisson: nu, thickness_mm: h } = *l;
            h * (1.0 + nu) * (1.0 - 2.0 * nu) / (e * (1.0 - nu))
        };
        let due: f64 = layers.iter().map(oedometer).sum();
        assert!((of_wave(1e-4, &layers) / due - 1.0).abs() < 1e-3);
    }
}
