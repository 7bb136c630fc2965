use crate::mesh::tests::{ball, cuboid};
use crate::mesh::{Mended, Mesh, MeshDistance, MeshError};
use crate::{AnyOf, Placed, Placement, RoundedPlate, SignedDistance, Sphere};
use papilla_vector::{minus, norm};
use proptest::prelude::*;
use std::sync::{Arc, OnceLock};

/// Both meshes in one, the second one moved.
fn together(mut one: Mesh, other: &Mesh, at: [f64; 3]) -> Mesh {
    let first = one.vertices_mm.len() as u32;
    one.vertices_mm.extend(other.vertices_mm.iter().map(|p| minus(*p, at.map(|v| -v))));
    one.triangles.extend(other.triangles.iter().map(|t| t.map(|c| c + first)));
    one
}

/// A ball whose cap above this height is missing.
fn bowl(radius: f64, height: f64) -> Mesh {
    let mut mesh = ball(radius, 4);
    let corners = &mesh.vertices_mm;
    mesh.triangles.retain(|t| t.iter().all(|c| corners[*c as usize][2] < height));
    mesh
}

fn mended(mesh: &Mesh) -> MeshDistance {
    let built = mesh.build().unwrap_or_else(|error| panic!("{error}"));
    assert!(built.mended().is_some(), "nothing was mended");
    built
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Away from the hole it is the whole ball; across the hole it is plane.
    #[test]
    fn a_ball_with_a_hole_is_the_ball_away_from_it(p in prop::array::uniform3(-8.0..8.0f64)) {
        static OPEN: OnceLock<[MeshDistance; 2]> = OnceLock::new();
        let [open, whole] =
            OPEN.get_or_init(|| [mended(&bowl(5.0, 4.0)), ball(5.0, 4).build().expect("closed")]);
        let [found, due] = [open.distance(p), whole.distance(p)];
        // Nearest to the whole ball where the bowl has it: below the rim, whose corners lie between
        // 3.4 and 4 above the middle.
        let far = norm(p);
        if p[2] < 0.6 * far {
            // Deep inside the flat lid may be nearer.
            if far > 5.0 || 3.3 - p[2] > 5.0 - far {
                prop_assert!((found.gap_mm - due.gap_mm).abs() < 1e-12, "{found:?} for {due:?}");
                let turn = norm(minus(found.normal, due.normal));
                prop_assert!(turn < 1e-9, "{found:?} for {due:?}");
            }
        }
        // Certainly under the lid, certainly over it.
        let aside = p[0].hypot(p[1]);
        if aside < 2.5 && p[2] < 3.3 && p[2] > -3.0 {
            prop_assert!(found.gap_mm < 0.0, "{found:?}");
        }
        if p[2] > 4.0 {
            prop_assert!(found.gap_mm > 0.0 && found.gap_mm >= p[2] - 4.0 - 1e-12, "{found:?}");
        }
        prop_assert!((norm(found.normal) - 1.0).abs() < 1e-9);
    }

    /// The distance changes no faster than one goes: in a gap that was not closed it would jump.
    #[test]
    fn the_distance_does_not_jump(
        p in prop::array::uniform3(-8.0..8.0f64), q in prop::array::uniform3(-8.0..8.0f64),
        near in 0.0..1.0f64,
    ) {
        static MESHES: OnceLock<Vec<MeshDistance>> = OnceLock::new();
        let meshes = MESHES.get_or_init(|| {
            let mut box_without_lid = cuboid([4.0, 3.0, 2.0]);
            box_without_lid.triangles.drain(2..4);
            let balls = together(ball(4.0, 3), &ball(3.0, 3), [2.0, 1.0, 2.5]);
            let boxes = together(cuboid([3.0, 3.0, 3.0]), &cuboid([1.0, 1.0, 6.0]), [0.0; 3]);
            [bowl(5.0, 2.0), box_without_lid, balls, boxes].iter().map(mended).collect()
        });
        let q = std::array::from_fn(|i| p[i] + near * near * (q[i] - p[i]));
        for mesh in meshes {
            let change = (mesh.distance(p).gap_mm - mesh.distance(q).gap_mm).abs();
            prop_assert!(change <= norm(minus(p, q)) + 1e-6, "{change} from {p:?} to {q:?}");
        }
    }

    /// Two balls that overlap in one mesh are the union of two balls, walls inside do not count.
    #[test]
    fn two_balls_that_cross_are_their_union(p in prop::array::uniform3(-8.0..10.0f64)) {
        static BALLS: OnceLock<(MeshDistance, AnyOf)> = OnceLock::new();
        let at = [3.0, 2.0, 4.0];
        let (mesh, union) = BALLS.get_or_init(|| {
            let part = |radius_mm, origin_mm| Placed {
                part: Arc::new(Sphere { radius_mm }),
                placement: Placement::turned(0.0, 0.0, 0.0, origin_mm),
            };
            let mesh = together(ball(5.0, 5), &ball(4.0, 5), at);
            (mended(&mesh), AnyOf::new(vec![part(5.0, [0.0; 3]), part(4.0, at)]))
        });
        let found = mesh.distance(p).gap_mm;
        // In closed form outside; inside of a lens no wall is nearer than the outer surface.
        let gaps = [norm(p) - 5.0, norm(minus(p, at)) - 4.0];
        let outside = gaps[0].min(gaps[1]);
        if outside > 0.01 {
            prop_assert!((found - outside).abs() < 6e-3, "{found} for {outside} at {p:?}");
        } else if outside < -0.01 {
            prop_assert!(found < 0.0 && found <= outside + 6e-3, "{found} for {outside} at {p:?}");
            // Where both cover, a wall would be far nearer than the union's surface is.
            let due = union.distance(p).gap_mm;
            prop_assert!((found - due).abs() < 0.1, "{found} for {due} at {p:?}");
        }
    }

    /// A box without one of its sides is the box.
    #[test]
    fn a_box_without_a_side_is_the_box(
        p in prop::array::uniform3(-6.0..6.0f64), side in 0usize..6,
    ) {
        let half = [3.0, 2.0, 2.5];
        let mut mesh = cuboid(half);
        mesh.triangles.drain(2 * side..2 * side + 2);
        let built = mended(&mesh);
        prop_assert_eq!(built.mended(), Some(Mended { holes: 1, ..Mended::default() }));
        let due = RoundedPlate { half_mm: half, edge_radius_mm: 1e-9 }.distance(p).gap_mm;
        let found = built.distance(p).gap_mm;
        prop_assert!((found - due).abs() < 1e-8, "{found} for {due}");
    }
}

