use super::*;
use crate::{RoundedPlate, Sphere};
use proptest::prelude::*;

/// A box of these half widths, two triangles a side.
pub(super) fn cuboid(half: [f64; 3]) -> Mesh {
    let corner =
        |i: usize| std::array::from_fn(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] });
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh { vertices_mm: (0..8).map(corner).collect(), triangles }
}

/// An octahedron, each triangle in four, so many times, on a sphere.
pub(super) fn ball(radius: f64, times: usize) -> Mesh {
    let mut vertices_mm: Vec<[f64; 3]> = (0..6)
        .map(|i| std::array::from_fn(|k| [1.0, -1.0][i % 2] * f64::from(u8::from(k == i / 2))))
        .collect();
    let mut triangles = Vec::new();
    for x in 0..2u32 {
        for y in 2..4u32 {
            for z in 4..6u32 {
                let flip = (x + y + z) % 2 == 1;
                triangles.push(if flip { [x, z, y] } else { [x, y, z] });
            }
        }
    }
    for _ in 0..times {
        let mut next = Vec::new();
        for [a, b, c] in triangles {
            // Corners that meet lie at the very same place, and become one.
            let mut between = |i: u32, j: u32| {
                let [p, q] = [i.min(j), i.max(j)].map(|k| vertices_mm[k as usize]);
                vertices_mm.push(scaled_to_one(std::array::from_fn(|k| p[k] + q[k])));
                vertices_mm.len() as u32 - 1
            };
            let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = next;
    }
    for v in &mut vertices_mm {
        *v = v.map(|c| radius * c);
    }
    Mesh { vertices_mm, triangles }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The exact box: a plate whose edges are rounded by next to nothing.
    #[test]
    fn a_box_is_as_far_as_a_box(p in prop::array::uniform3(-4.0..4.0f64)) {
        let half = [2.0, 1.0, 1.5];
        let due = RoundedPlate { half_mm: half, edge_radius_mm: 1e-9 }.distance(p);
        let found = cuboid(half).build().expect("closed").distance(p);
        prop_assert!((found.gap_mm - due.gap_mm).abs() < 1e-8, "{found:?} for {due:?}");
        // Midway between two sides either normal is right.
        if found.gap_mm > 1e-6 {
            for i in 0..3 {
                prop_assert!((found.normal[i] - due.normal[i]).abs() < 1e-5, "{found:?} for {due:?}");
                for j in 0..3 {
                    let off = (found.hessian[i][j] - due.hessian[i][j]).abs();
                    prop_assert!(off < 1e-4 / found.gap_mm, "{found:?} for {due:?}");
                }
            }
        }
    }

    /// The farther it is refined, the less it is off: at most the height of a chord's arc.
    #[test]
    fn a_fine_ball_is_a_sphere(p in prop::array::uniform3(-8.0..8.0f64)) {
        static BALL: std::sync::OnceLock<MeshDistance> = std::sync::OnceLock::new();
        let mesh = BALL.get_or_init(|| ball(5.0, 5).build().expect("closed"));
        let due = Sphere { radius_mm: 5.0 }.distance(p);
        prop_assert!((mesh.distance(p).gap_mm - due.gap_mm).abs() < 6e-3, "{p:?}");
    }
}

#[test]
fn what_bounds_no_body_is_named() {
    let whole = || cuboid([1.0; 3]);
    let with = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = whole();
        change(&mut mesh);
        mesh.build().map(|_| ()).expect_err("refused")
    };
    assert!(whole().build().is_ok());
    assert_eq!(with(&|m| m.triangles.truncate(3)), MeshError::Count { found: 3 });
    let many = TRIANGLES_MAX + 10_000;
    let crowd = with(&|m| m.triangles = vec![[0, 1, 2]; many]);
    assert_eq!(crowd, MeshError::Count { found: many });
    assert_eq!(with(&|m| m.triangles[5][2] = 8), MeshError::Index { triangle: 5 });
    assert_eq!(with(&|m| m.vertices_mm[2][1] = f64::NAN), MeshError::Vertex { vertex: 2 });
    assert_eq!(with(&|m| m.vertices_mm[7][0] = 1e9), MeshError::Vertex { vertex: 7 });
    let nothing = with(&|m| m.vertices_mm = vec![[0.0; 3]; 8]);
    assert_eq!(nothing, MeshError::NoInside { percent: 0 });
}

