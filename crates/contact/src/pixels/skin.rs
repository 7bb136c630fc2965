//! What contact on pixels needs to know of the skin.

use super::convolution::Plans;
use super::mirror::Mirror;
use super::own_dents::{Correction, OwnDents};
use super::smooth::{self, HELD_ROWS, PixelStencil};
use crate::layers::SurfaceCompliance;
use crate::model::ContactModel;
use papilla_atlas::{Atlas, Pixel, Raster};
use std::sync::Arc;

/// Rows of triangles from the skin's edge from which pixels know nothing of the vertices' pressure.
const FREE_ROWS: u8 = 5;

/// What pixels have to know of a skin; made once, for any number of fingers.
#[derive(Debug)]
pub struct PixelSkin {
    pub(super) raster: Arc<Raster>,
    pub(super) uv_px: Vec<[f32; 2]>,
    /// By pixel, and by vertex.
    pub(super) stencils: Vec<PixelStencil>,
    pub(super) corrections: Vec<Correction>,
    /// By vertex: pixels of the triangles round it.
    pub(super) around: Vec<Vec<u32>>,
    /// By pixel: gap for a pressure beside the vertices', mm/MPa; infinite where theirs is held.
    pub(super) ease: Vec<f32>,
    pub(super) mirror: Mirror,
    pub(super) surface: SurfaceCompliance,
    pub(super) plans: Arc<Plans>,
    /// Places of the pixels at rest.
    pub(super) rest_mm: Vec<[f32; 3]>,
    /// Mean distance of neighbours among them, along rows.
    pub(super) apart_mm: f32,
}

impl PixelSkin {
    /// The skin of an atlas and of a model of it; none if the model names no layers, or has other
    /// vertices than the atlas.
    #[must_use]
    pub fn new(model: &ContactModel, atlas: &Atlas, raster: Arc<Raster>) -> Option<Self> {
        let layers = &model.header().layers;
        if layers.is_empty() || model.vertices() != atlas.vertex_count() {
            return None;
        }
        let uv_px = atlas.patch(raster.patch()).uv_px.clone();
        let stencils = smooth::of_pixels(atlas, &raster);
        let surface = SurfaceCompliance::new(layers);
        let mirror = Mirror::new(model, atlas, &raster);
        let rows = smooth::rows_from_edge(atlas, |vertex| mirror.holds(vertex), FREE_ROWS);
        let largest = surface.largest() as f32;
        let ease = |pixel: &Pixel| {
            let corners = pixel.vertices.iter().zip(pixel.weights);
            let row: f32 = corners.map(|(v, w)| w * f32::from(rows[*v as usize])).sum();
            let [held, free] = [HELD_ROWS, FREE_ROWS].map(f32::from);
            let part = (free - row).max(0.0) / (row - held + 1.0);
            if row < held { f32::INFINITY } else { largest * part.powi(2) }
        };
        let ease: Vec<f32> = raster.pixels().iter().map(ease).collect();
        let place = |stencil: &PixelStencil| {
            std::array::from_fn(|i| stencil.value(|v| model.positions_mm[v][i] as f32))
        };
        let rest_mm: Vec<[f32; 3]> = stencils.iter().map(place).collect();
        let mut around = vec![Vec::new(); model.vertices()];
        for (entry, pixel) in raster.pixels().iter().enumerate() {
            pixel.vertices.iter().for_each(|corner| around[*corner as usize].push(entry as u32));
        }
        let plans = Arc::new(Plans::new());
        let apart = smooth::apart_px(atlas);
        let own = OwnDents {
            model,
            uv_px: &uv_px,
            apart: &apart,
            mirror: &mirror,
            raster: &raster,
            rest_mm: &rest_mm,
        };
        let corrections = own.corrections(&surface, &plans, &rows);
        let apart_mm = apart_mm(raster.indices(), &rest_mm);
        Some(Self {
            raster,
            uv_px,
            stencils,
            corrections,
            around,
            ease,
            mirror,
            surface,
            plans,
            apart_mm,
            rest_mm,
        })
    }
}

/// Mean distance of pixels beside each other in a row.
fn apart_mm(indices: &[u32], rest_mm: &[[f32; 3]]) -> f32 {
    let beside = indices.windows(2).zip(rest_mm.windows(2)).filter(|(i, _)| i[1] == i[0] + 1);
    let apart = |at: &[[f32; 3]]| (0..3).map(|i| (at[1][i] - at[0][i]).powi(2)).sum::<f32>().sqrt();
    let (sum, count) = beside.fold((0.0, 0.0), |(sum, n), (_, at)| (sum + apart(at), n + 1.0f32));
    sum / count.max(1.0)
}
