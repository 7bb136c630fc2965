//! Traction along the skin on pixels.
//!
//! The vertices find where the skin sticks and where it slips, by their normal forces `N_v` and
//! their forces along the skin `Q_v`. At a pixel under the pressure `p` the traction is
//!
//! ```text
//! q = p r,   r = sum_v w_v Q_v / sum_v w_v N_v,   |r| <= mu
//! ```
//!
//! The `w_v` are the weights of the corners of its triangle. Of `r` only the part along the surface
//! of the object counts. If no corner is under force, `r` is that of the whole contact. So what
//! sticks or slips at vertices does so on pixels. Skin that slips everywhere is pulled with `mu`
//! times the normal force of the pixels.

use super::PixelSkin;
use super::window::Window;
use crate::solver::Solver;

/// Forces of one frame's vertices, N.
#[derive(Debug)]
pub(super) struct Rubbing {
    is_rough: bool,
    /// By vertex: normal, and along the skin.
    normal_n: Vec<f32>,
    along_n: Vec<[f32; 3]>,
    /// Force along the skin over the normal force of all vertices.
    whole: [f32; 3],
}

impl Rubbing {
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            is_rough: false,
            normal_n: vec![0.0; vertices],
            along_n: vec![[0.0; 3]; vertices],
            whole: [0.0; 3],
        }
    }

    /// Whether anything of the frame has friction.
    pub(super) fn is_rough(&self) -> bool {
        self.is_rough
    }

    /// Takes what vertices found, from which the frame's first round starts.
    pub(super) fn begin(&mut self, solver: &Solver, shear_n: &mut [Vec<f32>; 3]) {
        let was_rough = self.is_rough;
        if was_rough {
            self.normal_n.fill(0.0);
            self.along_n.fill([0.0; 3]);
            shear_n.iter_mut().for_each(|shear| shear.fill(0.0));
        }
        let (mut normal, mut along) = (0.0, [0.0; 3]);
        let Self { normal_n, along_n, .. } = self;
        self.is_rough = solver.each_rubbed(|vertex, size, shear| {
            (normal_n[vertex], along_n[vertex]) = (size, shear);
            normal += size;
            for i in 0..3 {
                along[i] += shear[i];
                shear_n[i][vertex] = shear[i];
            }
        });
        self.whole = along.map(|q| if normal > 0.0 { q / normal } else { 0.0 });
    }

    /// Traction over pressure at a pixel of the window.
    pub(super) fn ratio(&self, skin: &PixelSkin, window: &Window, slot: usize) -> [f32; 3] {
        let pixel = &skin.raster.pixels()[window.entries[slot] as usize];
        let (mut normal, mut along) = (0.0, [0.0; 3]);
        for (vertex, weight) in pixel.vertices.iter().zip(pixel.weights) {
            normal += weight * self.normal_n[*vertex as usize];
            for (sum, q) in along.iter_mut().zip(self.along_n[*vertex as usize]) {
                *sum += weight * q;
            }
        }
        let ratio = if normal > 0.0 { along.map(|q| q / normal) } else { self.whole };
        let out_of_plane: f32 = ratio.iter().zip(window.normal[slot]).map(|(r, n)| r * n).sum();
        let flat: [f32; 3] =
            std::array::from_fn(|i| ratio[i] - out_of_plane * window.normal[slot][i]);
        let size = flat.iter().map(|r| r * r).sum::<f32>().sqrt();
        let bound = window.friction[slot];
        if size > bound { flat.map(|r| r * bound / size) } else { flat }
    }

    /// Sums the traction under the pixels' pressure (MPa) to forces of the vertices, N.
    pub(super) fn sum_forces(&self, skin: &PixelSkin, window: &mut Window, pressure: &[f32]) {
        if !self.is_rough {
            return;
        }
        let mut shear_n = std::mem::take(&mut window.shear_n);
        shear_n.iter_mut().for_each(|shear| shear.fill(0.0));
        for (slot, p) in pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            let ratio = self.ratio(skin, window, slot);
            let size = p * window.area_mm2[slot];
            let pixel = &skin.raster.pixels()[window.entries[slot] as usize];
            for (vertex, weight) in pixel.vertices.iter().zip(pixel.weights) {
                for (shear, ratio) in shear_n.iter_mut().zip(ratio) {
                    shear[*vertex as usize] += weight * size * ratio;
                }
            }
        }
        window.shear_n = shear_n;
    }
}
