//! Tension of a surface at rest, such as that of skin.
//!
//! A sheet on the surface is stretched at rest, by `gamma` (N/mm) in every direction along it. The
//! shape at rest is known with this tension in it. So whatever balances it there is taken as a
//! *dead load*: it keeps its size and its direction. At rest nothing moves, then.
//!
//! In a solid that is stretched at rest the energy begins with `S : E`: its second Piola-Kirchhoff
//! stress at rest times Green's strain `E = (grad u + grad u^T + grad u^T grad u) / 2`. What is of
//! second order and more in the strain is the tissue's own law. Of a sheet, integrated over the
//! undeformed surface,
//!
//! ```text
//! integral gamma tr E dA  =  gamma integral div_s u dA  +  gamma/2 integral |grad_s u|^2 dA
//! ```
//!
//! with the gradient `grad_s` along the surface. The first term is the work of the tension's forces
//! at rest; the dead load takes it away. The second one is all that is left. It is quadratic and
//! never negative, so that it cannot make a body unstable, and its tangent is constant. A sheet
//! stretched along x and y that moves by `w` across itself has `gamma/2 (w,x^2 + w,y^2)`, exactly.
//! A film of liquid, with the energy `gamma` times the deformed area, has the same up to second
//! order in `w`. It would not resist shear along itself, as a stretched solid does.
//!
//! **What turns.** Moving the body adds nothing. Turning it does, since the dead load does not turn
//! with it: a plane surface of area `A` and normal `n` that is turned about the axis `a` has the
//! energy `gamma A (1 - cos) (1 + (n . a)^2)`, and a moment of first order in the angle turns it
//! back. The true load, stress in the tissue below, would turn too. A body that is held at its bone
//! cannot turn as a whole. But where its skin is turned by a press or a stroke, the part of the
//! tension that the curvature bears, `gamma` over the radius, keeps its direction.

use super::sides::{Side, Sides};
use crate::linear::{SymbolicSystem, SymmetricMatrix};
use crate::mesh::{FaceKind, Mesh};
use papilla_vector::{cross, dot, norm};

/// A surface under tension.
#[derive(Clone, Debug)]
pub struct SurfaceTension {
    faces: Vec<TenseFace>,
}

#[derive(Clone, Debug)]
struct TenseFace {
    nodes: Vec<u32>,
    side: Side,
    /// `gamma integral grad_s N_a . grad_s N_b dA`, N/mm, row by row.
    stiffness: Vec<f64>,
}

/// Why a surface cannot be under tension.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceTensionError {
    /// No tension.
    #[error("a tension of {0} N/mm: it has to be a finite number that is not negative")]
    Value(f64),
    /// No such surface.
    #[error("no tension without a surface '{name}'; the mesh has: {known}")]
    Missing {
        /// Name that was asked for.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// A face belongs to no element.
    #[error("a face of surface '{0}' is no side of an element: no tension can act on it")]
    Loose(String),
    /// A face has no area.
    #[error("face {face} of surface '{name}' has no area: no tension can act on it")]
    Empty {
        /// Surface.
        name: String,
        /// Face.
        face: usize,
    },
}

impl SurfaceTension {
    /// Tension, N/mm, on the named surface; on the edges of a plane section, of 1 mm thickness.
    ///
    /// # Errors
    /// [`SurfaceTensionError`].
    pub fn new(mesh: &Mesh, surface: &str, n_per_mm: f64) -> Result<Self, SurfaceTensionError> {
        if !(n_per_mm.is_finite() && n_per_mm >= 0.0) {
            return Err(SurfaceTensionError::Value(n_per_mm));
        }
        let name = || surface.to_owned();
        let missing = || SurfaceTensionError::Missing {
            name: name(),
            known: mesh.surfaces.keys().cloned().collect::<Vec<_>>().join(", "),
        };
        let found = mesh.surfaces.get(surface).ok_or_else(missing)?;
        let sides = Sides::new(mesh, found.faces());
        let face = |(face, nodes): (usize, &[u32])| {
            let side = sides.of(nodes).ok_or_else(|| SurfaceTensionError::Loose(name()))?;
            let stiffness = stiffness(mesh, found.kind, nodes, n_per_mm)
                .ok_or_else(|| SurfaceTensionError::Empty { name: name(), face })?;
            Ok(TenseFace { nodes: nodes.to_vec(), side, stiffness })
        };
        let faces = found.faces().enumerate().map(face).collect::<Result<_, _>>()?;
        Ok(Self { faces })
    }

