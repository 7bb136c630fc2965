//! What a force at a vertex does to its own neighbourhood: the skin's dent in place of the mesh's.
//!
//! A force at a vertex of linear elements moves that vertex 2.3 times as far as pressure on its hat
//! moves layered skin, and its neighbours too little. The difference `C - K` of the two
//! compliances, of which only what is far away is the finger's, is smooth but for that. Near
//! the force it goes on as the polynomial of second degree through what is round it.

use super::convolution::{Convolution, Plans};
use super::smooth::{HELD_ROWS, Stencil, TERMS, solve, square};
use crate::layers::SurfaceCompliance;
use crate::model::ContactModel;
use papilla_atlas::{MAP_SIDE_PX, Raster};
use std::sync::Arc;

/// Vertices whose displacement is corrected: the one that is pressed and those round it.
const NEAR: usize = 9;
/// Vertices up to the end of the ring from which the polynomial comes.
const FAR: usize = 36;
/// Pixels of the window beyond the ring.
const BEYOND: usize = 12;

/// By force along the normal of a vertex: what its neighbours move more along theirs, mm/N.
pub(super) type Correction = Stencil<NEAR>;

/// What corrections are made of.
pub(super) struct OwnDents<'a> {
    pub model: &'a ContactModel,
    pub uv_px: &'a [[f32; 2]],
    /// How far vertices are apart round each of them, px.
    pub apart: &'a [[f32; 2]],
    pub raster: &'a Raster,
    /// Places of the pixels at rest.
    pub rest_mm: &'a [[f32; 3]],
}

