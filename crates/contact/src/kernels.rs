//! Sums and products over f32 vectors, in the widest vectors of the processor that are used.
//!
//! The code that runs over vectors is a type with [`WithSimd`]. A closure would be compiled for the
//! plainest processor, unless the compiler happened to inline it.

use crate::compliance::{Compliance, TILE, TILE_LEN, Tiles};
use pulp::{Arch, Simd, WithSimd};

/// Runs `work` for the widest vectors of this processor.
#[inline]
pub(crate) fn run<W: WithSimd>(work: W) -> W::Output {
    Arch::new().dispatch(work)
}

/// `a . b`.
#[inline(always)]
pub(crate) fn dot<S: Simd>(simd: S, a: &[f32], b: &[f32]) -> f32 {
    let n = a.len().min(b.len());
    let (a, a_rest) = S::as_simd_f32s(&a[..n]);
    let (b, b_rest) = S::as_simd_f32s(&b[..n]);
    let mut sums = [simd.splat_f32s(0.0); 4];
    let (a_fours, a_ones) = a.as_chunks::<4>();
    let (b_fours, b_ones) = b.as_chunks::<4>();
    for (x, y) in a_fours.iter().zip(b_fours) {
        for l in 0..4 {
            sums[l] = simd.mul_add_e_f32s(x[l], y[l], sums[l]);
        }
    }
    for (x, y) in a_ones.iter().zip(b_ones) {
        sums[0] = simd.mul_add_e_f32s(*x, *y, sums[0]);
    }
    let [p, q, r, s] = sums;
    let sum = simd.add_f32s(simd.add_f32s(p, q), simd.add_f32s(r, s));
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    simd.reduce_sum_f32s(sum) + rest
}

/// `y += k x`.
#[inline(always)]
pub(crate) fn add_scaled<S: Simd>(simd: S, y: &mut [f32], k: f32, x: &[f32]) {
    let n = y.len().min(x.len());
    let (y, y_rest) = S::as_mut_simd_f32s(&mut y[..n]);
    let (x, x_rest) = S::as_simd_f32s(&x[..n]);
    let factor = simd.splat_f32s(k);
    for (y, x) in y.iter_mut().zip(x) {
        *y = simd.mul_add_e_f32s(factor, *x, *y);
    }
    for (y, x) in y_rest.iter_mut().zip(x_rest) {
        *y += k * x;
    }
}

struct Dot<'a>(&'a [f32], &'a [f32]);

impl WithSimd for Dot<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        dot(simd, self.0, self.1)
    }
}

/// `a . b`, on its own.
pub(crate) fn product(a: &[f32], b: &[f32]) -> f32 {
    run(Dot(a, b))
}

struct Multiply<'a> {
    a: &'a [f32],
    stride: usize,
    x: &'a [f32],
    y: &'a mut [f32],
}

impl WithSimd for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (y, row) in self.y.iter_mut().zip(self.a.chunks(self.stride)) {
            *y = dot(simd, &row[..self.x.len()], self.x);
        }
    }
}

/// `y = A x` for a square matrix of `x.len()` columns whose rows are `stride` apart.
pub(crate) fn multiply(a: &[f32], stride: usize, x: &[f32], y: &mut [f32]) {
    run(Multiply { a, stride, x, y });
}

/// `linear[a][i] = sum_b blocks[i][3 a + b] . force[b]` for the first rows.
pub(crate) struct Displace<'a> {
    pub blocks: &'a [f32],
    pub stride: usize,
    pub rows: usize,
    pub force: [&'a [f32]; 3],
    pub linear: &'a mut [Vec<f32>; 3],
}

impl WithSimd for Displace<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { blocks, stride, rows, force, linear } = self;
        let m = force[0].len();
        for (i, block) in blocks.chunks_exact(9 * stride).take(rows).enumerate() {
            for (a, linear) in linear.iter_mut().enumerate() {
                let mut sum = 0.0;
                for b in 0..3 {
                    sum += dot(simd, &block[(3 * a + b) * stride..][..m], force[b]);
                }
                linear[i] = sum;
            }
        }
    }
}

/// Displacement of the vertices of some tiles, `[tile][component][vertex]`, under the forces of
/// others.
pub(crate) struct DisplaceTiles<'a> {
    pub compliance: &'a Compliance,
    /// Tiles under force; each has one.
    pub pushing: &'a [u32],
    pub force: &'a [Vectors],
    /// Tiles that are displaced.
    pub moving: &'a [u32],
    pub moved: &'a mut [Vectors],
}

/// Vectors of a tile's vertices, component by component.
pub(crate) type Vectors = [[f32; TILE]; 3];

