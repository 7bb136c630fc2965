//! The plane at which the map ends towards the hand, and which the skin cannot leave: the skin goes
//! on behind it as in a mirror.
//!
//! This is the base plane of the finger. Points in it slide along it and move in no other way. So
//! the skin deforms there like one half of a skin that is the same on both sides of the plane.

use super::smooth;
use crate::model::ContactModel;
use papilla_atlas::{Atlas, MAP_SIDE_PX, Raster};

/// Compliance across a plane that vertices cannot leave, over their greatest.
const HELD: f32 = 1e-6;

/// Which vertices stand on such a plane, and where the map's columns end at it.
#[derive(Debug)]
pub(super) struct Mirror {
    on_plane: Vec<bool>,
    /// Last row of each column that ends there.
    last_row: Vec<Option<u32>>,
}

impl Mirror {
    /// Of the vertices that can move along two axes and not along the third.
    pub(super) fn new(model: &ContactModel, atlas: &Atlas, raster: &Raster) -> Self {
        let is_held = |vertex: usize| {
            let pair = model.compliance.pair(vertex, vertex);
            let along = [pair[0], pair[4], pair[8]];
            let most = along.into_iter().fold(0.0, f32::max);
            along.into_iter().filter(|c| *c <= HELD * most).count() == 1
        };
        let mut on_plane = vec![false; model.vertices()];
        for [a, b] in smooth::edge_sides(atlas) {
            let ends = [a, b].map(|vertex| vertex as usize);
            if ends.into_iter().all(is_held) {
                ends.into_iter().for_each(|vertex| on_plane[vertex] = true);
            }
        }
        let mut last = vec![None; MAP_SIDE_PX];
        for (pixel, index) in raster.pixels().iter().zip(raster.indices()) {
            let [row, column] = [*index as usize / MAP_SIDE_PX, *index as usize % MAP_SIDE_PX];
            // Pixels stand row by row: the last one of a column comes last.
            let ends = pixel.vertices.iter().any(|vertex| on_plane[*vertex as usize]);
            last[column] = ends.then_some(row as u32);
        }
        Self { on_plane, last_row: last }
    }

    /// Whether a vertex stands on the plane.
    pub(super) fn holds(&self, vertex: usize) -> bool {
        self.on_plane[vertex]
    }

    /// Row behind the plane in which a pixel's image stands.
    pub(super) fn image_row(&self, row: usize, column: usize) -> Option<usize> {
        let last = (*self.last_row.get(column)?)? as usize;
        (2 * last + 1).checked_sub(row)
    }

    /// Place on the map of a vertex' image; none on the plane, and far from it.
    pub(super) fn image_px(&self, vertex: usize, [u, v]: [f32; 2]) -> Option<[f32; 2]> {
        if self.holds(vertex) {
            return None;
        }
        let column = (u as usize).min(MAP_SIDE_PX - 1);
        let end = (self.last_row[column]? + 1) as f32;
        Some([u, 2.0 * end - v])
    }
}
