//! Linearises the gaps, solves for forces and displaces the skin, in turn, until displacements
//! settle.

use super::{
    FORCE_MIN_N, FRAME_PRODUCTS_MAX, NEAR_MM, PRODUCTS_MAX, PRODUCTS_MIN, RELAXATION, SHARE,
    Solver, TURN_MAX, Until, VIOLATION_MM,
};
use crate::answer::Effort;
use crate::bounded::Symmetric;
use crate::objects::View;
use crate::patch::Slots;

impl Solver {
    /// Linearises and solves until displacements settle; returns their last change, mm.
    pub(super) fn iterate(
        &mut self,
        view: View<'_>,
        Until { settled_mm, iterations_max }: Until,
        effort: &mut Effort,
    ) -> f32 {
        let (mut relaxation, mut change) = (1.0f32, f32::INFINITY);
        for iteration in 0..iterations_max {
            effort.iterations += 1;
            self.measure(view, effort);
            self.choose_near();
            let taken = self.share_taken();
            self.remake_matrix();
            let left = FRAME_PRODUCTS_MAX.saturating_sub(effort.products);
            self.find_forces(view, 1.0 - 2.0 * taken, left, effort);
            relaxation = self.relax(relaxation, iteration == 0);
            change = self.follow() / relaxation.min(1.0);
            effort.work += self.patch.take_work();
            if change <= settled_mm {
                // Slots that carry no force have stood still meanwhile.
                self.displace(self.patch.vertices().len());
                self.measure_all(view, effort);
                if !self.any_far_inside() {
                    return change;
                }
            }
            if view.is_spent(effort) {
                break;
            }
        }
        self.displace(self.patch.vertices().len());
        self.measure_all(view, effort);
        effort.work += self.patch.take_work();
        change
    }

    /// Solves for forces with the compliance scaled by `scale`, of a frame with so many products
    /// `left`.
    pub(super) fn find_forces(
        &mut self,
        view: View<'_>,
        scale: f32,
        left: u32,
        effort: &mut Effort,
    ) {
        let entries = self.entries();
        // Along two tangents each product goes over four blocks.
        let [most, slips_most] =
            [entries, 4 * entries].map(|entries| view.most(left, entries, effort));
        let products = self.complement(scale, most);
        let slips = self.resist_slip(view, scale, slips_most);
        effort.products += products + slips;
        effort.work += (u64::from(products) + 4 * u64::from(slips)) * entries;
    }

    /// Entries of the matrix along normals.
    pub(super) fn entries(&self) -> u64 {
        (self.patch.near() as u64).pow(2).max(1)
    }

    pub(super) fn any_far_inside(&self) -> bool {
        let n = self.patch.vertices().len();
        self.patch.values.gap[self.patch.near()..n].iter().any(|gap| *gap < 0.0)
    }

    /// Lets every slot carry force that does or might.
    pub(super) fn choose_near(&mut self) {
        for slot in self.patch.near()..self.patch.vertices().len() {
            if self.patch.values.gap[slot] < NEAR_MM {
                self.patch.bring_near(slot);
                self.made = 0;
            }
        }
        for slot in (0..self.patch.near()).rev() {
            let v = &self.patch.values;
            if v.gap[slot] > 2.0 * NEAR_MM && v.size[slot] <= 0.0 {
                let Slots { force, found, change, .. } = &mut self.patch.values;
                for vector in [force, found, change] {
                    vector.iter_mut().for_each(|v| v[slot] = 0.0);
                }
                self.patch.send_far(slot);
                self.made = 0;
            }
        }
    }

    /// Share of the displacement in contact that the second order takes back.
    pub(super) fn share_taken(&self) -> f32 {
        let v = &self.patch.values;
        let (mut along, mut square) = (0.0f32, 0.0f32);
        for slot in 0..self.patch.near() {
            if v.size[slot] > 0.0 {
                for i in 0..3 {
                    let linear = v.linear[i][slot];
                    along += (linear - v.moved[i][slot]) * linear;
                    square += linear * linear;
                }
            }
        }
        if square > 0.0 { (along / square).clamp(SHARE[0], SHARE[1]) } else { 0.0 }
    }

