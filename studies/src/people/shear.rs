//! Which way the epidermis shears where it touches a plate that presses on.
//!
//! Optical coherence tomography tells two shears of a ridge apart: it tilts sideways, so that what
//! lies higher moves along the skin (*horizontal*), or one of its flanks sinks beside the other
//! (*vertical*). Here skin is smooth. The change from one state of contact to another is looked at, for
//! the skin is turned as a whole when it comes to touch.

use crate::people::PeopleError;
use crate::people::gradients::STORED;
use crate::people::press::{Press, Subject};
use crate::people::solution::{Reads, held_at};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_solid::tensor::{Kinematics, Mat3, product};
use std::path::Path;

/// Skin nearer to the plate than this touches, mm.
const TOUCH_MM: f64 = 0.005;

/// Root mean square of vertical over that of horizontal shear between two forces, where the skin
/// touches the plate already at the smaller one.
pub(crate) fn ratio(
    subject: &Subject,
    forces_n: [f64; 2],
    folder: &Path,
) -> Result<f64, PeopleError> {
    let press = Press::plate(0.0, subject.clone());
    let held = held_at(&press, &forces_n, Density::Coarse, Reads::Gradients, folder)?;
    let [from, to] = [&held.states[0].felt[0], &held.states[1].felt[0]];
    let gradient = |stored: &[Vec<f64>], place: usize| -> Mat3 {
        std::array::from_fn(|i| std::array::from_fn(|j| stored[3 * i + j][place]))
    };
    let touches = (0..from[0].len()).filter(|&p| from[STORED - 1][p] <= TOUCH_MM);
    let (mut vertical, mut horizontal) = (0.0, 0.0);
    for place in touches {
        let [v, h] = shears_squared(gradient(from, place), gradient(to, place));
        vertical += v;
        horizontal += h;
    }
    Ok((vertical / horizontal).sqrt())
}

/// Squares of vertical and of horizontal shear from one displacement gradient to another, the plate's
/// normal along z: of `F2 F1^-1`.
fn shears_squared(from: Mat3, to: Mat3) -> [f64; 2] {
    let back = Kinematics::new(from).f_inverse();
    let change = product(&Kinematics::new(to).f, &back);
    let square = |i: usize, j: usize| change[i][j].powi(2);
    [square(2, 0) + square(2, 1), square(0, 2) + square(1, 2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ridge whose flank sinks shears vertically, one that tilts sideways horizontally, whatever
    /// happened before.
    #[test]
    fn sinking_is_vertical_and_tilting_horizontal() {
        let before = [[0.1, 0.02, 0.0], [0.0, -0.05, 0.01], [0.0, 0.0, -0.2]];
        let after = |shear: Mat3| {
            let f = product(&Kinematics::new(shear).f, &Kinematics::new(before).f);
            let one = |i: usize, j: usize| f64::from(u8::from(i == j));
            std::array::from_fn(|i| std::array::from_fn(|j| f[i][j] - one(i, j)))
        };
        let sunk = shears_squared(before, after([[0.0; 3], [0.0; 3], [0.0, 0.3, 0.0]]));
        assert!((sunk[0] - 0.09).abs() < 1e-12 && sunk[1] < 1e-24, "{sunk:?}");
        let tilted = shears_squared(before, after([[0.0, 0.0, 0.2], [0.0; 3], [0.0; 3]]));
        assert!((tilted[1] - 0.04).abs() < 1e-12 && tilted[0] < 1e-24, "{tilted:?}");
    }
}
