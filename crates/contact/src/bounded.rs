//! Non-negative forces under a symmetric positive definite compliance.
//!
//! Finds `f >= 0` with `w = M f + g >= 0` and `f w = 0`, which minimises
//! `f M f / 2 + g f`: modified proportioning with reduced gradient projections (Dostal,
//! *Optimal Quadratic Programming Algorithms*, 2009, algorithm 5.8). Conjugate gradients on
//! the points in contact, a projected step where one of them would be pulled, a step towards
//! contact where points outside penetrate. One product with `M` an iteration, or two.
//!
//! Points that would be pulled let go one by one. Where an operator asks for it, all of them let go in
//! one step, as Polonsky and Keer do (Wear 231, 1999), if energy then falls by no less.

use crate::kernels::{multiply, product as dot, run};
use pulp::{Simd, WithSimd};

/// Weighs points that penetrate against points out of balance: 1 treats them alike.
const PROPORTION: f32 = 1.0;

/// Memory of the iteration for up to a fixed number of points.
#[derive(Clone, Debug)]
pub(crate) struct BoundedSolver {
    gradient: Vec<f32>,
    free: Vec<f32>,
    towards: Vec<f32>,
    chopped: Vec<f32>,
    direction: Vec<f32>,
    product: Vec<f32>,
}

/// A square symmetric matrix whose rows are `stride` apart.
#[derive(Clone, Copy)]
pub(crate) struct Symmetric<'a> {
    pub values: &'a [f32],
    pub stride: usize,
    /// No less than its largest eigenvalue.
    pub norm: f32,
}

/// A symmetric positive definite operator.
pub(crate) trait Operator {
    /// No less than its largest eigenvalue.
    fn norm(&self) -> f32;
    /// Fills `y` with its product with `x`.
    fn times(&mut self, x: &[f32], y: &mut [f32]);
    /// Fills `z` with something closer to the inverse's product with `r`, which is 0 where `f` is;
    /// symmetric and positive definite among the points under force.
    fn towards_inverse(&self, r: &[f32], _f: &[f32], z: &mut [f32]) {
        z.copy_from_slice(r);
    }
    /// Whether all that would be pulled may let go in one step, if that gains more: fewer products where
    /// contact shrinks.
    fn lets_go_at_once(&self) -> bool {
        false
    }
}

impl Operator for Symmetric<'_> {
    fn norm(&self) -> f32 {
        self.norm
    }

    fn times(&mut self, x: &[f32], y: &mut [f32]) {
        multiply(self.values, self.stride, x, y);
    }
}

impl<'a> Symmetric<'a> {
    /// The first `n` rows and columns.
    pub(crate) fn new(values: &'a [f32], stride: usize, n: usize) -> Self {
        let sum = |row: &[f32]| row[..n].iter().map(|v| v.abs()).sum::<f32>();
        let norm = values.chunks(stride).take(n).map(sum).fold(0.0, f32::max);
        Self { values, stride, norm }
    }
}

/// How an iteration ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Effort {
    /// Products with the matrix.
    pub products: u32,
    /// Largest violation left: penetration, or imbalance of a point in contact, mm.
    pub violation_mm: f32,
}

impl BoundedSolver {
    pub(crate) fn new(points: usize) -> Self {
        let zeros = || vec![0.0; points];
        Self {
            gradient: zeros(),
            free: zeros(),
            towards: zeros(),
            chopped: zeros(),
            direction: zeros(),
            product: zeros(),
        }
    }

    /// Improves `f` (N) from what it holds, for gaps `g` (mm) without force, until no point
    /// violates its condition by more than `tolerance_mm`, or `products_max` are done.
    pub(crate) fn solve(
        &mut self,
        mut m: impl Operator,
        g: &[f32],
        f: &mut [f32],
        tolerance_mm: f32,
        products_max: u32,
    ) -> Effort {
        for f in f.iter_mut() {
            *f = if *f > 0.0 { *f } else { 0.0 };
        }
        let mut gradient = std::mem::take(&mut self.gradient);
        let w = &mut gradient[..f.len()];
        m.times(f, w);
        for (w, g) in w.iter_mut().zip(g) {
            *w += g;
        }
        let effort = self.improve(m, w, f, tolerance_mm, products_max.saturating_sub(1));
        self.gradient = gradient;
        Effort { products: effort.products + 1, ..effort }
    }

