//! Plane positions from corner angles, in the least-squares sense.
//!
//! With the plane as complex numbers, a triangle of given shape `p` placed at `U` is
//! similar to `p` exactly if `sum W_j U_j = 0`, `W_j` the edge opposite to corner `j`. The
//! sum of `|sum W_j U_j|^2 / (2 area)` over the triangles is the conformal energy of
//! Levy et al. (2002), eq. 3. It does not depend on the size of `p`, so the corner angles
//! say all: those of the surface give the conformal map, those of angle-based
//! flattening give its reconstruction, where the energy comes out as zero.

use super::FlattenError;
use super::disc::Disc;
use super::sparse::{Cholesky, Entry, Factor};
use papilla_vector::{minus, norm};

/// Corrections after the first solve: the normal equations square the condition number,
/// and these win the lost digits back.
const REFINEMENTS: usize = 4;
/// Inverse iterations allowed for the spectral map.
const ITERATIONS_MAX: usize = 200;
/// Relative change of the eigenvalue that ends the iteration.
const EIGENVALUE_CHANGE_MAX: f64 = 1e-13;
/// Shift of the singular matrix (its kernel: all vertices in one place), as a share of
/// its mean diagonal.
const SHIFT_SHARE: f64 = 1e-9;

type Complex = [f64; 2];

/// The energy as a sum over triangles.
struct Energy<'a> {
    disc: &'a Disc,
    /// `W_j / sqrt(2 area)` of each triangle.
    weights: Vec<[Complex; 3]>,
}

impl<'a> Energy<'a> {
    fn new(disc: &'a Disc, angles: &[[f64; 3]]) -> Self {
        Self { disc, weights: angles.iter().map(|&a| edge_weights(a)).collect() }
    }

    /// Lower triangle of the real matrix over `(x, y)` of the vertices that `unknown`
    /// numbers.
    fn lower(&self, unknown: impl Fn(usize) -> Option<usize>) -> Vec<Entry> {
        let mut lower = Vec::with_capacity(21 * self.weights.len());
        for (corners, w) in self.disc.triangles.iter().zip(&self.weights) {
            for j in 0..3 {
                let Some(row) = unknown(corners[j]) else { continue };
                for k in 0..3 {
                    let Some(column) = unknown(corners[k]) else { continue };
                    let [re, im] = times(conjugate(w[j]), w[k]);
                    for (r, c, value) in [(0, 0, re), (0, 1, -im), (1, 0, im), (1, 1, re)] {
                        let (row, column) = (2 * row + r, 2 * column + c);
                        if column <= row {
                            lower.push(Entry::new(row, column, value));
                        }
                    }
                }
            }
        }
        lower
    }

    /// Half the gradient: the matrix times the positions.
    fn apply(&self, uv: &[Complex]) -> Vec<Complex> {
        let mut out = vec![[0.0; 2]; uv.len()];
        for (corners, w) in self.disc.triangles.iter().zip(&self.weights) {
            let mut misfit = [0.0; 2];
            for j in 0..3 {
                misfit = plus(misfit, times(w[j], uv[corners[j]]));
            }
            for j in 0..3 {
                out[corners[j]] = plus(out[corners[j]], times(conjugate(w[j]), misfit));
            }
        }
        out
    }
}

fn edge_weights([a, b, c]: [f64; 3]) -> [Complex; 3] {
    // Law of sines: corner 0 at the origin, corner 1 on the first axis.
    let (q, r) = ([c.sin(), 0.0], [b.sin() * a.cos(), b.sin() * a.sin()]);
    let scale = (q[0] * r[1]).sqrt().recip();
    [[r[0] - q[0], r[1] - q[1]], [-r[0], -r[1]], q].map(|w: Complex| w.map(|x| x * scale))
}

