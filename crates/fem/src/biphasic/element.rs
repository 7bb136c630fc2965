//! One element's fluid: pressure between its corners, its force, its flow and their tangent.

use super::Permeability;
use crate::element::geometry::{ElementGeometry, displacement_gradient};
use crate::element::{ElementKind, Inverted};
use papilla_solid::tensor::{Kinematics, Mat3, UNIT, trace};

/// Most corners of an element.
pub(super) const CORNERS_MAX: usize = 8;
/// Most nodes of an element.
pub(super) const NODES_MAX: usize = 27;

/// Pressure functions of a kind of element: linear between its corners.
pub(super) struct Interpolation {
    pub corners: usize,
    /// At the quadrature points.
    at_points: Vec<[f64; CORNERS_MAX]>,
    /// At the element's nodes: pressure functions are sums of displacement functions with these
    /// factors, and so are their gradients.
    pub at_nodes: Vec<[f64; CORNERS_MAX]>,
}

impl Interpolation {
    /// `None` for a kind whose displacement is linear.
    pub(super) fn new(kind: ElementKind) -> Option<Self> {
        let linear = match kind {
            ElementKind::Hex20 | ElementKind::Hex27 => ElementKind::Hex8,
            ElementKind::Tet10 => ElementKind::Tet4,
            ElementKind::Quad8 | ElementKind::Quad9 => ElementKind::Quad4,
            ElementKind::Hex8 | ElementKind::Tet4 | ElementKind::Quad4 => return None,
        };
        let values = |xi: [f64; 3]| {
            let (mut value, mut gradient) = ([0.0; CORNERS_MAX], [[0.0; 3]; CORNERS_MAX]);
            linear.shape(xi, &mut value, &mut gradient);
            value
        };
        Some(Self {
            corners: linear.nodes(),
            at_points: kind.quadrature().iter().map(|q| values(q.xi)).collect(),
            at_nodes: (0..kind.nodes()).map(|a| values(kind.node_xi(a))).collect(),
        })
    }

    /// Gradients of the pressure functions, 1/mm, of those of displacement.
    fn gradients(&self, displacement: &[[f64; 3]]) -> [[f64; 3]; CORNERS_MAX] {
        let mut out = [[0.0; 3]; CORNERS_MAX];
        for (factors, g) in self.at_nodes.iter().zip(displacement) {
            for (o, f) in out.iter_mut().zip(factors) {
                for i in 0..3 {
                    o[i] += f * g[i];
                }
            }
        }
        out
    }
}

/// What an element's fluid depends on.
pub(super) struct Flowing<'a> {
    pub geometry: ElementGeometry<'a>,
    pub interpolation: &'a Interpolation,
    pub permeability: Permeability,
    /// Whether the solid's law is of finite strain.
    pub finite: bool,
    /// Displacement of the nodes at the end and the start of the step, mm.
    pub u: &'a [[f64; 3]],
    pub start: &'a [[f64; 3]],
    /// That at the start of the step before, and this step over that one.
    pub older: Option<(&'a [[f64; 3]], f64)>,
    /// Pressure of the corners, MPa.
    pub pressure: [f64; CORNERS_MAX],
    pub dt_s: f64,
}

/// What the fluid does at one quadrature point.
pub(super) struct Point<'a> {
    pub weight: f64,
    /// Gradients of the displacement functions.
    pub displacement: &'a [[f64; 3]],
    /// Pressure functions and their gradients.
    pub value: &'a [f64; CORNERS_MAX],
    gradient: [[f64; 3]; CORNERS_MAX],
    f: Mat3,
    /// Derivative of the volume ratio by the displacement gradient.
    pub by_h: Mat3,
    /// What the volume ratio is above `J*`.
    pub growth: f64,
    /// Pressure, MPa.
    pub pressure: f64,
    /// `dt/b K* Grad N` of each pressure function.
    flux: [[f64; 3]; CORNERS_MAX],
}

