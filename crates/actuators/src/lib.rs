//! The drive of an array of pins whose strain energy density (SED) comes closest to a wanted map.
//!
//! A pin presses as a smooth round contact does, `p(d) = a sqrt(1 - d^2 / R^2)` within its reach
//! `R` (Hertz); its **drive** `a` is the greatest pressure under it, Pa. Strain at the interface is
//! linear in the drives, so SED is quadratic in them, `SED(x) = |sum_i a_i s_i(x)|^2` with six
//! numbers a pin: those of an elastic half-space ([`HalfSpace`]).
//!
//! Least squares on SED with `0 <= a <= max` is therefore not linear. [`Inverse::fit`] begins with
//! the one linear problem that needs no signs of strain, magnitudes that add,
//! `min sum_x (sum_i a_i |s_i(x)| - sqrt(SED(x)))^2`, and goes on with Gauss-Newton on SED itself;
//! both are non-negative least squares. [`Inverse::correct`] is told what a network makes of that
//! drive, scales the half-space to it at each pixel, and fits again.
//!
//! ```
//! use papilla_actuators::{Array, HalfSpace, Inverse, Pin};
//! use papilla_atlas::{Atlas, MAP_LEN, Patch, PatchVertices, Raster};
//!
//! // A plane finger of 18 mm, 0.1 mm a pixel, and two pins on it, 4 mm apart.
//! let uv_px = vec![[20.0, 20.0], [200.0, 20.0], [200.0, 200.0], [20.0, 200.0]];
//! let positions_mm = uv_px.iter().map(|[u, v]| [0.1 * v, -0.1 * u, 0.0]).collect();
//! let patch = PatchVertices { positions_mm, uv_px };
//! let atlas = Atlas::new(0.1, vec![[0, 2, 1], [0, 3, 2]], patch.clone(), patch)?;
//! let [skin, interface] = [Patch::Skin, Patch::Interface].map(|of| Raster::new(&atlas, of));
//! let pin = |column: u32| Pin { pixel: 100 * 224 + column, reach_mm: 1.0, max_pa: 1e5 };
//! let array = Array::new(&atlas, [&skin, &interface], &[pin(90), pin(130)], HalfSpace::SHIPPED)?;
//!
//! let mut wanted_j_per_m3 = vec![0.0; MAP_LEN];
//! array.sed(&[4e3, 9e3], &mut wanted_j_per_m3);
//! let mut inverse = Inverse::new(array);
//! let drive_pa = inverse.fit(&wanted_j_per_m3, Inverse::STEPS);
//! assert!((drive_pa[0] / 4e3 - 1.0).abs() < 1e-2 && (drive_pa[1] / 9e3 - 1.0).abs() < 1e-2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod array;
mod half_space;
mod inverse;
mod nnls;

#[cfg(test)]
mod tests;

pub use array::{Array, ArrayError, Pin};
pub use half_space::HalfSpace;
pub use inverse::Inverse;
