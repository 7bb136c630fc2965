//! Properties that every indenter has to have; a shape is tested in one line:
//!
//! ```ignore
//! distance_tests! { name: shape => Exactness::Exact, detail_mm 0.5, mirrors [0, 1] }
//! ```

use super::{Distance, SignedDistance};
use papilla_vector::{along, norm};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

/// What a shape's gap is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exactness {
    /// The distance, inside and out.
    Exact,
    /// The distance outside, no more than it inside (a union).
    ExactOutside,
    /// The same of curved parts that overlap: where they cover each other it is found by steps.
    OuterOfCurved,
    /// The distance to first order at the surface.
    Approximate,
}

/// A shape and what is claimed of it.
pub(super) struct Subject {
    pub(super) shape: Box<dyn SignedDistance>,
    pub(super) exactness: Exactness,
    /// Smallest radius of curvature, mm.
    pub(super) detail_mm: f64,
}

/// Where to look: three coordinates in 0..1, which population, and a height
/// above the surface in units of the detail.
pub(super) type Draw = ([f64; 3], u8, f64);

pub(super) fn draw() -> impl Strategy<Value = Draw> {
    (prop::array::uniform3(0.0..1.0f64), 0u8..4, -0.6..2.0f64)
}

fn axis(i: usize, sign: f64) -> [f64; 3] {
    std::array::from_fn(|k| if k == i { sign } else { 0.0 })
}

fn largest(h: &[[f64; 3]; 3]) -> f64 {
    h.iter().flatten().fold(0.0, |a, v| v.abs().max(a))
}

impl Subject {
    /// A point in the shape's box, near its top, or near its surface.
    pub(super) fn point(&self, (u, population, height): Draw) -> [f64; 3] {
        let end = |i: usize, sign: f64| sign * self.shape.reach_mm(axis(i, sign)).min(15.0);
        let p = match population {
            0 => {
                let top = end(2, 1.0);
                let near = |v: f64, middle: f64| middle + self.detail_mm * (12.0 * v - 6.0);
                [near(u[0], 0.0), near(u[1], 0.0), near(u[2], top)]
            }
            _ => std::array::from_fn(|i| {
                let (from, to) = (end(i, -1.0), end(i, 1.0));
                let margin = 0.1 * (to - from);
                from - margin + u[i] * (to - from + 2.0 * margin)
            }),
        };
        if population < 2 {
            p
        } else {
            along(self.foot(p), height * self.detail_mm, self.at(p).normal)
        }
    }

    /// Point of the surface near `p`.
    fn foot(&self, p: [f64; 3]) -> [f64; 3] {
        let steps = if self.exactness == Exactness::Approximate { 20 } else { 1 };
        (0..steps).fold(p, |q, _| {
            let d = self.at(q);
            let square = norm(d.normal).powi(2);
            along(q, -d.gap_mm / square, d.normal)
        })
    }

    fn at(&self, p: [f64; 3]) -> Distance {
        self.shape.distance(p)
    }

    pub(super) fn has_a_unit_normal(&self, p: [f64; 3]) -> Result<(), TestCaseError> {
        let q = if self.exactness == Exactness::Approximate { self.foot(p) } else { p };
        prop_assert!((norm(self.at(q).normal) - 1.0).abs() < 1e-12, "{:?} at {q:?}", self.at(q));
        Ok(())
    }

    /// First and second derivatives against central differences. A kink between
    /// the two points shows as a jump of the normal that no curvature near the
    /// shape's detail explains, or as a jump of the Hessian.
    pub(super) fn has_right_derivatives(&self, p: [f64; 3]) -> Result<(), TestCaseError> {
        let detail = self.detail_mm;
        let h = 1e-5 * detail;
        let d = self.at(p);
        prop_assume!(self.exactness != Exactness::OuterOfCurved || d.gap_mm > 0.0);
        // Near a focal point differences say nothing.
        prop_assume!(largest(&d.hessian) * detail < 5.0);
        for i in 0..3 {
            let (a, b) = (self.at(along(p, h, axis(i, 1.0))), self.at(along(p, -h, axis(i, 1.0))));
            let jump = largest(&std::array::from_fn(|j| {
                std::array::from_fn(|k| a.hessian[j][k] - b.hessian[j][k])
            }));
            let turn = norm(std::array::from_fn(|j| a.normal[j] - b.normal[j]));
            prop_assume!(turn < 1e-2 && jump * detail < 4e-3);
            let slope = (a.gap_mm - b.gap_mm) / (2.0 * h);
            prop_assert!((slope - d.normal[i]).abs() < 1e-6, "d{i}: {slope}, {d:?} at {p:?}");
            for j in 0..3 {
                let bend = (a.normal[j] - b.normal[j]) / (2.0 * h);
                let off = (bend - d.hessian[i][j]).abs() * detail;
                prop_assert!(off < 1e-2, "d{i}d{j}: {bend}, {d:?} at {p:?}");
            }
        }
        for i in 0..3 {
            for j in 0..i {
                prop_assert!((d.hessian[i][j] - d.hessian[j][i]).abs() * detail < 1e-12);
            }
        }
        Ok(())
    }