#[test]
fn a_sheet_has_no_inside() {
    let sheet = |bend: f64| {
        let at = |i: u32, j: u32| {
            let [x, y] = [i, j].map(|k| f64::from(k) - 4.0);
            [x, y, bend * (x * x + y * y)]
        };
        let vertices_mm = (0..9).flat_map(|i| (0..9).map(move |j| at(i, j))).collect();
        let cell = |i: u32, j: u32| {
            let a = 9 * i + j;
            [[a, a + 9, a + 10], [a, a + 10, a + 1]]
        };
        let triangles = (0..8).flat_map(|i| (0..8).flat_map(move |j| cell(i, j))).collect();
        Mesh { vertices_mm, triangles }
    };
    for bend in [0.0, 1e-3, -1e-3] {
        let error = sheet(bend).build().map(|_| ()).expect_err("a sheet");
        let MeshError::NoInside { percent } = error else { panic!("{error}") };
        assert!(percent <= 55, "{percent}");
        assert!(error.to_string().contains("thickness"), "{error}");
    }
    // A deep bowl has one.
    assert!(sheet(0.2).build().is_ok());
    // A tube that is open at both ends and shorter than wide has none either.
    let mut tube = cuboid([5.0, 5.0, 0.5]);
    tube.triangles.drain(..4);
    let error = tube.build().map(|_| ()).expect_err("no inside");
    assert!(matches!(error, MeshError::NoInside { .. }), "{error}");
}

#[test]
fn what_is_turned_the_wrong_way_is_turned() {
    let p = [0.3, 0.2, 2.5];
    let due = cuboid([1.0; 3]).build().expect("closed").distance(p);
    for wrong in [vec![3], vec![0, 5, 7], (0..12).collect(), (0..11).collect()] {
        let mut mesh = cuboid([1.0; 3]);
        for &triangle in &wrong {
            let t: &mut [u32; 3] = &mut mesh.triangles[triangle];
            t.swap(0, 1);
        }
        let built = mended(&mesh);
        assert_eq!(built.mended().map(|m| m.turned), Some(wrong.len()));
        assert_eq!(built.distance(p), due);
        assert!((built.distance([0.1, 0.0, 0.0]).gap_mm + 0.9).abs() < 1e-12);
    }
}

