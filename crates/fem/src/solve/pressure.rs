//! Pressure on a surface that it follows: per deformed area, along the deformed normal.
//!
//! At a point of a face with tangents `t1`, `t2` and outward area vector `n = t1 x t2` the force on
//! node `a` is `-p N_a n`. Its derivative is not symmetric where pressure varies or the loaded
//! surface ends; the tangent takes the symmetric part, which finds the same equilibrium in a few
//! more iterations (Schweizerhof & Ramm 1984).

use super::problem::Problem;
use super::sides::{Side, Sides};
use crate::linear::SymmetricMatrix;
use crate::mesh::Mesh;
use papilla_vector::cross;

/// Two Gauss points and weights on `[0, 1]`.
const GAUSS_2: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];

/// A pressure field on faces of a mesh, MPa, of which a loading takes a share.
#[derive(Clone, Debug)]
pub struct SurfacePressure {
    faces: Vec<LoadedFace>,
}

/// What a share of the pressure comes to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Acting {
    /// Sum of its forces, N, and of their squares at the nodes, N2.
    pub force_n: [f64; 3],
    pub square: f64,
    /// Work on the straight way from rest, mJ.
    pub work_mj: f64,
}

/// A face, and the element that it is a side of.
#[derive(Clone, Debug)]
struct LoadedFace {
    nodes: Vec<u32>,
    side: Side,
    points: Vec<Point>,
}

/// A quadrature point.
#[derive(Clone, Debug)]
struct Point {
    value: [f64; 9],
    gradient: [[f64; 2]; 9],
    /// Pressure times the weight of the rule.
    weighted_mpa: f64,
}

/// Why pressure cannot act on a surface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SurfacePressureError {
    /// No such surface.
    #[error("the mesh has no surface named '{0}'")]
    Missing(String),
    /// Edges of a plane section.
    #[error("pressure acts on faces; surface '{0}' has edges")]
    Edges(String),
    /// A face belongs to no element.
    #[error("a face of surface '{0}' is no side of an element")]
    Loose(String),
}

impl SurfacePressure {
    /// Pressure on the named surface: `at_mpa` is asked at each quadrature point, by its place on the
    /// undeformed surface, mm. Faces on which it is zero cost nothing.
    ///
    /// # Errors
    /// [`SurfacePressureError`].
    pub fn new(
        mesh: &Mesh,
        surface: &str,
        at_mpa: &mut dyn FnMut([f64; 3]) -> f64,
    ) -> Result<Self, SurfacePressureError> {
        let name = || surface.to_owned();
        let faces =
            mesh.surfaces.get(surface).ok_or_else(|| SurfacePressureError::Missing(name()))?;
        let kind = faces.kind;
        if kind.corners() == 2 {
            return Err(SurfacePressureError::Edges(name()));
        }
        let rule = kind.quadrature();
        let mut loaded = Vec::new();
        for nodes in faces.faces() {
            let points = rule.iter().map(|&(xi, weight)| {
                let (mut value, mut gradient) = ([0.0; 9], [[0.0; 2]; 9]);
                kind.shape(xi, &mut value, &mut gradient);
                let mut place = [0.0; 3];
                for (&n, v) in nodes.iter().zip(value) {
                    for i in 0..3 {
                        place[i] += v * mesh.nodes[n as usize][i];
                    }
                }
                Point { value, gradient, weighted_mpa: weight * at_mpa(place) }
            });
            let points: Vec<Point> = points.collect();
            if points.iter().any(|p| p.weighted_mpa != 0.0) {
                loaded.push((nodes, points));
            }
        }
        let sides = Sides::new(mesh, loaded.iter().map(|(nodes, _)| *nodes));
        let faces = loaded.into_iter().map(|(nodes, points)| {
            let side = sides.of(nodes).ok_or_else(|| SurfacePressureError::Loose(name()))?;
            Ok(LoadedFace { nodes: nodes.to_vec(), side, points })
        });
        Ok(Self { faces: faces.collect::<Result<_, _>>()? })
    }