    pub(super) fn remake_matrix(&mut self) {
        let m = self.patch.near();
        let v = &self.patch.values;
        let turned = |slot: usize| {
            (0..3).any(|i| (v.normal[i][slot] - self.made_for[i][slot]).abs() > TURN_MAX)
        };
        if self.made == m && !(0..m).any(turned) {
            return;
        }
        // Along normals, and between two tangents.
        let is_rough = self.friction.as_ref().is_some_and(|friction| friction.is_rough);
        self.patch.count(if is_rough { 46 } else { 10 } * m * m);
        self.patch.along_normals(&mut self.matrix);
        self.norm = Symmetric::new(&self.matrix, self.patch.stride(), m).norm;
        for (kept, normal) in self.made_for.iter_mut().zip(&self.patch.values.normal) {
            kept[..m].copy_from_slice(&normal[..m]);
        }
        self.made_with[..m].copy_from_slice(&self.patch.values.object[..m]);
        self.made = m;
        if let Some(friction) = &mut self.friction {
            friction.made = 0;
        }
    }

    /// Solves for the sizes of the forces with the compliance scaled by `scale`, of a frame with so
    /// many products `left`.
    pub(super) fn complement(&mut self, scale: f32, left: u32) -> u32 {
        let products_max = left.clamp(PRODUCTS_MIN, PRODUCTS_MAX);
        let Self { patch, bounded, matrix, norm, rest, .. } = self;
        let (m, stride) = (patch.near(), patch.stride());
        let Slots { force, found, normal, gap, size, .. } = &mut patch.values;
        let size = &mut size[..m];
        for slot in 0..m {
            size[slot] = (0..3).map(|i| force[i][slot] * normal[i][slot]).sum();
        }
        crate::kernels::multiply(matrix, stride, size, &mut rest[..m]);
        for slot in 0..m {
            rest[slot] = gap[slot] / scale - rest[slot];
        }
        let symmetric = Symmetric { values: matrix, stride, norm: *norm };
        let effort = bounded.solve(symmetric, &rest[..m], size, VIOLATION_MM, products_max);
        for slot in 0..m {
            for i in 0..3 {
                found[i][slot] = size[slot] * normal[i][slot];
            }
        }
        effort.products
    }

    /// Goes on from the forces towards those found, as far as Aitken's extrapolation of the last
    /// two changes says.
    pub(super) fn relax(&mut self, last: f32, first: bool) -> f32 {
        let m = self.patch.near();
        let Slots { force, found, change, .. } = &mut self.patch.values;
        let (mut along, mut square) = (0.0f32, 0.0f32);
        for i in 0..3 {
            for slot in 0..m {
                let new = found[i][slot] - force[i][slot];
                let turn = new - change[i][slot];
                along += change[i][slot] * turn;
                square += turn * turn;
                change[i][slot] = new;
            }
        }
        let aitken = if first || !(square > 0.0) { 1.0 } else { -last * along / square };
        let relaxation = aitken.clamp(RELAXATION[0], RELAXATION[1]);
        for i in 0..3 {
            for slot in 0..m {
                let new = force[i][slot] + relaxation * change[i][slot];
                // What fades must not become subnormal, which is slow.
                force[i][slot] = if new.abs() < FORCE_MIN_N { 0.0 } else { new };
            }
        }
        relaxation
    }

    /// Takes the forces gone on from for the answer: the mean of what an iteration that does not
    /// settle goes to and fro between.
    pub(super) fn take_mean(&mut self) {
        let m = self.patch.near();
        let Slots { force, found, normal, size, .. } = &mut self.patch.values;
        for slot in 0..m {
            let along: f32 = (0..3).map(|i| force[i][slot] * normal[i][slot]).sum();
            size[slot] = if along > FORCE_MIN_N { along } else { 0.0 };
            for i in 0..3 {
                found[i][slot] = size[slot] * normal[i][slot];
            }
        }
        if let Some(friction) = self.friction.as_mut().filter(|f| f.is_rough) {
            friction.take_mean(&mut self.patch);
        }
    }

    /// Displaces all slots; returns the largest change, mm.
    pub(super) fn follow(&mut self) -> f32 {
        let n = self.patch.near();
        let v = &mut self.patch.values;
        for (before, moved) in v.before.iter_mut().zip(&v.moved) {
            before[..n].copy_from_slice(&moved[..n]);
        }
        self.displace(n);
        let v = &self.patch.values;
        let mut change = 0.0f32;
        for (now, before) in v.moved.iter().zip(&v.before) {
            for (now, before) in now[..n].iter().zip(&before[..n]) {
                let by = (now - before).abs();
                // NaN must not hide behind a maximum.
                if !(by <= change) {
                    change = by;
                }
            }
        }
        change
    }
}
