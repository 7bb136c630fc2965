//! A half-space in place of the finger, for comparison: it shows what shape, bone and layers are
//! worth.

use crate::error::ModelError;
use crate::model::{Arrays, ContactModel, Header};
use std::f64::consts::PI;

impl Arrays {
    /// A skin whose vertices move along their normals as the surface of an elastic half-space
    /// (Boussinesq): `1 / (pi E* r)` for 1 N at the chord `r`, and at a vertex itself the mean under
    /// a uniform disc of its area, `16 / (3 pi^2 E* a)`.
    ///
    /// `modulus_mpa` is `E* = E / (1 - nu^2)`.
    #[must_use]
    pub fn half_space(
        positions_mm: Vec<f32>,
        normals: Vec<f32>,
        areas_mm2: Vec<f32>,
        triangles: Vec<u32>,
        modulus_mpa: f64,
    ) -> Self {
        let (place, normal) = (positions_mm.as_chunks::<3>().0, normals.as_chunks::<3>().0);
        let v = place.len();
        let size = 3 * v;
        let mut compliance = Vec::with_capacity(size * (size + 1) / 2);
        for i in 0..size {
            let (p, a) = (i / 3, i % 3);
            for k in i..size {
                let (q, b) = (k / 3, k % 3);
                let value = along(place, &areas_mm2, p, q) / modulus_mpa;
                compliance.push((value * f64::from(normal[p][a] * normal[q][b])) as f32);
            }
        }
        Self {
            positions_mm,
            normals,
            areas_mm2,
            triangles,
            compliance_mm_per_n: compliance,
            ..Self::default()
        }
    }
}

/// Displacement along the normal times `E*`.
fn along(place: &[[f32; 3]], areas_mm2: &[f32], p: usize, q: usize) -> f64 {
    if p == q {
        let radius = (f64::from(areas_mm2[p]) / PI).sqrt();
        return 16.0 / (3.0 * PI * PI * radius);
    }
    let square = |i: usize| f64::from(place[p][i] - place[q][i]).powi(2);
    1.0 / (PI * (0..3).map(square).sum::<f64>().sqrt())
}

impl ContactModel {
    /// The same skin on a half-space whose modulus fits the finger's own compliance along the
    /// normals best (least squares over all pairs of vertices within 3 mm).
    ///
    /// # Errors
    /// [`ModelError`] as of [`Self::new`].
    pub fn on_half_space(&self) -> Result<Self, ModelError> {
        const NEAR_MM: f64 = 3.0;
        let place: Vec<[f32; 3]> = self.positions_mm.iter().map(|p| p.map(|c| c as f32)).collect();
        let v = self.vertices();
        let (mut shared, mut square) = (0.0, 0.0);
        for p in 0..v {
            for q in 0..v {
                let shape = along(&place, &self.areas_mm2, p, q);
                if p != q && shape * PI * NEAR_MM < 1.0 {
                    continue;
                }
                let values = self.compliance.pair(p, q).into_iter().enumerate();
                let own: f64 = values
                    .map(|(pair, value)| {
                        let n = self.normals[p][pair / 3] * self.normals[q][pair % 3];
                        f64::from(n * value)
                    })
                    .sum();
                shared += own * shape;
                square += shape * shape;
            }
        }
        let flat = |x: &[[f32; 3]]| x.as_flattened().to_vec();
        let arrays = Arrays::half_space(
            flat(&place),
            flat(&self.normals),
            self.areas_mm2.clone(),
            self.triangles.as_flattened().to_vec(),
            square / shared,
        );
        let header = Header { modes: 0, outputs: 0, ..self.header().clone() };
        Self::new(header, arrays)
    }
}
