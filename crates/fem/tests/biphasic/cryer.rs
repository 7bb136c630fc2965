//! Cryer's ball: suddenly pressed all round on its drained surface. In its middle pressure rises
//! above what presses it (Cryer 1963): the Mandel-Cryer effect in space.

use crate::bodies::{Body, march, place, sudden, times};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::{REGION, lattice};
use papilla_fem::mesh::{Block, FaceKind, Mesh, Surface};
use papilla_fem::solve::Loading;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, PI};

const RADIUS_MM: f64 = 1.5;
const PRESSURE_MPA: f64 = 0.01;
/// Half the side of the cube in the ball's middle before its far sides bulge, over the radius.
const CORE: f64 = 0.1;
/// How far they bulge: 0 is a cube, 1 a ball.
const BULGE: f64 = 0.65;

/// Poisson's ratio; `p / P` in the middle at T = .01, .05, .1, .5; its peak and when.
const TABLE: [(f64, [f64; 4], f64, f64); 3] = [
    (0.0, [1.245_450, 1.557_325, 1.475_505, 0.272_313], 1.575_42, 0.063),
    (0.2, [1.175_762, 1.363_718, 1.194_103, 0.111_119], 1.364_27, 0.052),
    (0.4, [1.072_546, 1.115_835, 0.876_360, 0.032_166], 1.126_46, 0.039),
];
const STOPS: [f64; 4] = [0.01, 0.05, 0.1, 0.5];

/// A point of the unit cube in the bulged one.
fn bulged(p: [f64; 3]) -> [f64; 3] {
    let (norm, largest) = (norm(p), p.into_iter().fold(0.0, f64::max));
    let round = if norm > 0.0 { 1.3 * largest / norm } else { 1.0 };
    p.map(|v| CORE * v * (1.0 - BULGE + BULGE * round))
}

fn norm(p: [f64; 3]) -> f64 {
    p.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// An eighth of the ball: a bulged cube, and between each of its far sides and the sphere a shell,
/// `cells` wide and `layers` deep, thinner outwards.
fn eighth(cells: usize, layers: usize) -> Mesh {
    let kind = ElementKind::Hex27;
    let side = even(1.0, 2 * cells);
    let core = lattice(kind, [side.clone(), side.clone(), side.clone()], bulged);
    let through = even(1.0, 2 * layers);
    let mut pieces = vec![core];
    for axis in 0..3 {
        // Of a shell the third coordinate goes outwards along `axis`, keeping the hand.
        pieces.push(lattice(kind, [side.clone(), side.clone(), through.clone()], |[a, b, s]| {
            let turned = |a: f64, b: f64| {
                let mut p = [1.0; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (a, b);
                p
            };
            let (inner, out) = (bulged(turned(a, b)), {
                let way = |v: f64| (FRAC_PI_4 * v).tan();
                turned(way(a), way(b))
            });
            let s = s * (1.15 - 0.15 * s);
            std::array::from_fn(|i| (1.0 - s) * inner[i] + s * out[i] / norm(out))
        }));
    }
    join(&pieces)
}

fn join(pieces: &[Mesh]) -> Mesh {
    let mut mesh = Mesh::default();
    let mut number: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let mut block =
        Block { kind: ElementKind::Hex27, connectivity: Vec::new(), region: Vec::new() };
    let mut outside = Surface { kind: FaceKind::of(block.kind), connectivity: Vec::new() };
    for (i, piece) in pieces.iter().enumerate() {
        let new: Vec<u32> = piece
            .nodes
            .iter()
            .map(|p| {
                let key = p.map(|v| (v * 1e8).round() as i64);
                *number.entry(key).or_insert_with(|| {
                    mesh.nodes.push(p.map(|v| RADIUS_MM * v));
                    mesh.nodes.len() as u32 - 1
                })
            })
            .collect();
        let from = &piece.blocks[0];
        block.connectivity.extend(from.connectivity.iter().map(|&n| new[n as usize]));
        block.region.extend(from.region.iter().map(|_| REGION));
        if i > 0 {
            let faces = &piece.surfaces["z_max"].connectivity;
            outside.connectivity.extend(faces.iter().map(|&n| new[n as usize]));
        }
    }
    for (i, name) in ["x_min", "y_min", "z_min"].into_iter().enumerate() {
        let on = |n: &u32| mesh.nodes[*n as usize][i].abs() < 1e-9;
        mesh.node_sets.insert(name.into(), (0..mesh.nodes.len() as u32).filter(on).collect());
    }
    mesh.blocks.push(block);
    mesh.surfaces.insert("sphere".into(), outside);
    mesh
}

#[test]
fn cryer_is_met_with_its_overshoot_without_lateral_strain() {
    assert_cryer(TABLE[0]);
}

#[test]
fn cryer_is_met_with_its_overshoot_at_a_fifth() {
    assert_cryer(TABLE[1]);
}

#[test]
fn cryer_is_met_with_its_overshoot_at_two_fifths() {
    assert_cryer(TABLE[2]);
}

fn assert_cryer((nu, table, peak, peak_at): (f64, [f64; 4], f64, f64)) {
    let [x, y, z] = [0, 1, 2].map(|i| std::array::from_fn(|j| i == j));
    let held = [("x_min", x), ("y_min", y), ("z_min", z)];
    let body = Body::new(eighth(1, 15 + (10.0 * nu) as usize), nu, &held, "sphere");
    let t = times(&STOPS, &[14, 10, 10, 40 + (900.0 * nu * nu) as usize]);
    // Of the ball that has the mesh's volume: parabolas through points of the sphere lie within it.
    let at_rest = vec![[0.0; 3]; body.problem.mesh.nodes.len()];
    let radius_mm = (6.0 / PI * body.problem.volume_mm3(&at_rest)).cbrt();
    println!("radius {radius_mm} of {RADIUS_MM}");
    assert!((radius_mm / RADIUS_MM - 1.0).abs() < 2e-3);
    let scale_s = radius_mm * radius_mm / body.c();
    let seconds: Vec<f64> = t.iter().map(|t| t * scale_s).collect();
    let loading = Loading {
        dead_n: body.pressed("sphere", PRESSURE_MPA),
        course: sudden(&seconds),
        ..Loading::default()
    };
    let middle = body.node([0.0; 3]);
    let mut found = Vec::new();
    march(&body.problem, loading, &seconds, |_, solver| {
        found.push(solver.fluid_pressure_mpa()[middle] / PRESSURE_MPA);
    });
    for (at, due) in STOPS.into_iter().zip(table) {
        let p = found[place(&t, at)];
        println!("nu {nu} T {at}: {p:.6} {due} {:.3} %", 100.0 * (p / due - 1.0));
    }
    let (highest, when) =
        found.iter().zip(&t).fold((0.0, 0.0), |m, (&f, &t)| if f > m.0 { (f, t) } else { m });
    println!("nu {nu}: peak {highest} at {when}; {peak} at {peak_at}");
    for (at, due) in STOPS.into_iter().zip(table) {
        let p = found[place(&t, at)];
        assert!((p / due - 1.0).abs() < 5e-3, "nu {nu}, T {at}: {p}, {due}");
    }
    assert!((highest / peak - 1.0).abs() < 5e-3, "nu {nu}: {highest}");
    assert!((when / peak_at - 1.0).abs() < 0.15, "nu {nu}: {when}");
}
