//! Which pixels are solved for, and what a map shows between them.

use papilla_atlas::MAP_SIDE_PX;

/// How far the pixels that are solved for are apart, along rows and down them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PixelSpacing {
    /// One pixel: each is solved for.
    #[default]
    One,
    /// Two pixels: in half the time, less accurate, under narrow shapes most.
    Two,
}

/// Keys' parameter, the slope of a step's overshoot: 0 does not overshoot, -0.5 is exact for
/// parabolas. Between, maps of training indentations were closest to FE's pressure in pixels' middles.
const KEYS: f64 = -0.3;
/// Points of a pixel at which the cubic is read for its mean.
const READ: i32 = 64;

impl PixelSpacing {
    pub(super) const fn px(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two => 2,
        }
    }

    /// Whether a pixel of the map, told by its index, is solved for.
    pub(super) const fn takes(self, index: u32) -> bool {
        let index = index as usize;
        (index / MAP_SIDE_PX).is_multiple_of(self.px())
            && (index % MAP_SIDE_PX).is_multiple_of(self.px())
    }

    /// Means over pixels, one after the other, of the cubic that is 1 at a pixel that is solved for and
    /// 0 at all others (Keys, IEEE Trans. Acoustics, Speech and Signal Processing 29, 1981).
    pub(super) fn shares(self) -> Vec<f32> {
        let step = self.px() as i32;
        let reach = 2 * step;
        let read = |pixel: i32, point: i32| {
            let x = f64::from(pixel) - 0.5 + (f64::from(point) + 0.5) / f64::from(READ);
            cubic(x.abs() / f64::from(step))
        };
        let mean = |pixel| (0..READ).map(|point| read(pixel, point)).sum::<f64>() / f64::from(READ);
        (-reach..=reach).map(|pixel| mean(pixel) as f32).collect()
    }
}

fn cubic(x: f64) -> f64 {
    let a = KEYS;
    if x < 1.0 {
        (a + 2.0) * x.powi(3) - (a + 3.0) * x.powi(2) + 1.0
    } else if x < 2.0 {
        a * (x.powi(3) - 5.0 * x.powi(2) + 8.0 * x - 4.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the spacing, equal pressure is shown as it is.
    #[test]
    fn shares_of_all_pixels_that_reach_one_sum_to_one() {
        for spacing in [PixelSpacing::One, PixelSpacing::Two] {
            let (shares, step) = (spacing.shares(), spacing.px());
            for first in 0..step {
                let sum: f32 = shares.iter().skip(first).step_by(step).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{spacing:?} {first}: {sum}");
            }
        }
    }
}
