//! Points and directions in three dimensions, `[x, y, z]`: the products and sizes that finite elements,
//! shapes, the atlas and contact need. Each sums in the order of the axes, so that all of them have the
//! same bits.

pub mod single;

/// `a . b`, summed in the order of the axes.
#[inline]
#[must_use]
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Euclidean norm.
#[inline]
#[must_use]
pub fn norm(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

/// `a x b`.
#[inline]
#[must_use]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a - b`.
#[inline]
#[must_use]
pub fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// `p + step v`.
#[inline]
#[must_use]
pub fn along(p: [f64; 3], step: f64, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| p[i] + step * v[i])
}

/// `v` scaled to one; zero stays zero.
#[inline]
#[must_use]
pub fn scaled_to_one(v: [f64; 3]) -> [f64; 3] {
    let size = norm(v);
    if size > 0.0 { v.map(|c| c / size) } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_product_stands_upright_on_both(
            a in prop::array::uniform3(-9.0f64..9.0),
            b in prop::array::uniform3(-9.0f64..9.0),
        ) {
            let n = cross(a, b);
            let size = norm(a) * norm(b);
            prop_assert!(dot(n, a).abs() <= 1e-14 * size * norm(a));
            prop_assert!(dot(n, b).abs() <= 1e-14 * size * norm(b));
            // Lagrange: |a x b|2 + (a . b)2 = |a|2 |b|2
            prop_assert!((dot(n, n) + dot(a, b).powi(2) - size * size).abs() <= 1e-12 * size * size);
            prop_assert_eq!(along(b, 1.0, minus(a, b)).map(|v| v.is_finite()), [true; 3]);
            prop_assert!((norm(scaled_to_one(a)) - 1.0).abs() < 4e-15 || norm(a) == 0.0);
            prop_assert!(norm(scaled_to_one([0.0; 3])) == 0.0);
        }
    }
}
