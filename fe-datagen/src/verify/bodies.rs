//! Meshes, materials, loads and fields that the cases share.

use super::CaseError;
use crate::element::kernel::displacement_gradient;
use crate::element::reference::{HEX27_LATTICE, TET10_EDGES};
use crate::element::{Elastic, ElementKind, Inverted, Memory};
use crate::material::kinematics::Mat3;
use crate::material::{ElasticConstants, Kinematics, MaterialError, NeoHookean};
use crate::mesh::block::{BlockLattice, build, even};
use crate::mesh::{Block, FaceKind, Mesh, Surface, Tissue};
use crate::solve::evaluate::{Evaluation, Trial, evaluate_body};
use crate::solve::{Loading, Materials, Options, Problem, Solver, StepError, StepReport};
use std::collections::{HashMap, HashSet};

/// The same material for every tissue.
pub(crate) fn uniform(e_mpa: f64, nu: f64) -> Result<Materials, MaterialError> {
    let constants = ElasticConstants { youngs_modulus_mpa: e_mpa, poissons_ratio: nu };
    let [mu_mpa, bulk_mpa] = constants.moduli_mpa()?;
    let solid = Elastic::shared(NeoHookean { mu_mpa }, bulk_mpa);
    Ok(std::array::from_fn(|_| solid.clone()))
}

/// Options that drive the residual to rounding.
pub(crate) fn tight() -> Options {
    Options { residual_tolerance: 1e-12, ..Options::default() }
}

