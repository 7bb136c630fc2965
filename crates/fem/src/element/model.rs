//! What an element is made of: a law with its bulk modulus, and the memory that
//! a law may have.
//!
//! Each combination is its own type, so an elastic body's elements run through code
//! that has no memory in it.

use super::geometry::ElementGeometry;
use super::independent::IndependentDilatation;
use super::kernel::{ElementState, Inverted, Points, evaluate};
use papilla_solid::tensor::{Kinematics, Mat3};
use papilla_solid::{Isochoric, LinearElastic, NeoHookean, Ogden, Prony, Relaxing, prony};
use std::sync::Arc;

/// History variables of one element over a time step.
#[derive(Clone, Copy, Debug, Default)]
pub struct HistoryVariables<'a> {
    /// History of each quadrature point at the start of the step; empty for
    /// laws without.
    pub history: &'a [f64],
    /// Length of the step, s.
    pub dt_s: f64,
}

/// A law as the solver sees it.
pub trait ConstitutiveModel: Send + Sync {
    /// Force (N, one a node) and, if asked, tangent of one element; see
    /// [`evaluate`].
    ///
    /// # Errors
    /// [`Inverted`] where `J <= 0`.
    fn evaluate(
        &self,
        geometry: ElementGeometry<'_>,
        u: &[[f64; 3]],
        memory: HistoryVariables<'_>,
        force: &mut [[f64; 3]],
        stiffness: Option<&mut [f64]>,
    ) -> Result<ElementState, Inverted> {
        self.evaluate_with(geometry, u, memory, None, force, stiffness)
    }

    /// The same with an independent dilatation.
    ///
    /// # Errors
    /// [`Inverted`] where `J <= 0`.
    fn evaluate_with(
        &self,
        geometry: ElementGeometry<'_>,
        u: &[[f64; 3]],
        memory: HistoryVariables<'_>,
        independent: Option<IndependentDilatation<'_>>,
        force: &mut [[f64; 3]],
        stiffness: Option<&mut [f64]>,
    ) -> Result<ElementState, Inverted>;

    /// Energy density that can be got back, MPa, at a point with this history.
    fn stored_mpa(&self, k: &Kinematics, theta_minus_1: f64, history: &[f64]) -> f64;

    /// First Piola-Kirchhoff stress of a point, volumetric part included, MPa.
    fn first_piola_mpa(
        &self,
        k: &Kinematics,
        theta_minus_1: f64,
        memory: HistoryVariables<'_>,
    ) -> Mat3;

    /// Shear modulus at rest and at once, MPa.
    fn shear_modulus_mpa(&self) -> f64;

    /// Bulk modulus, MPa.
    fn bulk_modulus_mpa(&self) -> f64;

    /// Whether the law is of finite strain.
    fn is_finite_strain(&self) -> bool;

    /// Whether the point has left the stretches that the law was fitted to.
    fn outside_calibration(&self, k: &Kinematics) -> bool;

    /// Numbers of history that a point has.
    fn history_len(&self) -> usize {
        0
    }

    /// Shortest relaxation time, s, of a law that has one.
    fn shortest_time_s(&self) -> Option<f64> {
        None
    }

    /// Moves a point's history over a step of `dt_s` that ended at `k`.
    fn advance(&self, _k: &Kinematics, _dt_s: f64, _history: &mut [f64]) {}
}

/// A law without memory.
#[derive(Clone, Copy, Debug)]
pub struct Elastic<L> {
    /// Isochoric law.
    pub law: L,
    /// Bulk modulus, MPa.
    pub bulk_mpa: f64,
}

struct Same<L>(L);

impl<L: Isochoric> Points for Same<L> {
    type At = L;

    #[inline]
    fn at(&self, _q: usize) -> L {
        self.0
    }
}

impl<L: ModelOf> Elastic<L> {
    /// As a value to share.
    pub fn shared(law: L, bulk_mpa: f64) -> Arc<dyn ConstitutiveModel> {
        law.elastic(bulk_mpa)
    }
}

/// A law of which elements are made. What it takes to evaluate them is compiled where this is
/// implemented, with that crate's optimisation, not where a law is used.
pub trait ModelOf: Isochoric {
    /// The law and a bulk modulus, MPa.
    fn elastic(self, bulk_mpa: f64) -> Arc<dyn ConstitutiveModel>;

    /// The law with instantaneous moduli, a bulk modulus, MPa, and how the law relaxes.
    fn viscoelastic(self, bulk_mpa: f64, prony: Prony) -> Arc<dyn ConstitutiveModel>;
}

/// Makes elements of a law; a new law has a line with it.
#[macro_export]
macro_rules! constitutive_model_of {
    ($law:ty) => {
        impl $crate::element::ModelOf for $law {
            fn elastic(
                self,
                bulk_mpa: f64,
            ) -> ::std::sync::Arc<dyn $crate::element::ConstitutiveModel> {
                ::std::sync::Arc::new($crate::element::Elastic { law: self, bulk_mpa })
            }

            fn viscoelastic(
                self,
                bulk_mpa: f64,
                prony: papilla_solid::Prony,
            ) -> ::std::sync::Arc<dyn $crate::element::ConstitutiveModel> {
                ::std::sync::Arc::new($crate::element::Viscoelastic { law: self, bulk_mpa, prony })
            }
        }
    };
}

constitutive_model_of!(LinearElastic);
constitutive_model_of!(NeoHookean);
constitutive_model_of!(Ogden);

