//! Finite strain to second order: how far the skin moves beyond its compliance.
//!
//! The equilibrium of a hyperelastic body is `K u + r(u) = f`, with the tangent at rest `K` and
//! internal forces `r` of second and higher order. Its expansion in the forces is `u = C f + Q(f,
//! f) + ...`, with `C = K^-1` and `Q(f, f) = -K^-1 r''(C f, C f) / 2`. Here `Q` acts on the
//! amplitudes `z` of R load modes, and its values are combinations of a number of stored
//! displacements. A series in the force is wrong for large forces. Therefore the share of the
//! second order is limited smoothly, which changes nothing where the share is small.

use crate::kernels::{add_scaled, dot, product, run};
use pulp::{Simd, WithSimd};

/// Share of the second order in the displacement at which the bound sets in.
const SHARE_BOUND: f32 = 0.35;

/// The quadratic operator.
#[derive(Debug)]
pub(crate) struct SecondOrder {
    modes: usize,
    outputs: usize,
    projection: Vec<f32>,
    products: Vec<f32>,
    displacements: Vec<f32>,
    /// `[R][R]`: products of the modes' displacements over the skin, for its size.
    gram: Vec<f32>,
}

/// Memory of an evaluation.
#[derive(Clone, Debug)]
pub(crate) struct Amplitudes {
    loads: Vec<f32>,
    outputs: Vec<f32>,
    /// Second-order displacement over first-order displacement, before it is bounded.
    pub(crate) share: f32,
}

impl SecondOrder {
    pub(crate) fn new(
        [modes, outputs]: [usize; 2],
        projection: Vec<f32>,
        products: Vec<f32>,
        displacements: Vec<f32>,
    ) -> Self {
        // Amplitudes are works on the modes' displacements: column k of the projection
        // is the skin's displacement under mode k.
        let mut gram = vec![0.0; modes * modes];
        for row in projection.chunks_exact(modes) {
            for (gram, value) in gram.chunks_exact_mut(modes).zip(row) {
                gram.iter_mut().zip(row).for_each(|(g, other)| *g += value * other);
            }
        }
        Self { modes, outputs, projection, products, displacements, gram }
    }

    pub(crate) fn amplitudes(&self) -> Amplitudes {
        Amplitudes { loads: vec![0.0; self.modes], outputs: vec![0.0; self.outputs], share: 0.0 }
    }

    /// Amplitudes under `forces` (N) at `vertices`.
    pub(crate) fn evaluate(&self, vertices: &[u32], forces: [&[f32]; 3], a: &mut Amplitudes) {
        run(Amplify { operator: self, vertices, forces, amplitudes: a });
        let rows = self.gram.chunks_exact(self.modes).zip(&a.loads);
        let square: f32 = rows.map(|(row, own)| own * product(row, &a.loads)).sum();
        let size = product(&a.outputs, &a.outputs).sqrt();
        a.share = if square > 0.0 { size / square.sqrt() } else { 0.0 };
        let bound = (1.0 + (a.share / SHARE_BOUND).powi(4)).powf(-0.25);
        for output in &mut a.outputs {
            *output *= bound;
        }
    }

    /// Units of work that the displacement of so many vertices under forces on so many takes.
    pub(crate) fn work(&self, pushing: usize, moving: usize) -> usize {
        let Self { modes: r, outputs: k, .. } = self;
        3 * r * pushing + r * (r + 1) / 2 * k + r * r + 3 * k * moving
    }

    /// Adds the displacement of `vertices`, mm, to `first`, into `moved`.
    pub(crate) fn displace(
        &self,
        a: &Amplitudes,
        vertices: &[u32],
        first: &[Vec<f32>; 3],
        moved: &mut [Vec<f32>; 3],
    ) {
        run(Displace { operator: self, amplitudes: a, vertices, first, moved });
    }
}

struct Amplify<'a> {
    operator: &'a SecondOrder,
    vertices: &'a [u32],
    forces: [&'a [f32]; 3],
    amplitudes: &'a mut Amplitudes,
}

impl WithSimd for Amplify<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let SecondOrder { modes: r, outputs: k, projection, products, .. } = self.operator;
        let (r, k) = (*r, *k);
        let Amplitudes { loads, outputs, .. } = self.amplitudes;
        loads.fill(0.0);
        for (i, &vertex) in self.vertices.iter().enumerate() {
            let rows = &projection[3 * r * vertex as usize..][..3 * r];
            for (row, force) in rows.chunks_exact(r).zip(self.forces) {
                add_scaled(simd, loads, force[i], row);
            }
        }
        outputs.fill(0.0);
        let mut first = 0;
        for (l, &own) in loads.iter().enumerate() {
            let rows = &products[first * k..][..(r - l) * k];
            for (row, other) in rows.chunks_exact(k).zip(&loads[l..]) {
                add_scaled(simd, outputs, own * other, row);
            }
            first += r - l;
        }
    }
}

struct Displace<'a> {
    operator: &'a SecondOrder,
    amplitudes: &'a Amplitudes,
    vertices: &'a [u32],
    first: &'a [Vec<f32>; 3],
    moved: &'a mut [Vec<f32>; 3],
}

impl WithSimd for Displace<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let k = self.operator.outputs;
        for (slot, &vertex) in self.vertices.iter().enumerate() {
            let rows = &self.operator.displacements[3 * k * vertex as usize..][..3 * k];
            for (i, row) in rows.chunks_exact(k).enumerate() {
                self.moved[i][slot] =
                    self.first[i][slot] + dot(simd, row, &self.amplitudes.outputs);
            }
        }
    }
}
