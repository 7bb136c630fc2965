//! From pixels back to vertices: what a client paints on the 3-D finger.

use super::raster::check_length;
use super::{Atlas, AtlasError, Raster};
use crate::{MAP_LEN, MAP_SIDE_PX};

/// Reads a map at the vertices of a patch.
///
/// Bilinear between the four pixel centres around a vertex, without those outside the
/// patch (they hold 0 and would darken the rim); a vertex with none inside takes the
/// nearest pixel of the patch. A constant field comes back exactly.
#[derive(Clone, Debug)]
pub struct VertexSampler {
    taps: Vec<[(u32, f32); 4]>,
}

impl VertexSampler {
    /// Prepares the taps of every vertex of the patch that `raster` draws.
    #[must_use]
    pub fn new(atlas: &Atlas, raster: &Raster) -> Self {
        let uv_px = &atlas.patch(raster.patch()).uv_px;
        Self { taps: uv_px.iter().map(|&uv| taps(raster, uv)).collect() }
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.taps.len()
    }

    /// Writes the value of `pixels` (224 x 224, row-major) at each vertex.
    ///
    /// # Errors
    /// [`AtlasError::BufferLength`] if either buffer has another length.
    pub fn sample(&self, pixels: &[f32], vertex_values: &mut [f32]) -> Result<(), AtlasError> {
        check_length("the map", pixels.len(), MAP_LEN)?;
        check_length("the list of vertex values", vertex_values.len(), self.taps.len())?;
        for (value, taps) in vertex_values.iter_mut().zip(&self.taps) {
            *value = taps.iter().map(|&(index, weight)| weight * pixels[index as usize]).sum();
        }
        Ok(())
    }
}

fn taps(raster: &Raster, [u, v]: [f32; 2]) -> [(u32, f32); 4] {
    let (left, top) = ((u - 0.5).floor(), (v - 0.5).floor());
    let (right_share, low_share) = (u - 0.5 - left, v - 0.5 - top);
    let mut taps = [(0, 0.0); 4];
    let mut total = 0.0;
    for (corner, tap) in taps.iter_mut().enumerate() {
        let (right, low) = (corner & 1, corner >> 1);
        let share_u = if right == 1 { right_share } else { 1.0 - right_share };
        let share_v = if low == 1 { low_share } else { 1.0 - low_share };
        // Left or top of the image the cast gives 0, which is not that pixel.
        let (column, row) = (left + right as f32, top + low as f32);
        if column < 0.0 || row < 0.0 || raster.at(row as usize, column as usize).is_none() {
            continue;
        }
        *tap = ((row as usize * MAP_SIDE_PX + column as usize) as u32, share_u * share_v);
        total += share_u * share_v;
    }
    if total > 0.0 {
        taps.iter_mut().for_each(|tap| tap.1 /= total);
    } else {
        taps[0] = (nearest(raster, [u, v]), 1.0);
    }
    taps
}

fn nearest(raster: &Raster, [u, v]: [f32; 2]) -> u32 {
    let distance = |index: u32| {
        let (row, column) = (index as usize / MAP_SIDE_PX, index as usize % MAP_SIDE_PX);
        (column as f32 + 0.5 - u).hypot(row as f32 + 0.5 - v)
    };
    let all = raster.indices().iter().copied();
    all.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}
