//! Convergence order from a manufactured finite-strain solution.

use super::bodies::{solve, tight, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::geometry::{displacement_gradient, jacobian};
use papilla_fem::element::reference::GAUSS_3;
use papilla_fem::element::{ConstitutiveModel, ElementKind, HistoryVariables};
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::lattice::{REGION, cube};
use papilla_fem::mesh::supports::{hold_boundary, prescribe};
use papilla_fem::solve::{Loading, Problem};
use papilla_solid::tensor::{Kinematics, Mat3};

const SOURCE: &str = "theory: order of interpolation, of the dilatation if that is lower";

/// `u_i = 0.07 sin(a_i . X + b_i)` mm on a unit cube or square: strains up to 0.3.
const AMPLITUDE_MM: f64 = 0.07;
const WAVES: [[f64; 3]; 3] = [[2.4, 1.3, -0.9], [-1.1, 2.2, 1.5], [0.8, -1.6, 2.7]];
const PHASES: [f64; 3] = [0.3, 1.1, -0.6];

/// The solution in so many dimensions: plane strain leaves z out.
#[derive(Clone, Copy)]
struct Solution(usize);

impl Solution {
    fn phase(self, x: [f64; 3], i: usize) -> f64 {
        (0..self.0).map(|j| WAVES[i][j] * x[j]).sum::<f64>() + PHASES[i]
    }

    fn displacement(self, x: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(
            |i| if i < self.0 { AMPLITUDE_MM * self.phase(x, i).sin() } else { 0.0 },
        )
    }

    fn gradient(self, x: [f64; 3]) -> Mat3 {
        let mut h = [[0.0; 3]; 3];
        for i in 0..self.0 {
            let c = AMPLITUDE_MM * self.phase(x, i).cos();
            for j in 0..self.0 {
                h[i][j] = c * WAVES[i][j];
            }
        }
        h
    }
}

/// Body force `-Div P` per undeformed volume, N/mm3: sixth-order differences
/// of the material's own stress, whose error is below 1e-9 of the force.
fn body_force(material: &dyn ConstitutiveModel, solution: Solution, x: [f64; 3]) -> [f64; 3] {
    const H: f64 = 4e-3;
    const WEIGHTS: [f64; 3] = [0.75, -0.15, 1.0 / 60.0];
    let stress = |x: [f64; 3]| {
        let k = Kinematics::new(solution.gradient(x));
        material.first_piola_mpa(&k, k.j_minus_1, HistoryVariables::default())
    };
    let mut force = [0.0; 3];
    for j in 0..3 {
        for (m, w) in WEIGHTS.iter().enumerate() {
            let at = |sign: f64| {
                let mut y = x;
                y[j] += sign * (m + 1) as f64 * H;
                stress(y)
            };
            let (plus, minus) = (at(1.0), at(-1.0));
            for i in 0..3 {
                force[i] -= w * (plus[i][j] - minus[i][j]) / H;
            }
        }
    }
    force
}

/// A quadrature point of the undeformed mesh.
struct Place<'a> {
    nodes: &'a [u32],
    value: &'a [f64],
    gradients: &'a [[f64; 3]],
    x: [f64; 3],
    volume: f64,
}