    /// Number of faces.
    #[must_use]
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether there is no face.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Energy, mJ, with the body displaced by `u`, mm.
    #[must_use]
    pub fn energy_mj(&self, u: &[[f64; 3]]) -> f64 {
        self.forces(u, &mut |_, _| {})
    }

    /// Calls `visit` with every node of every face and the derivative of the energy there, N; gives
    /// the energy, mJ.
    fn forces(&self, u: &[[f64; 3]], visit: &mut dyn FnMut(u32, [f64; 3])) -> f64 {
        let mut energy = 0.0;
        for face in &self.faces {
            let n = face.nodes.len();
            for (&node, row) in face.nodes.iter().zip(face.stiffness.chunks_exact(n)) {
                // Rows sum to 0: of differences small displacements keep their digits.
                let own = u[node as usize];
                let mut force = [0.0; 3];
                for (k, &other) in row.iter().zip(&face.nodes) {
                    let other = u[other as usize];
                    for i in 0..3 {
                        force[i] += k * (other[i] - own[i]);
                    }
                }
                energy += 0.5 * dot(force, own);
                visit(node, force);
            }
        }
        energy
    }

    /// Adds the forces to the tangent, if one is given, and to the residual (N); gives the energy,
    /// mJ.
    pub(super) fn add(
        &self,
        mesh: &Mesh,
        system: &SymbolicSystem,
        u: &[[f64; 3]],
        (tangent, residual_n): (Option<&mut SymmetricMatrix>, &mut [f64]),
    ) -> f64 {
        if let Some(tangent) = tangent {
            for face in &self.faces {
                face.stiffen(mesh, system, tangent);
            }
        }
        self.forces(u, &mut |node, force| {
            for i in 0..3 {
                residual_n[3 * node as usize + i] += force[i];
            }
        })
    }
}

impl TenseFace {
    /// Adds the tangent by way of the element's own matrix: so nodes that hang are followed.
    fn stiffen(&self, mesh: &Mesh, system: &SymbolicSystem, tangent: &mut SymmetricMatrix) {
        let Side { block, element, local } = &self.side;
        let size = 3 * mesh.blocks[*block].kind.nodes();
        let mut dense = vec![0.0; size * size];
        for (row, &at) in self.stiffness.chunks_exact(local.len()).zip(local) {
            for (k, &to) in row.iter().zip(local) {
                for i in 0..3 {
                    dense[(3 * at + i) * size + 3 * to + i] += k;
                }
            }
        }
        system.add_element(tangent, *block, *element, &mut dense);
    }
}

