//! The vertices that move a window's pixels.

use super::{NONE, Window};
use crate::model::ContactModel;
use crate::pixels::PixelSkin;
use crate::second_order::Amplitudes;
use papilla_atlas::MAP_SIDE_PX;

impl Window {
    /// Moves the stencils' vertices under the vertices' forces.
    pub(in super::super) fn displace(
        &mut self,
        skin: &PixelSkin,
        model: &ContactModel,
        amplitudes: Option<&mut Amplitudes>,
    ) {
        let Self { push, close, force_n, shear_n, moving, ids, linear, .. } = self;
        push.take(model, |vertex| [0, 1, 2].map(|i| force_n[i][vertex] + shear_n[i][vertex]));
        let forces = (push.vertices(), push.forces());
        if !close.displace(model, forces, ids, linear) {
            push.displace(model, [moving, ids], linear);
        }
        self.correct(skin, model);
        let Self { push, ids, linear, moved, .. } = self;
        push.add_second_order(model, amplitudes, ids, linear, moved);
        for (slot, id) in self.ids.iter().enumerate() {
            let rest = model.positions_mm[*id as usize];
            for i in 0..3 {
                self.vertices[*id as usize][i] = rest[i] as f32 + self.moved[i][slot];
            }
        }
    }

    /// Fills in how far these vertices have moved: as the pixel that shows them, if there is one.
    pub(in super::super) fn moved_near(
        &self,
        skin: &PixelSkin,
        model: &ContactModel,
        moved: &mut [Vec<f32>; 3],
    ) {
        for id in &self.ids {
            let vertex = *id as usize;
            let of_pixel = self.pixel_at(skin.uv_px[vertex]).map(|slot| {
                let rest = skin.rest_mm[self.entries[slot] as usize];
                let (at, own, inward) = (self.at_mm[slot], self.own_mm[slot], self.inward[slot]);
                [0, 1, 2].map(|i| at[i] + own * inward[i] - rest[i])
            });
            let (now, rest) = (self.vertices[vertex], model.positions_mm[vertex]);
            let by = of_pixel.unwrap_or([0, 1, 2].map(|i| now[i] - rest[i] as f32));
            for (moved, by) in moved.iter_mut().zip(by) {
                moved[vertex] = by;
            }
        }
    }

    /// The pixel at a place of the map, or one beside it where not all are looked at.
    fn pixel_at(&self, [u, v]: [f32; 2]) -> Option<usize> {
        let [column, row] = [u, v].map(|c| c.max(0.0) as usize);
        let beside = [[0, 0], [0, 1], [1, 0], [1, 1]];
        let mut slots = beside.iter().filter_map(|[down, right]| {
            let [row, column] = [row + down, column + right];
            let inside = row < MAP_SIDE_PX && column < MAP_SIDE_PX;
            let slot = inside.then(|| self.slot[row * MAP_SIDE_PX + column])?;
            (slot != NONE).then_some(slot as usize)
        });
        slots.next()
    }

    /// Puts the skin's own dents in the place of the mesh's.
    fn correct(&mut self, skin: &PixelSkin, model: &ContactModel) {
        let forces = self.push.forces();
        for (k, vertex) in self.push.vertices().iter().enumerate() {
            let normal = model.normals[*vertex as usize];
            let force: f32 = normal.iter().zip(forces).map(|(n, f)| n * f[k]).sum();
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
            let [x, y] = [u, v].map(|c| (c - 0.5) / self.step_px as f32);
            let [x, y] = [x - self.first[1] as f32, y - self.first[0] as f32];
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
