//! Two flattened patches in one image.

use super::angles::{area, doubled_area_vector};
use super::{BuildAtlasError, Convergence, Distortion, Flattening, Method, flatten};
use crate::{Atlas, MAP_SIDE_PX, Patch, PatchVertices, Raster};
use papilla_vector::minus;
use serde::Serialize;
use std::time::Instant;

/// Free pixels between the patches and the edge of the image.
const MARGIN_PX: f64 = 4.0;
/// Steps per pixel to which `uv_px` is rounded. Exact in `f32`, so a symmetric patch stays
/// symmetric in the image, and the last bits of a linear solver do not reach the hash.
const STEPS_PER_PX: f64 = 4096.0;

/// How an atlas came out.
#[derive(Clone, Debug, Serialize)]
pub struct AtlasReport {
    /// Hash of the atlas.
    pub hash: String,
    /// Vertices of each patch.
    pub vertices: usize,
    /// Triangles of each patch.
    pub triangles: usize,
    /// Length of a pixel on the finger, mm.
    pub mm_per_px: f64,
    /// The skin.
    pub skin: PatchReport,
    /// The interface.
    pub interface: PatchReport,
    /// Distance in the image between vertices that lie over each other: root mean square
    /// over the patch, pixels.
    pub patch_offset_rms_px: f64,
}

/// How one patch came out.
#[derive(Clone, Debug, Serialize)]
pub struct PatchReport {
    /// Area of the patch on the finger, mm2.
    pub area_mm2: f64,
    /// Pixels of its mask.
    pub pixels: usize,
    /// Angle-based flattening, which the atlas uses, then the conformal maps.
    pub methods: Vec<MethodReport>,
}

/// How one method flattened one patch.
#[derive(Clone, Debug, Serialize)]
pub struct MethodReport {
    /// The method.
    pub method: Method,
    /// Newton's method, where there is one.
    pub convergence: Option<Convergence>,
    /// Distortion against the surface.
    pub distortion: Distortion,
    /// Wall time, s.
    pub seconds: f64,
}

/// Makes the atlas of two patches, vertex `i` of the skin over vertex `i` of the interface.
///
/// Positions are in mm in the finger's frame (`x` from the tip to the base, `y` lateral,
/// `z` towards the nail). Both patches are flattened by [`Method::AngleBased`], keep their
/// areas, and share one scale, the largest at which both fit. The tip points up; the pad
/// is seen from outside. Triangles that are wound against the side of the skin are
/// turned round. The report compares with the conformal maps.
///
/// # Errors
/// [`BuildAtlasError`]: different vertex counts, a patch that cannot be flattened, or a
/// layout that folds over itself.
pub fn build_atlas(
    skin_positions: &[[f64; 3]],
    interface_positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
) -> Result<(Atlas, AtlasReport), BuildAtlasError> {
    let (skin, interface) = (skin_positions.len(), interface_positions.len());
    if skin != interface {
        return Err(BuildAtlasError::Counts { skin, interface });
    }
    let surfaces = [skin_positions, interface_positions];
    // Any flattening checks the indices; the winding may use them only afterwards.
    let (flat_skin, skin_report) = flatten_patch(Patch::Skin, skin_positions, triangles)?;
    let triangles = wound_outward(skin_positions, interface_positions, triangles);
    let outward = triangles.outward;
    let (flat_interface, interface_report) =
        flatten_patch(Patch::Interface, interface_positions, &triangles.list)?;
    let skin_uv = if outward { flat_skin.uv } else { mirrored(flat_skin.uv) };
    let weights = vertex_areas(skin_positions, &triangles.list);
    let placed = place([skin_uv, flat_interface.uv], skin_positions, &weights);

    let vertices = |patch: usize| PatchVertices {
        positions_mm: surfaces[patch].iter().map(|p| p.map(|x| x as f32)).collect(),
        uv_px: placed.uv_px[patch].clone(),
    };
    let count = triangles.list.len();
    let atlas = Atlas::new(placed.mm_per_px as f32, triangles.list, vertices(0), vertices(1))?;
    let with_pixels = |patch, mut report: PatchReport| {
        report.pixels = Raster::new(&atlas, patch).pixel_count();
        report
    };
    let report = AtlasReport {
        hash: atlas.hash().to_owned(),
        vertices: skin,
        triangles: count,
        mm_per_px: placed.mm_per_px,
        skin: with_pixels(Patch::Skin, skin_report),
        interface: with_pixels(Patch::Interface, interface_report),
        patch_offset_rms_px: offset_rms_px(&placed.uv_px, &weights),
    };
    Ok((atlas, report))
}

/// Flattens by all methods; returns the angle-based one.
fn flatten_patch(
    patch: Patch,
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
) -> Result<(Flattening, PatchReport), BuildAtlasError> {
    let run = |method| {
        let start = Instant::now();
        let flat = flatten(positions, triangles, method)
            .map_err(|source| BuildAtlasError::Flatten { patch, source })?;
        let report = MethodReport {
            method,
            convergence: flat.convergence,
            distortion: flat.distortion,
            seconds: start.elapsed().as_secs_f64(),
        };
        Ok::<_, BuildAtlasError>((flat, report))
    };
    let (angle_based, report) = run(Method::AngleBased)?;
    let mut methods = vec![report];
    for method in [Method::LeastSquaresConformal, Method::SpectralConformal] {
        methods.push(run(method)?.1);
    }
    let corners = |t: &[u32; 3]| t.map(|vertex| positions[vertex as usize]);
    let area_mm2 = triangles.iter().map(|t| area(corners(t))).sum();
    Ok((angle_based, PatchReport { area_mm2, pixels: 0, methods }))
}