    /// The same from forces `f >= 0` whose gaps `gradient` are known.
    pub(crate) fn improve(
        &mut self,
        m: impl Operator,
        gradient: &mut [f32],
        f: &mut [f32],
        tolerance_mm: f32,
        products_max: u32,
    ) -> Effort {
        run(Improve { solver: self, m, gradient, f, tolerance_mm, products_max })
    }

    /// Sum of `travel f` for the forces `f` with `M f = travel` at the points whose travel is not
    /// zero, the others free: conjugate gradients; with the products that it took.
    pub(crate) fn work_of_travel(
        &mut self,
        m: Symmetric<'_>,
        travel: &[f32],
        products_max: u32,
    ) -> (f32, u32) {
        let n = travel.len();
        let Self { gradient, free, direction, product, .. } = self;
        let [left, f, direction, product] =
            [gradient, free, direction, product].map(|v| &mut v[..n]);
        left.copy_from_slice(travel);
        direction.copy_from_slice(travel);
        f.fill(0.0);
        let first = dot(travel, travel);
        let (mut square, mut products) = (first, 0);
        while products < products_max {
            if !(square > 1e-6 * first) {
                break;
            }
            multiply(m.values, m.stride, direction, product);
            products += 1;
            for (p, t) in product.iter_mut().zip(travel) {
                if *t == 0.0 {
                    *p = 0.0;
                }
            }
            let length = square / dot(direction, product).max(f32::MIN_POSITIVE);
            add_scaled(f, length, direction);
            add_scaled(left, -length, product);
            let next = dot(left, left);
            for (d, l) in direction.iter_mut().zip(&*left) {
                *d = l + next / square * *d;
            }
            square = next;
        }
        (dot(travel, f), products)
    }
}

/// The iteration, in the widest vectors of the processor.
struct Improve<'a, M> {
    solver: &'a mut BoundedSolver,
    m: M,
    gradient: &'a mut [f32],
    f: &'a mut [f32],
    tolerance_mm: f32,
    products_max: u32,
}

impl<M: Operator> WithSimd for Improve<'_, M> {
    type Output = Effort;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Effort {
        let Self { solver, mut m, gradient, f, tolerance_mm, products_max } = self;
        let n = f.len();
        let BoundedSolver { free, towards, chopped, direction, product, .. } = solver;
        let [free, towards, chopped, direction, product] =
            [free, towards, chopped, direction, product].map(|v| &mut v[..n]);
        let mut effort = Effort::default();
        let step = 1.0 / m.norm().max(f32::MIN_POSITIVE);
        let mut restart = true;
        loop {
            let (mut out_of_balance, mut penetrating) = (0.0f32, 0.0f32);
            effort.violation_mm = 0.0;
            // The reduced free gradient: what a projected step of the fixed length can use.
            let mut usable = 0.0f32;
            for i in 0..n {
                let w = gradient[i];
                let touching = f[i] > 0.0;
                free[i] = if touching { w } else { 0.0 };
                chopped[i] = if touching { 0.0 } else { w.min(0.0) };
                // A force of no consequence that is about to vanish is in balance.
                let counts = if touching { w.min(f[i] / step) } else { chopped[i] };
                effort.violation_mm = effort.violation_mm.max(counts.abs());
                out_of_balance += free[i] * free[i];
                usable += free[i] * free[i].min(f[i] / step);
                penetrating += chopped[i] * chopped[i];
            }
            let done = effort.violation_mm <= tolerance_mm;
            if done || effort.products >= products_max || !out_of_balance.is_finite() {
                return effort;
            }
            if penetrating > PROPORTION * usable.max(0.0) {
                m.times(chopped, product);
                effort.products += 1;
                let bends = dot(chopped, product);
                let length = penetrating / bends.max(f32::MIN_POSITIVE);
                add_scaled(f, -length, chopped);
                add_scaled(gradient, -length, product);
                restart = true;
                continue;
            }
            if restart {
                m.towards_inverse(free, f, direction);
                restart = false;
            }
            m.times(direction, product);
            effort.products += 1;
            let bends = dot(direction, product).max(f32::MIN_POSITIVE);
            let length = dot(gradient, direction) / bends;
            let mut longest = f32::INFINITY;
            for i in 0..n {
                if direction[i] > 0.0 {
                    longest = longest.min(f[i] / direction[i]);
                }
            }
            if length <= longest {
                add_scaled(f, -length, direction);
                add_scaled(gradient, -length, product);
                for i in 0..n {
                    free[i] = if f[i] > 0.0 { gradient[i] } else { 0.0 };
                }
                m.towards_inverse(free, f, towards);
                let turn = dot(towards, product) / bends;
                for i in 0..n {
                    direction[i] = towards[i] - turn * direction[i];
                }
            } else {
                restart = true;
                if m.lets_go_at_once() {
                    // All of the step, as far as nothing is pulled.
                    for i in 0..n {
                        towards[i] = (f[i] - length * direction[i]).max(0.0) - f[i];
                    }
                    m.times(towards, chopped);
                    effort.products += 1;
                    let change = dot(gradient, towards) + 0.5 * dot(towards, chopped);
                    let due = longest * (0.5 * longest * bends - dot(gradient, direction));
                    if change <= due {
                        for i in 0..n {
                            f[i] = (f[i] + towards[i]).max(0.0);
                            gradient[i] += chopped[i];
                        }
                        continue;
                    }
                }
                // To the first point that lets go, then a projected step of fixed length.
                for i in 0..n {
                    f[i] = (f[i] - longest * direction[i]).max(0.0);
                    gradient[i] -= longest * product[i];
                }
                for i in 0..n {
                    let before = f[i];
                    if before > 0.0 {
                        f[i] = (before - step * gradient[i]).max(0.0);
                    }
                    direction[i] = f[i] - before;
                }
                m.times(direction, product);
                add_scaled(gradient, 1.0, product);
                effort.products += 1;
            }
        }
    }
}

