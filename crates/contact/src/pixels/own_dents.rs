//! Replaces the dent that a force at a vertex makes in the mesh by that of the layered skin.
//!
//! A force at a vertex of linear elements moves that vertex 2.3 times as far as the same force
//! moves layered skin, when it is spread over the vertex' hat function; its neighbours move too
//! little. In the difference `C - K` of the compliances of mesh and layers, only what is far away
//! belongs to the finger. It is smooth, but for the surroundings of the force. There it is
//! continued by the polynomial of second degree through the values around.
//!
//! Under an even load the mesh moves as far as it should, since such dents only add up. So a
//! correction makes no volume: what it takes away near the force is given back at some more
//! vertices. A dot then gets the dent of the layers, and a plate the stiffness of the mesh.

use super::convolution::{Cells, Convolution, Plans};
use super::mirror::Mirror;
use super::smooth::{HELD_ROWS, Stencil, TERMS, solve, square};
use crate::layers::SurfaceCompliance;
use crate::model::ContactModel;
use papilla_atlas::{MAP_SIDE_PX, Raster};
use std::cmp::Ordering;
use std::sync::Arc;

/// Vertices that dent otherwise: the one that is pressed and those round it.
const NEAR: usize = 9;
/// Vertices on which the volume of that is made up for.
const EVEN: usize = 20;
/// Vertices up to the end of the ring from which the polynomial comes.
const FAR: usize = 36;
/// Pixels of the window beyond the ring.
const BEYOND: usize = 12;

/// By force along the normal of a vertex: what its neighbours move more along theirs, mm/N.
pub(super) type Correction = Stencil<EVEN>;

/// A vertex, or its image behind the skin's mirror, near one that is pressed.
struct Near {
    /// Square of the distance, in how far vertices are apart.
    away: f32,
    vertex: u16,
    is_image: bool,
    uv_px: [f32; 2],
}

impl Near {
    fn order(&self, other: &Self) -> Ordering {
        let by_vertex = self.vertex.cmp(&other.vertex).then(self.is_image.cmp(&other.is_image));
        self.away.total_cmp(&other.away).then(by_vertex)
    }
}

