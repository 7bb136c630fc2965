//! The compliance between the pixels of a window.

use super::convolution::{Cells, Convolution};
use crate::bounded::Operator;

/// Compliance between the pixels of a window.
pub(super) struct Nearby<'a> {
    pub convolution: &'a mut Convolution,
    pub cells: Cells<'a>,
    /// How far the object gives way at each pixel, mm/MPa.
    pub give: &'a [f32],
    /// How far it leaves gaps near the skin's edge, mm/MPa.
    pub ease: &'a [f32],
    pub norm: f32,
    pub beside: &'a [[u32; 4]],
    /// `1 / h^2` by the pixels' distances `h` down and along rows, and `k^2` by the wave number in
    /// the middle, mm^-2.
    pub bends: [f32; 3],
    /// Whether the frame starts from the last one's pressure: contact that shrinks then does so by
    /// whole rows of pixels.
    pub is_warm: bool,
}

impl Operator for Nearby<'_> {
    fn norm(&self) -> f32 {
        self.norm
    }

    fn times(&mut self, x: &[f32], y: &mut [f32]) {
        let grid = self.convolution.press_rows(self.cells, x);
        let gives = self.give.iter().zip(self.ease);
        for (((cell, (give, ease)), x), y) in self.cells.own.iter().zip(gives).zip(x).zip(y) {
            *y = grid[*cell as usize] + (give + ease) * x;
        }
    }

    fn lets_go_at_once(&self) -> bool {
        self.is_warm
    }

    /// Compliance falls as `1 / k` with the wave number: `-laplacian + k^2` over it is as large for
    /// the longest waves as for the shortest, and half of it in the middle.
    fn towards_inverse(&self, r: &[f32], f: &[f32], z: &mut [f32]) {
        let [down, along, middle] = self.bends;
        let at = |slot: u32| r.get(slot as usize).copied().unwrap_or(0.0);
        for (i, (z, sides)) in z.iter_mut().zip(self.beside).enumerate() {
            *z = 0.0;
            if f[i] > 0.0 {
                let [up, low, left, right] = sides.map(at);
                *z = middle * r[i]
                    + down * (2.0 * r[i] - up - low)
                    + along * (2.0 * r[i] - left - right);
            }
        }
    }
}