impl WithSimd for DisplaceTiles<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.compliance.tiles() {
            Tiles::Values(values) => self.displace(simd, &Values(values)),
            Tiles::Steps { steps, mm_per_n } => {
                self.displace(simd, &Steps { steps, mm_per_n: *mm_per_n });
            }
        }
    }
}

impl DisplaceTiles<'_> {
    #[inline(always)]
    fn displace<S: Simd>(self, simd: S, stored: &impl Stored) {
        const PLANE: usize = TILE * TILE;
        let Self { compliance, pushing, force, moving, moved } = self;
        for tile in moving {
            moved[*tile as usize] = Default::default();
        }
        for from in pushing {
            let force = &force[*from as usize];
            let row = *from as usize * compliance.side();
            for to in moving {
                let tile = (row + *to as usize) * TILE_LEN;
                let mut sums = moved[*to as usize];
                for (b, force) in force.iter().enumerate() {
                    for (j, force) in force.iter().enumerate().filter(|(_, f)| **f != 0.0) {
                        for (a, sum) in sums.iter_mut().enumerate() {
                            let column = stored.column(tile + (3 * b + a) * PLANE + j * TILE);
                            add_scaled(simd, sum, *force, &column);
                        }
                    }
                }
                moved[*to as usize] = sums;
            }
        }
    }
}

/// Tiles as they are stored.
trait Stored {
    /// Displacements of a tile's vertices under one force, mm/N, from a place on.
    fn column(&self, at: usize) -> [f32; TILE];
}

struct Values<'a>(&'a [f32]);

impl Stored for Values<'_> {
    #[inline(always)]
    fn column(&self, at: usize) -> [f32; TILE] {
        let mut column = [0.0; TILE];
        column.copy_from_slice(&self.0[at..][..TILE]);
        column
    }
}

struct Steps<'a> {
    steps: &'a [i16],
    mm_per_n: f32,
}

impl Stored for Steps<'_> {
    #[inline(always)]
    fn column(&self, at: usize) -> [f32; TILE] {
        let mut column = [0.0; TILE];
        for (to, steps) in column.iter_mut().zip(&self.steps[at..][..TILE]) {
            *to = f32::from(*steps) * self.mm_per_n;
        }
        column
    }
}

/// `matrix[i][k] = sum_ab rows[a][i] blocks[i][3 a + b][k] columns[b][k]`: compliance along unit
/// vectors.
pub(crate) struct Along<'a> {
    pub blocks: &'a [f32],
    pub stride: usize,
    pub rows: [&'a [f32]; 3],
    pub columns: [&'a [f32]; 3],
    pub matrix: &'a mut [f32],
}

impl WithSimd for Along<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { blocks, stride, rows, columns, matrix } = self;
        let m = columns[0].len();
        for (i, row) in matrix.chunks_mut(stride).take(m).enumerate() {
            let row = &mut row[..m];
            row.fill(0.0);
            for b in 0..3 {
                let of = |a: usize| &blocks[(9 * i + 3 * a + b) * stride..][..m];
                let (row, row_rest) = S::as_mut_simd_f32s(row);
                let (other, other_rest) = S::as_simd_f32s(columns[b]);
                for a in 0..3 {
                    let own = rows[a][i];
                    let factor = simd.splat_f32s(own);
                    let (plane, plane_rest) = S::as_simd_f32s(of(a));
                    for ((sum, p), n) in row.iter_mut().zip(plane).zip(other) {
                        *sum = simd.mul_add_e_f32s(simd.mul_f32s(factor, *p), *n, *sum);
                    }
                    for ((sum, p), n) in row_rest.iter_mut().zip(plane_rest).zip(other_rest) {
                        *sum += own * p * n;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_what_they_are_in_double_precision() {
        for n in [0, 1, 7, 31, 32, 33, 100] {
            let a: Vec<f32> = (0..n).map(|i| (i as f32 * 0.37).sin()).collect();
            let b: Vec<f32> = (0..n).map(|i| (i as f32 * 0.11).cos()).collect();
            let due: f64 = a.iter().zip(&b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum();
            let found = f64::from(product(&a, &b));
            assert!((found - due).abs() <= 1e-5 * (n as f64).sqrt().max(1.0), "{n}: {found} {due}");
        }
    }

    #[test]
    fn rows_may_be_farther_apart_than_they_are_long() {
        let a = [1.0, 2.0, 9.0, 3.0, 4.0, 9.0];
        let mut y = [0.0; 2];
        multiply(&a, 3, &[1.0, 10.0], &mut y);
        assert_eq!(y.map(f32::to_bits), [21f32, 43.0].map(f32::to_bits));
    }
}