    /// Whether it presses nowhere.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.faces.is_empty()
    }

    /// Calls `visit` with every node of every face and the force (N) that the whole pressure has
    /// there, with the body displaced by `scale` times `u`, mm.
    fn forces(
        &self,
        mesh: &Mesh,
        u: &[[f64; 3]],
        scale: f64,
        visit: &mut dyn FnMut(u32, [f64; 3]),
    ) {
        for face in &self.faces {
            for point in &face.points {
                let normal = point.normal(face, mesh, u, scale);
                for (&node, v) in face.nodes.iter().zip(point.value) {
                    visit(node, normal.map(|n| -point.weighted_mpa * v * n));
                }
            }
        }
    }

    /// Sum of the forces of the whole pressure, N, with the body displaced by `u`, mm.
    #[must_use]
    pub fn force_n(&self, mesh: &Mesh, u: &[[f64; 3]]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.forces(mesh, u, 1.0, &mut |_, force| (0..3).for_each(|i| sum[i] += force[i]));
        sum
    }

    /// Work, mJ, on a straight way of the nodes from `from` to `to`, mm, on which the share of the
    /// pressure goes linearly from `shares[0]` to `shares[1]`.
    pub(super) fn work_mj(
        &self,
        mesh: &Mesh,
        [from, to]: [&[[f64; 3]]; 2],
        shares: [f64; 2],
    ) -> f64 {
        let mut at = from.to_vec();
        let mut sum = 0.0;
        for (s, weight) in GAUSS_2 {
            for ((at, from), to) in at.iter_mut().zip(from).zip(to) {
                *at = std::array::from_fn(|i| from[i] + s * (to[i] - from[i]));
            }
            let share = shares[0] + s * (shares[1] - shares[0]);
            self.forces(mesh, &at, 1.0, &mut |node, force| {
                let n = node as usize;
                sum += weight
                    * share
                    * (0..3).map(|i| force[i] * (to[n][i] - from[n][i])).sum::<f64>();
            });
        }
        sum
    }

    /// Takes the forces of a share of the pressure from the residual (N), and adds its tangent.
    pub(super) fn add(
        &self,
        problem: &Problem,
        u: &[[f64; 3]],
        share: f64,
        tangent: Option<&mut SymmetricMatrix>,
        residual_n: &mut [f64],
    ) -> Acting {
        let mesh = &problem.mesh;
        let mut acting = Acting::default();
        self.forces(mesh, u, 1.0, &mut |node, force| {
            for i in 0..3 {
                let f = share * force[i];
                residual_n[3 * node as usize + i] -= f;
                acting.force_n[i] += f;
                acting.square += f * f;
            }
        });
        // The work on the straight way from rest is the potential where there is one.
        for (s, weight) in GAUSS_2 {
            self.forces(mesh, u, s, &mut |node, force| {
                let u = u[node as usize];
                acting.work_mj += weight * share * (0..3).map(|i| force[i] * u[i]).sum::<f64>();
            });
        }
        if let Some(tangent) = tangent {
            for face in &self.faces {
                face.stiffen(problem, u, share, tangent);
            }
        }
        acting
    }
}

impl Point {
    /// Tangents of the deformed face.
    fn tangents(
        &self,
        face: &LoadedFace,
        mesh: &Mesh,
        u: &[[f64; 3]],
        scale: f64,
    ) -> [[f64; 3]; 2] {
        let mut t = [[0.0; 3]; 2];
        for (&node, gradient) in face.nodes.iter().zip(self.gradient) {
            let n = node as usize;
            for i in 0..3 {
                let x = mesh.nodes[n][i] + scale * u[n][i];
                t[0][i] += gradient[0] * x;
                t[1][i] += gradient[1] * x;
            }
        }
        t
    }

    fn normal(&self, face: &LoadedFace, mesh: &Mesh, u: &[[f64; 3]], scale: f64) -> [f64; 3] {
        let [a, b] = self.tangents(face, mesh, u, scale);
        cross(a, b)
    }
}

