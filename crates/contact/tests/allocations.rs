//! A warm frame takes no memory.

use papilla_atlas::{Atlas, Patch, PatchVertices, Raster};
use papilla_contact::{
    Arrays, Contact, ContactModel, Displacement, Gaps, Header, Layer, Method, NetForce, Object,
    PixelContact, PixelSkin, PixelSpacing, Settings, Solver,
};
use papilla_sdf::{Placement, RoundedPlate, Sphere};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

struct Counting;

static TAKEN: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static COUNTING: Counting = Counting;

#[expect(unsafe_code, reason = "an allocator is unsafe; this one counts and hands on")]
// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        TAKEN.fetch_add(1, Ordering::Relaxed);
        // SAFETY: handed on as it came.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: handed on as it came.
        unsafe { System.dealloc(memory, layout) }
    }
}

fn model() -> (Arc<ContactModel>, PixelContact) {
    let side = 17u32;
    let place = |i: u32| [f64::from(i % side), f64::from(i / side)].map(|v| 0.1 * v - 0.8);
    let vertices: Vec<u32> = (0..side * side).collect();
    let uv = |[x, y]: [f64; 2]| [100.0 * y + 112.0, 100.0 * x + 112.0].map(|v| v as f32);
    let uv_px = vertices.iter().map(|i| uv(place(*i))).collect();
    let positions = vertices.iter().flat_map(|i| [place(*i)[0] as f32, place(*i)[1] as f32, 0.0]);
    let triangles: Vec<u32> = vertices
        .iter()
        .filter(|i| **i % side + 1 < side && **i / side + 1 < side)
        .flat_map(|a| [*a, a + 1, a + side, a + 1, a + side + 1, a + side])
        .collect();
    let header = Header {
        vertices: vertices.len(),
        triangles: triangles.len() / 3,
        share_max: 1.0,
        layers: vec![Layer { young_mpa: 0.15, poisson: 0.48, thickness_mm: 50.0 }],
        ..Header::current()
    };
    let normals = vertices.iter().flat_map(|_| [0.0, 0.0, -1.0]).collect();
    let areas = vec![0.01; vertices.len()];
    let arrays = Arrays::half_space(positions.collect(), normals, areas, triangles, 0.2);
    let positions_mm = arrays.positions_mm.as_chunks::<3>().0.to_vec();
    let corners = arrays.triangles.as_chunks::<3>().0.to_vec();
    let patch = PatchVertices { positions_mm, uv_px };
    let atlas = Atlas::new(0.01, corners, patch.clone(), patch).expect("an atlas");
    let model = Arc::new(ContactModel::new(header, arrays).expect("a model"));
    let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
    let skin = PixelSkin::new(&model, &atlas, raster).expect("layers");
    let pixels = PixelContact::new(Arc::new(skin), &model, PixelSpacing::One);
    (model, pixels)
}

fn ball(step: u32) -> Object {
    let at = 1e-3 * f64::from(step % 50);
    let place = Placement::turned(0.0, 0.0, 0.0, [at, 0.0, 0.04 + 0.2 * at - 10.0]);
    Object::rigid(Arc::new(Sphere { radius_mm: 10.0 }), place)
}

/// A thin piece upon another one, and a narrow one beside them.
fn pieces() -> [Object; 3] {
    let piece = |half_mm: [f64; 3], origin_mm| {
        let shape = Arc::new(RoundedPlate { half_mm, edge_radius_mm: 0.0 });
        Object::rigid(shape, Placement::turned(0.0, 0.0, 0.0, origin_mm))
    };
    [
        piece([0.3, 0.5, 0.04], [0.0, 0.0, 0.06]),
        piece([0.3, 0.5, 0.2], [0.0, 0.0, -0.18]),
        piece([0.05, 0.5, 0.24], [0.35, 0.0, -0.14]),
    ]
}

#[test]
fn a_warm_frame_takes_no_memory() {
    let (model, mut pixels) = model();
    let settings = Settings {
        method: Method::SmallStrain,
        stiffness: true,
        friction: true,
        ..Settings::default()
    };
    let mut solver = Solver::new(model.clone(), settings).expect("a solver");
    let mut out = Contact::new(model.vertices());
    let mut displacement = Displacement::new(&solver);
    let mut moved_mm = vec![[0.0; 3]; model.vertices()];
    let objects: Vec<_> = (0..20).map(ball).collect();
    let depth_mm: Vec<f32> = (0..model.vertices()).map(|i| 0.02 - 1e-4 * i as f32).collect();
    let pieces = pieces();
    let net = NetForce { direction: [0.0, 0.0, 1.0], force_n: 0.005 };
    let mut frame = |object: &Object| {
        solver.solve(std::slice::from_ref(object), &mut out).expect("an answer");
        assert!(out.force_n[2] > 0.0);
        let rough = [Object { friction: 0.4, ..object.clone() }];
        solver.solve(&rough, &mut out).expect("an answer");
        solver.solve_for_force(&rough, net, &mut out).expect("a travel");
        let gaps = Gaps::rigid(&depth_mm);
        solver.solve(gaps, &mut out).expect("an answer");
        solver.solve_for_force(std::slice::from_ref(object), net, &mut out).expect("a travel");
        let objects = std::slice::from_ref(object);
        solver.solve_on_pixels(objects, &mut pixels, &mut out).expect("an answer");
        assert!(out.force_n[2] > 0.0);
        displacement.fill(&solver, Some(&pixels), &out, &mut moved_mm);
        solver.solve_for_force_on_pixels(objects, net, &mut pixels, &mut out).expect("a travel");
        solver.solve(&pieces, &mut out).expect("an answer");
        assert!(out.force_n[2] > 0.0);
        solver.solve(&[] as &[Object; 0], &mut out).expect("an answer");
    };
    objects.iter().take(3).for_each(&mut frame);
    let before = TAKEN.load(Ordering::Relaxed);
    objects.iter().for_each(&mut frame);
    assert_eq!(TAKEN.load(Ordering::Relaxed), before);
}
