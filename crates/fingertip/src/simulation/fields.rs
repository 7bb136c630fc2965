//! Fields of a whole body at one equilibrium, for looking at.

use super::body::Body;
use papilla_atlas::PA_PER_MPA;
use papilla_fem::element::extrapolate::weights as extrapolation;
use papilla_fem::element::geometry::displacement_gradient;
use papilla_fem::element::{ConstitutiveModel, HistoryVariables};
use papilla_fem::solve::Solver;
use papilla_solid::tensor::{Kinematics, Mat3};

/// Components of a symmetric tensor in the order of the xx yy zz xy yz xz that VTK takes.
pub type Symmetric = [f64; 6];

/// Element means, in the order of the mesh's blocks, and tensors at the nodes.
pub struct ElementFields {
    /// SED, J/m3 of undeformed volume.
    pub sed_j_per_m3: Vec<f64>,
    /// Volume over undeformed volume.
    pub volume_ratio: Vec<f64>,
    /// [`Tissue::index`](crate::tissue::Tissue::index).
    pub layer: Vec<i32>,
    /// Cauchy stress, Pa; of biphasic tissue that of its solid.
    pub stress_pa: Vec<Symmetric>,
    /// Green-Lagrange strain; of laws of small strain the linear strain.
    pub strain: Vec<Symmetric>,
    /// Stress at each node, Pa: what the elements around it have there, extrapolated from their
    /// quadrature points, in the mean. Between two layers it is the mean of both.
    pub node_stress_pa: Vec<Symmetric>,
    /// Strain at each node, likewise.
    pub node_strain: Vec<Symmetric>,
}

fn symmetric(m: &Mat3) -> Symmetric {
    let mixed = |i: usize, j: usize| 0.5 * (m[i][j] + m[j][i]);
    [m[0][0], m[1][1], m[2][2], mixed(0, 1), mixed(1, 2), mixed(0, 2)]
}

fn add(sum: &mut Symmetric, weight: f64, value: &Symmetric) {
    sum.iter_mut().zip(value).for_each(|(s, v)| *s += weight * v);
}

/// Cauchy stress (Pa) and strain of a point.
fn stress_and_strain(
    solid: &dyn ConstitutiveModel,
    k: &Kinematics,
    theta_minus_1: f64,
    history: &[f64],
) -> [Symmetric; 2] {
    let memory = HistoryVariables { history, dt_s: 0.0 };
    let piola = solid.first_piola_mpa(k, theta_minus_1, memory).map(|r| r.map(|v| v * PA_PER_MPA));
    if !solid.is_finite_strain() {
        return [symmetric(&piola), symmetric(&k.h)];
    }
    // sigma = P F^T / J
    let f: Mat3 =
        std::array::from_fn(|i| std::array::from_fn(|j| k.h[i][j] + f64::from(u8::from(i == j))));
    let cauchy: Mat3 = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|a| piola[i][a] * f[j][a]).sum::<f64>() / k.j())
    });
    [symmetric(&cauchy), symmetric(&k.green_strain())]
}

impl ElementFields {
    /// Of the body at the solver's equilibrium.
    #[must_use]
    pub fn new(body: &Body, solver: &Solver<'_>) -> Self {
        let (problem, u) = (&body.problem, solver.displacement_mm());
        let nodes = problem.mesh.nodes.len();
        let mut fields = Self {
            sed_j_per_m3: Vec::new(),
            volume_ratio: Vec::new(),
            layer: Vec::new(),
            stress_pa: Vec::new(),
            strain: Vec::new(),
            node_stress_pa: vec![[0.0; 6]; nodes],
            node_strain: vec![[0.0; 6]; nodes],
        };
        let mut around = vec![0.0; nodes];
        for (b, (block, geometry)) in problem.mesh.blocks.iter().zip(&problem.geometry).enumerate()
        {
            let n = block.kind.nodes();
            let at_nodes: Vec<_> =
                (0..n).map(|l| extrapolation(block.kind, block.kind.node_xi(l))).collect();
            let mut force = vec![[0.0; 3]; n];
            for e in 0..block.len() {
                let local: Vec<_> = block.element(e).iter().map(|&n| u[n as usize]).collect();
                let solid = &problem.materials[block.region[e]];
                let shape = geometry.element(e);
                let history = solver.history_of(b, e);
                let memory = HistoryVariables { history, dt_s: 0.0 };
                // An equilibrium has no inverted element; NaN would show one.
                let theta = solid
                    .evaluate(shape, &local, memory, &mut force, None)
                    .map_or([f64::NAN; 4], |s| s.theta_minus_1);
                let (mut energy, mut volume, mut growth) = (0.0, 0.0, 0.0);
                let mut mean = [[0.0; 6]; 2];
                let mut points = Vec::with_capacity(shape.weights.len());
                let len = solid.history_len();
                for (q, gradients) in shape.gradients.chunks_exact(n).enumerate() {
                    let k = Kinematics::new(displacement_gradient(&local, gradients));
                    let t: f64 = shape.basis[q].iter().zip(theta).map(|(b, t)| b * t).sum();
                    let own = &history[q * len..(q + 1) * len];
                    let weight = shape.weights[q];
                    energy += weight * solid.stored_mpa(&k, t, own);
                    volume += weight;
                    growth += weight * t;
                    let found = stress_and_strain(solid, &k, t, own);
                    mean.iter_mut().zip(&found).for_each(|(sum, v)| add(sum, weight, v));
                    points.push(found);
                }
                fields.sed_j_per_m3.push(energy / volume * PA_PER_MPA);
                fields.volume_ratio.push(1.0 + growth / volume);
                fields.layer.push(block.region[e].index() as i32);
                let [stress, strain] = mean.map(|sum| sum.map(|v| v / volume));
                fields.stress_pa.push(stress);
                fields.strain.push(strain);
                for (&node, from) in block.element(e).iter().zip(&at_nodes) {
                    around[node as usize] += 1.0;
                    for (w, [stress, strain]) in from.iter().zip(&points) {
                        add(&mut fields.node_stress_pa[node as usize], *w, stress);
                        add(&mut fields.node_strain[node as usize], *w, strain);
                    }
                }
            }
        }
        for field in [&mut fields.node_stress_pa, &mut fields.node_strain] {
            for (value, elements) in field.iter_mut().zip(&around) {
                value.iter_mut().for_each(|v| *v /= f64::max(*elements, 1.0));
            }
        }
        fields
    }
}