impl LoadedFace {
    /// Adds the symmetric part of what the residual changes with the displacement, by way of the
    /// element's own matrix: so nodes that hang are followed.
    fn stiffen(
        &self,
        problem: &Problem,
        u: &[[f64; 3]],
        share: f64,
        tangent: &mut SymmetricMatrix,
    ) {
        let Side { block, element, local } = &self.side;
        let size = 3 * problem.mesh.blocks[*block].kind.nodes();
        let mut dense = vec![0.0; size * size];
        for point in &self.points {
            let [t1, t2] = point.tangents(self, &problem.mesh, u, 1.0);
            let half = 0.5 * share * point.weighted_mpa;
            for (a, &at) in local.iter().enumerate() {
                for (b, &to) in local.iter().enumerate() {
                    let (va, vb) = (point.value[a], point.value[b]);
                    let ([a1, a2], [b1, b2]) = (point.gradient[a], point.gradient[b]);
                    let v: [f64; 3] = std::array::from_fn(|k| {
                        half * (va * (b1 * t2[k] - b2 * t1[k]) - vb * (a1 * t2[k] - a2 * t1[k]))
                    });
                    // epsilon_ijk v_k
                    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                        dense[(3 * at + i) * size + 3 * to + j] += v[k];
                        dense[(3 * at + j) * size + 3 * to + i] -= v[k];
                    }
                }
            }
        }
        problem.system.add_element(tangent, *block, *element, &mut dense);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{Elastic, ElementKind, Materials};
    use crate::mesh::block::even;
    use crate::mesh::lattice::{REGION, intervals, lattice};
    use crate::mesh::supports::hold;
    use crate::solve::{Loading, Options, Solver};
    use papilla_solid::NeoHookean;
    use std::sync::Arc;

    const BULK_MPA: f64 = 0.5;

    /// A block of 2 x 3 x 4 mm that may slide on three of its sides, from soft neo-Hookean rubber.
    fn block(kind: ElementKind, cells: usize) -> Problem {
        let n = intervals(kind) * cells;
        let mesh = lattice(kind, [even(2.0, n), even(3.0, n), even(4.0, n)], |p| p);
        let sides = [
            ("x_min", [true, false, false]),
            ("y_min", [false, true, false]),
            ("z_min", [false, false, true]),
        ];
        let fixed = hold(&mesh, &sides);
        let model = Elastic::shared(NeoHookean { mu_mpa: 0.1 }, BULK_MPA);
        let materials = Materials::new(vec![model; REGION.index() + 1]);
        Problem::new(mesh, materials, fixed, None).unwrap()
    }

    /// What a body with several loaded sides bears: they are one surface.
    fn all_round(problem: &Problem, pressure_mpa: f64) -> SurfacePressure {
        let mut all = SurfacePressure { faces: Vec::new() };
        for side in ["x_max", "y_max", "z_max"] {
            let one = SurfacePressure::new(&problem.mesh, side, &mut |_| pressure_mpa).unwrap();
            all.faces.extend(one.faces);
        }
        all
    }

    /// Under pressure all round, `K (J - 1) = -p`, whatever the shape: a dead load, which is of the
    /// undeformed area, or a normal that does not turn would give another volume.
    #[test]
    fn a_block_under_pressure_all_round_has_the_volume_of_its_law() {
        for kind in [ElementKind::Hex8, ElementKind::Hex20, ElementKind::Hex27] {
            let problem = block(kind, 2);
            let pressure_mpa = 0.2;
            let pressure = Arc::new(all_round(&problem, pressure_mpa));
            let tight = Options { residual_tolerance: 1e-11, ..Options::default() };
            let mut solver = Solver::new(&problem, tight).unwrap();
            solver.start(Loading { pressure: Some(pressure.clone()), ..Loading::default() });
            let report = solver.advance_to(1.0).unwrap();
            let stretch = (1.0 - pressure_mpa / BULK_MPA).cbrt();
            for (x, u) in problem.mesh.nodes.iter().zip(solver.displacement_mm()) {
                for i in 0..3 {
                    assert!((u[i] - (stretch - 1.0) * x[i]).abs() < 1e-8, "{kind:?} {x:?} {u:?}");
                }
            }
            assert!(report.effort.newton_iterations <= 10, "{:?}", report.effort);
            // The sides bear p on the deformed area.
            let due = [12.0, 8.0, 6.0].map(|area| -pressure_mpa * area * stretch * stretch);
            let (force, held) =
                (solver.balance().contact_force_n, solver.balance().support_force_n);
            for i in 0..3 {
                assert!((force[i] - due[i]).abs() < 1e-8 && (held[i] + due[i]).abs() < 1e-7);
            }
            // Of one step the work misses the curved way; it is exact in the limit of many.
            let energy = |steps: u32| solver_of(&problem, &pressure, steps, tight);
            let [coarse, fine] = [8, 16].map(energy);
            assert!(fine < 0.3 * coarse && fine < 2e-3, "{coarse} {fine}");
        }
    }