impl Flowing<'_> {
    /// Visits the quadrature points.
    pub(super) fn points(&self, visit: &mut dyn FnMut(&Point<'_>)) -> Result<(), Inverted> {
        let n = self.u.len();
        for (q, &weight) in self.geometry.weights.iter().enumerate() {
            let displacement = &self.geometry.gradients[q * n..(q + 1) * n];
            let k = Kinematics::new(displacement_gradient(self.u, displacement));
            if self.finite && !(k.j() > 0.0) {
                return Err(Inverted { point: q, j: k.j() });
            }
            let (past, ahead) = self.past(displacement);
            let value = &self.interpolation.at_points[q];
            let gradient = self.interpolation.gradients(displacement);
            let conductivity = self.conductivity(&ahead);
            let dt_s = self.dt_s / self.leading();
            let flux = gradient.map(|g| {
                std::array::from_fn(|i| {
                    dt_s * (0..3).map(|j| conductivity[i][j] * g[j]).sum::<f64>()
                })
            });
            visit(&Point {
                weight,
                displacement,
                value,
                gradient,
                f: k.f,
                by_h: if self.finite { k.cof } else { UNIT },
                growth: self.growth(&k) - past,
                pressure: value.iter().zip(&self.pressure).map(|(v, p)| v * p).sum(),
                flux,
            });
        }
        Ok(())
    }

    fn growth(&self, k: &Kinematics) -> f64 {
        if self.finite { k.j_minus_1 } else { trace(&k.h) }
    }

    /// The factor `b` of the newest volume.
    fn leading(&self) -> f64 {
        self.older.map_or(1.0, |(_, r)| (1.0 + 2.0 * r) / (1.0 + r))
    }

    /// `J* - 1`, and the deformation that the permeability is taken at: extrapolated, or that of
    /// the step's start where extrapolation turns a point inside out.
    fn past(&self, displacement: &[[f64; 3]]) -> (f64, Kinematics) {
        let start = Kinematics::new(displacement_gradient(self.start, displacement));
        let Some((older, r)) = self.older else { return (self.growth(&start), start) };
        let older = Kinematics::new(displacement_gradient(older, displacement));
        let past = ((1.0 + r) * self.growth(&start) - r * r / (1.0 + r) * self.growth(&older))
            / self.leading();
        let ahead: Mat3 = std::array::from_fn(|i| {
            std::array::from_fn(|j| start.h[i][j] + r * (start.h[i][j] - older.h[i][j]))
        });
        let ahead = Kinematics::new(ahead);
        (past, if ahead.j() > 0.5 * start.j() { ahead } else { start })
    }

    /// `K = J F^-1 k F^-T = k cof^T cof / J`, mm4/(N s).
    fn conductivity(&self, at: &Kinematics) -> Mat3 {
        let k = self.permeability.at_mm4_per_n_s(self.growth(at));
        if !self.finite {
            return UNIT.map(|row| row.map(|v| k * v));
        }
        let c = &at.cof;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| k / at.j() * (0..3).map(|m| c[m][i] * c[m][j]).sum::<f64>())
        })
    }
}

impl Point<'_> {
    /// `cof F . Grad N` of a displacement function.
    fn push(&self, node: usize) -> [f64; 3] {
        let g = self.displacement[node];
        std::array::from_fn(|i| (0..3).map(|j| self.by_h[i][j] * g[j]).sum())
    }

    /// Adds the force of the pressure on the nodes, N.
    pub(super) fn add_force(&self, force: &mut [[f64; 3]]) {
        for (a, f) in force.iter_mut().enumerate() {
            let push = self.push(a);
            for i in 0..3 {
                f[i] -= self.weight * self.pressure * push[i];
            }
        }
    }

    /// Adds the volume that came to each corner without fluid that flowed there, mm3.
    pub(super) fn add_surplus(&self, pressure: &[f64; CORNERS_MAX], surplus: &mut [f64]) {
        for (a, s) in surplus.iter_mut().enumerate() {
            let g = self.gradient[a];
            let flown: f64 = (0..pressure.len())
                .map(|b| pressure[b] * (0..3).map(|i| g[i] * self.flux[b][i]).sum::<f64>())
                .sum();
            *s -= self.weight * (self.value[a] * self.growth + flown);
        }
    }

    /// Adds `-p d cof / dF` between nodes `a < b`, dense and row-major; nothing on the diagonal.
    ///
    /// `Grad N_a . d cof_ik / dF . Grad N_b = e_ikm (F (Grad N_a x Grad N_b))_m`.
    pub(super) fn add_geometric(&self, stiffness: &mut [f64]) {
        let n = self.displacement.len();
        for a in 0..n {
            let g = self.displacement[a];
            for b in a + 1..n {
                let h = self.displacement[b];
                let cross: [f64; 3] = std::array::from_fn(|i| {
                    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                    g[j] * h[k] - g[k] * h[j]
                });
                for m in 0..3 {
                    let (i, k) = ((m + 1) % 3, (m + 2) % 3);
                    let turned: f64 = (0..3).map(|j| self.f[m][j] * cross[j]).sum();
                    let v = self.weight * self.pressure * turned;
                    stiffness[(3 * a + i) * 3 * n + 3 * b + k] -= v;
                    stiffness[(3 * a + k) * 3 * n + 3 * b + i] += v;
                }
            }
        }
    }

    /// Adds `B`, corner by displacement, and `-C`, corner by corner, row-major.
    pub(super) fn add_coupling(&self, corners: usize, coupled: &mut [f64], between: &mut [f64]) {
        let n = self.displacement.len();
        for b in 0..n {
            let push = self.push(b).map(|v| self.weight * v);
            for a in 0..corners {
                for i in 0..3 {
                    coupled[a * 3 * n + 3 * b + i] -= self.value[a] * push[i];
                }
            }
        }
        for a in 0..corners {
            let g = self.gradient[a];
            for b in 0..corners {
                let flown: f64 = (0..3).map(|i| g[i] * self.flux[b][i]).sum();
                between[a * corners + b] -= self.weight * flown;
            }
        }
    }
}
