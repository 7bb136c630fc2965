//! The window: the part of the skin near objects, its pixels, and the vertices that move them.

mod close;
mod creases;
mod gaps;
mod hats;
mod known;
mod taken;
mod vertices;

use super::convolution::Cells;
use super::{PixelSkin, PixelSpacing};
use crate::model::ContactModel;
use crate::push::Push;
use close::Close;
use known::Known;
use papilla_atlas::MAP_SIDE_PX;
use papilla_vector::single::cross;

/// Pixels of the map between the window and itself, where it repeats.
const BETWEEN: usize = 24;
const NONE: u32 = u32::MAX;
/// Units of work that a pixel takes when a window is opened, and in each round.
const OPEN: usize = 100;
const PLACE: usize = 200;

/// Pixels that things are near, and the vertices that move them.
#[derive(Debug)]
pub(super) struct Window {
    /// Entries of the raster, the held ones last, and their cells in the grid.
    pub entries: Vec<u32>,
    held: Vec<u32>,
    cells: Vec<u32>,
    /// Row in which images end; 0 where no pixel is near the mirror.
    images_end: usize,
    /// Slots of the pixels that have an image behind the skin's [`Mirror`](super::mirror::Mirror),
    /// and the images' cells.
    images: Vec<[u32; 2]>,
    /// Slots of the pixels above, below, before and after each.
    pub beside: Vec<[u32; 4]>,
    pub at_mm: Vec<[f32; 3]>,
    /// Directions of the force of their pressure: the object's normal, or that of the skin as far as the
    /// object does not lie across it.
    pub normal: Vec<[f32; 3]>,
    pub area_mm2: Vec<f32>,
    /// The skin's normal, into the finger.
    inward: Vec<[f32; 3]>,
    gap_mm: Vec<f32>,
    /// How far pixels move by themselves, beside the vertices round them, mm along `inward`.
    own_mm: Vec<f32>,
    /// How far the object gives way, mm/MPa.
    pub give: Vec<f32>,
    /// Coefficient of friction of the object.
    pub friction: Vec<f32>,
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
    /// Pixels, as bits, all of whose shares lie on the skin.
    is_inner: Vec<u64>,
    /// What is known of them at rest.
    known: Known,
    /// Pixels, as bits, that are looked at.
    looked_at: Vec<u64>,
    /// Vertices of the pixels' stencils, and where each stands among them.
    pub ids: Vec<u32>,
    place: Vec<u32>,
    linear: [Vec<f32>; 3],
    moved: [Vec<f32>; 3],
    /// By vertex of the skin: deformed place, mm, beside which a fourth number keeps it together;
    /// displacement by its own hats, mm; normal force, N; hat's area, mm2; pressure, MPa; force, N.
    vertices: Vec<[f32; 4]>,
    dent_mm: Vec<f32>,
    pub force_n: [Vec<f32>; 3],
    /// By vertex of the skin: force along it, N; 0 where nothing has friction.
    pub shear_n: [Vec<f32>; 3],
    hat_mm2: Vec<f32>,
    hat_mpa: Vec<f32>,
    hat_n: Vec<f32>,
    push: Push,
    close: Close,
    /// Tiles of the compliance that are displaced.
    moving: Vec<u32>,
}

impl Window {
    pub(super) fn new(skin: &PixelSkin, model: &ContactModel, spacing: PixelSpacing) -> Self {
        let (pixels, vertices) = (skin.raster.pixel_count(), model.vertices());
        let mut solved_for = vec![0; pixels.div_ceil(64)];
        for (entry, index) in skin.raster.indices().iter().enumerate() {
            solved_for[entry / 64] |= u64::from(spacing.takes(*index)) << (entry % 64);
        }
        let zeros = || vec![0.0f32; vertices];
        let vector = || std::array::from_fn(|_| zeros());
        let mut window = Self {
            entries: Vec::with_capacity(pixels),
            held: Vec::with_capacity(pixels),
            cells: Vec::with_capacity(pixels),
            images_end: 0,
            images: Vec::with_capacity(pixels),
            beside: Vec::with_capacity(pixels),
            at_mm: vec![[0.0; 3]; pixels],
            normal: vec![[0.0; 3]; pixels],
            area_mm2: vec![0.0; pixels],
            inward: vec![[0.0; 3]; pixels],
            gap_mm: vec![0.0; pixels],
            own_mm: vec![0.0; pixels],
            give: vec![0.0; pixels],
            friction: vec![0.0; pixels],
            ease: vec![0.0; pixels],
            slot: vec![NONE; MAP_SIDE_PX * MAP_SIDE_PX],
            first: [0; 2],
            size: [0; 2],
            step_px: spacing.px(),
            solved_for,
            shares: spacing.shares(),
            is_inner: vec![0; pixels.div_ceil(64)],
            known: Known::new(&skin.rest_mm),
            looked_at: vec![0; pixels.div_ceil(64)],
            ids: Vec::with_capacity(vertices),
            place: vec![NONE; vertices],
            linear: vector(),
            moved: vector(),
            vertices: vec![[0.0; 4]; vertices],
            dent_mm: zeros(),
            force_n: vector(),
            shear_n: vector(),
            hat_mm2: zeros(),
            hat_mpa: zeros(),
            hat_n: zeros(),
            push: Push::new(model),
            close: Close::new(vertices),
            moving: Vec::with_capacity(vertices),
        };
        window.note_inner(skin);
        window
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Units of work of a round beside transforms, distances and products: moving the vertices and
    /// placing the pixels, and passing pressure to vertices and back.
    pub(super) fn work(&self, model: &ContactModel, has_second_order: bool) -> u64 {
        let (pushing, moving) = (self.push.vertices().len(), self.ids.len());
        let second_order = model.second_order.as_ref().filter(|_| has_second_order);
        let bent = second_order.map_or(0, |of| of.work(pushing, moving));
        (9 * pushing * moving + bent + PLACE * self.entries.len()) as u64
    }

    /// The same of opening the window: choosing pixels and vertices, and reading the compliance between
    /// those that push and those that move. It counts in each frame, whether or not some of it is still
    /// known from an earlier one.
    pub(super) fn opening_work(&self) -> u64 {
        (18 * self.push.vertices().len() * self.ids.len() + OPEN * self.entries.len()) as u64
    }

    /// How many pixels, the first, are solved for; the others are held.
    pub(super) fn free(&self) -> usize {
        self.entries.len() - self.held.len()
    }

    /// Row behind the skin's mirror in which the image of a pixel stands, in rows of those that are solved
    /// for: the mirror stands where they end.
    fn image_row(&self, skin: &PixelSkin, index: usize) -> Option<usize> {
        let image = skin.mirror.image_row(index / MAP_SIDE_PX, index % MAP_SIDE_PX)?;
        Some(image / self.step_px)
    }

    /// Cells of the window's first pixels and of their images.
    pub(super) fn cells(&self, count: usize) -> Cells<'_> {
        Cells { own: &self.cells[..count], images: &self.images }
    }