    /// Relative difference of stored energy and work after some equal steps.
    fn solver_of(
        problem: &Problem,
        pressure: &Arc<SurfacePressure>,
        steps: u32,
        options: Options,
    ) -> f64 {
        let mut solver = Solver::new(problem, options).unwrap();
        solver.start(Loading { pressure: Some(pressure.clone()), ..Loading::default() });
        let mut stored = 0.0;
        for step in 1..=steps {
            let fraction = f64::from(step) / f64::from(steps);
            stored = solver.advance_to(fraction).unwrap().stored_mj;
        }
        (solver.pressure_work_mj() / stored - 1.0).abs()
    }

    /// The tangent is the symmetric part of the derivative of the residual, at a displacement that
    /// bends the loaded side.
    #[test]
    fn the_tangent_is_the_symmetric_part_of_the_derivative() {
        let problem = block(ElementKind::Hex27, 1);
        let mut ramp = |x: [f64; 3]| 0.05 + 0.02 * x[0] * x[1];
        let pressure = SurfacePressure::new(&problem.mesh, "z_max", &mut ramp).unwrap();
        let mut u: Vec<[f64; 3]> = problem
            .mesh
            .nodes
            .iter()
            .map(|[x, y, z]| [0.02 * x * z, -0.03 * y * z * x, 0.05 * z * (x - 0.4 * y)])
            .collect();
        let force = |u: &[[f64; 3]]| {
            let mut residual = vec![0.0; 3 * u.len()];
            pressure.forces(&problem.mesh, u, 1.0, &mut |n, f| {
                (0..3).for_each(|i| residual[3 * n as usize + i] -= f[i]);
            });
            residual
        };
        let size = 3 * u.len();
        let mut derivative = vec![0.0; size * size];
        for c in 0..size {
            let h = 1e-5;
            let at = u[c / 3][c % 3];
            u[c / 3][c % 3] = at + h;
            let up = force(&u);
            u[c / 3][c % 3] = at - h;
            let down = force(&u);
            u[c / 3][c % 3] = at;
            for r in 0..size {
                derivative[r * size + c] = (up[r] - down[r]) / (2.0 * h);
            }
        }
        let mut tangent = problem.system.zeros();
        for face in &pressure.faces {
            face.stiffen(&problem, &u, 1.0, &mut tangent);
        }
        let dofs = &problem.system.dofs;
        let free: Vec<usize> =
            (0..size).filter(|&d| dofs.of_dof[d] != crate::linear::DofMap::FIXED).collect();
        let mut product = vec![0.0; dofs.count];
        let mut largest = 0.0f64;
        for &c in &free {
            let mut unit = vec![0.0; dofs.count];
            unit[dofs.of_dof[c] as usize] = 1.0;
            problem.system.multiply(&tangent, &unit, &mut product);
            for &r in &free {
                let due = 0.5 * (derivative[r * size + c] + derivative[c * size + r]);
                let found = product[dofs.of_dof[r] as usize];
                assert!((found - due).abs() < 1e-7, "{r} {c}: {found} {due}");
                largest = largest.max(due.abs());
            }
        }
        assert!(largest > 1e-3, "nothing was compared: {largest}");
    }

    #[test]
    fn what_cannot_bear_pressure_is_said() {
        let problem = block(ElementKind::Hex8, 1);
        let new = |name: &str| SurfacePressure::new(&problem.mesh, name, &mut |_| 1.0);
        assert_eq!(new("lid").unwrap_err(), SurfacePressureError::Missing("lid".into()));
        assert!(SurfacePressure::new(&problem.mesh, "z_max", &mut |_| 0.0).unwrap().is_zero());
        let mesh = lattice(ElementKind::Quad4, [even(1.0, 1), even(1.0, 1), vec![0.0]], |p| p);
        let edges = SurfacePressure::new(&mesh, "y_max", &mut |_| 1.0);
        assert_eq!(edges.unwrap_err(), SurfacePressureError::Edges("y_max".into()));
    }
}
