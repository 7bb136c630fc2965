//! Surfaces for tests. All are wound counter-clockwise as seen from outside.

use std::f64::consts::{FRAC_PI_2, PI};

pub(super) struct Shape {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A grid `rows x columns` of quads put in place by `point(s, t)`, `s` along the columns
    /// and `t` along the rows, both 0..1. Left and right halves are cut as mirror images.
    pub(super) fn grid(rows: usize, columns: usize, point: impl Fn(f64, f64) -> [f64; 3]) -> Self {
        let mut positions = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                positions.push(point(column as f64 / columns as f64, row as f64 / rows as f64));
            }
        }
        let vertex = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [vertex(row, column), vertex(row, column + 1)];
                let [c, d] = [vertex(row + 1, column), vertex(row + 1, column + 1)];
                if 2 * column < columns {
                    triangles.extend([[a, c, d], [a, d, b]]);
                } else {
                    triangles.extend([[a, c, b], [b, c, d]]);
                }
            }
        }
        Self { positions, triangles }
    }

    pub(super) fn flatten(
        &self,
        method: super::Method,
    ) -> Result<super::Flattening, super::FlattenError> {
        super::flatten(&self.positions, &self.triangles, method)
    }
}

/// A sector of a cylinder about `x`, below it: radius 7, 20 long, 140 degrees.
pub(super) fn cylinder_sector() -> Shape {
    Shape::grid(12, 18, |s, t| {
        let angle = (0.5 - s) * 140.0_f64.to_radians();
        [20.0 * t, 7.0 * angle.sin(), -7.0 * angle.cos()]
    })
}

/// The square grid drawn onto a spherical cap of radius 1 about `-z`, `half_angle` wide.
pub(super) fn spherical_cap(n: usize, half_angle: f64) -> Shape {
    Shape::grid(n, n, |s, t| {
        let (a, b) = (2.0 * t - 1.0, 1.0 - 2.0 * s);
        // Square to disc by concentric squares, then disc to cap by arc length.
        let radius = a.abs().max(b.abs());
        let length = a.hypot(b).max(f64::MIN_POSITIVE);
        let polar = radius * half_angle;
        [polar.sin() * a / length, polar.sin() * b / length, -polar.cos()]
    })
}

/// A finger-like tongue: the palmar half of an ellipsoid cap and of a tapered elliptic
/// cylinder, `inset` mm inside the skin. `n` quads across.
pub(super) fn tongue(n: usize, inset: f64) -> Shape {
    let (cap, length) = (7.5, 25.0);
    Shape::grid(2 * n, n, |s, t| {
        let angle = (0.5 - s) * PI * 1.1;
        // The first 45 % of the rows run over the cap, from near its pole.
        let (x, taper) = if t < 0.45 {
            let polar = 0.12 + (FRAC_PI_2 - 0.12) * t / 0.45;
            (cap * (1.0 - polar.cos()), polar.sin())
        } else {
            (cap + (length - cap) * (t - 0.45) / 0.55, 1.0)
        };
        let wide = 1.0 + 0.008 * (x - cap).max(0.0);
        let (y, z) = ((8.0 * wide - inset) * taper, (6.0 * wide - inset) * taper);
        [x + inset * (1.0 - x / length), y * angle.sin(), -z * angle.cos()]
    })
}

/// A closed octahedron.
pub(super) fn octahedron() -> Shape {
    let positions = vec![
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let around = |k: u32| (k, (k + 1) % 4);
    let upper = (0..4).map(|k| [around(k).0, around(k).1, 4]);
    let lower = (0..4).map(|k| [around(k).1, around(k).0, 5]);
    Shape { positions, triangles: upper.chain(lower).collect() }
}
