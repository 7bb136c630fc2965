//! Which pixels and vertices belong to the window of a frame.

use super::{BETWEEN, NONE, Window};
use crate::answer::Effort;
use crate::model::ContactModel;
use crate::objects::View;
use crate::pixels::PixelSkin;
use crate::pixels::convolution::LENGTH_MAX;
use papilla_atlas::MAP_SIDE_PX;

/// Pixels round vertices nearer than this are looked at, reference mm.
const NEAR_MM: f64 = 0.6;
/// Of these, pixels nearer than this can come to touch, reference mm.
const REACH_MM: f64 = 0.2;

impl Window {
    /// Takes the pixels round `candidates`, distances (reference mm) and vertices, that things are
    /// near; false if there are none.
    pub(in super::super) fn open(
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
        self.measure_extent(skin);
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

    /// Rows and columns of the pixels, and of their images if one of them is near the mirror: all or
    /// none, as what is cut off would be missed by the pixels and not by the vertices.
    fn measure_extent(&mut self, skin: &PixelSkin) {
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        let (mut nearest, mut last) = (usize::MAX, 0);
        for (slot, entry) in self.entries.iter().enumerate() {
            let index = skin.raster.indices()[*entry as usize] as usize;
            self.slot[index] = slot as u32;
            let at = [index / MAP_SIDE_PX, index % MAP_SIDE_PX].map(|i| i / self.step_px);
            for i in 0..2 {
                (low[i], high[i]) = (low[i].min(at[i]), high[i].max(at[i] + 1));
            }
            if let Some(row) = self.image_row(skin, index) {
                (nearest, last) = (nearest.min(row - at[0]), last.max(row + 1));
            }
        }
        let gap = BETWEEN.div_ceil(self.step_px);
        let is_near = nearest < 2 * BETWEEN / self.step_px;
        self.images_end = if is_near { last.min(low[0] + LENGTH_MAX - gap) } else { 0 };
        self.first = low;
        self.size = [high[0].max(self.images_end) - low[0], high[1] - low[1]];
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
    /// that most follow from the one before, or from the frames before: then each counts as asked, as the
    /// budget has to be the same wherever a frame's memory comes from.
    fn take_near(&mut self, skin: &PixelSkin, view: View<'_>, effort: &mut Effort) {
        let mut asked: Option<([f32; 3], f64)> = None;
        let is_followed = self.known.follow(view);
        for (word, (bits, solved_for)) in self.looked_at.iter().zip(&self.solved_for).enumerate() {
            let mut bits = bits & solved_for;
            while bits != 0 {
                let entry = 64 * word + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let at = skin.rest_mm[entry];
                let follows = || {
                    let (from, gap_mm) = asked?;
                    let square: f32 = (0..3).map(|i| (at[i] - from[i]).powi(2)).sum();
                    let away = f64::from(square.sqrt());
                    let is_near = gap_mm + away < REACH_MM;
                    (is_near || gap_mm - away > REACH_MM).then_some(is_near)
                };
                let told = if is_followed {
                    let is_spent = view.is_spent(effort);
                    view.count(1, effort);
                    let known = self.known.is_nearer(entry, REACH_MM as f32);
                    if is_spent { Some(true) } else { known.or_else(follows) }
                } else {
                    follows()
                };
                let is_near = told.unwrap_or_else(|| {
                    if !is_followed {
                        if view.is_spent(effort) {
                            return true;
                        }
                        view.count(1, effort);
                    }
                    let nearest = view.nearest_at(at.map(f64::from));
                    view.count_more(nearest.map_or(0, |nearest| nearest.asked), effort);
                    let gap_mm = nearest.map_or(f64::INFINITY, |nearest| nearest.gap_mm);
                    if is_followed {
                        self.known.note(entry, gap_mm);
                    }
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
    pub(in super::super) fn is_inside_at_rest(
        &self,
        skin: &PixelSkin,
        view: View<'_>,
        effort: &mut Effort,
    ) -> bool {
        self.entries.iter().any(|entry| {
            if view.is_spent(effort) {
                return true;
            }
            view.count(1, effort);
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

    pub(in super::super) fn number_cells(&mut self, skin: &PixelSkin, [rows, columns]: [usize; 2]) {
        self.cells.clear();
        self.images.clear();
        for (slot, entry) in self.entries.iter().enumerate() {
            let index = skin.raster.indices()[*entry as usize] as usize;
            let [row, column] =
                [index / MAP_SIDE_PX, index % MAP_SIDE_PX].map(|i| i / self.step_px);
            let cell = |row: usize| {
                let [row, column] = [row - self.first[0], column - self.first[1]];
                (row % rows * columns + column % columns) as u32
            };
            self.cells.push(cell(row));
            if let Some(row) = self.image_row(skin, index).filter(|row| *row < self.images_end) {
                self.images.push([slot as u32, cell(row)]);
            }
        }
    }
}
