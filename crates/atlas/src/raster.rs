//! From vertex values to pixels: which triangle each pixel centre lies in.

use super::exact::{GridPoint, doubled_area};
use super::{Atlas, AtlasError, Patch};
use crate::{MAP_LEN, MAP_SIDE_PX};

/// What one pixel of the mask shows: a point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Index of the triangle that the pixel centre lies in.
    pub triangle: u32,
    /// The triangle's vertices.
    pub vertices: [u32; 3],
    /// Barycentric weights of those vertices: each in 0..=1, their sum is 1.
    pub weights: [f32; 3],
}

impl Pixel {
    /// Value at the pixel centre of a field given at the vertices.
    ///
    /// # Panics
    /// If `vertex_values` is shorter than the atlas's vertex count.
    #[must_use]
    pub fn value(&self, vertex_values: &[f32]) -> f32 {
        let [a, b, c] = self.vertices.map(|vertex| vertex_values[vertex as usize]);
        let [wa, wb, wc] = self.weights;
        wa * a + wb * b + wc * c
    }
}

/// The pixels of one patch, each with its triangle and weights.
///
/// A pixel belongs to the patch if its **centre** lies in one of the triangles, edges
/// and corners included. A centre on a shared edge or vertex belongs to the triangle
/// of lowest index there, so none is lost or counted twice. Tests are exact.
#[derive(Clone, Debug)]
pub struct Raster {
    patch: Patch,
    vertex_count: usize,
    /// Flat pixel index of each entry, ascending.
    indices: Vec<u32>,
    pixels: Vec<Pixel>,
    /// Entry of each pixel of the image, or `OUTSIDE`.
    entry_of_index: Vec<u32>,
    mask: Vec<bool>,
}

const OUTSIDE: u32 = u32::MAX;

impl Raster {
    /// Finds the pixels of `patch`; some milliseconds, to be done once.
    #[must_use]
    pub fn new(atlas: &Atlas, patch: Patch) -> Self {
        let uv_px = &atlas.patch(patch).uv_px;
        let owner = Cover::new(uv_px, atlas.triangles()).owner;
        let mut raster = Self {
            patch,
            vertex_count: atlas.vertex_count(),
            indices: Vec::new(),
            pixels: Vec::new(),
            entry_of_index: vec![OUTSIDE; MAP_LEN],
            mask: vec![false; MAP_LEN],
        };
        for (index, &triangle) in owner.iter().enumerate() {
            if triangle == OUTSIDE {
                continue;
            }
            let vertices = atlas.triangles()[triangle as usize];
            let centre = GridPoint::pixel_centre(index / MAP_SIDE_PX, index % MAP_SIDE_PX);
            let corners = vertices.map(|vertex| GridPoint::new(uv_px[vertex as usize]));
            raster.entry_of_index[index] = raster.pixels.len() as u32;
            raster.mask[index] = true;
            raster.indices.push(index as u32);
            raster.pixels.push(Pixel { triangle, vertices, weights: weights(corners, centre) });
        }
        raster
    }

    /// The patch this raster draws.
    #[must_use]
    pub fn patch(&self) -> Patch {
        self.patch
    }

    /// True inside the patch; 224 x 224, row-major, row 0 at the top.
    #[must_use]
    pub fn mask(&self) -> &[bool] {
        &self.mask
    }