    /// Rows that pixels and their images stand in.
    pub(super) fn rows(&self) -> usize {
        self.size[0]
    }

    pub(super) fn size(&self) -> [usize; 2] {
        self.size.map(|s| s + BETWEEN.div_ceil(self.step_px))
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

    /// How far from a pixel, in the map's order, its pressure or its image's shows at most.
    pub(super) fn reach(&self) -> usize {
        // An image that shows stands within as many rows as a pixel has shares.
        (2 * self.shares.len()) * MAP_SIDE_PX
    }

    /// Adds the pressure of a pixel of the window, and of its image, to the means over pixels of pressure
    /// that is a cubic between those that are solved for.
    pub(super) fn spread(&self, skin: &PixelSkin, slot: usize, pressure: f32, map: &mut [f32]) {
        let entry = self.entries[slot] as usize;
        let index = skin.raster.indices()[entry] as usize;
        if self.is_inner[entry / 64] >> (entry % 64) & 1 == 1 {
            let side = self.shares.len();
            let first = index - (side / 2) * (MAP_SIDE_PX + 1);
            for (row, a) in self.shares.iter().enumerate() {
                let to = &mut map[first + row * MAP_SIDE_PX..][..side];
                for (to, b) in to.iter_mut().zip(&self.shares) {
                    *to += a * b * pressure;
                }
            }
            return;
        }
        let image = self.image_row(skin, index).map(|row| row * self.step_px);
        let near = image.filter(|row| *row < index / MAP_SIDE_PX + self.shares.len());
        let Some(row) = near else {
            // What would leave the skin stays.
            return self.share(skin, index, Some(index), pressure, map);
        };
        // Over the mirror it leaves, and the image's enters.
        self.share(skin, index, None, pressure, map);
        self.share(skin, row * MAP_SIDE_PX + index % MAP_SIDE_PX, None, pressure, map);
    }

    /// Notes pixels all of whose shares lie on the skin, and whose image, if they have one, is far.
    fn note_inner(&mut self, skin: &PixelSkin) {
        let (mask, side) = (skin.raster.mask(), self.shares.len());
        let around = (side / 2) * (MAP_SIDE_PX + 1);
        for (entry, index) in skin.raster.indices().iter().enumerate() {
            let index = *index as usize;
            let image = self.image_row(skin, index).map(|row| row * self.step_px);
            let is_far = image.is_none_or(|row| row >= index / MAP_SIDE_PX + side);
            let is_on_skin = |row: usize| {
                let first = (index + row * MAP_SIDE_PX).checked_sub(around);
                let row = first.and_then(|first| mask.get(first..first + side));
                row.is_some_and(|row| row.iter().all(|on| *on))
            };
            let is_inner = is_far && (0..side).all(is_on_skin);
            self.is_inner[entry / 64] |= u64::from(is_inner) << (entry % 64);
        }
    }

    /// Adds what a pixel at `index`, which may lie beyond the map, gives to those round it.
    fn share(
        &self,
        skin: &PixelSkin,
        index: usize,
        beyond: Option<usize>,
        pressure: f32,
        map: &mut [f32],
    ) {
        let mask = skin.raster.mask();
        let first = (self.shares.len() / 2) * (MAP_SIDE_PX + 1);
        for (row, a) in self.shares.iter().enumerate() {
            for (column, b) in self.shares.iter().enumerate() {
                let to = (index + row * MAP_SIDE_PX + column).checked_sub(first);
                let to = to.filter(|to| mask.get(*to) == Some(&true));
                if let Some(to) = to.or(beyond) {
                    map[to] += a * b * pressure;
                }
            }
        }
    }
}
