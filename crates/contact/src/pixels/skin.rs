//! What pixels have to know of a skin.

use super::convolution::Plans;
use super::own_dents::{Correction, OwnDents};
use super::smooth::{self, HELD_ROWS, PixelStencil};
use crate::layers::SurfaceCompliance;
use crate::model::ContactModel;
use papilla_atlas::{Atlas, Pixel, Raster};
use std::sync::Arc;

/// Rows of triangles from the skin's edge from which pixels know nothing of the vertices' pressure.
const FREE_ROWS: u8 = 5;

/// Pressure at the skin's edge over the greatest from which contact goes on beyond it.
const WHOLE: f32 = 0.5;
/// Gap for a pressure beside the vertices' at the skin's edge where contact goes on half, over the
/// layers' greatest compliance.
const FIRM: f32 = 16.0;

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
    /// By pixel: gap for a pressure beside the vertices' where contact goes on beyond the skin, mm/MPa;
    /// infinite where theirs is held.
    pub(super) ease: Vec<f32>,
    /// Vertices at the skin's edge, and the areas of all, reference mm2.
    edge: Vec<u32>,
    areas_mm2: Vec<f32>,
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
        let rows = smooth::rows_from_edge(atlas, FREE_ROWS);
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
        let own =
            OwnDents { model, uv_px: &uv_px, apart: &apart, raster: &raster, rest_mm: &rest_mm };
        let corrections = own.corrections(&surface, &plans, &rows);
        let edge = (0..).zip(&rows).filter_map(|(v, row)| (*row == 0).then_some(v)).collect();
        let areas_mm2 = model.areas_mm2.clone();
        Some(Self {
            raster,
            uv_px,
            stencils,
            corrections,
            around,
            ease,
            edge,
            areas_mm2,
            surface,
            plans,
            rest_mm,
        })
    }

    /// How far contact goes on beyond the skin: 0 where the vertices at its edge bear no force (N), 1
    /// from `WHOLE` on. Squared, as Hertz' pressure falls linearly towards the contact's end.
    pub(super) fn goes_on(&self, force_n: &[Vec<f32>; 3]) -> f32 {
        let pressure = |vertex: usize| {
            let square: f32 = force_n.iter().map(|f| f[vertex].powi(2)).sum();
            square.sqrt() / self.areas_mm2[vertex].max(1e-6)
        };
        let most = (0..self.areas_mm2.len()).map(pressure).fold(0.0, f32::max);
        let at_edge = self.edge.iter().map(|v| pressure(*v as usize)).fold(0.0, f32::max);
        if at_edge > 0.0 { (at_edge / (WHOLE * most)).powi(2).min(1.0) } else { 0.0 }
    }

    /// Whether a pixel holds the vertices' pressure where contact goes on beyond the skin.
    pub(super) fn is_at_edge(&self, pixel: usize) -> bool {
        self.ease[pixel].is_infinite()
    }

    /// As `ease` where contact goes on beyond the skin to this part; none where vertices' pressure is
    /// held.
    pub(super) fn eased(&self, pixel: usize, goes_on: f32) -> Option<f32> {
        if !self.is_at_edge(pixel) {
            return Some(goes_on * self.ease[pixel]);
        }
        let firm = FIRM * self.surface.largest() as f32;
        (goes_on < 1.0).then(|| firm * goes_on / (1.0 - goes_on))
    }
}
