//! The rules an atlas must keep.

use super::exact::{GridPoint, doubled_area};
use super::raster::Cover;
use super::{ATLAS_VERSION, AtlasError, AtlasFile, Patch};
use crate::MAP_SIDE_PX;

pub(super) fn check(file: &AtlasFile) -> Result<(), AtlasError> {
    check_header(file)?;
    check_counts(file)?;
    check_indices(file)?;
    for patch in Patch::ALL {
        check_vertices(file, patch)?;
        check_orientation(file, patch)?;
        check_overlap(file, patch)?;
    }
    let expected = file.computed_hash();
    if file.hash != expected {
        return Err(AtlasError::Hash { expected, found: file.hash.clone() });
    }
    Ok(())
}

fn check_header(file: &AtlasFile) -> Result<(), AtlasError> {
    if file.version != ATLAS_VERSION {
        return Err(AtlasError::Version { found: file.version, expected: ATLAS_VERSION });
    }
    let side_px = MAP_SIDE_PX as u32;
    if file.size_px != side_px {
        return Err(AtlasError::Size { found: file.size_px, expected: side_px });
    }
    if !(file.mm_per_px.is_finite() && file.mm_per_px > 0.0) {
        return Err(AtlasError::Scale(file.mm_per_px));
    }
    if file.triangles.is_empty() {
        return Err(AtlasError::Empty);
    }
    Ok(())
}

fn check_counts(file: &AtlasFile) -> Result<(), AtlasError> {
    let expected = file.skin.positions_mm.len();
    for patch in Patch::ALL {
        let vertices = file.patch(patch);
        let lists =
            [("positions_mm", vertices.positions_mm.len()), ("uv_px", vertices.uv_px.len())];
        for (list, found) in lists {
            if found != expected {
                return Err(AtlasError::Count { patch, list, found, expected });
            }
        }
    }
    Ok(())
}

fn check_indices(file: &AtlasFile) -> Result<(), AtlasError> {
    let count = file.skin.positions_mm.len();
    for (triangle, corners) in file.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&vertex| vertex as usize >= count) {
            return Err(AtlasError::Index { triangle, vertex, count });
        }
    }
    Ok(())
}

fn check_vertices(file: &AtlasFile, patch: Patch) -> Result<(), AtlasError> {
    let vertices = file.patch(patch);
    for (vertex, position) in vertices.positions_mm.iter().enumerate() {
        if !position.iter().all(|coordinate| coordinate.is_finite()) {
            return Err(AtlasError::NotFinite { patch, list: "positions_mm", vertex });
        }
    }
    let inside = 0.0..=MAP_SIDE_PX as f32;
    for (vertex, &[u, v]) in vertices.uv_px.iter().enumerate() {
        if !(u.is_finite() && v.is_finite()) {
            return Err(AtlasError::NotFinite { patch, list: "uv_px", vertex });
        }
        if !(inside.contains(&u) && inside.contains(&v)) {
            return Err(AtlasError::Outside { patch, vertex, u, v, size: MAP_SIDE_PX });
        }
    }
    Ok(())
}

fn check_orientation(file: &AtlasFile, patch: Patch) -> Result<(), AtlasError> {
    let uv_px = &file.patch(patch).uv_px;
    for (triangle, corners) in file.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|vertex| GridPoint::new(uv_px[vertex as usize]));
        let area = doubled_area(a, b, c);
        if area <= 0 {
            return Err(AtlasError::Flipped { patch, triangle, empty: area == 0 });
        }
    }
    Ok(())
}

fn check_overlap(file: &AtlasFile, patch: Patch) -> Result<(), AtlasError> {
    let Some(overlap) = Cover::new(&file.patch(patch).uv_px, &file.triangles).overlap else {
        return Ok(());
    };
    Err(AtlasError::Overlap {
        patch,
        row: overlap.index / MAP_SIDE_PX,
        column: overlap.index % MAP_SIDE_PX,
        first: overlap.first,
        second: overlap.second,
    })
}