    pub(super) fn is_lipschitz(&self, p: [f64; 3], q: [f64; 3]) -> Result<(), TestCaseError> {
        if self.exactness != Exactness::Approximate {
            let apart = norm(std::array::from_fn(|i| p[i] - q[i]));
            let change = (self.at(p).gap_mm - self.at(q).gap_mm).abs();
            let steps = if self.exactness == Exactness::OuterOfCurved { 0.05 } else { 0.0 };
            let most = apart + 1e-13 * (norm(p) + norm(q)) + steps;
            prop_assert!(change <= most, "{p:?}, {q:?}");
        }
        Ok(())
    }

    /// The surface is where the gap says, and the sign changes there.
    pub(super) fn has_the_right_sign(&self, p: [f64; 3]) -> Result<(), TestCaseError> {
        let there = self.at(p);
        let exact = match self.exactness {
            Exactness::Exact => true,
            _ => there.gap_mm > 0.0,
        };
        // Next to a kink inside, rounding chooses the side.
        if !exact {
            return Ok(());
        }
        let foot = self.foot(p);
        let d = self.at(foot);
        prop_assert!(d.gap_mm.abs() < 1e-12 * (1.0 + norm(p)), "gap {} at {foot:?}", d.gap_mm);
        let step = 1e-6 * self.detail_mm;
        let (out, inside) = (along(foot, step, d.normal), along(foot, -step, d.normal));
        prop_assert!((self.at(out).gap_mm - step).abs() < 1e-3 * step, "outside {foot:?}");
        prop_assert!((self.at(inside).gap_mm + step).abs() < 1e-3 * step, "inside {foot:?}");
        Ok(())
    }

    pub(super) fn is_mirrored(&self, p: [f64; 3], i: usize) -> Result<(), TestCaseError> {
        let flip = |mut v: [f64; 3]| {
            v[i] = -v[i];
            v
        };
        let (a, b) = (self.at(p), self.at(flip(p)));
        if self.exactness == Exactness::OuterOfCurved && a.gap_mm < 0.0 {
            // Approached step by step, in directions that are no mirror images.
            prop_assert!((a.gap_mm - b.gap_mm).abs() <= 0.05, "{a:?} {b:?}");
            return Ok(());
        }
        prop_assert!((a.gap_mm - b.gap_mm).abs() <= 1e-14 * (1.0 + norm(p)));
        let normal = flip(b.normal);
        prop_assert!((0..3).all(|k| (a.normal[k] - normal[k]).abs() < 1e-9), "{a:?} {b:?}");
        Ok(())
    }

    /// Nothing is beyond the reach, and seen from far away it is the distance.
    pub(super) fn ends_where_it_says(&self, p: [f64; 3], u: [f64; 3]) -> Result<(), TestCaseError> {
        let v = u.map(|c| c - 0.5);
        prop_assume!(norm(v) > 0.05);
        let direction = v.map(|c| c / norm(v));
        let reach = self.shape.reach_mm(direction);
        let height: f64 = (0..3).map(|i| p[i] * direction[i]).sum();
        if height > reach {
            prop_assert!(self.at(p).gap_mm > 0.0);
        }
        if self.exactness != Exactness::Approximate {
            prop_assert!(self.at(p).gap_mm >= height - reach - 1e-12);
            let far = 1e6;
            let seen = far - self.at(direction.map(|c| far * c)).gap_mm;
            prop_assert!((seen - reach).abs() < 2e-3, "{seen} seen, {reach} said");
        }
        Ok(())
    }
}

/// Property tests of one shape.
macro_rules! distance_tests {
    ($name:ident: $shape:expr => $exactness:expr, detail_mm $detail:expr, mirrors [$($axis:expr),*]) => {
        mod $name {
            use super::*;
            use crate::testing::{Subject, draw};

            fn subject() -> Subject {
                Subject { shape: Box::new($shape), exactness: $exactness, detail_mm: $detail }
            }

            proptest::proptest! {
                #[test]
                fn has_a_unit_normal(a in draw()) {
                    let s = subject();
                    s.has_a_unit_normal(s.point(a))?;
                }

                #[test]
                fn has_right_derivatives(a in draw()) {
                    let s = subject();
                    s.has_right_derivatives(s.point(a))?;
                }

                #[test]
                fn is_lipschitz(a in draw(), b in draw()) {
                    let s = subject();
                    s.is_lipschitz(s.point(a), s.point(b))?;
                }

                #[test]
                fn has_the_right_sign(a in draw()) {
                    let s = subject();
                    s.has_the_right_sign(s.point(a))?;
                }

                #[test]
                fn is_mirrored(a in draw()) {
                    let s = subject();
                    let axes: &[usize] = &[$($axis),*];
                    for &i in axes {
                        s.is_mirrored(s.point(a), i)?;
                    }
                }

                #[test]
                fn ends_where_it_says(a in draw(), u in proptest::array::uniform3(0.0..1.0f64)) {
                    let s = subject();
                    s.ends_where_it_says(s.point(a), u)?;
                }
            }
        }
    };
}
pub(super) use distance_tests;
