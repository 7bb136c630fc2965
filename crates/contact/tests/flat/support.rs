//! A flat patch of an elastic half-space and what presses on it.

use papilla_contact::{Arrays, Contact, ContactModel, Header, Method, Object, Settings, Solver};
use papilla_sdf::{Placement, SignedDistance, Sphere};
use std::sync::Arc;

pub(crate) const SIDE: usize = 21;
pub(crate) const SPACING_MM: f64 = 0.1;
/// E / (1 - nu^2), MPa.
pub(crate) const MODULUS_MPA: f64 = 0.2;

pub(crate) fn vertex(i: usize) -> [f64; 2] {
    let middle = (SIDE - 1) as f64 / 2.0;
    [i % SIDE, i / SIDE].map(|k| (k as f64 - middle) * SPACING_MM)
}

/// Vertices on a square grid at z = 0, skin looking down (-z): objects press towards +z. Only the
/// normal displacement is not zero.
pub(crate) fn arrays() -> (Header, Arrays) {
    let v = SIDE * SIDE;
    let mut triangles = Vec::new();
    for y in 0..SIDE - 1 {
        for x in 0..SIDE - 1 {
            let a = (y * SIDE + x) as u32;
            let s = SIDE as u32;
            triangles.extend([a, a + 1, a + s, a + 1, a + s + 1, a + s]);
        }
    }
    let header = Header {
        vertices: v,
        triangles: triangles.len() / 3,
        share_max: 1.0,
        atlas_hash: "flat".into(),
        ..Header::current()
    };
    let place = |i: usize| {
        let [x, y] = vertex(i);
        [x as f32, y as f32, 0.0]
    };
    let arrays = Arrays::half_space(
        (0..v).flat_map(place).collect(),
        (0..v).flat_map(|_| [0.0, 0.0, -1.0]).collect(),
        vec![(SPACING_MM * SPACING_MM) as f32; v],
        triangles,
        MODULUS_MPA,
    );
    (header, arrays)
}

pub(crate) fn model() -> Arc<ContactModel> {
    static MODEL: std::sync::OnceLock<Arc<ContactModel>> = std::sync::OnceLock::new();
    let make = || {
        let (header, arrays) = arrays();
        Arc::new(ContactModel::new(header, arrays).expect("a model"))
    };
    MODEL.get_or_init(make).clone()
}

pub(crate) fn ball(radius_mm: f64, at: [f64; 2], depth_mm: f64) -> Object {
    let shape: Arc<dyn SignedDistance> = Arc::new(Sphere { radius_mm });
    let place = [at[0], at[1], depth_mm - radius_mm];
    Object::rigid(shape, Placement::turned(0.0, 0.0, 0.0, place))
}

pub(crate) fn solver(settings: Settings) -> (Solver, Contact) {
    let model = model();
    let out = Contact::new(model.vertices());
    (Solver::new(model, settings).expect("a solver"), out)
}

pub(crate) fn small_strain() -> Settings {
    Settings { method: Method::SmallStrain, ..Settings::default() }
}