/// A closed fan of so many slivers, all boxes of which overlap.
fn slivers(count: u32) -> Mesh {
    let mut vertices_mm = vec![[0.0, 0.0, 5.0], [0.0, 0.0, -5.0]];
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(count);
    vertices_mm.extend((0..count).map(|i| [20.0 * angle(i).cos(), 20.0 * angle(i).sin(), 0.0]));
    // Turned, so that no axis separates them.
    for v in &mut vertices_mm {
        let [x, y, z] = *v;
        *v = [0.6 * x + 0.8 * z, y, 0.6 * z - 0.8 * x];
    }
    let triangles =
        (0..count).flat_map(|i| [[0, 2 + i, 2 + (i + 1) % count], [1, 2 + (i + 1) % count, 2 + i]]);
    Mesh { vertices_mm, triangles: triangles.collect() }
}

#[test]
fn the_search_for_crossings_is_bounded_and_can_be_stopped() {
    assert!(slivers(100).build().is_ok(), "few");
    let found = slivers(8000).build().map(|_| ()).expect_err("too many boxes overlap");
    assert!(matches!(found, MeshError::TooTangled { .. }), "{found}");
    assert!(found.to_string().contains("less slender"), "{found}");
    let asked = std::cell::Cell::new(0);
    let stopped = ball(5.0, 4).build_until(&|| {
        asked.set(asked.get() + 1);
        asked.get() < 3
    });
    assert!(matches!(stopped, Err(MeshError::Stopped)));
    assert_eq!(asked.get(), 3);
    // A well-made one of the most triangles needs far less than is allowed.
    assert!(ball(5.0, 5).build().is_ok());
}

#[test]
fn a_mesh_costs_what_its_tree_looks_at() {
    let [small, large] = [2, 5].map(|times| ball(5.0, times).build().expect("closed").cost());
    // 64 times the triangles, in a tree six levels deeper.
    assert!(small < large && large < 8.0 * small, "{small} {large}");
}

#[test]
fn corners_told_for_each_triangle_are_joined() {
    let whole = cuboid([1.0, 2.0, 3.0]);
    let vertices_mm: Vec<_> =
        whole.triangles.iter().flatten().map(|c| whole.vertices_mm[*c as usize]).collect();
    let triangles = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let apart = Mesh { vertices_mm, triangles }.build().expect("closed");
    assert!((apart.distance([0.0, 0.0, 5.0]).gap_mm - 2.0).abs() < 1e-12);
    assert!((apart.reach_mm([0.0, 1.0, 0.0]) - 2.0).abs() < 1e-12);
}

#[test]
fn an_open_surface_has_the_distance_of_the_closed_one_away_from_its_rim() {
    let closed = ball(3.0, 4);
    let mut open = closed.clone();
    let corners = &closed.vertices_mm;
    open.triangles.retain(|t| t.iter().all(|&c| corners[c as usize][2] < 2.0));
    assert!(open.triangles.len() < closed.triangles.len());
    assert!(open.build().unwrap().mended().is_some() && closed.build().unwrap().mended().is_none());
    let (whole, part) = (closed.build().unwrap(), open.build_open().unwrap());
    for p in [[0.0, 0.0, -2.0], [1.0, 0.5, -4.0], [-2.5, 0.0, -1.0], [0.0, 3.5, 0.0]] {
        let [due, found] = [&whole, &part].map(|mesh| mesh.distance(p).gap_mm);
        assert!((due - found).abs() < 1e-12, "{p:?}: {found} for {due}");
    }
    assert!(matches!(Mesh::default().build_open(), Err(MeshError::Count { found: 0 })));
}
