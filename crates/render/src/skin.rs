//! Which pixels show skin.

use papilla_proto::{MAP_SIDE_PX, PixelMask, atlas::Raster};
use papilla_session_contact::Finger;

/// Share of the greatest pressure that none of 2824 FE states has at the edge of the atlas: it is
/// zero there in all of them.
const RIM_SHARE: f32 = 0.01;

/// The pixels that show skin, and those of them at the edge of the atlas.
#[derive(Debug, Clone)]
pub struct SkinPixels {
    pub(crate) mask: PixelMask,
    rim: Vec<usize>,
}

impl From<&Raster> for SkinPixels {
    fn from(skin: &Raster) -> Self {
        Self { mask: PixelMask::from(skin.mask()), rim: rim(skin.mask()) }
    }
}

impl SkinPixels {
    /// Whether a map whose greatest pressure is `peak_pa` presses at the edge of the atlas, so that
    /// what lies beyond is missing.
    #[must_use]
    pub fn are_cut_off(&self, pressure_pa: &[f32], peak_pa: f32) -> bool {
        let least_pa = RIM_SHARE * peak_pa;
        self.rim.iter().any(|&i| pressure_pa.get(i).is_some_and(|p| *p > least_pa))
    }

    /// The same of the pressure that a finger's contact found, whose map has not been drawn.
    #[must_use]
    pub fn are_cut_off_in(&self, finger: &Finger) -> bool {
        finger.presses_on(&self.rim, RIM_SHARE)
    }
}

/// The pixels of a mask that have a neighbour outside of it.
fn rim(mask: &[bool]) -> Vec<usize> {
    let is_inside = |row: usize, column: usize| {
        row < MAP_SIDE_PX && column < MAP_SIDE_PX && mask[row * MAP_SIDE_PX + column]
    };
    let is_rim = |&i: &usize| {
        let (row, column) = (i / MAP_SIDE_PX, i % MAP_SIDE_PX);
        let sides = [(0, 1), (2, 1), (1, 0), (1, 2)];
        // Before row or column 0 the difference wraps, and lies outside.
        let is_off = |(down, across): (usize, usize)| {
            !is_inside((row + down).wrapping_sub(1), (column + across).wrapping_sub(1))
        };
        mask[i] && sides.into_iter().any(is_off)
    };
    (0..mask.len()).filter(is_rim).collect()
}

#[cfg(test)]
mod tests {
    use papilla_proto::MAP_LEN;

    use super::*;

    #[test]
    fn the_rim_of_a_square_is_its_edge_also_at_the_map_s_own() {
        let square = |from: usize, side: usize| {
            let within = from..from + side;
            let at = |i| within.contains(&(i / MAP_SIDE_PX)) && within.contains(&(i % MAP_SIDE_PX));
            (0..MAP_LEN).map(at).collect::<Vec<bool>>()
        };
        assert_eq!(rim(&square(100, 5)).len(), 16);
        assert_eq!(rim(&square(0, MAP_SIDE_PX)).len(), 4 * (MAP_SIDE_PX - 1));
        assert!(rim(&vec![false; MAP_LEN]).is_empty());
    }
}