/// Runs `work` compiled for the widest vectors of this processor. Products and sums stay what
/// they are, one by one, so the result is the same bit for bit on any.
#[inline(always)]
fn vectorized<T>(work: impl FnOnce() -> T) -> T {
    pulp::Arch::new().dispatch(work)
}

/// `K (theta - 1)` as a first Piola-Kirchhoff stress, added to `p`.
fn with_volumetric<L: Isochoric>(p: &Mat3, pressure: f64, k: &Kinematics) -> Mat3 {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let cof = if L::FINITE { k.cof[i][j] } else { f64::from(u8::from(i == j)) };
            p[i][j] + pressure * cof
        })
    })
}

impl<L: Isochoric> ConstitutiveModel for Elastic<L> {
    fn evaluate_with(
        &self,
        geometry: ElementGeometry<'_>,
        u: &[[f64; 3]],
        _memory: HistoryVariables<'_>,
        independent: Option<IndependentDilatation<'_>>,
        force: &mut [[f64; 3]],
        stiffness: Option<&mut [f64]>,
    ) -> Result<ElementState, Inverted> {
        vectorized(
            #[inline(always)]
            || evaluate(geometry, &Same(self.law), self.bulk_mpa, u, independent, force, stiffness),
        )
    }

    fn stored_mpa(&self, k: &Kinematics, theta_minus_1: f64, _history: &[f64]) -> f64 {
        self.law.energy(k) + 0.5 * self.bulk_mpa * theta_minus_1 * theta_minus_1
    }

    fn first_piola_mpa(
        &self,
        k: &Kinematics,
        theta_minus_1: f64,
        _memory: HistoryVariables<'_>,
    ) -> Mat3 {
        with_volumetric::<L>(&self.law.first_piola(k), self.bulk_mpa * theta_minus_1, k)
    }

    fn shear_modulus_mpa(&self) -> f64 {
        self.law.shear_modulus_mpa()
    }

    fn bulk_modulus_mpa(&self) -> f64 {
        self.bulk_mpa
    }

    fn is_finite_strain(&self) -> bool {
        L::FINITE
    }

    fn outside_calibration(&self, k: &Kinematics) -> bool {
        self.law.outside_calibration(k)
    }
}

/// A law whose isochoric stress relaxes.
#[derive(Clone, Copy, Debug)]
pub struct Viscoelastic<L> {
    /// Isochoric law with instantaneous moduli.
    pub law: L,
    /// Bulk modulus, MPa; does not relax.
    pub bulk_mpa: f64,
    /// How it relaxes.
    pub prony: Prony,
}

struct ViscoelasticPoints<'a, L> {
    solid: &'a Viscoelastic<L>,
    memory: HistoryVariables<'a>,
    len: usize,
}

impl<L: Isochoric> Points for ViscoelasticPoints<'_, L> {
    type At = Relaxing<L>;

    #[inline]
    fn at(&self, q: usize) -> Relaxing<L> {
        let history = &self.memory.history[q * self.len..(q + 1) * self.len];
        Relaxing::new(self.solid.law, &self.solid.prony, history, self.memory.dt_s)
    }
}

impl<L: ModelOf> Viscoelastic<L> {
    /// As a value to share.
    pub fn shared(law: L, bulk_mpa: f64, prony: Prony) -> Arc<dyn ConstitutiveModel> {
        law.viscoelastic(bulk_mpa, prony)
    }
}

impl<L: Isochoric> ConstitutiveModel for Viscoelastic<L> {
    fn evaluate_with(
        &self,
        geometry: ElementGeometry<'_>,
        u: &[[f64; 3]],
        memory: HistoryVariables<'_>,
        independent: Option<IndependentDilatation<'_>>,
        force: &mut [[f64; 3]],
        stiffness: Option<&mut [f64]>,
    ) -> Result<ElementState, Inverted> {
        let points = ViscoelasticPoints { solid: self, memory, len: self.history_len() };
        vectorized(
            #[inline(always)]
            || evaluate(geometry, &points, self.bulk_mpa, u, independent, force, stiffness),
        )
    }

    fn stored_mpa(&self, k: &Kinematics, theta_minus_1: f64, history: &[f64]) -> f64 {
        prony::stored(&self.law, &self.prony, k, history)
            + 0.5 * self.bulk_mpa * theta_minus_1 * theta_minus_1
    }

    fn first_piola_mpa(
        &self,
        k: &Kinematics,
        theta_minus_1: f64,
        memory: HistoryVariables<'_>,
    ) -> Mat3 {
        let law = Relaxing::new(self.law, &self.prony, memory.history, memory.dt_s);
        with_volumetric::<L>(&law.first_piola(k), self.bulk_mpa * theta_minus_1, k)
    }

    fn shear_modulus_mpa(&self) -> f64 {
        self.law.shear_modulus_mpa()
    }

    fn bulk_modulus_mpa(&self) -> f64 {
        self.bulk_mpa
    }

    fn is_finite_strain(&self) -> bool {
        L::FINITE
    }

    fn outside_calibration(&self, k: &Kinematics) -> bool {
        self.law.outside_calibration(k)
    }

    fn history_len(&self) -> usize {
        self.prony.history_len()
    }

    fn shortest_time_s(&self) -> Option<f64> {
        self.prony.terms().iter().map(|t| t.time_s).reduce(f64::min)
    }

    fn advance(&self, k: &Kinematics, dt_s: f64, history: &mut [f64]) {
        prony::advance(&self.law, &self.prony, k, dt_s, history);
    }
}
