//! Finite-strain finite elements with frictional contact against rigid shapes.
//!
//! A body is a [`mesh`] whose elements belong to numbered regions, one
//! [`element::ConstitutiveModel`] a region, supports and a surface that may touch.
//! [`solve::Solver`] finds its equilibria: total Lagrangian, mean-dilatation elements, augmented
//! Lagrangian contact on signed distances ([`papilla_sdf`]), Newton's method with a line search,
//! conjugate gradients preconditioned by an older single-precision factor. The same input gives the
//! same bits.
//!
//! Units: mm, N, MPa, s; energy in mJ.
//!
//! A block of rubber, pressed by a rigid ball:
//!
//! ```
//! use papilla_fem::element::{Elastic, ElementKind, Materials};
//! use papilla_solid::{NeoHookean, moduli};
//! use papilla_fem::mesh::{block::even, lattice::lattice, supports::hold};
//! use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem, Solver};
//! use papilla_sdf::{Placement, Sphere};
//! use std::sync::Arc;
//!
//! // A quarter of a block, 10 mm wide and high, with its planes of symmetry, held below.
//! let axes = [even(5.0, 8), even(5.0, 8), even(10.0, 8)];
//! let mesh = lattice(ElementKind::Hex8, axes, |p| p);
//! let [x, y] = [[true, false, false], [false, true, false]];
//! let fixed = hold(&mesh, &[("z_min", [true; 3]), ("x_min", x), ("y_min", y)]);
//!
//! // One region: E = 0.1 MPa, nu = 0.45.
//! let [mu_mpa, bulk_mpa] = moduli(0.1, 0.45);
//! let materials = Materials::new(vec![Elastic::shared(NeoHookean { mu_mpa }, bulk_mpa)]);
//! let problem = Problem::new(mesh, materials, fixed, Some("z_max"))?;
//!
//! // A ball that touches the top comes down by half a millimetre.
//! let ball = Arc::new(Sphere { radius_mm: 4.0 });
//! let start = Placement::turned(0.0, 0.0, 0.0, [0.0, 0.0, 14.0]);
//! let indenter = MovingIndenter::straight(ball, start, [0.0, 0.0, -0.5]);
//! let mut solver = Solver::new(&problem, Options::default())?;
//! solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
//! for step in 1..=5 {
//!     let report = solver.advance_to(f64::from(step) / 5.0)?;
//!     assert!(report.j_min > 0.0 && report.residual_relative < 1e-6);
//! }
//!
//! // Hertz: 4/3 E / (1 - nu^2) sqrt(R) d^1.5, of which a quarter is here.
//! let hertz_n = 4.0 / 3.0 * 0.1 / (1.0 - 0.45f64.powi(2)) * 2.0 * 0.5f64.powf(1.5);
//! let force_n = -4.0 * solver.balance().contact_force_n[2];
//! assert!((force_n / hertz_n - 1.0).abs() < 0.15, "{force_n} N, Hertz {hertz_n} N");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod biphasic;
pub mod contact;
pub mod element;
pub mod linear;
pub mod mesh;
pub mod solve;
pub mod testing;