struct Winding {
    list: Vec<[u32; 3]>,
    /// Whether the triangles were so from the start.
    outward: bool,
}

/// Winds all triangles counter-clockwise as seen from the skin's side.
fn wound_outward(skin: &[[f64; 3]], interface: &[[f64; 3]], triangles: &[[u32; 3]]) -> Winding {
    let volume = |corners: &[u32; 3]| {
        let corners = corners.map(|vertex| vertex as usize);
        let normal = doubled_area_vector(corners.map(|vertex| skin[vertex]));
        let up = corners.map(|vertex| minus(skin[vertex], interface[vertex]));
        (0..3).map(|k| normal[k] * (up[0][k] + up[1][k] + up[2][k])).sum::<f64>()
    };
    let outward = triangles.iter().map(volume).sum::<f64>() >= 0.0;
    let turned = |&[a, b, c]: &[u32; 3]| if outward { [a, b, c] } else { [a, c, b] };
    Winding { list: triangles.iter().map(turned).collect(), outward }
}

fn mirrored(mut uv: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    uv.iter_mut().for_each(|point| point[0] = -point[0]);
    uv
}

/// A third of the surface area of the triangles around each vertex.
fn vertex_areas(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<f64> {
    let mut areas = vec![0.0; positions.len()];
    for corners in triangles {
        let third = area(corners.map(|vertex| positions[vertex as usize])) / 3.0;
        for &vertex in corners {
            areas[vertex as usize] += third;
        }
    }
    areas
}

struct Placed {
    mm_per_px: f64,
    uv_px: [Vec<[f32; 2]>; 2],
}

/// Turns, scales and shifts the flat patches (mm, second axis up) into the image.
fn place(
    [skin_uv, interface_uv]: [Vec<[f64; 2]>; 2],
    skin_positions: &[[f64; 3]],
    weights: &[f64],
) -> Placed {
    // Looking at the pad from outside with the tip up, -x is up and -y is to the right.
    let view: Vec<[f64; 2]> = skin_positions.iter().map(|p| [-p[1], -p[0]]).collect();
    let skin_uv = aligned(&skin_uv, &view, weights);
    let interface_uv = aligned(&interface_uv, &skin_uv, weights);
    let (mut least, mut greatest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for point in skin_uv.iter().chain(&interface_uv) {
        for axis in 0..2 {
            least[axis] = least[axis].min(point[axis]);
            greatest[axis] = greatest[axis].max(point[axis]);
        }
    }
    let side = MAP_SIDE_PX as f64;
    let extent_mm = (greatest[0] - least[0]).max(greatest[1] - least[1]);
    let mm_per_px = extent_mm / (side - 2.0 * MARGIN_PX);
    let middle = [0, 1].map(|axis| 0.5 * (least[axis] + greatest[axis]));
    let to_px = |point: &[f64; 2]| {
        let u = 0.5 * side + (point[0] - middle[0]) / mm_per_px;
        let v = 0.5 * side - (point[1] - middle[1]) / mm_per_px;
        [u, v].map(|x| ((x * STEPS_PER_PX).round() / STEPS_PER_PX) as f32)
    };
    let uv_px = [&skin_uv, &interface_uv].map(|uv| uv.iter().map(to_px).collect());
    Placed { mm_per_px, uv_px }
}

/// `points` turned and shifted, not scaled, onto `goal` by weighted least squares.
fn aligned(points: &[[f64; 2]], goal: &[[f64; 2]], weights: &[f64]) -> Vec<[f64; 2]> {
    let (centre, goal_centre) = (mean(points, weights), mean(goal, weights));
    let (mut along, mut across) = (0.0, 0.0);
    for ((p, q), weight) in points.iter().zip(goal).zip(weights) {
        let (p, q) = (offset(*p, centre), offset(*q, goal_centre));
        along += weight * (p[0] * q[0] + p[1] * q[1]);
        across += weight * (p[0] * q[1] - p[1] * q[0]);
    }
    let (sine, cosine) = across.atan2(along).sin_cos();
    let turn = |p: &[f64; 2]| {
        let [x, y] = offset(*p, centre);
        [goal_centre[0] + cosine * x - sine * y, goal_centre[1] + sine * x + cosine * y]
    };
    points.iter().map(turn).collect()
}

fn mean(points: &[[f64; 2]], weights: &[f64]) -> [f64; 2] {
    let total: f64 = weights.iter().sum();
    [0, 1].map(|axis| points.iter().zip(weights).map(|(p, w)| p[axis] * w).sum::<f64>() / total)
}

fn offset(p: [f64; 2], centre: [f64; 2]) -> [f64; 2] {
    [p[0] - centre[0], p[1] - centre[1]]
}

fn offset_rms_px(uv_px: &[Vec<[f32; 2]>; 2], weights: &[f64]) -> f64 {
    let squared = |(a, b): (&[f32; 2], &[f32; 2])| {
        (0..2).map(|axis| f64::from(a[axis] - b[axis]).powi(2)).sum::<f64>()
    };
    let pairs = uv_px[0].iter().zip(&uv_px[1]).map(squared);
    let total: f64 = weights.iter().sum();
    (pairs.zip(weights).map(|(square, weight)| square * weight).sum::<f64>() / total).sqrt()
}
