//! Pressure that is linear between vertices, and sums of the pressure on pixels over the hat
//! functions of the vertices.

use super::Window;
use crate::model::ContactModel;
use crate::pixels::PixelSkin;

/// Most area that a pixel at the skin's edge stands for, over its own.
const BEYOND_MAX: f32 = 3.0;

impl Window {
    /// Areas of the vertices' hats. Those at the skin's edge reach beyond the map: pixels there stand
    /// for what lies beyond, too.
    pub(in super::super) fn measure_hats(&mut self, skin: &PixelSkin, model: &ContactModel) {
        self.sum_hats(skin);
        for slot in self.free()..self.entries.len() {
            let pixel = &skin.raster.pixels()[self.entries[slot] as usize];
            let beyond = |vertex: &u32| {
                let vertex = *vertex as usize;
                (model.areas_mm2[vertex] / self.hat_mm2[vertex]).clamp(1.0, BEYOND_MAX)
            };
            let corners = pixel.vertices.iter().zip(pixel.weights);
            self.area_mm2[slot] *= corners.map(|(v, w)| w * beyond(v)).sum::<f32>();
        }
        if !self.held.is_empty() {
            self.sum_hats(skin);
        }
    }

    fn sum_hats(&mut self, skin: &PixelSkin) {
        self.hat_mm2.fill(0.0);
        for (entry, area) in self.entries.iter().zip(&self.area_mm2) {
            let pixel = &skin.raster.pixels()[*entry as usize];
            for (vertex, weight) in pixel.vertices.iter().zip(pixel.weights) {
                self.hat_mm2[*vertex as usize] += weight * area;
            }
        }
    }

    /// Pressure of the vertices' forces, linear between them, MPa.
    pub(in super::super) fn press_forces(&mut self, skin: &PixelSkin, pressure: &mut [f32]) {
        let force_n = std::mem::take(&mut self.force_n);
        self.press_hats(skin, &force_n, pressure);
        self.force_n = force_n;
    }

    /// Pressure of forces of the vertices, linear between them, MPa.
    pub(in super::super) fn press_hats(
        &mut self,
        skin: &PixelSkin,
        force_n: &[Vec<f32>; 3],
        pressure: &mut [f32],
    ) {
        let [x, y, z] = force_n;
        // Corners of the pixels' triangles are among these.
        for vertex in self.ids.iter().map(|id| *id as usize) {
            let square = x[vertex].powi(2) + y[vertex].powi(2) + z[vertex].powi(2);
            self.hat_mpa[vertex] = square.sqrt() / self.hat_mm2[vertex].max(1e-3);
        }
        for (slot, entry) in self.entries.iter().enumerate() {
            let pixel = &skin.raster.pixels()[*entry as usize];
            let corners = pixel.vertices.iter().zip(pixel.weights);
            pressure[slot] = corners.map(|(v, w)| w * self.hat_mpa[*v as usize]).sum();
        }
    }

    /// Sums the pixels' pressure to forces of the vertices.
    pub(in super::super) fn sum_forces(
        &mut self,
        skin: &PixelSkin,
        pressure: &[f32],
        force_n: &mut [Vec<f32>; 3],
    ) {
        for force in force_n.iter_mut() {
            force.fill(0.0);
        }
        self.hat_n.fill(0.0);
        for (slot, entry) in self.entries.iter().enumerate().filter(|(i, _)| pressure[*i] > 0.0) {
            let size = pressure[slot] * self.area_mm2[slot];
            let pixel = &skin.raster.pixels()[*entry as usize];
            for (vertex, weight) in pixel.vertices.iter().zip(pixel.weights) {
                self.hat_n[*vertex as usize] += weight * size;
                for (force, normal) in force_n.iter_mut().zip(self.normal[slot]) {
                    force[*vertex as usize] += weight * size * normal;
                }
            }
        }
    }

    /// Mean traction along the skin under a vertex' hat, MPa.
    pub(in super::super) fn vertex_traction(&self, vertex: usize) -> [f32; 3] {
        let area = self.hat_mm2[vertex];
        [0, 1, 2].map(|i| if area > 0.0 { self.shear_n[i][vertex] / area } else { 0.0 })
    }

    /// Mean pressure under a vertex' hat, MPa.
    pub(in super::super) fn vertex_pressure(&self, vertex: usize) -> f32 {
        if self.hat_mm2[vertex] > 0.0 { self.hat_n[vertex] / self.hat_mm2[vertex] } else { 0.0 }
    }
}