/// `gamma integral grad_s N_a . grad_s N_b dA` of a face; `None` if it has no area.
fn stiffness(mesh: &Mesh, kind: FaceKind, nodes: &[u32], n_per_mm: f64) -> Option<Vec<f64>> {
    let n = nodes.len();
    let mut stiffness = vec![0.0; n * n];
    let (mut value, mut gradient) = ([0.0; 9], [[0.0; 2]; 9]);
    for (xi, weight) in kind.quadrature() {
        kind.shape(xi, &mut value, &mut gradient);
        let mut t = [[0.0; 3]; 2];
        for (&node, slope) in nodes.iter().zip(gradient) {
            let x = mesh.nodes[node as usize];
            for i in 0..3 {
                t[0][i] += slope[0] * x[i];
                t[1][i] += slope[1] * x[i];
            }
        }
        if kind.corners() == 2 {
            t[1] = [0.0, 0.0, 1.0];
        }
        // The metric of the face and its inverse.
        let [a, b, c] = [dot(t[0], t[0]), dot(t[0], t[1]), dot(t[1], t[1])];
        let area = norm(cross(t[0], t[1]));
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let scale = n_per_mm * weight / area;
        for (row, [p, q]) in stiffness.chunks_exact_mut(n).zip(gradient) {
            for (k, [r, s]) in row.iter_mut().zip(gradient) {
                *k += scale * (c * p * r - b * (p * s + q * r) + a * q * s);
            }
        }
    }
    Some(stiffness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{Elastic, ElementKind, Materials};
    use crate::linear::DofMap;
    use crate::mesh::block::even;
    use crate::mesh::lattice::{REGION, cube, intervals, lattice};
    use crate::solve::{Loading, Options, Problem, Solver};
    use papilla_solid::LinearElastic;

    const GAMMA: f64 = 0.03;

    /// A cube (square) whose sides are bent and whose nodes are moved along them.
    fn bent(kind: ElementKind) -> Mesh {
        cube(kind, 2, |[x, y, z]| {
            let flat = if kind.is_planar() { 0.0 } else { 1.0 };
            [x + 0.2 * y * y + 0.1 * z * x, y + 0.15 * x * y, z + flat * 0.2 * x * y + 0.1 * z * z]
        })
    }

    fn side(mesh: &Mesh) -> &crate::mesh::Surface {
        &mesh.surfaces["x_max"]
    }

    /// Turns about the axis (1, 2, 2) / 3; in the plane about z.
    fn turned(mesh: &Mesh, axis: [f64; 3], angle: f64) -> Vec<[f64; 3]> {
        let (s, c) = angle.sin_cos();
        let turn = |x: &[f64; 3]| {
            let (across, along) = (cross(axis, *x), dot(axis, *x));
            std::array::from_fn(|i| (c - 1.0) * (x[i] - axis[i] * along) + s * across[i])
        };
        mesh.nodes.iter().map(turn).collect()
    }

    /// A closed form on every kind of face: `gamma integral (1 - cos) (1 + (n . a)^2) dA`, in the
    /// plane `gamma (1 - cos)` times the length. A move costs nothing.
    #[test]
    fn a_turn_costs_what_the_dead_load_makes_it_cost() {
        for kind in ElementKind::ALL {
            let mesh = bent(kind);
            let tension = SurfaceTension::new(&mesh, "x_max", GAMMA).unwrap();
            let plane = kind.is_planar();
            let axis = if plane { [0.0, 0.0, 1.0] } else { [1.0, 2.0, 2.0].map(|v| v / 3.0) };
            for angle in [1e-4_f64, 0.7, 3.0] {
                let mut due = 0.0;
                let rule = side(&mesh).kind.quadrature();
                let at = |n: u32| mesh.nodes[n as usize];
                side(&mesh).integrate(&rule, &at, &mut |_, values, normal| {
                    // Once a point: shares of the nodes sum to 1.
                    let share: f64 = values.iter().sum();
                    let along = dot(normal, axis).powi(2) / norm(normal);
                    due += share * (norm(normal) + if plane { 0.0 } else { along });
                });
                // 1 - cos, of which small angles keep the digits.
                due *= GAMMA * 2.0 * (0.5 * angle).sin().powi(2);
                let found = tension.energy_mj(&turned(&mesh, axis, angle));
                assert!((found / due - 1.0).abs() < 1e-9, "{kind:?} {angle}: {found} {due}");
            }
            let moved = vec![[0.5, -2.0, 0.25]; mesh.nodes.len()];
            let energy = tension.forces(&moved, &mut |_, f| assert_eq!(f, [0.0; 3]));
            assert_eq!(energy, 0.0);
        }
    }

    fn problem(mesh: Mesh, fixed: Vec<bool>, tension: f64, surface: &str) -> Problem {
        let model = Elastic::shared(LinearElastic { mu_mpa: 0.01 }, 0.03);
        let materials = Materials::new(vec![model; REGION.index() + 1]);
        let materials = match tension {
            0.0 => materials,
            tension => materials.with_tension(surface, tension),
        };
        Problem::new(mesh, materials, fixed, None).unwrap()
    }

    #[test]
    fn forces_are_the_derivative_of_the_energy_and_the_tangent_that_of_the_forces() {
        const STEP_MM: f64 = 1e-3;
        for kind in ElementKind::ALL {
            let mesh = bent(kind);
            let count = mesh.nodes.len();
            let problem = problem(mesh, vec![false; 3 * count], GAMMA, "x_max");
            let tension = problem.tension.as_ref().unwrap();
            let nodes = side(&problem.mesh).nodes();
            let mut u: Vec<[f64; 3]> = problem.mesh.nodes.clone();
            u.iter_mut().for_each(|u| *u = [u[1] * u[2], 0.3 * u[0] - u[1] * u[1], u[0] * u[1]]);
            let residual = |u: &[[f64; 3]]| {
                let mut r = vec![0.0; 3 * u.len()];
                tension.add(&problem.mesh, &problem.system, u, (None, &mut r));
                r
            };
            let mut tangent = problem.system.zeros();
            let mut at_u = vec![0.0; 3 * count];
            let forces = (Some(&mut tangent), at_u.as_mut_slice());
            tension.add(&problem.mesh, &problem.system, &u, forces);
            let largest = at_u.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let dofs = &problem.system.dofs;
            let mut product = vec![0.0; dofs.count];
            for d in nodes.iter().flat_map(|&n| 3 * n as usize..3 * n as usize + 3) {
                let at = u[d / 3][d % 3];
                let mut moved = |step: f64| {
                    u[d / 3][d % 3] = at + step;
                    (tension.energy_mj(&u), residual(&u))
                };
                let ((up, up_n), (down, down_n)) = (moved(STEP_MM), moved(-STEP_MM));
                moved(0.0);
                let slope = (up - down) / (2.0 * STEP_MM);
                assert!((slope - at_u[d]).abs() < 1e-9 * largest, "{kind:?}: {slope} {}", at_u[d]);
                if dofs.of_dof[d] == DofMap::FIXED {
                    continue;
                }
                let mut unit = vec![0.0; dofs.count];
                unit[dofs.of_dof[d] as usize] = 1.0;
                problem.system.multiply(&tangent, &unit, &mut product);
                for (r, &e) in dofs.of_dof.iter().enumerate().filter(|(_, e)| **e != DofMap::FIXED)
                {
                    let slope = (up_n[r] - down_n[r]) / (2.0 * STEP_MM);
                    let found = product[e as usize];
                    assert!(
                        (found - slope).abs() < 1e-9 * GAMMA,
                        "{kind:?} {d} {r}: {found} {slope}"
                    );
                }
            }
        }
    }

    /// A strip clamped at both ends under pressure hangs through by `p L^2 / 8 gamma`: its parabola
    /// is in equilibrium on any mesh of quadratic edges or faces.
    #[test]
    fn a_strip_under_pressure_is_a_parabola() {
        const LENGTH_MM: f64 = 10.0;
        const PRESSURE_MPA: f64 = 0.002;
        for kind in [ElementKind::Quad9, ElementKind::Quad8, ElementKind::Hex27] {
            let axes = [even(LENGTH_MM, 8), even(1.0, 2), even(1.0, 2)];
            let mesh = lattice(kind, axes, |p| p);
            let (top, up) = if kind.is_planar() { ("y_max", 1) } else { ("z_max", 2) };
            let tension = SurfaceTension::new(&mesh, top, GAMMA).unwrap();
            let mut u = vec![[0.0; 3]; mesh.nodes.len()];
            for (u, x) in u.iter_mut().zip(&mesh.nodes) {
                u[up] = PRESSURE_MPA * x[0] * (LENGTH_MM - x[0]) / (2.0 * GAMMA);
            }
            let deepest = u.iter().fold(0.0f64, |m, u| m.max(u[up]));
            let due = PRESSURE_MPA * LENGTH_MM * LENGTH_MM / (8.0 * GAMMA);
            assert!((deepest / due - 1.0).abs() < 1e-12);
            let mut load = vec![0.0; u.len()];
            let mut found = vec![0.0; u.len()];
            let surface = &mesh.surfaces[top];
            let at = |n: u32| mesh.nodes[n as usize];
            surface.integrate(&surface.kind.quadrature(), &at, &mut |face, values, normal| {
                for (&n, v) in face.iter().zip(values) {
                    load[n as usize] += v * PRESSURE_MPA * normal[up];
                }
            });
            tension.forces(&u, &mut |n, f| found[n as usize] += f[up]);
            let largest = load.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let inner = |n: &u32| (0.1..LENGTH_MM - 0.1).contains(&mesh.nodes[*n as usize][0]);
            for n in surface.nodes().into_iter().filter(inner).map(|n| n as usize) {
                assert!((found[n] - load[n]).abs() < 1e-12 * largest, "{kind:?} {n}");
            }
        }
    }

    /// A layer that can move across itself alone, glued down below, under `p cos(k x)` on its top: at
    /// the top it moves by `p / (M q coth(q H) + gamma k^2)`, with `q = k sqrt(mu / M)` and
    /// `M = K + 4/3 mu`.
    fn layer_error(kind: ElementKind, cells: usize, tension: f64) -> f64 {
        const LENGTH_MM: f64 = 2.0;
        const HEIGHT_MM: f64 = 3.0;
        const PRESSURE_MPA: f64 = 1e-4;
        let n = intervals(kind) * cells;
        let mesh = lattice(kind, [even(LENGTH_MM, n), even(HEIGHT_MM, n), vec![0.0]], |p| p);
        let mut fixed = vec![false; 3 * mesh.nodes.len()];
        for (free, x) in fixed.chunks_exact_mut(3).zip(&mesh.nodes) {
            free[0] = true;
            free[1] = x[1] == 0.0;
        }
        let k = std::f64::consts::PI / LENGTH_MM;
        let mut dead_n = vec![[0.0; 3]; mesh.nodes.len()];
        let at = |n: u32| mesh.nodes[n as usize];
        let top = &mesh.surfaces["y_max"];
        top.integrate(&top.kind.quadrature(), &at, &mut |face, values, normal| {
            let x: f64 = face.iter().zip(values).map(|(&n, v)| v * at(n)[0]).sum();
            for (&n, v) in face.iter().zip(values) {
                dead_n[n as usize][1] += v * PRESSURE_MPA * (k * x).cos() * normal[1];
            }
        });
        let first = (0..mesh.nodes.len()).find(|&n| at(n as u32)[..2] == [0.0, HEIGHT_MM]).unwrap();
        let problem = problem(mesh, fixed, tension, "y_max");
        let tight = Options { residual_tolerance: 1e-11, ..Options::default() };
        let mut solver = Solver::new(&problem, tight).unwrap();
        solver.start(Loading { dead_n, ..Loading::default() });
        let report = solver.advance_to(1.0).unwrap();
        assert!(report.effort.newton_iterations <= 4, "{:?}", report.effort);
        let (mu, modulus) = (0.01, 0.03 + 4.0 / 3.0 * 0.01);
        let q = k * f64::sqrt(mu / modulus);
        let due = PRESSURE_MPA / (modulus * q / (q * HEIGHT_MM).tanh() + tension * k * k);
        (solver.displacement_mm()[first][1] / due - 1.0).abs()
    }

    #[test]
    fn a_layer_under_tension_converges_to_its_closed_form() {
        for (kind, tension, order, largest) in [
            (ElementKind::Quad4, 0.0, 2.0, 3e-3),
            (ElementKind::Quad4, GAMMA, 2.0, 1e-3),
            (ElementKind::Quad9, GAMMA, 4.0, 1e-6),
        ] {
            let errors = [4, 8, 16].map(|cells| layer_error(kind, cells, tension));
            let found = errors.windows(2).map(|e| (e[0] / e[1]).log2()).fold(f64::MAX, f64::min);
            println!("{kind:?} {tension}: {errors:?}, order {found:.2}");
            assert!(found > order - 0.1 && errors[2] < largest, "{kind:?} {tension}: {errors:?}");
        }
    }

    #[test]
    fn what_cannot_be_under_tension_is_said() {
        let mesh = cube(ElementKind::Hex8, 1, |p| p);
        let new = |name: &str, n_per_mm| SurfaceTension::new(&mesh, name, n_per_mm).unwrap_err();
        for value in [-1e-3, f64::INFINITY] {
            assert_eq!(new("x_max", value), SurfaceTensionError::Value(value));
        }
        assert!(matches!(new("x_max", f64::NAN), SurfaceTensionError::Value(_)));
        assert!(new("skin", 0.1).to_string().contains("x_max"));
        let flat = cube(ElementKind::Hex8, 1, |[x, y, z]| [x, y, z * (1.0 - x)]);
        let empty = SurfaceTension::new(&flat, "x_max", 0.1).unwrap_err();
        assert_eq!(empty, SurfaceTensionError::Empty { name: "x_max".into(), face: 0 });
    }
}