    /// Number of pixels inside the patch.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.pixels.len()
    }

    /// Flat index (`row * 224 + column`) of each pixel of the patch, ascending; same
    /// order and length as [`Raster::pixels`].
    #[must_use]
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Triangle, vertices and weights of each pixel of the patch.
    #[must_use]
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// What the pixel at `row`, `column` shows; `None` outside the patch or the image.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> Option<&Pixel> {
        self.entry(row, column).map(|entry| &self.pixels[entry])
    }

    /// Where the pixel at `row`, `column` stands in [`Raster::pixels`]; `None` as of [`Raster::at`].
    #[must_use]
    pub fn entry(&self, row: usize, column: usize) -> Option<usize> {
        if row >= MAP_SIDE_PX || column >= MAP_SIDE_PX {
            return None;
        }
        let entry = self.entry_of_index[row * MAP_SIDE_PX + column];
        (entry != OUTSIDE).then_some(entry as usize)
    }

    /// Draws a field: linear in each triangle, 0 outside the patch.
    ///
    /// `vertex_values` has one value per vertex, `pixels` is 224 x 224 row-major; all of
    /// it is overwritten. Allocates nothing.
    ///
    /// # Errors
    /// [`AtlasError::BufferLength`] if either buffer has another length.
    pub fn rasterise(&self, vertex_values: &[f32], pixels: &mut [f32]) -> Result<(), AtlasError> {
        check_length("the list of vertex values", vertex_values.len(), self.vertex_count)?;
        check_length("the map", pixels.len(), MAP_LEN)?;
        pixels.fill(0.0);
        for (&index, pixel) in self.indices.iter().zip(&self.pixels) {
            pixels[index as usize] = pixel.value(vertex_values);
        }
        Ok(())
    }

    /// Draws values that are known pixel by pixel, 0 outside the patch.
    ///
    /// `pixel_values` has one value per pixel of the patch, in the order of
    /// [`Raster::indices`]; all of `pixels` is overwritten. Allocates nothing.
    ///
    /// # Errors
    /// [`AtlasError::BufferLength`] if either buffer has another length.
    pub fn scatter(&self, pixel_values: &[f32], pixels: &mut [f32]) -> Result<(), AtlasError> {
        check_length("the list of pixel values", pixel_values.len(), self.indices.len())?;
        check_length("the map", pixels.len(), MAP_LEN)?;
        pixels.fill(0.0);
        for (&index, value) in self.indices.iter().zip(pixel_values) {
            pixels[index as usize] = *value;
        }
        Ok(())
    }

    /// Position on the undeformed finger (mm) that the pixel at `row`, `column` shows;
    /// `None` outside the patch. `atlas` must be the one this raster was made from.
    #[must_use]
    pub fn position_mm(&self, atlas: &Atlas, row: usize, column: usize) -> Option<[f32; 3]> {
        let pixel = self.at(row, column)?;
        let positions_mm = &atlas.patch(self.patch).positions_mm;
        let mut point = [0.0; 3];
        for (vertex, weight) in pixel.vertices.iter().zip(pixel.weights) {
            let position = positions_mm.get(*vertex as usize)?;
            for axis in 0..3 {
                point[axis] += weight * position[axis];
            }
        }
        Some(point)
    }
}

pub(super) fn check_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), AtlasError> {
    if found == expected { Ok(()) } else { Err(AtlasError::BufferLength { what, found, expected }) }
}

/// Barycentric weights of `point` in a triangle that contains it.
fn weights([a, b, c]: [GridPoint; 3], point: GridPoint) -> [f32; 3] {
    let total = doubled_area(a, b, c) as f64;
    let part = |p, q| (doubled_area(p, q, point) as f64 / total) as f32;
    [part(b, c), part(c, a), part(a, b)]
}

/// The triangle that owns each pixel of the image.
pub(super) struct Cover {
    owner: Vec<u32>,
    /// The last pixel found strictly inside two triangles, and those triangles.
    pub(super) overlap: Option<Overlap>,
}

/// A pixel centre strictly inside two triangles.
pub(super) struct Overlap {
    pub(super) index: usize,
    pub(super) first: u32,
    pub(super) second: u32,
}

impl Cover {
    /// Walks all triangles (counter-clockwise, vertices inside the image).
    pub(super) fn new(uv_px: &[[f32; 2]], triangles: &[[u32; 3]]) -> Self {
        let mut cover = Self { owner: vec![OUTSIDE; MAP_LEN], overlap: None };
        let mut inner_owner = vec![OUTSIDE; MAP_LEN];
        for (triangle, vertices) in (0u32..).zip(triangles) {
            let corners_px = vertices.map(|vertex| uv_px[vertex as usize]);
            let corners = corners_px.map(GridPoint::new);
            let [columns, rows] = [0, 1].map(|axis| centres_between(corners_px.map(|p| p[axis])));
            for (row, column) in rows.flat_map(|row| columns.clone().map(move |c| (row, c))) {
                let index = row * MAP_SIDE_PX + column;
                let place = place(corners, GridPoint::pixel_centre(row, column));
                if place != Place::Outside && cover.owner[index] == OUTSIDE {
                    cover.owner[index] = triangle;
                }
                if place == Place::Inside {
                    let first = std::mem::replace(&mut inner_owner[index], triangle);
                    if first != OUTSIDE {
                        cover.overlap = Some(Overlap { index, first, second: triangle });
                    }
                }
            }
        }
        cover
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Outside,
    Border,
    Inside,
}

fn place([a, b, c]: [GridPoint; 3], point: GridPoint) -> Place {
    let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| doubled_area(p, q, point));
    match sides.iter().min() {
        Some(0) => Place::Border,
        Some(side) if *side > 0 => Place::Inside,
        _ => Place::Outside,
    }
}

/// Rows or columns whose centres can lie between the least and the greatest of three
/// pixel coordinates.
fn centres_between(coordinates_px: [f32; 3]) -> std::ops::Range<usize> {
    let least = coordinates_px.iter().copied().fold(f32::INFINITY, f32::min);
    let greatest = coordinates_px.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let first = (least - 0.5).floor().max(0.0) as usize;
    let end = ((greatest + 0.5).ceil().max(0.0) as usize).min(MAP_SIDE_PX);
    first..end
}
