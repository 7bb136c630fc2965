//! Formulas of the shape functions on the lattice `{-1, 0, 1}^d` and the simplex.

/// Edges of a tetrahedron in the order of its mid-edge nodes (VTK).
pub const TET10_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Linear function of the node at `at` (-1 or 1) and its slope.
pub(crate) fn linear_1d(at: i8, x: f64) -> (f64, f64) {
    let s = f64::from(at);
    (0.5 * (1.0 + s * x), 0.5 * s)
}

/// Quadratic Lagrange function of the node at `at` (-1, 0 or 1) and its slope.
#[must_use]
pub fn quadratic_1d(at: i8, x: f64) -> (f64, f64) {
    match at {
        0 => (1.0 - x * x, -2.0 * x),
        s => {
            let s = f64::from(s);
            (0.5 * x * (x + s), x + 0.5 * s)
        }
    }
}

/// Function of the node at `at` (-1, 0 or 1) that is linear between neighbouring ones.
#[must_use]
pub fn hat_1d(at: i8, x: f64) -> f64 {
    if at == 0 { 1.0 - x.abs() } else { (f64::from(at) * x).max(0.0) }
}

/// Products of one-dimensional functions along the first `d` axes.
pub(super) fn tensor(
    lattice: &[[i8; 3]],
    d: usize,
    xi: [f64; 3],
    one_d: fn(i8, f64) -> (f64, f64),
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) {
    for (a, at) in lattice.iter().enumerate() {
        let (x, dx) = one_d(at[0], xi[0]);
        let (y, dy) = one_d(at[1], xi[1]);
        let (z, dz) = if d == 3 { one_d(at[2], xi[2]) } else { (1.0, 0.0) };
        value[a] = x * y * z;
        gradient[a] = [dx * y * z, x * dy * z, x * y * dz];
    }
}

/// Serendipity functions of corners and mid-edge nodes (Zienkiewicz & Taylor,
/// vol. 1, sec. 8.6): a corner's is the product of linear functions times
/// `sum s_i xi_i - (d - 1)`, a mid-edge's the product of linear functions across
/// and `1 - x^2` along its edge.
pub(super) fn serendipity(
    lattice: &[[i8; 3]],
    d: usize,
    xi: [f64; 3],
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) {
    for (a, at) in lattice.iter().enumerate() {
        let corner = at[..d].iter().all(|c| *c != 0);
        let mut factor = [(1.0, 0.0); 3];
        for i in 0..d {
            factor[i] = if at[i] == 0 { quadratic_1d(0, xi[i]) } else { linear_1d(at[i], xi[i]) };
        }
        let product = factor[0].0 * factor[1].0 * factor[2].0;
        let slope: [f64; 3] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            factor[i].1 * factor[j].0 * factor[k].0
        });
        if corner {
            let sum: f64 = (0..d).map(|i| f64::from(at[i]) * xi[i]).sum();
            let last = sum - (d - 1) as f64;
            value[a] = product * last;
            gradient[a] = std::array::from_fn(|i| {
                let inner = if i < d { f64::from(at[i]) } else { 0.0 };
                slope[i] * last + product * inner
            });
        } else {
            value[a] = product;
            gradient[a] = slope;
        }
    }
}

/// Linear or quadratic functions of the tetrahedron's barycentric coordinates.
pub(super) fn tetrahedron(
    quadratic: bool,
    xi: [f64; 3],
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) {
    let l = [1.0 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]];
    let dl = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if !quadratic {
        value[..4].copy_from_slice(&l);
        gradient[..4].copy_from_slice(&dl);
        return;
    }
    for a in 0..4 {
        value[a] = l[a] * (2.0 * l[a] - 1.0);
        gradient[a] = dl[a].map(|d| (4.0 * l[a] - 1.0) * d);
    }
    for (e, [p, q]) in TET10_EDGES.into_iter().enumerate() {
        value[4 + e] = 4.0 * l[p] * l[q];
        gradient[4 + e] = std::array::from_fn(|i| 4.0 * (dl[p][i] * l[q] + l[p] * dl[q][i]));
    }
}
