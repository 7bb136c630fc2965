//! The part of the skin that things are near: its pixels, and the vertices that move them.

mod gaps;
mod hats;
mod vertices;

use super::{PixelSkin, PixelSpacing};
use crate::answer::Effort;
use crate::kernels::Vectors;
use crate::model::ContactModel;
use crate::objects::View;
use papilla_atlas::MAP_SIDE_PX;

/// Pixels round vertices nearer than this are looked at, reference mm.
const NEAR_MM: f64 = 0.6;
/// Of these, pixels nearer than this can come to touch, reference mm.
const REACH_MM: f64 = 0.2;
/// Pixels of the map between the window and itself, where it repeats.
const BETWEEN: usize = 24;
const NONE: u32 = u32::MAX;

/// Pixels that things are near, and the vertices that move them.
#[derive(Debug)]
pub(super) struct Window {
    /// Entries of the raster, the held ones last, and their cells in the grid.
    pub entries: Vec<u32>,
    held: Vec<u32>,
    pub cells: Vec<u32>,
    /// Slots of the pixels above, below, before and after each.
    pub beside: Vec<[u32; 4]>,
    pub at_mm: Vec<[f32; 3]>,
    pub normal: Vec<[f32; 3]>,
    pub area_mm2: Vec<f32>,
    /// The skin's normal, into the finger.
    inward: Vec<[f32; 3]>,
    gap_mm: Vec<f32>,
    /// How far the object gives way, mm/MPa.
    pub give: Vec<f32>,
    /// Of the pixels that are solved for: gap for a pressure beside the vertices', mm/MPa.
    pub ease: Vec<f32>,
    /// Slot of each pixel of the map.
    slot: Vec<u32>,
    first: [usize; 2],
    size: [usize; 2],
    /// Pixels of the map from one that is solved for to the next, which those are, as bits, and what
    /// a map shows of one.
    step_px: usize,
    solved_for: Vec<u64>,
    shares: Vec<f32>,
    /// Pixels, as bits, that are looked at.
    looked_at: Vec<u64>,
    /// Vertices of the pixels' stencils, and where each stands among them.
    ids: Vec<u32>,
    place: Vec<u32>,
    linear: [Vec<f32>; 3],
    moved: [Vec<f32>; 3],
    /// By vertex of the skin: deformed place, mm, beside which a fourth number keeps it together;
    /// displacement by its own hats, mm; force, N; hat's area, mm2; pressure, MPa; force, N.
    vertices: Vec<[f32; 4]>,
    dent_mm: Vec<f32>,
    pub force_n: [Vec<f32>; 3],
    hat_mm2: Vec<f32>,
    hat_mpa: Vec<f32>,
    hat_n: Vec<f32>,
    /// Vertices under force, and their forces.
    touched: Vec<u32>,
    packed: [Vec<f32>; 3],
    /// Tiles of the compliance under force, and those that are displaced.
    pushing: Vec<u32>,
    is_pushing: Vec<bool>,
    moving: Vec<u32>,
    tile_force: Vec<Vectors>,
    tile_moved: Vec<Vectors>,
}