impl OwnDents<'_> {
    /// A correction for each vertex; none for those at the skin's edge.
    pub(super) fn corrections(
        &self,
        surface: &SurfaceCompliance,
        plans: &Arc<Plans>,
        rows_from_edge: &[u8],
    ) -> Vec<Correction> {
        let mut hats = vec![Vec::new(); self.uv_px.len()];
        for (entry, pixel) in self.raster.pixels().iter().enumerate() {
            for (vertex, weight) in pixel.vertices.iter().zip(pixel.weights) {
                hats[*vertex as usize].push((entry, weight));
            }
        }
        let mut slot = vec![None; MAP_SIDE_PX * MAP_SIDE_PX];
        for (entry, index) in self.raster.indices().iter().enumerate() {
            slot[*index as usize] = Some(entry);
        }
        let mut convolution = Convolution::new(Arc::clone(plans));
        let none = Correction { vertices: [0; NEAR], weights: [0.0; NEAR] };
        let of = |vertex: usize| {
            let hat = &hats[vertex];
            if rows_from_edge[vertex] < HELD_ROWS || hat.is_empty() {
                return none;
            }
            self.correction(vertex, hat, &slot, surface, &mut convolution).unwrap_or(none)
        };
        (0..self.uv_px.len()).map(of).collect()
    }

    fn correction(
        &self,
        vertex: usize,
        hat: &[(usize, f32)],
        slot: &[Option<usize>],
        surface: &SurfaceCompliance,
        convolution: &mut Convolution,
    ) -> Option<Correction> {
        let pitch = |entry: usize, step: usize| {
            let index = self.raster.indices()[entry] as usize;
            let side = |to: Option<usize>| to.and_then(|i| *slot.get(i)?);
            let ends = [side(index.checked_sub(step)), side(index.checked_add(step))];
            let apart = ends.iter().flatten().count();
            let [a, b] = ends.map(|e| self.rest_mm[e.unwrap_or(entry)]);
            let length = (0..3).map(|i| f64::from(b[i] - a[i]).powi(2)).sum::<f64>().sqrt();
            length / apart.max(1) as f64
        };
        let total: f64 = hat.iter().map(|(_, w)| f64::from(*w)).sum();
        let mean = |step: usize| {
            hat.iter().map(|(e, w)| f64::from(*w) * pitch(*e, step)).sum::<f64>() / total
        };
        let pitch_mm = [MAP_SIDE_PX, 1].map(mean);
        let near = self.near(vertex)?;
        let away = |other: &u16, axis: usize| {
            (self.uv_px[usize::from(*other)][axis] - self.uv_px[vertex][axis]).abs()
        };
        let reach = near.iter().flat_map(|(_, v)| [away(v, 0), away(v, 1)]).fold(0.0, f32::max);
        let side = 2 * (reach.ceil() as usize + BEYOND);
        convolution.open([side; 2], usize::MAX, pitch_mm, surface);
        // Square, as the plans of both ways are the same.
        let side = convolution.columns();
        let first = self.uv_px[vertex].map(|c| c.floor() as i64 - side as i64 / 2);
        let cell = |(entry, _): &(usize, f32)| {
            let index = self.raster.indices()[*entry] as i64;
            let [row, column] = [index / MAP_SIDE_PX as i64, index % MAP_SIDE_PX as i64];
            let row = (row - first[1]).clamp(0, side as i64 - 1);
            let column = (column - first[0]).clamp(0, side as i64 - 1);
            (row * side as i64 + column) as u32
        };
        let cells: Vec<u32> = hat.iter().map(cell).collect();
        let force_n = total * pitch_mm[0] * pitch_mm[1];
        let pressure: Vec<f32> =
            hat.iter().map(|(_, w)| (f64::from(*w) / force_n) as f32).collect();
        let grid = convolution.press(&cells, &pressure);
        self.go_on(vertex, &near, |other| {
            let own = read(grid, side, first, self.uv_px[usize::from(other)]);
            self.compliance(usize::from(other), vertex) - own
        })
    }

    /// A vertex and those round it, with the squares of their distances, in how far vertices are
    /// apart; none if there are too few.
    fn near(&self, vertex: usize) -> Option<Vec<(f32, u16)>> {
        let at = self.uv_px[vertex];
        let mut order: Vec<(f32, u16)> = self
            .uv_px
            .iter()
            .enumerate()
            .map(|(v, uv)| (square(*uv, at, self.apart[vertex]), v as u16))
            .collect();
        if order.len() < FAR {
            return None;
        }
        let by_place = |a: &(f32, u16), b: &(f32, u16)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        order.select_nth_unstable_by(FAR - 1, by_place);
        order.truncate(FAR);
        order.sort_unstable_by(by_place);
        Some(order)
    }

    /// What a field that is smooth round a vertex, but not at it, differs from its own continuation
    /// by at the vertex and its neighbours.
    fn go_on(
        &self,
        vertex: usize,
        near: &[(f32, u16)],
        field: impl Fn(u16) -> f64,
    ) -> Option<Correction> {
        let (at, apart) = (self.uv_px[vertex], self.apart[vertex]);
        let reach = near.last()?.0.sqrt();
        let row = |(_, v): &(f32, u16)| {
            let uv = self.uv_px[usize::from(*v)];
            let [x, y] = [0, 1].map(|a| f64::from((uv[a] - at[a]) / (apart[a] * reach)));
            [1.0, x, y, x * x, x * y, y * y]
        };
        let rows: Vec<[f64; TERMS]> = near.iter().map(row).collect();
        let values: Vec<f64> = near.iter().map(|(_, v)| field(*v)).collect();
        let (mut normal, mut side) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
        for (row, due) in rows.iter().zip(&values).skip(NEAR) {
            for a in 0..TERMS {
                side[a] += row[a] * due;
                for b in 0..TERMS {
                    normal[a][b] += row[a] * row[b];
                }
            }
        }
        let polynomial = solve(normal, side)?;
        let goes_on = |i: usize| (0..TERMS).map(|a| polynomial[a] * rows[i][a]).sum::<f64>();
        Some(Correction {
            vertices: std::array::from_fn(|i| near[i].1),
            weights: std::array::from_fn(|i| (goes_on(i) - values[i]) as f32),
        })
    }

    /// Displacement of a vertex along its normal under a force along another one's, mm/N.
    fn compliance(&self, to: usize, from: usize) -> f64 {
        let pair = self.model.compliance.pair(to, from);
        let [n, m] = [to, from].map(|vertex| self.model.normals[vertex]);
        let along = |a: usize| (0..3).map(|b| n[a] * pair[3 * a + b] * m[b]).sum::<f32>();
        f64::from((0..3).map(along).sum::<f32>())
    }
}

/// Displacement at a place of the map, of a square window that begins at `first`, mm.
fn read(grid: &[f32], side: usize, first: [i64; 2], [u, v]: [f32; 2]) -> f64 {
    let [x, y] = [u - 0.5 - first[0] as f32, v - 0.5 - first[1] as f32];
    let (left, top) = (x.floor(), y.floor());
    let at = |down: f32, right: f32| {
        let row = (top + down).rem_euclid(side as f32) as usize;
        let column = (left + right).rem_euclid(side as f32) as usize;
        f64::from(grid[row * side + column])
    };
    let (a, b) = (f64::from(x - left), f64::from(y - top));
    (1.0 - b) * ((1.0 - a) * at(0.0, 0.0) + a * at(0.0, 1.0))
        + b * ((1.0 - a) * at(1.0, 0.0) + a * at(1.0, 1.0))
}