/// A second box beside, upon or in the first.
fn two_boxes(at: [f64; 3], half: [f64; 3], turn: bool) -> MeshDistance {
    let mut other = cuboid(half);
    if turn {
        other.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    together(cuboid([1.0; 3]), &other, at).build().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn boxes_that_touch_or_overlap_in_one_mesh_are_one_body() {
    assert_eq!(two_boxes([2.5, 0.0, 0.0], [1.0; 3], false).mended(), None, "apart");
    assert_eq!(two_boxes([0.0; 3], [0.5; 3], true).mended(), None, "a cavity");
    // Side by side: the same corners and so the same face twice, other corners, a hair's breadth
    // off, one into the other with tops in one plane.
    for (at, half) in [
        ([2.0, 0.0, 0.0], [1.0; 3]),
        ([1.8, 0.1, 0.2], [0.8, 0.7, 0.6]),
        ([1.8, 0.0, 0.0], [0.8, 2.0, 2.0]),
        ([1.8 + 5e-4, 0.1, 0.2], [0.8, 0.7, 0.6]),
        ([1.0, 0.0, 0.0], [1.0; 3]),
        ([1.5, 0.0, 0.0], [1.0, 0.5, 0.5]),
    ] {
        let built = two_boxes(at, half, false);
        assert!(built.mended().is_some(), "{at:?}");
        // Where they meet, no wall: the nearest free face is a side of the narrower one.
        let wall = 1.0f64.min(at[0]);
        let p = [wall, at[1], at[2]];
        let due = -half[1].min(half[2]).min(1.0);
        let found = built.distance(p).gap_mm;
        assert!(found < 0.7 * due, "{found} for {due} where {at:?} meets {half:?}");
    }
    let nested = two_boxes([0.1; 3], [0.5; 3], false);
    let due = cuboid([1.0; 3]).build().expect("closed");
    for p in [[0.1; 3], [0.3, 0.2, 0.6], [0.0, 0.0, 3.0]] {
        assert_eq!(nested.distance(p).gap_mm.to_bits(), due.distance(p).gap_mm.to_bits());
    }
    assert_eq!(nested.mended(), Some(Mended { covered: 12, ..Mended::default() }));
    // Outside of all a cavity is none.
    let beside = two_boxes([3.0; 3], [0.5; 3], true);
    assert_eq!(beside.mended(), Some(Mended { turned: 12, ..Mended::default() }));
    assert!((beside.distance([3.0, 3.0, 4.0]).gap_mm - 0.5).abs() < 1e-12);
}

#[test]
fn a_surface_told_from_both_sides_is_told_once() {
    let mut mesh = ball(3.0, 3);
    let backs: Vec<_> = mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    mesh.triangles.extend(backs);
    let due = ball(3.0, 3).build().expect("closed").distance([0.5, -1.0, 1.0]);
    let built = mended(&mesh);
    assert_eq!(built.distance([0.5, -1.0, 1.0]).gap_mm.to_bits(), due.gap_mm.to_bits());
    assert_eq!(built.mended().map(|m| m.covered), Some(512));
}

#[test]
fn halves_with_a_crack_between_them_are_one_body() {
    let half = |up: bool, off: f64| {
        let mut mesh = ball(5.0, 4);
        let corners = mesh.vertices_mm.clone();
        let above = |c: &u32| corners[*c as usize][2];
        mesh.triangles.retain(|t| {
            let middle: f64 = t.iter().map(above).sum();
            (middle > 0.0) == up
        });
        for p in &mut mesh.vertices_mm {
            p[2] += off;
        }
        mesh
    };
    let whole = ball(5.0, 4).build().expect("closed");
    let cracked = mended(&together(half(true, 0.01), &half(false, 0.0), [0.0; 3]));
    assert_eq!(cracked.mended(), Some(Mended { cracks: 2, ..Mended::default() }));
    for p in
        [[0.1, 0.2, 0.004], [0.0, 3.0, 1.0], [0.0, -6.0, -1.0], [1.0, 1.0, 7.0], [0.5, 0.5, -2.0]]
    {
        let [found, due] = [cracked.distance(p).gap_mm, whole.distance(p).gap_mm];
        assert!((found - due).abs() < 0.011, "{found} for {due} at {p:?}");
    }
}

#[test]
fn mending_is_bounded_and_can_be_stopped() {
    // Every triangle of one comb crosses every one of the other.
    let comb = |turned: bool| {
        let blade = |k: u32| {
            let at = 0.01 * f64::from(k) - 0.5;
            let corner = |x: f64, z: f64| if turned { [x, at, z] } else { [at, x, z] };
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)]
        };
        let vertices_mm = (0..100).flat_map(blade).collect();
        Mesh { vertices_mm, triangles: (0..100).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect() }
    };
    let combs = together(comb(false), &comb(true), [0.0; 3]);
    assert!(combs.build().is_err());
    let asked = std::cell::Cell::new(0);
    let balls = together(ball(4.0, 5), &ball(3.0, 5), [2.0, 1.0, 2.5]);
    let stopped = balls.build_until(&|| {
        asked.set(asked.get() + 1);
        asked.get() < 40
    });
    assert!(matches!(stopped, Err(MeshError::Stopped)), "{:?}", stopped.map(|_| ()).err());
}

#[test]
fn a_heap_of_loose_triangles_is_refused_within_bounds() {
    let corner = |k: u32| {
        let at = |n: u32| f64::from(k.wrapping_mul(n) % 1009) / 100.0;
        [at(7919), at(6101), at(4999)]
    };
    let vertices_mm = (0..9000).map(corner).collect();
    let triangles = (0..3000).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let asked = std::cell::Cell::new(0u32);
    let heap = Mesh { vertices_mm, triangles };
    let error = heap.build_until(&|| {
        asked.set(asked.get() + 1);
        true
    });
    assert!(error.is_err());
    // It is asked before each few holes.
    assert!(asked.get() > 100, "{}", asked.get());
}

#[test]
fn what_was_done_is_said() {
    let said = Mended { holes: 1, cracks: 2, turned: 1, covered: 3 }.to_string();
    for words in [
        "1 hole was closed",
        "2 open rims were left",
        "1 triangle was turned",
        "3 triangles do not count",
    ] {
        assert!(said.contains(words), "{said}");
    }
    assert!(!Mended::default().to_string().contains("hole"));
}
