//! The part of the skin that things are near: its pixels, and the vertices that move them.

mod gaps;
mod hats;
mod vertices;

use super::PixelSkin;
use crate::answer::Effort;
use crate::model::ContactModel;
use crate::objects::View;
use papilla_atlas::MAP_SIDE_PX;

/// Pixels round vertices nearer than this are looked at, reference mm.
const NEAR_MM: f64 = 0.6;
/// Of these, pixels nearer than this can come to touch, reference mm.
const REACH_MM: f64 = 0.2;
/// Pixels between the window and itself, where it repeats.
const BETWEEN: usize = 24;
const NONE: u32 = u32::MAX;

/// Pixels that things are near, and the vertices that move them.
#[derive(Debug)]
pub(super) struct Window {
    /// Entries of the raster, the held ones last, and their cells in the grid.
    pub entries: Vec<u32>,
    held: Vec<u32>,
    pub cells: Vec<u32>,
    pub at_mm: Vec<[f32; 3]>,
    pub normal: Vec<[f32; 3]>,
    pub area_mm2: Vec<f32>,
    /// The skin's normal, into the finger.
    inward: Vec<[f32; 3]>,
    gap_mm: Vec<f32>,
    /// How far the object gives way, mm/MPa.
    pub give: Vec<f32>,
    /// Slot of each pixel of the map.
    slot: Vec<u32>,
    first: [usize; 2],
    size: [usize; 2],
    /// Vertices of the pixels' stencils, and where each stands among them.
    ids: Vec<u32>,
    place: Vec<u32>,
    near: Vec<bool>,
    linear: [Vec<f32>; 3],
    moved: [Vec<f32>; 3],
    /// By vertex of the skin: displacement by its own hats, mm; force, N; hat's area, mm2; pressure,
    /// MPa.
    dent_mm: Vec<f32>,
    pub force_n: [Vec<f32>; 3],
    hat_mm2: Vec<f32>,
    hat_n: Vec<f32>,
    touched: Vec<u32>,
    packed: [Vec<f32>; 3],
    /// Forces by the compliance's columns, and where they are not 0.
    dense: [Vec<f32>; 3],
    blocks: Vec<bool>,
    runs: Vec<[usize; 2]>,
}

