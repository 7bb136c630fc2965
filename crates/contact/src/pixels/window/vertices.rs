//! The vertices that move a window's pixels.

use super::{NONE, Window};
use crate::kernels::{DisplaceRuns, run};
use crate::model::ContactModel;
use crate::pixels::PixelSkin;
use crate::second_order::Amplitudes;

/// Columns that are taken together.
pub(super) const BLOCK: usize = 8;

impl Window {
    /// Moves the stencils' vertices under the vertices' forces.
    pub(in super::super) fn displace(
        &mut self,
        skin: &PixelSkin,
        model: &ContactModel,
        amplitudes: Option<&mut Amplitudes>,
    ) {
        let v = model.vertices();
        self.touched.clear();
        for vertex in 0..v {
            if (0..3).any(|i| self.force_n[i][vertex] != 0.0) {
                let at = self.touched.len();
                self.touched.push(vertex as u32);
                for i in 0..3 {
                    self.packed[i][at] = self.force_n[i][vertex];
                }
            }
        }
        self.find_runs(model);
        run(DisplaceRuns {
            compliance: &model.compliance,
            columns: v,
            ids: &self.ids,
            runs: &self.runs,
            force: &self.dense,
            moved: &mut self.linear,
        });
        self.correct(skin, model);
        if let (Some(a), Some(s)) = (amplitudes, &model.second_order) {
            let m = self.touched.len();
            let [x, y, z] = &self.packed;
            s.evaluate(&self.touched, [&x[..m], &y[..m], &z[..m]], a);
            s.displace(a, &self.ids, &self.linear, &mut self.moved);
        } else {
            for (moved, linear) in self.moved.iter_mut().zip(&self.linear) {
                moved.copy_from_slice(linear);
            }
        }
    }

    /// Spreads the packed forces over the compliance's columns, and finds runs of those that are
    /// not 0.
    fn find_runs(&mut self, model: &ContactModel) {
        self.dense.iter_mut().for_each(|force| force.fill(0.0));
        self.blocks.fill(false);
        for (k, vertex) in self.touched.iter().enumerate() {
            let column = model.rank[*vertex as usize] as usize;
            self.blocks[column / BLOCK] = true;
            for (dense, packed) in self.dense.iter_mut().zip(&self.packed) {
                dense[column] = packed[k];
            }
        }
        self.runs.clear();
        for (block, _) in self.blocks.iter().enumerate().filter(|(_, is_touched)| **is_touched) {
            let (first, last) = (block * BLOCK, ((block + 1) * BLOCK).min(model.vertices()));
            match self.runs.last_mut() {
                Some(run) if run[1] == first => run[1] = last,
                _ => self.runs.push([first, last]),
            }
        }
    }

    /// Puts the skin's own dents in the place of the mesh's.
    fn correct(&mut self, skin: &PixelSkin, model: &ContactModel) {
        for (k, vertex) in self.touched.iter().enumerate() {
            let normal = model.normals[*vertex as usize];
            let force: f32 = normal.iter().zip(&self.packed).map(|(n, f)| n * f[k]).sum();
            let near = &skin.corrections[*vertex as usize];
            for (other, by) in near.vertices.iter().zip(near.weights) {
                let slot = self.place[usize::from(*other)];
                if slot == NONE {
                    continue;
                }
                let normal = model.normals[usize::from(*other)];
                for (linear, n) in self.linear.iter_mut().zip(normal) {
                    linear[slot as usize] += by * force * n;
                }
            }
        }
    }

    /// Displacement of the stencils' vertices in a grid of displacements.
    pub(in super::super) fn own_dents(
        &mut self,
        skin: &PixelSkin,
        grid: &[f32],
        [rows, columns]: [usize; 2],
    ) {
        for id in &self.ids {
            let [u, v] = skin.uv_px[*id as usize];
            let [x, y] = [u - 0.5 - self.first[1] as f32, v - 0.5 - self.first[0] as f32];
            let (left, top) = (x.floor(), y.floor());
            let at = |down: i32, right: i32| {
                let row = (top as i32 + down).rem_euclid(rows as i32) as usize;
                let column = (left as i32 + right).rem_euclid(columns as i32) as usize;
                grid[row * columns + column]
            };
            let (a, b) = (x - left, y - top);
            self.dent_mm[*id as usize] = (1.0 - b) * ((1.0 - a) * at(0, 0) + a * at(0, 1))
                + b * ((1.0 - a) * at(1, 0) + a * at(1, 1));
        }
    }
}