impl Window {
    pub(super) fn new(skin: &PixelSkin, model: &ContactModel, spacing: PixelSpacing) -> Self {
        let (pixels, vertices) = (skin.raster.pixel_count(), model.vertices());
        let tiles = model.compliance.side();
        let mut solved_for = vec![0; pixels.div_ceil(64)];
        for (entry, index) in skin.raster.indices().iter().enumerate() {
            solved_for[entry / 64] |= u64::from(spacing.takes(*index)) << (entry % 64);
        }
        let zeros = || vec![0.0f32; vertices];
        let vector = || std::array::from_fn(|_| zeros());
        Self {
            entries: Vec::with_capacity(pixels),
            held: Vec::with_capacity(pixels),
            cells: Vec::with_capacity(pixels),
            beside: Vec::with_capacity(pixels),
            at_mm: vec![[0.0; 3]; pixels],
            normal: vec![[0.0; 3]; pixels],
            area_mm2: vec![0.0; pixels],
            inward: vec![[0.0; 3]; pixels],
            gap_mm: vec![0.0; pixels],
            give: vec![0.0; pixels],
            ease: vec![0.0; pixels],
            slot: vec![NONE; MAP_SIDE_PX * MAP_SIDE_PX],
            first: [0; 2],
            size: [0; 2],
            step_px: spacing.px(),
            solved_for,
            shares: spacing.shares(),
            looked_at: vec![0; pixels.div_ceil(64)],
            ids: Vec::with_capacity(vertices),
            place: vec![NONE; vertices],
            linear: vector(),
            moved: vector(),
            vertices: vec![[0.0; 4]; vertices],
            dent_mm: zeros(),
            force_n: vector(),
            hat_mm2: zeros(),
            hat_mpa: zeros(),
            hat_n: zeros(),
            touched: Vec::with_capacity(vertices),
            packed: vector(),
            pushing: Vec::with_capacity(tiles),
            is_pushing: vec![false; tiles],
            moving: Vec::with_capacity(vertices),
            tile_force: vec![Vectors::default(); tiles],
            tile_moved: vec![Vectors::default(); tiles],
        }
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// How many pixels, the first, are solved for; the others are held.
    pub(super) fn free(&self) -> usize {
        self.entries.len() - self.held.len()
    }

    /// Rows that pixels stand in.
    pub(super) fn rows(&self) -> usize {
        self.size[0]
    }

    pub(super) fn size(&self) -> [usize; 2] {
        self.size.map(|s| s + BETWEEN.div_ceil(self.step_px))
    }

    /// Takes the pixels round `candidates`, distances (reference mm) and vertices, that things are
    /// near; false if there are none.
    pub(super) fn open(
        &mut self,
        skin: &PixelSkin,
        model: &ContactModel,
        candidates: &[(f64, u32)],
        view: View<'_>,
        effort: &mut Effort,
    ) -> bool {
        self.close(skin);
        self.look_at(skin, candidates);
        self.take_near(skin, view, effort);
        if self.entries.is_empty() {
            return false;
        }
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for (slot, entry) in self.entries.iter().enumerate() {
            let index = skin.raster.indices()[*entry as usize] as usize;
            self.slot[index] = slot as u32;
            let at = [index / MAP_SIDE_PX, index % MAP_SIDE_PX].map(|i| i / self.step_px);
            for i in 0..2 {
                (low[i], high[i]) = (low[i].min(at[i]), high[i].max(at[i] + 1));
            }
        }
        self.first = low;
        self.size = [high[0] - low[0], high[1] - low[1]];
        for entry in &self.entries {
            let index = skin.raster.indices()[*entry as usize] as usize;
            let steps = [self.step_px * MAP_SIDE_PX, self.step_px];
            let side = |to: Option<usize>| to.and_then(|i| self.slot.get(i)).copied();
            let [up, left] = steps.map(|step| side(index.checked_sub(step)));
            let [down, right] = steps.map(|step| side(Some(index + step)));
            self.beside.push([up, down, left, right].map(|slot| slot.unwrap_or(NONE)));
        }
        self.take_vertices(skin, model);
        true
    }

    /// Forgets the last window.
    fn close(&mut self, skin: &PixelSkin) {
        for entry in self.entries.drain(..) {
            self.slot[skin.raster.indices()[entry as usize] as usize] = NONE;
        }
        for id in self.ids.drain(..) {
            self.place[id as usize] = NONE;
        }
        self.held.clear();
        self.beside.clear();
        self.looked_at.fill(0);
    }

    /// Marks the pixels of triangles with a near corner.
    fn look_at(&mut self, skin: &PixelSkin, candidates: &[(f64, u32)]) {
        for (_, vertex) in candidates.iter().filter(|(free, _)| *free < NEAR_MM) {
            for entry in &skin.around[*vertex as usize] {
                self.looked_at[*entry as usize / 64] |= 1 << (entry % 64);
            }
        }
    }

    /// Takes those of them that things are near. A distance changes no faster than a place, so
    /// that most follow from the one before.
    fn take_near(&mut self, skin: &PixelSkin, view: View<'_>, effort: &mut Effort) {
        let mut asked: Option<([f32; 3], f64)> = None;
        for (word, (bits, solved_for)) in self.looked_at.iter().zip(&self.solved_for).enumerate() {
            let mut bits = bits & solved_for;
            while bits != 0 {
                let entry = 64 * word + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let at = skin.rest_mm[entry];
                let told = asked.and_then(|(from, gap_mm)| {
                    let square: f32 = (0..3).map(|i| (at[i] - from[i]).powi(2)).sum();
                    let away = f64::from(square.sqrt());
                    let is_near = gap_mm + away < REACH_MM;
                    (is_near || gap_mm - away > REACH_MM).then_some(is_near)
                });
                let is_near = told.unwrap_or_else(|| {
                    effort.distances += 1;
                    let nearest = view.nearest_at(at.map(f64::from));
                    let gap_mm = nearest.map_or(f64::INFINITY, |nearest| nearest.gap_mm);
                    asked = Some((at, gap_mm));
                    gap_mm < REACH_MM
                });
                if is_near {
                    let ease = skin.ease[entry];
                    if ease.is_finite() {
                        self.ease[self.entries.len()] = ease;
                        self.entries.push(entry as u32);
                    } else {
                        self.held.push(entry as u32);
                    }
                }
            }
        }
        self.entries.extend(&self.held);
    }

    /// Whether skin at rest lies in a thing at any of the pixels.
    pub(super) fn is_inside_at_rest(
        &self,
        skin: &PixelSkin,
        view: View<'_>,
        effort: &mut Effort,
    ) -> bool {
        self.entries.iter().any(|entry| {
            effort.distances += 1;
            let nearest = view.nearest_at(skin.rest_mm[*entry as usize].map(f64::from));
            nearest.is_some_and(|nearest| nearest.gap_mm < 0.0)
        })
    }

    /// Takes the vertices of the pixels' stencils, and of their triangles.
    fn take_vertices(&mut self, skin: &PixelSkin, model: &ContactModel) {
        self.moving.clear();
        for entry in &self.entries {
            let corners = skin.raster.pixels()[*entry as usize].vertices.map(|v| v as u16);
            for vertex in skin.stencils[*entry as usize].vertices.iter().chain(&corners) {
                let place = &mut self.place[usize::from(*vertex)];
                if *place == NONE {
                    *place = self.ids.len() as u32;
                    self.ids.push(u32::from(*vertex));
                    let [tile, _] = model.compliance.place(usize::from(*vertex));
                    self.moving.push(tile as u32);
                }
            }
        }
        self.moving.sort_unstable();
        self.moving.dedup();
    }

    pub(super) fn number_cells(&mut self, skin: &PixelSkin, [rows, columns]: [usize; 2]) {
        self.cells.clear();
        for entry in &self.entries {
            let index = skin.raster.indices()[*entry as usize] as usize;
            let row = (index / MAP_SIDE_PX / self.step_px - self.first[0]) % rows;
            let column = (index % MAP_SIDE_PX / self.step_px - self.first[1]) % columns;
            self.cells.push((row * columns + column) as u32);
        }
    }

    /// Places the pixels, and finds their deformed areas.
    pub(super) fn place(&mut self, skin: &PixelSkin, model: &ContactModel) {
        for (slot, entry) in self.entries.iter().enumerate() {
            let [x, y, z, _] = skin.stencils[*entry as usize].vector(&self.vertices);
            self.at_mm[slot] = [x, y, z];
        }
        self.measure_planes(skin, model);
    }

    fn measure_planes(&mut self, skin: &PixelSkin, model: &ContactModel) {
        for slot in 0..self.entries.len() {
            let [a, b] = self.across(slot);
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

    /// From one pixel to the next, mm, down and along rows.
    fn across(&self, slot: usize) -> [[f32; 3]; 2] {
        let [up, down, left, right] = self.beside[slot];
        [[up, down], [left, right]].map(|sides| {
            let apart = sides.iter().filter(|side| **side != NONE).count() as f32;
            let at = |side: u32| self.at_mm[if side == NONE { slot } else { side as usize }];
            let [from, to] = sides.map(at);
            std::array::from_fn(|i| (to[i] - from[i]) / apart.max(1.0))
        })
    }

    /// Mean distance of neighbouring pixels under pressure, down and along rows, mm.
    pub(super) fn pitch_mm(&self, pressure: &[f32]) -> [f64; 2] {
        let pressed = pressure[..self.len()].iter().any(|p| *p > 0.0);
        let (mut sums, mut count) = ([0.0f64; 2], 0.0);
        for slot in (0..self.len()).filter(|slot| !pressed || pressure[*slot] > 0.0) {
            for (sum, by) in sums.iter_mut().zip(self.across(slot)) {
                *sum += f64::from(by.iter().map(|v| v * v).sum::<f32>().sqrt());
            }
            count += 1.0;
        }
        sums.map(|sum| (sum / count).max(1e-3))
    }

    /// Adds a pixel's pressure to the means over pixels of pressure that is a cubic between those that
    /// are solved for.
    pub(super) fn spread(&self, skin: &PixelSkin, index: usize, pressure: f32, map: &mut [f32]) {
        let mask = skin.raster.mask();
        let first = (self.shares.len() / 2) * (MAP_SIDE_PX + 1);
        for (row, a) in self.shares.iter().enumerate() {
            for (column, b) in self.shares.iter().enumerate() {
                let to = (index + row * MAP_SIDE_PX + column).checked_sub(first);
                // What would leave the skin stays.
                let to = to.filter(|to| mask.get(*to) == Some(&true)).unwrap_or(index);
                map[to] += a * b * pressure;
            }
        }
    }
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
