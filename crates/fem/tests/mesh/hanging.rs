//! Nodes that follow the edge of a coarser neighbour.

use papilla_fem::element::{Elastic, ElementKind, Materials};
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::lattice;
use papilla_fem::mesh::surface::side_nodes;
use papilla_fem::mesh::{FaceKind, HangingNode, Mesh, Surface};
use papilla_fem::solve::evaluate::{Evaluation, Trial, evaluate_body};
use papilla_fem::solve::{Loading, Options, Problem, Solver};
use papilla_solid::NeoHookean;

/// A large cube beside two half its size along y, joined at x = 1.
fn joined() -> Mesh {
    let axis = |n: usize| even(1.0, n);
    let kind = ElementKind::Hex27;
    let large = lattice(kind, [axis(2), axis(2), axis(2)], |p| p);
    let small = lattice(kind, [axis(2), axis(4), axis(2)], |[x, y, z]| [1.0 + 0.5 * x, y, z]);
    let mut mesh = Mesh { nodes: large.nodes.clone(), ..Mesh::default() };
    let find = |nodes: &[[f64; 3]], p: [f64; 3]| {
        nodes.iter().position(|q| (0..3).all(|i| (p[i] - q[i]).abs() < 1e-9)).map(|n| n as u32)
    };
    let number: Vec<u32> = small
        .nodes
        .iter()
        .map(|&p| {
            find(&mesh.nodes, p).unwrap_or_else(|| {
                mesh.nodes.push(p);
                mesh.nodes.len() as u32 - 1
            })
        })
        .collect();
    let mut block = large.blocks[0].clone();
    block.connectivity.extend(small.blocks[0].connectivity.iter().map(|&n| number[n as usize]));
    block.region.extend(&small.blocks[0].region);
    mesh.blocks.push(block);
    for z in [0.0, 0.5, 1.0] {
        let at = |y: f64| find(&mesh.nodes, [1.0, y, z]).unwrap();
        for (y, near, far) in [(0.25, 0.0, 1.0), (0.75, 1.0, 0.0)] {
            let masters = [at(near), at(0.5), at(far)];
            mesh.hanging.push(HangingNode { node: at(y), masters });
        }
    }
    mesh.hanging.sort_unstable_by_key(|h| h.node);
    mesh
}

/// Solves for what lies between the two ends, where `field` is prescribed.
fn solve(mesh: Mesh, field: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[f64; 3]> {
    let law = NeoHookean { mu_mpa: 0.3 };
    let materials = Materials::new([0; 5].map(|_| Elastic::shared(law, 4.0)).into());
    let nodes = mesh.nodes.clone();
    let mut fixed = vec![false; 3 * nodes.len()];
    let mut loading = Loading::default();
    for (n, &p) in nodes.iter().enumerate().filter(|(_, p)| p[0] < 1e-9 || p[0] > 1.5 - 1e-9) {
        for i in 0..3 {
            fixed[3 * n + i] = true;
            loading.prescribed_mm.push((3 * n + i, field(p)[i]));
        }
    }
    let problem = Problem::new(mesh, materials, fixed, None).unwrap();
    let options = Options { residual_tolerance: 1e-11, ..Options::default() };
    let mut solver = Solver::new(&problem, options).unwrap();
    solver.start(loading);
    solver.advance_to(1.0).unwrap();
    solver.displacement_mm().to_vec()
}

/// A bar that is pulled, its ends held, against one of small cubes only: the joint costs no
/// accuracy beyond that of the large cube, but for its small cubes' being on one side.
#[test]
fn a_joint_is_no_worse_than_the_large_side() {
    let field = |[x, _, _]: [f64; 3]| [0.1 * x, 0.0, 0.0];
    let mesh = joined();
    let u = solve(mesh.clone(), field);
    for h in &mesh.hanging {
        assert_eq!(h.of(|m| u[m as usize]), u[h.node as usize], "the node follows");
    }
    let kind = ElementKind::Hex27;
    let fine = lattice(kind, [even(1.5, 12), even(1.0, 8), even(1.0, 4)], |p| p);
    let large = lattice(kind, [vec![0.0, 0.5, 1.0, 1.25, 1.5], even(1.0, 2), even(1.0, 2)], |p| p);
    let (fine_at, large_at) = (fine.nodes.clone(), large.nodes.clone());
    let due = solve(fine, field);
    // At the nodes of the large cubes, which all meshes have.
    let error = |at: &[[f64; 3]], u: &[[f64; 3]]| -> f64 {
        let find = |at: &[[f64; 3]], p: &[f64; 3]| {
            at.iter().position(|q| (0..3).all(|i| (p[i] - q[i]).abs() < 1e-9)).unwrap()
        };
        let miss = |p: &[f64; 3]| {
            let (a, b) = (u[find(at, p)], due[find(&fine_at, p)]);
            (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>()
        };
        large_at.iter().map(miss).sum::<f64>().sqrt()
    };
    let (joint, coarse) = (error(&mesh.nodes, &u), error(&large_at, &solve(large, field)));
    assert!(joint < 1.2 * coarse, "{joint} against {coarse}");
}

/// A strain that is even in every direction, prescribed on the whole outside: inside and on the
/// joint nodes find it themselves, to rounding.
#[test]
fn the_patch_test_is_passed_to_rounding() {
    let h = [[0.08, 0.03, -0.02], [0.01, -0.05, 0.04], [0.02, 0.01, 0.06]];
    let field =
        |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| (0..3).map(|j| h[i][j] * p[j]).sum()) };
    let mesh = joined();
    let nodes = mesh.nodes.clone();
    let law = NeoHookean { mu_mpa: 0.3 };
    let materials = Materials::new([0; 5].map(|_| Elastic::shared(law, 4.0)).into());
    let mut fixed = vec![false; 3 * nodes.len()];
    let mut loading = Loading::default();
    let outside = |p: &[f64; 3]| (0..3).any(|i| p[i] < 1e-9 || p[i] > [1.5, 1.0, 1.0][i] - 1e-9);
    for (n, &p) in nodes.iter().enumerate() {
        if mesh.hanging_node(n as u32).is_none() && outside(&p) {
            for i in 0..3 {
                fixed[3 * n + i] = true;
                loading.prescribed_mm.push((3 * n + i, field(p)[i]));
            }
        }
    }
    let problem = Problem::new(mesh, materials, fixed, None).unwrap();
    assert!(problem.system.dofs.count >= 9);
    let options = Options { residual_tolerance: 1e-12, ..Options::default() };
    let mut solver = Solver::new(&problem, options).unwrap();
    solver.start(loading);
    solver.advance_to(1.0).unwrap();
    for (p, u) in nodes.iter().zip(solver.displacement_mm()) {
        let due = field(*p);
        assert!((0..3).all(|i| (due[i] - u[i]).abs() < 1e-9), "{p:?}: {u:?} {due:?}");
    }
}