/// The least-squares map with the two farthest boundary vertices pinned at their distance.
pub(super) fn pinned(
    disc: &Disc,
    positions: &[[f64; 3]],
    angles: &[[f64; 3]],
) -> Result<Vec<Complex>, FlattenError> {
    let energy = Energy::new(disc, angles);
    let (first, second, distance) = farthest_pair(disc, positions);
    let mut number = vec![None; disc.vertex_count];
    let free: Vec<usize> = (0..disc.vertex_count).filter(|&v| v != first && v != second).collect();
    for (i, &vertex) in free.iter().enumerate() {
        number[vertex] = Some(i);
    }
    let mut uv = vec![[0.0; 2]; disc.vertex_count];
    uv[second][0] = distance;
    let lower = energy.lower(|vertex| number[vertex]);
    let factor = Cholesky::new("the conformal map", 2 * free.len()).factor(&lower)?;
    for _ in 0..=REFINEMENTS {
        let gradient = energy.apply(&uv);
        let mut change: Vec<f64> = free.iter().flat_map(|&vertex| gradient[vertex]).collect();
        factor.solve_in_place(&mut change);
        for (&vertex, change) in free.iter().zip(change.as_chunks::<2>().0) {
            uv[vertex] = [uv[vertex][0] - change[0], uv[vertex][1] - change[1]];
        }
    }
    Ok(uv)
}

/// The two boundary vertices farthest apart in space (the first such pair), and how far.
fn farthest_pair(disc: &Disc, positions: &[[f64; 3]]) -> (usize, usize, f64) {
    let mut best = (0, 0, 0.0);
    for (i, &a) in disc.boundary.iter().enumerate() {
        for &b in &disc.boundary[i + 1..] {
            let distance = norm(minus(positions[a], positions[b]));
            if distance > best.2 {
                best = (a, b, distance);
            }
        }
    }
    best
}

/// The map of least conformal energy among those whose boundary vertices have a given
/// second moment about their mean (Mullen et al. 2008, eq. 8), by inverse iteration.
pub(super) fn spectral(
    disc: &Disc,
    positions: &[[f64; 3]],
    angles: &[[f64; 3]],
) -> Result<Vec<Complex>, FlattenError> {
    let energy = Energy::new(disc, angles);
    let factor = shifted_factor(&energy)?;
    let mut uv = pinned(disc, positions, angles)?;
    let mut eigenvalue = f64::INFINITY;
    for _ in 0..ITERATIONS_MAX {
        normalise(disc, &mut uv);
        let rayleigh: f64 =
            energy.apply(&uv).iter().zip(&uv).map(|(g, u)| g[0] * u[0] + g[1] * u[1]).sum();
        if (eigenvalue - rayleigh).abs() <= EIGENVALUE_CHANGE_MAX * rayleigh.abs() {
            return Ok(uv);
        }
        eigenvalue = rayleigh;
        let mut right = vec![0.0; 2 * disc.vertex_count];
        for &vertex in &disc.boundary {
            right[2 * vertex..2 * vertex + 2].copy_from_slice(&uv[vertex]);
        }
        factor.solve_in_place(&mut right);
        uv = right.as_chunks::<2>().0.to_vec();
    }
    normalise(disc, &mut uv);
    Ok(uv)
}

fn shifted_factor(energy: &Energy<'_>) -> Result<Factor, FlattenError> {
    let size = 2 * energy.disc.vertex_count;
    let mut lower = energy.lower(Some);
    let trace: f64 = lower.iter().filter(|e| e.row == e.col).map(|e| e.val).sum();
    let shift = SHIFT_SHARE * trace / size as f64;
    lower.extend((0..size).map(|i| Entry::new(i, i, shift)));
    Cholesky::new("the spectral conformal map", size).factor(&lower)
}

/// Boundary vertices to mean zero and unit second moment.
fn normalise(disc: &Disc, uv: &mut [Complex]) {
    let count = disc.boundary.len() as f64;
    let mut mean = [0.0; 2];
    for &vertex in &disc.boundary {
        mean = plus(mean, uv[vertex]);
    }
    for point in uv.iter_mut() {
        *point = [point[0] - mean[0] / count, point[1] - mean[1] / count];
    }
    let moment: f64 =
        disc.boundary.iter().map(|&v| uv[v][0] * uv[v][0] + uv[v][1] * uv[v][1]).sum();
    uv.iter_mut().for_each(|point| *point = point.map(|x| x / moment.sqrt()));
}

fn times(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn plus(a: Complex, b: Complex) -> Complex {
    [a[0] + b[0], a[1] + b[1]]
}

fn conjugate(a: Complex) -> Complex {
    [a[0], -a[1]]
}