/// Visits a three-point Gauss rule along each axis of every element.
fn integrate(mesh: &Mesh, visit: &mut dyn FnMut(&Place<'_>)) {
    let block = &mesh.blocks[0];
    let n = block.kind.nodes();
    let (mut value, mut reference) = (vec![0.0; n], vec![[0.0; 3]; n]);
    let through: &[(f64, f64)] = if block.kind.is_planar() { &[(0.0, 1.0)] } else { &GAUSS_3 };
    let rule = GAUSS_3
        .iter()
        .flat_map(|&a| GAUSS_3.iter().flat_map(move |&b| through.iter().map(move |&c| [a, b, c])));
    for point in rule {
        let xi = point.map(|p| p.0);
        let weight: f64 = point.iter().map(|p| p.1).product();
        block.kind.shape(xi, &mut value, &mut reference);
        for e in 0..block.len() {
            let nodes = block.element(e);
            let at = || nodes.iter().map(|&a| mesh.nodes[a as usize]);
            let (inverse, determinant) = jacobian(at(), &reference);
            let gradients: Vec<[f64; 3]> = reference
                .iter()
                .map(|d| std::array::from_fn(|i| (0..3).map(|k| d[k] * inverse[k][i]).sum()))
                .collect();
            let mut x = [0.0; 3];
            for (p, v) in at().zip(&value) {
                for i in 0..3 {
                    x[i] += v * p[i];
                }
            }
            let volume = weight * determinant;
            visit(&Place { nodes, value: &value, gradients: &gradients, x, volume });
        }
    }
}

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    let (hex8, hex27) = if context.quick { ([4, 8], [2, 4]) } else { ([8, 16], [4, 8]) };
    let (quad4, quad9) = if context.quick { ([8, 16], [4, 8]) } else { ([16, 32], [8, 16]) };
    // Its one spurious mode (element/reference.rs) makes it late to reach its order.
    let (hex20, late) = if context.quick { ([4, 8], 0.3) } else { ([8, 16], 0.2) };
    let kinds = [
        (ElementKind::Hex8, "Hex8", hex8, 2.0),
        (ElementKind::Hex20, "Hex20", hex20, 2.0),
        (ElementKind::Hex27, "Hex27", hex27, 3.0),
        (ElementKind::Quad4, "Quad4", quad4, 2.0),
        (ElementKind::Quad8, "Quad8", quad9, 2.0),
        (ElementKind::Quad9, "Quad9", quad9, 3.0),
    ];
    for (kind, name, cells, order) in kinds {
        let coarse = errors(kind, cells[0])?;
        let fine = errors(kind, cells[1])?;
        let halvings = (cells[1] as f64 / cells[0] as f64).log2();
        let observed = |i: usize| (coarse[i] / fine[i]).log2() / halvings;
        let row = |what: &str, value, reference| {
            let quantity = format!("{name}, {} to {} cells: order of {what}", cells[0], cells[1]);
            let tolerance = if kind == ElementKind::Hex20 { late } else { 0.2 };
            Check::absolute(quantity, value, reference, tolerance, SOURCE)
        };
        rows.push(row("displacement (L2)", observed(0), order));
        rows.push(row("its gradient (L2)", observed(1), order - 1.0));
    }
    Ok(rows)
}

/// L2 errors of displacement and of its gradient on a smoothly distorted cube
/// or square.
fn errors(kind: ElementKind, cells: usize) -> Result<[f64; 2], CaseError> {
    let pi = std::f64::consts::PI;
    let d = kind.dimension();
    let solution = Solution(d);
    let mesh = cube(kind, cells, |p| {
        let bump: f64 = p[..d].iter().map(|v| (pi * v).sin()).product();
        let shift = |i: usize| 0.05 * [1.0, -0.8, 0.6][i] * bump;
        std::array::from_fn(|i| if i < d { p[i] + shift(i) } else { p[i] })
    });
    let materials = uniform(1.0, 0.3)?;
    let mut dead_n = vec![[0.0; 3]; mesh.nodes.len()];
    integrate(&mesh, &mut |p| {
        let force = body_force(&materials[REGION], solution, p.x);
        for (&node, v) in p.nodes.iter().zip(p.value) {
            for i in 0..3 {
                dead_n[node as usize][i] += v * force[i] * p.volume;
            }
        }
    });
    let fixed = hold_boundary(&mesh);
    let prescribed_mm = prescribe(&mesh, &fixed, |x| solution.displacement(x));
    let problem = Problem::new(mesh, materials, fixed, None)?;
    let loading = Loading { dead_n, prescribed_mm, ..Loading::default() };
    let (solver, _) = solve(&problem, loading, tight(), 2)?;
    let u = solver.displacement_mm();
    let mut squares = [0.0; 2];
    integrate(&problem.mesh, &mut |p| {
        let local: Vec<_> = p.nodes.iter().map(|&n| u[n as usize]).collect();
        let (exact, exact_gradient) = (solution.displacement(p.x), solution.gradient(p.x));
        let found_gradient = displacement_gradient(&local, p.gradients);
        for i in 0..3 {
            let found: f64 = local.iter().zip(p.value).map(|(l, v)| v * l[i]).sum();
            squares[0] += (found - exact[i]).powi(2) * p.volume;
            for j in 0..3 {
                squares[1] += (found_gradient[i][j] - exact_gradient[i][j]).powi(2) * p.volume;
            }
        }
    });
    Ok(squares.map(f64::sqrt))
}
