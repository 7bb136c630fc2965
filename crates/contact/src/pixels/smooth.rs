//! Interpolation of values between vertices by polynomials of second degree, smoother than linear
//! on each triangle.

use papilla_atlas::{Atlas, Patch, Raster};

/// Vertices that a pixel's value is of.
const NEAR: usize = 16;
/// Terms of a polynomial of second degree in two coordinates.
pub(super) const TERMS: usize = 6;
/// Largest sum of the weights' sizes: beyond, where a pixel lies at the edge, the triangle's plane
/// is taken.
const WEIGHTS_MAX: f64 = 2.5;

/// What a value is made of: vertices and weights, whose sum is 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stencil<const N: usize> {
    pub vertices: [u16; N],
    pub weights: [f32; N],
}

/// Of a value at a pixel.
pub(super) type PixelStencil = Stencil<NEAR>;

impl<const N: usize> Stencil<N> {
    /// Value of a field where the stencil is of.
    pub(super) fn value(&self, field: impl Fn(usize) -> f32) -> f32 {
        let terms = self.vertices.iter().zip(self.weights);
        terms.map(|(vertex, weight)| weight * field(usize::from(*vertex))).sum()
    }

    /// The same of fields that stand beside each other.
    #[inline]
    pub(super) fn vector<const M: usize>(&self, fields: &[[f32; M]]) -> [f32; M] {
        // Two sums, as one would wait for itself.
        let mut sums = [[0.0; M]; 2];
        for (i, (vertex, weight)) in self.vertices.iter().zip(self.weights).enumerate() {
            let (sum, value) = (&mut sums[i % 2], &fields[usize::from(*vertex)]);
            for k in 0..M {
                sum[k] += weight * value[k];
            }
        }
        std::array::from_fn(|k| sums[0][k] + sums[1][k])
    }
}

/// A stencil for each pixel of the skin: the value at the pixel of the polynomial of second degree
/// that is closest to the values at its neighbours, nearer ones counting more (moving least squares).
pub(super) fn of_pixels(atlas: &Atlas, raster: &Raster) -> Vec<PixelStencil> {
    let (uv_px, apart) = (&atlas.patch(Patch::Skin).uv_px, apart_px(atlas));
    let side = papilla_atlas::MAP_SIDE_PX;
    let places = raster.indices().iter().map(|i| (*i as usize % side, *i as usize / side));
    let mut order: Vec<(f32, u16)> = Vec::with_capacity(uv_px.len());
    let stencil = |((column, row), pixel): ((usize, usize), &papilla_atlas::Pixel)| {
        let at = [column as f32 + 0.5, row as f32 + 0.5];
        let corners = || pixel.vertices.iter().zip(pixel.weights);
        let apart = [0, 1].map(|a| corners().map(|(v, w)| w * apart[*v as usize][a]).sum());
        least_squares(at, apart, uv_px, &mut order).unwrap_or_else(|| plane(pixel))
    };
    places.zip(raster.pixels()).map(stencil).collect()
}

/// How far vertices are apart round each of them, along the map's rows and down them, px: where the
/// lattice is coarser one way than the other, distances count in these, so that neighbours stand on
/// all sides.
pub(super) fn apart_px(atlas: &Atlas) -> Vec<[f32; 2]> {
    let uv_px = &atlas.patch(Patch::Skin).uv_px;
    let (mut sums, mut counts) = (vec![[0.0f32; 2]; uv_px.len()], vec![0.0f32; uv_px.len()]);
    for corners in atlas.triangles() {
        let of = |axis: usize| corners.map(|v| uv_px[v as usize][axis]);
        let extent = [0, 1].map(|axis| {
            of(axis).iter().fold(0.0f32, |most, a| of(axis).iter().fold(most, |m, b| m.max(a - b)))
        });
        for vertex in corners {
            (0..2).for_each(|axis| sums[*vertex as usize][axis] += extent[axis]);
            counts[*vertex as usize] += 1.0;
        }
    }
    let mean = |(sum, count): (&[f32; 2], &f32)| sum.map(|s| (s / count.max(1.0)).max(1e-3));
    sums.iter().zip(&counts).map(mean).collect()
}

/// Square of the distance between two places of the map, in how far vertices are apart.
pub(super) fn square(a: [f32; 2], b: [f32; 2], apart: [f32; 2]) -> f32 {
    (0..2).map(|i| ((a[i] - b[i]) / apart[i]).powi(2)).sum()
}

/// Rows of triangles from the skin's edge within which pixels hold the vertices' pressure, and the
/// mesh's own dents stay.
pub(super) const HELD_ROWS: u8 = 2;