impl Window {
    pub(super) fn new(pixels: usize, vertices: usize) -> Self {
        let zeros = || vec![0.0f32; vertices];
        let vector = || std::array::from_fn(|_| zeros());
        Self {
            entries: Vec::with_capacity(pixels),
            held: Vec::with_capacity(pixels),
            cells: Vec::with_capacity(pixels),
            at_mm: vec![[0.0; 3]; pixels],
            normal: vec![[0.0; 3]; pixels],
            area_mm2: vec![0.0; pixels],
            inward: vec![[0.0; 3]; pixels],
            gap_mm: vec![0.0; pixels],
            give: vec![0.0; pixels],
            slot: vec![NONE; MAP_SIDE_PX * MAP_SIDE_PX],
            first: [0; 2],
            size: [0; 2],
            ids: Vec::with_capacity(vertices),
            place: vec![NONE; vertices],
            near: vec![false; vertices],
            linear: vector(),
            moved: vector(),
            dent_mm: zeros(),
            force_n: vector(),
            hat_mm2: zeros(),
            hat_n: zeros(),
            touched: Vec::with_capacity(vertices),
            packed: vector(),
            dense: vector(),
            blocks: vec![false; vertices.div_ceil(vertices::BLOCK)],
            runs: Vec::with_capacity(vertices.div_ceil(vertices::BLOCK)),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// How many pixels, the first, are solved for; the others are held.
    pub(super) fn free(&self) -> usize {
        self.entries.len() - self.held.len()
    }

    pub(super) fn size(&self) -> [usize; 2] {
        self.size.map(|s| s + BETWEEN)
    }

    /// Takes the pixels round `candidates`, distances (reference mm) and vertices, that things are
    /// near; false if there are none.
    pub(super) fn open(
        &mut self,
        skin: &PixelSkin,
        candidates: &[(f64, u32)],
        view: View<'_>,
        effort: &mut Effort,
    ) -> bool {
        self.entries.clear();
        self.held.clear();
        self.ids.clear();
        if candidates.is_empty() {
            return false;
        }
        self.near.fill(false);
        self.slot.fill(NONE);
        self.place.fill(NONE);
        for (_, vertex) in candidates.iter().filter(|(free, _)| *free < NEAR_MM) {
            self.near[*vertex as usize] = true;
        }
        for (entry, pixel) in skin.raster.pixels().iter().enumerate() {
            if !pixel.vertices.iter().any(|v| self.near[*v as usize]) {
                continue;
            }
            effort.distances += 1;
            let nearest = view.nearest_at(skin.rest_mm[entry].map(f64::from));
            if nearest.is_some_and(|nearest| nearest.gap_mm < REACH_MM) {
                let is_held = pixel.vertices.iter().any(|v| skin.at_edge[*v as usize]);
                if is_held { &mut self.held } else { &mut self.entries }.push(entry as u32);
            }
        }
        self.entries.extend(&self.held);
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for (slot, entry) in self.entries.iter().enumerate() {
            let entry = *entry as usize;
            let (pixel, index) = (&skin.raster.pixels()[entry], skin.raster.indices()[entry]);
            self.slot[index as usize] = slot as u32;
            let at = [index as usize / MAP_SIDE_PX, index as usize % MAP_SIDE_PX];
            for i in 0..2 {
                (low[i], high[i]) = (low[i].min(at[i]), high[i].max(at[i] + 1));
            }
            let corners = pixel.vertices.map(|v| v as u16);
            for vertex in skin.stencils[entry].vertices.iter().chain(&corners) {
                if self.place[usize::from(*vertex)] == NONE {
                    self.place[usize::from(*vertex)] = self.ids.len() as u32;
                    self.ids.push(u32::from(*vertex));
                }
            }
        }
        if self.entries.is_empty() {
            return false;
        }
        self.first = low;
        self.size = [high[0] - low[0], high[1] - low[1]];
        true
    }

    pub(super) fn number_cells(&mut self, rows: usize, columns: usize) {
        self.cells.clear();
        self.cells.resize(self.entries.len(), 0);
        for (index, slot) in self.slot.iter().enumerate().filter(|(_, slot)| **slot != NONE) {
            let row = (index / MAP_SIDE_PX - self.first[0]) % rows;
            let column = (index % MAP_SIDE_PX - self.first[1]) % columns;
            self.cells[*slot as usize] = (row * columns + column) as u32;
        }
    }

    /// Places the pixels, and finds their deformed areas.
    pub(super) fn place(&mut self, skin: &PixelSkin, model: &ContactModel) {
        for (slot, entry) in self.entries.iter().enumerate() {
            let stencil = &skin.stencils[*entry as usize];
            self.at_mm[slot] = std::array::from_fn(|i| {
                stencil.value(|vertex| {
                    let moved = self.moved[i][self.place[vertex] as usize];
                    model.positions_mm[vertex][i] as f32 + moved
                })
            });
        }
        self.measure_planes(skin, model);
    }

    fn measure_planes(&mut self, skin: &PixelSkin, model: &ContactModel) {
        for slot in 0..self.entries.len() {
            let index = skin.raster.indices()[self.entries[slot] as usize] as usize;
            let [a, b] = [MAP_SIDE_PX, 1].map(|step| self.across(index, slot, step));
            let n = cross(a, b);
            let area = n.iter().map(|v| v * v).sum::<f32>().sqrt();
            self.area_mm2[slot] = area;
            let vertex = skin.raster.pixels()[self.entries[slot] as usize].vertices[0] as usize;
            let outward = model.normals[vertex];
            // A pixel without neighbours has no plane.
            self.inward[slot] = if area > 0.0 {
                let along: f32 = n.iter().zip(outward).map(|(a, b)| a * b).sum();
                n.map(|v| -v * along.signum() / area)
            } else {
                outward.map(|v| -v)
            };
        }
    }

    /// From one pixel to the next, mm, along rows or columns.
    fn across(&self, index: usize, slot: usize, step: usize) -> [f32; 3] {
        let side = |to: Option<usize>| {
            to.and_then(|i| self.slot.get(i)).filter(|s| **s != NONE).map(|s| *s as usize)
        };
        let (before, after) = (side(index.checked_sub(step)), side(index.checked_add(step)));
        let apart = f32::from(u8::from(before.is_some()) + u8::from(after.is_some()));
        let [from, to] = [before, after].map(|s| self.at_mm[s.unwrap_or(slot)]);
        std::array::from_fn(|i| (to[i] - from[i]) / apart.max(1.0))
    }

    /// Mean distance of neighbouring pixels under pressure, down and along rows, mm.
    pub(super) fn pitch_mm(&self, pressure: &[f32]) -> [f64; 2] {
        let pressed = pressure[..self.len()].iter().any(|p| *p > 0.0);
        let (mut sums, mut count) = ([0.0f64; 2], 0.0);
        for (index, slot) in self.slot.iter().enumerate().filter(|(_, slot)| **slot != NONE) {
            let slot = *slot as usize;
            if pressed && !(pressure[slot] > 0.0) {
                continue;
            }
            for (sum, step) in sums.iter_mut().zip([MAP_SIDE_PX, 1]) {
                let by = self.across(index, slot, step);
                *sum += f64::from(by.iter().map(|v| v * v).sum::<f32>().sqrt());
            }
            count += 1.0;
        }
        sums.map(|sum| (sum / count).max(1e-3))
    }

    /// Adds a pixel's pressure to the means over pixels of pressure that is linear between them.
    pub(super) fn spread(&self, skin: &PixelSkin, index: usize, pressure: f32, map: &mut [f32]) {
        const SHARE: [f32; 3] = [0.125, 0.75, 0.125];
        let mask = skin.raster.mask();
        for (row, a) in SHARE.iter().enumerate() {
            for (column, b) in SHARE.iter().enumerate() {
                let to = (index + row * MAP_SIDE_PX + column).checked_sub(MAP_SIDE_PX + 1);
                // What would leave the skin stays.
                let to = to.filter(|to| mask.get(*to) == Some(&true)).unwrap_or(index);
                map[to] += a * b * pressure;
            }
        }
    }

    /// Places and areas of the pixels at rest.
    pub(super) fn start(&mut self, skin: &PixelSkin, model: &ContactModel) {
        for (slot, entry) in self.entries.iter().enumerate() {
            self.at_mm[slot] = skin.rest_mm[*entry as usize];
        }
        self.measure_planes(skin, model);
    }
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
