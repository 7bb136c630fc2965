//! Slopes of functions that are linear on triangles.

use papilla_vector::{cross, minus, norm, scaled_to_one};

/// What a triangle adds to slopes at its corners.
#[derive(Debug)]
pub(crate) struct Slopes {
    /// Gradients of the hat functions of its corners, times its area.
    pub(crate) corners: [[f32; 3]; 3],
    /// mm2.
    pub(crate) area_mm2: f32,
}

/// Slopes of each triangle.
pub(crate) fn slopes(positions_mm: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<Slopes> {
    let of = |corners: &[u32; 3]| {
        let x = corners.map(|c| positions_mm[c as usize]);
        let side = |a: usize, b: usize| minus(x[b], x[a]);
        let double = cross(side(0, 1), side(0, 2));
        let size = norm(double);
        let unit = scaled_to_one(double);
        // The gradient of a corner's hat function is the unit normal turned across the opposite
        // side, over twice the area.
        let across = |k: usize| cross(unit, side((k + 1) % 3, (k + 2) % 3));
        let corners = [0, 1, 2].map(|k| across(k).map(|v| (0.5 * v) as f32));
        Slopes { corners, area_mm2: (0.5 * size) as f32 }
    };
    triangles.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_a_linear_function() {
        let x = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.5, 1.5, 0.0]];
        let slopes = slopes(&x, &[[0, 1, 2]]);
        let value = |p: [f64; 3]| (3.0 * p[0] - 2.0 * p[1]) as f32;
        assert!((slopes[0].area_mm2 - 1.5).abs() < 1e-6);
        for (i, due) in [3.0, -2.0, 0.0].into_iter().enumerate() {
            let found: f32 =
                (0..3).map(|k| value(x[k]) * slopes[0].corners[k][i]).sum::<f32>() / 1.5;
            assert!((found - due).abs() < 1e-5, "{i}: {found}");
        }
    }
}