/// What corrections are made of.
pub(super) struct OwnDents<'a> {
    pub model: &'a ContactModel,
    pub uv_px: &'a [[f32; 2]],
    /// How far vertices are apart round each of them, px.
    pub apart: &'a [[f32; 2]],
    pub mirror: &'a Mirror,
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
        let none = Correction { vertices: [0; EVEN], weights: [0.0; EVEN] };
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
        let away = |place: &Near, axis: usize| (place.uv_px[axis] - self.uv_px[vertex][axis]).abs();
        let reach = near.iter().flat_map(|n| [away(n, 0), away(n, 1)]).fold(0.0, f32::max);
        let side = 2 * (reach.ceil() as usize + BEYOND);
        convolution.open([side; 2], usize::MAX, pitch_mm, surface);
        // Square, as the plans of both ways are the same.
        let side = convolution.columns();
        let first = self.uv_px[vertex].map(|c| c.floor() as i64 - side as i64 / 2);
        let last = side as i64 - 1;
        let at = |row: i64, column: i64| {
            let column = (column - first[0]).clamp(0, last);
            ((row - first[1]) * side as i64 + column) as u32
        };
        let (mut cells, mut images) = (Vec::new(), Vec::new());
        for (i, (entry, _)) in hat.iter().enumerate() {
            let index = self.raster.indices()[*entry] as usize;
            let [row, column] = [index / MAP_SIDE_PX, index % MAP_SIDE_PX];
            cells.push(at((row as i64).clamp(first[1], first[1] + last), column as i64));
            let image = self.mirror.image_row(row, column).map(|row| row as i64);
            if let Some(row) = image.filter(|row| *row <= first[1] + last) {
                images.push([i as u32, at(row, column as i64)]);
            }
        }
        let force_n = total * pitch_mm[0] * pitch_mm[1];
        let pressure: Vec<f32> =
            hat.iter().map(|(_, w)| (f64::from(*w) / force_n) as f32).collect();
        let grid = convolution.press(Cells { own: &cells, images: &images }, &pressure);
        self.go_on(vertex, &near, |other| {
            let own = read(grid, side, first, self.uv_px[usize::from(other)]);
            self.compliance(usize::from(other), vertex) - own
        })
    }

    /// A vertex and those round it, and their images, the nearest first; none if there are too few.
    fn near(&self, vertex: usize) -> Option<Vec<Near>> {
        let at = self.uv_px[vertex];
        let place = |other: usize, uv_px: [f32; 2], is_image: bool| {
            let away = square(uv_px, at, self.apart[vertex]);
            Near { away, vertex: other as u16, is_image, uv_px }
        };
        let own = self.uv_px.iter().enumerate().map(|(v, uv)| place(v, *uv, false));
        let image = |v: usize| Some(place(v, self.mirror.image_px(v, self.uv_px[v])?, true));
        let mut order: Vec<Near> = own.chain((0..self.uv_px.len()).filter_map(image)).collect();
        if order.len() < FAR {
            return None;
        }
        order.select_nth_unstable_by(FAR - 1, Near::order);
        order.truncate(FAR);
        order.sort_unstable_by(Near::order);
        Some(order)
    }

    /// What a field that is smooth round a vertex and its image, but not at them, differs from its
    /// own continuation by at the vertex and its neighbours; in all as much volume as nothing.
    fn go_on(
        &self,
        vertex: usize,
        near: &[Near],
        field: impl Fn(u16) -> f64,
    ) -> Option<Correction> {
        let (at, apart) = (self.uv_px[vertex], self.apart[vertex]);
        let reach = near.last()?.away.sqrt();
        let row = |place: &Near| {
            let [x, y] = [0, 1].map(|a| f64::from((place.uv_px[a] - at[a]) / (apart[a] * reach)));
            [1.0, x, y, x * x, x * y, y * y]
        };
        let rows: Vec<[f64; TERMS]> = near.iter().map(row).collect();
        let values: Vec<f64> = near.iter().map(|place| field(place.vertex)).collect();
        let polynomial = through_ring(near, &rows, &values)?;
        let goes_on = |i: usize| (0..TERMS).map(|a| polynomial[a] * rows[i][a]).sum::<f64>();
        let off = |i: usize| if i < NEAR { goes_on(i) - values[i] } else { 0.0 };
        // Of an image nothing is corrected: the skin is the finger's.
        let area_mm2 = |i: usize| {
            let area_mm2 = f64::from(self.model.areas_mm2[usize::from(near[i].vertex)]);
            if near[i].is_image { 0.0 } else { area_mm2 }
        };
        let volume: f64 = (0..NEAR).map(|i| area_mm2(i) * off(i)).sum();
        let even = volume / (0..EVEN).map(area_mm2).sum::<f64>();
        let weight = |i: usize| if near[i].is_image { 0.0 } else { off(i) - even };
        Some(Correction {
            vertices: std::array::from_fn(|i| near[i].vertex),
            weights: std::array::from_fn(|i| weight(i) as f32),
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

/// The polynomial through what is round a vertex, and round its image.
fn through_ring(near: &[Near], rows: &[[f64; TERMS]], values: &[f64]) -> Option<[f64; TERMS]> {
    // The image's neighbours are the neighbours' images.
    let dents_image = |place: &Near| {
        let is_image_of = |d: &Near| d.vertex == place.vertex && d.is_image != place.is_image;
        near[..NEAR].iter().any(is_image_of)
    };
    let (mut normal, mut side) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
    for (i, row) in rows.iter().enumerate().skip(NEAR) {
        if dents_image(&near[i]) {
            continue;
        }
        for a in 0..TERMS {
            side[a] += row[a] * values[i];
            for b in 0..TERMS {
                normal[a][b] += row[a] * row[b];
            }
        }
    }
    solve(normal, side)
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