/// Sides of one triangle alone: the skin's edge.
pub(super) fn edge_sides(atlas: &Atlas) -> Vec<[u32; 2]> {
    let sides = |[a, b, c]: &[u32; 3]| [[*a, *b], [*b, *c], [*c, *a]];
    let all: std::collections::HashSet<[u32; 2]> =
        atlas.triangles().iter().flat_map(sides).collect();
    all.iter().filter(|[a, b]| !all.contains(&[*b, *a])).copied().collect()
}

/// Rows of triangles between each vertex and the skin's edge, up to `most`; a side whose ends both
/// `goes_on` names is no edge.
pub(super) fn rows_from_edge(atlas: &Atlas, goes_on: impl Fn(usize) -> bool, most: u8) -> Vec<u8> {
    let mut rows = vec![most; atlas.vertex_count()];
    for side in edge_sides(atlas) {
        let ends = side.map(|vertex| vertex as usize);
        if !ends.into_iter().all(&goes_on) {
            ends.into_iter().for_each(|vertex| rows[vertex] = 0);
        }
    }
    for row in 1..most {
        for corners in atlas.triangles() {
            if corners.iter().any(|v| rows[*v as usize] == row - 1) {
                for v in corners {
                    rows[*v as usize] = rows[*v as usize].min(row);
                }
            }
        }
    }
    rows
}

/// The triangle's plane.
fn plane(pixel: &papilla_atlas::Pixel) -> PixelStencil {
    let mut stencil = Stencil { vertices: [0; NEAR], weights: [0.0; NEAR] };
    stencil.vertices.fill(pixel.vertices[0] as u16);
    for i in 0..3 {
        (stencil.vertices[i], stencil.weights[i]) = (pixel.vertices[i] as u16, pixel.weights[i]);
    }
    stencil
}

/// None if there are too few neighbours, or they lie to one side.
fn least_squares<const N: usize>(
    at: [f32; 2],
    apart: [f32; 2],
    uv_px: &[[f32; 2]],
    order: &mut Vec<(f32, u16)>,
) -> Option<Stencil<N>> {
    if uv_px.len() <= N {
        return None;
    }
    order.clear();
    let places = uv_px.iter().enumerate();
    order.extend(places.map(|(vertex, uv)| (square(*uv, at, apart), vertex as u16)));
    let by_place = |a: &(f32, u16), b: &(f32, u16)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    let (near, next, _) = order.select_nth_unstable_by(N, by_place);
    near.sort_unstable_by(by_place);
    let reach = f64::from(next.0);
    let mut rows = [[0.0f64; TERMS]; N];
    let mut counts = [0.0f64; N];
    for (i, (away, vertex)) in near.iter().enumerate() {
        let uv = uv_px[usize::from(*vertex)];
        let [x, y] = [0, 1].map(|a| f64::from((uv[a] - at[a]) / apart[a]) / reach.sqrt());
        rows[i] = [1.0, x, y, x * x, x * y, y * y];
        // Nothing at the first vertex that does not count, so that the value has no steps.
        counts[i] = (1.0 - f64::from(*away) / reach).powi(2);
    }
    let mut normal = [[0.0f64; TERMS]; TERMS];
    for (row, count) in rows.iter().zip(counts) {
        for a in 0..TERMS {
            for b in 0..TERMS {
                normal[a][b] += count * row[a] * row[b];
            }
        }
    }
    let first = solve(normal, std::array::from_fn(|i| f64::from(i == 0)))?;
    let weight = |i: usize| counts[i] * (0..TERMS).map(|a| rows[i][a] * first[a]).sum::<f64>();
    let weights: [f64; N] = std::array::from_fn(weight);
    let size: f64 = weights.iter().map(|w| w.abs()).sum();
    (size <= WEIGHTS_MAX).then(|| Stencil {
        vertices: std::array::from_fn(|i| near[i].1),
        weights: weights.map(|w| w as f32),
    })
}

/// Gauss' elimination of a positive definite matrix; none if it is not.
pub(super) fn solve(mut m: [[f64; TERMS]; TERMS], mut b: [f64; TERMS]) -> Option<[f64; TERMS]> {
    for pivot in 0..TERMS {
        if !(m[pivot][pivot] > 1e-9) {
            return None;
        }
        for row in pivot + 1..TERMS {
            let factor = m[row][pivot] / m[pivot][pivot];
            for column in pivot..TERMS {
                m[row][column] -= factor * m[pivot][column];
            }
            b[row] -= factor * b[pivot];
        }
    }
    for row in (0..TERMS).rev() {
        let known: f64 = (row + 1..TERMS).map(|column| m[row][column] * b[column]).sum();
        b[row] = (b[row] - known) / m[row][row];
    }
    Some(b)
}
