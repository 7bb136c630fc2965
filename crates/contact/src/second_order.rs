//! Finite strain to second order: how far the skin moves beyond what its compliance says.
//!
//! Equilibrium of a hyperelastic body is `K u + r(u) = f` with the tangent at rest `K` and
//! internal forces `r` of second and higher order. Its expansion in the forces is
//! `u = C f + Q(f, f) + ...` with `C = K^-1` and `Q(f, f) = -K^-1 r''(C f, C f) / 2`. Here `Q` acts
//! on the amplitudes `z` of R load modes, and its values are combinations of K displacements.
//! A series in the force turns round at some force; the share of the second order is therefore
//! bounded smoothly, which changes nothing where the series is worth its name.

use crate::kernels::{add_scaled, dot, vectorized};

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
        let mut gram = vec![0.0; modes * modes];
        vectorized(|| {
            // Amplitudes are works on the modes' displacements: column k of the projection
            // is the skin's displacement under mode k.
            for row in projection.chunks_exact(modes) {
                for (gram, value) in gram.chunks_exact_mut(modes).zip(row) {
                    add_scaled(gram, *value, row);
                }
            }
        });
        Self { modes, outputs, projection, products, displacements, gram }
    }

    pub(crate) fn amplitudes(&self) -> Amplitudes {
        Amplitudes { loads: vec![0.0; self.modes], outputs: vec![0.0; self.outputs], share: 0.0 }
    }

    /// Amplitudes under `forces` (N) at `vertices`.
    pub(crate) fn evaluate(&self, vertices: &[u32], forces: [&[f32]; 3], a: &mut Amplitudes) {
        let (r, k) = (self.modes, self.outputs);
        vectorized(|| {
            a.loads.fill(0.0);
            for (i, &vertex) in vertices.iter().enumerate() {
                let rows = &self.projection[3 * r * vertex as usize..][..3 * r];
                for (row, force) in rows.chunks_exact(r).zip(forces) {
                    add_scaled(&mut a.loads, force[i], row);
                }
            }
            a.outputs.fill(0.0);
            let mut first = 0;
            for (l, &own) in a.loads.iter().enumerate() {
                let rows = &self.products[first * k..][..(r - l) * k];
                for (row, other) in rows.chunks_exact(k).zip(&a.loads[l..]) {
                    add_scaled(&mut a.outputs, own * other, row);
                }
                first += r - l;
            }
            let square: f32 = self
                .gram
                .chunks_exact(r)
                .zip(&a.loads)
                .map(|(row, own)| own * dot(row, &a.loads))
                .sum();
            let size = dot(&a.outputs, &a.outputs).sqrt();
            a.share = if square > 0.0 { size / square.sqrt() } else { 0.0 };
            let bound = (1.0 + (a.share / SHARE_BOUND).powi(4)).powf(-0.25);
            for output in &mut a.outputs {
                *output *= bound;
            }
        });
    }

    /// Displacement of a vertex, mm; to be called inside [`vectorized`].
    #[inline(always)]
    pub(crate) fn displacement_mm(&self, a: &Amplitudes, vertex: u32) -> [f32; 3] {
        let k = self.outputs;
        let rows = &self.displacements[3 * k * vertex as usize..][..3 * k];
        std::array::from_fn(|i| dot(&rows[i * k..][..k], &a.outputs))
    }
}
