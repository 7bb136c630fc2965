//! Biphasic tissue: a porous solid whose pores are full of fluid.
//!
//! Solid and fluid are incompressible themselves; the body changes its volume only as fluid flows
//! in or out (Biot 1941; as a mixture Mow, Kuei, Lai & Armstrong 1980; a fingertip of it Wu, Dong,
//! Rakheja, Schopper & Smutz 2004). With the displacement `u` and the fluid's pressure `p`, 0 at
//! rest, on the undeformed body (Simon 1992; Ateshian, Maas & Weiss 2010):
//!
//! - total stress: `P = P_solid(F) - p cof F`, `Div P = 0`, whatever the solid's law;
//! - Darcy's law: fluid flows relative to the solid with `-k grad p`, pulled back `-K Grad p`,
//!   `K = J F^-1 k(J) F^-T`, no inertia;
//! - nothing is lost: `dJ/dt = Div (K Grad p)`;
//! - on the surface the total traction is given, and either `p = 0` (drained: fluid leaves freely)
//!   or no flow (sealed, and where tissue without fluid begins).
//!
//! **In time**: the second backward difference of two steps of different length (Gear 1971),
//! backward Euler where a load turns. With `r` the ratio of this step `dt` to the last,
//! `J* = ((1 + r) J0 - r^2 / (1 + r) J00) / b` of the last two volume ratios and
//! `b = (1 + 2 r) / (1 + r)`, or `J* = J0` and `b = 1`, the step makes stationary
//!
//! `W(u) - integral p (J(u) - J*) dV - dt/2b integral Grad p . K* Grad p dV`
//!
//! with `W` the solid's (condensed) energy and `K*` extrapolated: second order, symmetric, what
//! oscillates dies away, and rest is right whatever the steps were; `dt = 0` is the sudden,
//! undrained answer.
//!
//! **In space**: displacement on quadratic elements, pressure linear between their corners and
//! continuous (Taylor & Hood 1973), inf-sup stable, so that undrained tissue neither locks nor
//! oscillates. With the solid's own mean dilatation nothing changes: it is the drained solid's.
//! Where a drained surface has just been loaded the pressure falls within `sqrt(c dt)` of it,
//! `c = k (K + 4/3 mu)`; elements wider than that show it as an overshoot which dies away within
//! `h^2 / c` (Vermeer & Verruijt 1981 ask for `dt >= h^2 / (6 c)`, h an interval of pressures).
//!
//! **Tangent**: `[A B^T; B -C]`, `A` of the solid with `-p d cof/dF`, `B = -integral N cof F Grad`,
//! `C = dt/b integral Grad N . K Grad N`: see [`SaddleSystem`](crate::linear::SaddleSystem).
//! With a law of small strain `J - 1` is `tr H`, `cof F` and `K / k` are unit matrices.

mod element;
mod permeability;
mod phase;
#[cfg(test)]
mod tests;

pub use permeability::{HolmesMow, Permeability, PermeabilityError};
pub use phase::{Flow, FluidError, FluidPhase, FluidSpec, Older};
pub(crate) use phase::{FluidForces, Solid};