/// `y += k x`.
#[inline(always)]
fn add_scaled(y: &mut [f32], k: f32, x: &[f32]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += k * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Compliance of points on a half-space with random spacing, and random gaps.
    fn problem(seed: u64, n: usize) -> (Vec<f32>, Vec<f32>) {
        let mut random = fastrand::Rng::with_seed(seed);
        let at: Vec<[f32; 2]> = (0..n).map(|_| [4.0 * random.f32(), 4.0 * random.f32()]).collect();
        let mut m = vec![0.0; n * n];
        for i in 0..n {
            for k in 0..n {
                let r = (at[i][0] - at[k][0]).hypot(at[i][1] - at[k][1]);
                m[i * n + k] = 3.0 / (r * r + 0.09).sqrt();
            }
        }
        (m, (0..n).map(|_| random.f32() - 0.6).collect())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// No tension, no penetration, no force across a gap.
        #[test]
        fn conditions_hold_at_random_points(seed in any::<u64>(), n in 1usize..60) {
            let (m, g) = problem(seed, n);
            let matrix = Symmetric::new(&m, n, n);
            let mut f = vec![0.0; n];
            let effort = BoundedSolver::new(n).solve(matrix, &g, &mut f, 1e-5, 4000);
            prop_assert!(effort.violation_mm <= 1e-5, "{effort:?}");
            for i in 0..n {
                let w: f64 = f64::from(g[i])
                    + (0..n).map(|k| f64::from(m[i * n + k]) * f64::from(f[k])).sum::<f64>();
                prop_assert!(f[i] >= 0.0);
                prop_assert!(w >= -5e-5, "penetration {w}");
                prop_assert!(f[i] <= 1e-4 || w.abs() <= 1e-4, "force {} across {w}", f[i]);
            }
        }

        /// From any start the same forces.
        #[test]
        fn a_warm_start_ends_where_a_cold_one_does(seed in any::<u64>(), n in 2usize..40) {
            let (m, g) = problem(seed, n);
            let matrix = Symmetric::new(&m, n, n);
            let (mut cold, mut warm) = (vec![0.0; n], (0..n).map(|i| i as f32).collect::<Vec<_>>());
            let mut solver = BoundedSolver::new(n);
            solver.solve(matrix, &g, &mut cold, 1e-6, 4000);
            solver.solve(matrix, &g, &mut warm, 1e-6, 4000);
            let [a, b]: [f32; 2] = [cold.iter().sum(), warm.iter().sum()];
            prop_assert!((a - b).abs() <= 2e-3 * a.abs().max(1e-3), "{a} {b}");
        }
    }

    #[test]
    fn what_makes_no_sense_ends() {
        let mut solver = BoundedSolver::new(2);
        let m = [f32::NAN, 0.0, 0.0, 1.0];
        let mut f = [1.0, f32::NAN];
        let matrix = Symmetric::new(&m, 2, 2);
        let effort = solver.solve(matrix, &[-1.0, f32::INFINITY], &mut f, 1e-6, 100);
        assert!(effort.products <= 100);
        let none = Symmetric::new(&[], 1, 0);
        assert_eq!(solver.solve(none, &[], &mut [], 1e-6, 9).violation_mm.to_bits(), 0);
    }
}
