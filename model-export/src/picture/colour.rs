//! The colours of pictures of a sample: numbers from 0 to 1 as red, green and blue.

use papilla_output::canvas::viridis;

/// How a number in 0..=1 becomes a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scale {
    /// Dark to light: [`viridis`], as in every picture of this project.
    Rising,
    /// Blue below, white at 0.5, red above.
    Signed,
}

const SIGNED: [[u8; 3]; 5] =
    [[12, 44, 132], [92, 150, 216], [255, 255, 255], [232, 118, 82], [150, 10, 30]];

impl Scale {
    /// Colour of `part`, held to 0..=1.
    pub(super) fn colour(self, part: f32) -> [u8; 3] {
        if self == Self::Rising {
            return viridis(f64::from(part));
        }
        let place = part.clamp(0.0, 1.0) * (SIGNED.len() - 1) as f32;
        let below = (place as usize).min(SIGNED.len() - 2);
        let share = place - below as f32;
        let (a, b) = (SIGNED[below], SIGNED[below + 1]);
        std::array::from_fn(|i| {
            (f32::from(a[i]) + share * (f32::from(b[i]) - f32::from(a[i]))).round() as u8
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{SIGNED, Scale, viridis};

    #[test]
    fn ends_and_middle_are_the_tables() {
        assert_eq!(Scale::Rising.colour(-1.0), viridis(0.0));
        assert_eq!(Scale::Rising.colour(2.0), viridis(1.0));
        assert_eq!(Scale::Signed.colour(0.5), SIGNED[2]);
        assert_eq!(Scale::Signed.colour(1.0), SIGNED[4]);
    }

    #[test]
    fn the_rising_scale_gets_lighter_all_the_way() {
        let light = |c: [u8; 3]| {
            0.2126 * f32::from(c[0]) + 0.7152 * f32::from(c[1]) + 0.0722 * f32::from(c[2])
        };
        let mut before = -1.0;
        for i in 0..=64 {
            let now = light(Scale::Rising.colour(i as f32 / 64.0));
            assert!(now > before, "step {i}");
            before = now;
        }
    }
}
