//! What pixels have to know of a skin.

use super::convolution::Plans;
use super::own_dents::{Correction, OwnDents};
use super::smooth::{self, PixelStencil};
use crate::layers::SurfaceCompliance;
use crate::model::ContactModel;
use papilla_atlas::{Atlas, Raster};
use std::sync::Arc;

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
    /// Whether a vertex is at the skin's edge.
    pub(super) at_edge: Vec<bool>,
    pub(super) surface: SurfaceCompliance,
    pub(super) plans: Arc<Plans>,
    /// Places of the pixels at rest.
    pub(super) rest_mm: Vec<[f32; 3]>,
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
        let at_edge = smooth::at_edge(atlas);
        let place = |stencil: &PixelStencil| {
            std::array::from_fn(|i| stencil.value(|v| model.positions_mm[v][i] as f32))
        };
        let rest_mm: Vec<[f32; 3]> = stencils.iter().map(place).collect();
        let mut around = vec![Vec::new(); model.vertices()];
        for (entry, pixel) in raster.pixels().iter().enumerate() {
            pixel.vertices.iter().for_each(|corner| around[*corner as usize].push(entry as u32));
        }
        let plans = Arc::new(Plans::new());
        let own = OwnDents { model, uv_px: &uv_px, raster: &raster, rest_mm: &rest_mm };
        let corrections = own.corrections(&surface, &plans, &at_edge);
        Some(Self {
            raster,
            uv_px,
            stencils,
            corrections,
            around,
            at_edge,
            surface,
            plans,
            rest_mm,
        })
    }
}
