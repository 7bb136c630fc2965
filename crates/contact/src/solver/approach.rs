//! Moves objects that have jumped deep into the skin in by steps.

use super::{BACK_MAX_MM, STEP_MM, STEPS_MAX, Solver, Until};
use crate::answer::Effort;
use crate::objects::View;
use crate::patch::Patch;
use papilla_vector::norm;

impl Solver {
    /// Brings objects in by steps that lie too deep in the displaced skin.
    pub(super) fn approach(&mut self, view: View<'_>, effort: &mut Effort) {
        self.measure_all(view, effort);
        let n = self.patch.vertices().len();
        let deepest = |patch: &Patch| patch.values.gap[..n].iter().copied().fold(0.0, f32::min);
        if f64::from(deepest(&self.patch)) >= -STEP_MM {
            return;
        }
        let Some(away) = self.way_back() else { return };
        let mut back = 0.0;
        let held = |back: f64| View {
            shift_mm: std::array::from_fn(|i| view.shift_mm[i] + back * away[i]),
            ..view
        };
        while back < BACK_MAX_MM && !view.is_spent(effort) {
            let deep = -f64::from(deepest(&self.patch));
            if deep <= STEP_MM {
                break;
            }
            back += (deep - 0.5 * STEP_MM).max(0.1 * STEP_MM);
            self.measure_all(held(back), effort);
        }
        let steps = (back / STEP_MM).ceil().min(f64::from(STEPS_MAX)) as u32;
        for step in 0..steps {
            let left = back * (1.0 - f64::from(step) / f64::from(steps));
            if view.is_spent(effort) {
                break;
            }
            self.iterate(held(left), Until::ON_THE_WAY, effort);
        }
    }

    /// The mean outward normal of the skin that lies in objects.
    pub(super) fn way_back(&self) -> Option<[f64; 3]> {
        let mut sum = [0.0; 3];
        for (&vertex, gap) in self.patch.vertices().iter().zip(&self.patch.values.gap) {
            let normal = self.model.normals[vertex as usize];
            for i in 0..3 {
                sum[i] += f64::from(normal[i]) * f64::from((-gap).max(0.0));
            }
        }
        let size = norm(sum);
        (size > 0.0).then(|| sum.map(|v| v / size))
    }
}