/// The faces of a joined mesh at z = 1, on which nodes hang.
fn lid(mesh: &Mesh) -> Surface {
    let (kind, block) = (ElementKind::Hex27, &mesh.blocks[0]);
    let mut connectivity = Vec::new();
    for element in (0..block.len()).map(|e| block.element(e)) {
        for side in 0..kind.sides().len() {
            let face: Vec<u32> = side_nodes(kind, side).into_iter().map(|l| element[l]).collect();
            if face.iter().all(|&n| mesh.nodes[n as usize][2] > 1.0 - 1e-9) {
                connectivity.extend(face);
            }
        }
    }
    Surface { kind: FaceKind::Quad9, connectivity }
}

/// A surface under tension across the joint: forces are the derivative of the energy, and the tangent
/// that of the forces, where nodes hang too.
#[test]
fn tension_follows_the_nodes_that_hang() {
    const STEP: f64 = 1e-4;
    let mut mesh = joined();
    let surface = lid(&mesh);
    assert_eq!(surface.faces().count(), 3);
    assert!(mesh.hanging.iter().any(|h| surface.connectivity.contains(&h.node)));
    mesh.surfaces.insert("lid".into(), surface);
    let law = NeoHookean { mu_mpa: 0.3 };
    let models = [0; 5].map(|_| Elastic::shared(law, 4.0)).into();
    let materials = Materials::new(models).with_tension("lid", 2.0);
    let count = mesh.nodes.len();
    let problem = Problem::new(mesh, materials, vec![false; 3 * count], None).unwrap();
    let follow = |mut u: Vec<[f64; 3]>| {
        for h in &problem.mesh.hanging {
            u[h.node as usize] = h.of(|m| u[m as usize]);
        }
        u
    };
    let nodes = problem.mesh.nodes.iter();
    let start =
        follow(nodes.clone().map(|[x, y, z]| [0.1 * z * y, 0.05 * x * x, 0.1 * y]).collect());
    let way = follow(nodes.map(|[x, y, z]| [y * y, z - x * y, x + y * z * z]).collect());
    let evaluate = |t: f64| {
        let u: Vec<[f64; 3]> =
            start.iter().zip(&way).map(|(u, w)| [0, 1, 2].map(|i| u[i] + t * w[i])).collect();
        let trial = Trial {
            u: &u,
            independent: &[],
            multipliers_mpa: &[],
            penalty: 1.0,
            load_fraction: 0.0,
            variables: Default::default(),
            friction: None,
            fluid: None,
        };
        let (mut tangent, mut out) = (problem.system.zeros(), Evaluation::default());
        evaluate_body(&problem, &Loading::default(), &trial, Some(&mut tangent), &mut out).unwrap();
        (out, tangent)
    };
    let ((at, tangent), (up, _), (down, _)) = (evaluate(0.0), evaluate(STEP), evaluate(-STEP));
    let slack = at.stored_mj - problem.tension.as_ref().unwrap().energy_mj(&start);
    assert!(slack < 0.8 * at.stored_mj, "tension hardly matters: {slack} of {}", at.stored_mj);
    let along: f64 = at.residual_n.iter().zip(way.as_flattened()).map(|(r, w)| r * w).sum();
    let slope = (up.potential_mj - down.potential_mj) / (2.0 * STEP);
    assert!((slope / along - 1.0).abs() < 1e-6, "{slope} {along}");
    let dofs = &problem.system.dofs;
    let mut unknowns = vec![0.0; dofs.count];
    let mut product = unknowns.clone();
    let free = |d: &usize| dofs.of_dof[*d] != papilla_fem::linear::DofMap::FIXED;
    for d in (0..3 * count).filter(free) {
        unknowns[dofs.of_dof[d] as usize] = way.as_flattened()[d];
    }
    problem.system.multiply(&tangent, &unknowns, &mut product);
    let largest = product.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for d in (0..3 * count).filter(free) {
        let slope = (up.residual_n[d] - down.residual_n[d]) / (2.0 * STEP);
        let found = product[dofs.of_dof[d] as usize];
        assert!((slope - found).abs() < 1e-6 * largest, "{d}: {slope} {found}");
    }
}