/// A repeatable number in `[-1, 1]` (splitmix64).
pub(crate) fn noise(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Meshes `axes` with elements of `kind`, all of one tissue, nodes moved by
/// `map`. Planar elements take the first two axes.
pub(crate) fn lattice(
    kind: ElementKind,
    mut axes: [Vec<f64>; 3],
    map: impl Fn([f64; 3]) -> [f64; 3],
) -> Mesh {
    if kind.is_planar() {
        axes[2] = vec![0.0];
    }
    let tetrahedral = kind.lattice().is_empty();
    let cells = if tetrahedral { ElementKind::Hex8 } else { kind };
    let layers = vec![Tissue::Dermis; (axes[kind.dimension() - 1].len() - 1) / cells.order()];
    let mesh = build(&BlockLattice { axes, layers, kind: cells }, map);
    if tetrahedral { tetrahedra(mesh, kind) } else { mesh }
}

/// Node intervals of a lattice along an edge of an element (tetrahedra get
/// their mid-edge nodes later).
pub(crate) fn intervals(kind: ElementKind) -> usize {
    if kind.lattice().is_empty() { 1 } else { kind.order() }
}

/// A unit cube of `cells^3` elements (tetrahedra: six a cell), or a unit square
/// of `cells^2` planar ones.
pub(crate) fn cube(kind: ElementKind, cells: usize, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let axis = even(1.0, intervals(kind) * cells);
    lattice(kind, [axis.clone(), axis.clone(), axis], map)
}

/// Cuts every hexahedron into six tetrahedra along its main diagonal, and the faces of
/// surfaces with them. Mid-edge nodes join the node sets that hold both ends.
pub(crate) fn tetrahedra(mut mesh: Mesh, kind: ElementKind) -> Mesh {
    const PATHS: [[usize; 3]; 6] =
        [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let hexes = mesh.blocks.remove(0);
    let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
    let mut connectivity = Vec::new();
    let mut tissue = Vec::new();
    for e in 0..hexes.len() {
        let corners = hexes.element(e);
        for (p, path) in PATHS.iter().enumerate() {
            let mut at = [-1i8; 3];
            let mut tet = [0; 4];
            for step in 0..4 {
                let a = HEX27_LATTICE[..8].iter().position(|c| *c == at).unwrap_or(0);
                tet[step] = corners[a];
                if step < 3 {
                    at[path[step]] = 1;
                }
            }
            if p >= 3 {
                tet.swap(1, 2);
            }
            connectivity.extend(tet);
            if kind == ElementKind::Tet10 {
                for [a, b] in TET10_EDGES {
                    let key = (tet[a].min(tet[b]), tet[a].max(tet[b]));
                    let next = mesh.nodes.len() as u32;
                    let id = *middle.entry(key).or_insert(next);
                    if id == next {
                        let (x, y) = (mesh.nodes[key.0 as usize], mesh.nodes[key.1 as usize]);
                        mesh.nodes.push(std::array::from_fn(|i| 0.5 * (x[i] + y[i])));
                    }
                    connectivity.push(id);
                }
            }
            tissue.push(hexes.tissue[e]);
        }
    }
    cut_surfaces(&mut mesh, &connectivity, kind, &middle);
    for set in mesh.node_sets.values_mut() {
        let both =
            |(a, b): &(u32, u32)| set.binary_search(a).is_ok() && set.binary_search(b).is_ok();
        let new: Vec<_> = middle.iter().filter(|(k, _)| both(k)).map(|(_, &m)| m).collect();
        set.extend(new);
        set.sort_unstable();
    }
    mesh.blocks.push(Block { kind, connectivity, tissue });
    mesh
}

/// Cuts every quadrangle into the two triangles that tetrahedra have there.
fn cut_surfaces(
    mesh: &mut Mesh,
    tetrahedra: &[u32],
    kind: ElementKind,
    middle: &HashMap<(u32, u32), u32>,
) {
    let key = |a: u32, b: u32| (a.min(b), a.max(b));
    let edges: HashSet<_> = tetrahedra
        .chunks_exact(kind.nodes())
        .flat_map(|tet| TET10_EDGES.map(|[a, b]| key(tet[a], tet[b])))
        .collect();
    for surface in mesh.surfaces.values_mut() {
        let mut connectivity = Vec::new();
        for face in surface.faces() {
            let [a, b, c, d] = [face[0], face[1], face[2], face[3]];
            let halves = match edges.contains(&key(a, c)) {
                true => [[a, b, c], [a, c, d]],
                false => [[b, c, d], [b, d, a]],
            };
            for half in halves {
                connectivity.extend(half);
                if kind == ElementKind::Tet10 {
                    connectivity.extend((0..3).map(|k| middle[&key(half[k], half[(k + 1) % 3])]));
                }
            }
        }
        *surface = Surface { kind: FaceKind::of(kind), connectivity };
    }
}

/// Coordinates from 0: steps of `h` up to `fine`, then growing by `ratio` up to
/// `end` exactly; an even number of intervals, as quadratic elements need.
pub(crate) fn graded(h: f64, fine: f64, ratio: f64, end: f64) -> Vec<f64> {
    let n = (fine / h).round() as usize;
    let mut axis: Vec<f64> = (0..=n).map(|i| h * i as f64).collect();
    let start = axis[n];
    let mut steps = 0;
    let mut length = 0.0;
    while length < end - start || (n + steps) % 2 == 1 {
        steps += 1;
        length += h * ratio.powi(steps as i32);
    }
    let scale = (end - start) / length;
    let mut x = start;
    for s in 1..=steps {
        x += scale * h * ratio.powi(s as i32);
        axis.push(x);
    }
    axis
}

/// A quarter of a half-space `z <= 0`, symmetric about `x = 0` and `y = 0`,
/// refined at the origin, far sides `end` away, the bottom held.
pub(crate) fn quarter_space(
    kind: ElementKind,
    h: f64,
    fine: f64,
    end: f64,
    deep: f64,
) -> (Mesh, Vec<bool>) {
    let side = graded(h, fine, 1.5, end);
    let depth = graded(h, deep, 1.5, end);
    let down = depth.iter().rev().map(|z| -z).collect();
    let mut mesh = lattice(kind, [side.clone(), side, down], |p| p);
    // Only where contact or load can be: far faces would distort mean areas.
    let limit = 1.001 * fine;
    let touch = part(&mesh.surfaces["z_max"], |n| {
        let p = mesh.nodes[n as usize];
        p[0] <= limit && p[1] <= limit
    });
    mesh.surfaces.insert("touch".into(), touch);
    let fixed = hold(&mesh, &[("x_min", [true, false, false]), ("y_min", [false, true, false])]);
    let fixed = merge(fixed, &hold(&mesh, &[("z_min", [true; 3])]));
    (mesh, fixed)
}

/// Faces of which every node satisfies `keep`.
pub(crate) fn part(surface: &Surface, keep: impl Fn(u32) -> bool) -> Surface {
    let faces = surface.faces().filter(|f| f.iter().all(|&n| keep(n)));
    Surface { kind: surface.kind, connectivity: faces.flatten().copied().collect() }
}

/// Prescribed degrees of freedom: components of the nodes of sets.
pub(crate) fn hold(mesh: &Mesh, sets: &[(&str, [bool; 3])]) -> Vec<bool> {
    let mut fixed = vec![false; 3 * mesh.nodes.len()];
    for (name, components) in sets {
        for &n in mesh.node_sets.get(*name).into_iter().flatten() {
            for i in 0..3 {
                fixed[3 * n as usize + i] |= components[i];
            }
        }
    }
    fixed
}

pub(crate) fn merge(mut a: Vec<bool>, b: &[bool]) -> Vec<bool> {
    for (x, y) in a.iter_mut().zip(b) {
        *x |= y;
    }
    a
}

/// All degrees of freedom of the sides of a lattice.
pub(crate) fn hold_boundary(mesh: &Mesh) -> Vec<bool> {
    let all = [true; 3];
    hold(
        mesh,
        &[
            ("x_min", all),
            ("x_max", all),
            ("y_min", all),
            ("y_max", all),
            ("z_min", all),
            ("z_max", all),
        ],
    )
}

/// Prescribed values of the held degrees of freedom from a displacement field.
pub(crate) fn prescribe(
    mesh: &Mesh,
    fixed: &[bool],
    u: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<(usize, f64)> {
    let held = (0..fixed.len()).filter(|&dof| fixed[dof]);
    held.map(|dof| (dof, u(mesh.nodes[dof / 3])[dof % 3])).collect()
}

/// Solves `loading` in `steps` equal steps and hands over the solver.
pub(crate) fn solve<'a>(
    problem: &'a Problem,
    loading: Loading,
    options: Options,
    steps: u32,
) -> Result<(Solver<'a>, StepReport), CaseError> {
    let mut solver = Solver::new(problem, options)?;
    solver.start(loading);
    let mut report = StepReport::default();
    for s in 1..=steps {
        report = solver.advance_to(f64::from(s) / f64::from(steps))?;
    }
    Ok((solver, report))
}

/// Internal forces, N, one a degree of freedom.
pub(crate) fn internal_force(problem: &Problem, u: &[[f64; 3]]) -> Result<Vec<f64>, StepError> {
    let trial = Trial {
        u,
        carried: &[],
        multipliers_mpa: &[],
        penalty: 1.0,
        load_fraction: 0.0,
        memory: Memory::default(),
        friction: None,
    };
    let mut out = Evaluation::default();
    evaluate_body(problem, &Loading::default(), &trial, None, &mut out)?;
    Ok(out.residual_n)
}

/// Deformation and stress at one quadrature point.
pub(crate) struct Point {
    /// First Piola-Kirchhoff stress, MPa.
    pub stress: Mat3,
}

/// Visits every quadrature point of the body.
pub(crate) fn points(
    problem: &Problem,
    u: &[[f64; 3]],
    visit: &mut dyn FnMut(Point),
) -> Result<(), Inverted> {
    for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
        let n = block.kind.nodes();
        let mut force = vec![[0.0; 3]; n];
        for e in 0..block.len() {
            let g = geometry.element(e);
            let material = &problem.materials[block.tissue[e].index()];
            let local: Vec<_> = block.element(e).iter().map(|&a| u[a as usize]).collect();
            let state = material.evaluate(g, &local, Memory::default(), &mut force, None)?;
            for (gradients, basis) in g.gradients.chunks_exact(n).zip(g.basis) {
                let theta: f64 = basis.iter().zip(state.theta_minus_1).map(|(b, t)| b * t).sum();
                let k = Kinematics::new(displacement_gradient(&local, gradients));
                visit(Point { stress: material.first_piola_mpa(&k, theta, Memory::default()) });
            }
        }
    }
    Ok(())
}

/// Largest entry by magnitude.
pub(crate) fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |m, v| if v.is_nan() { f64::NAN } else { m.max(v.abs()) })
}
