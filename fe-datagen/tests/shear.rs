//! Friction of the real-time contact solver against finite elements that press and drag.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use papilla_atlas::PA_PER_MPA;
use papilla_atlas::Patch;
use papilla_contact::{Arrays, Contact, ContactModel, Header, Method, Object, Settings, Solver};
use papilla_fem::solve::Options;
use papilla_fingertip::influence;
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::{Scene, TissueTable};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::drive::DrivePoint;
use papilla_fingertip::simulation::record::{IncrementRecord, relative_l2};
use papilla_sdf::{Placement, SignedDistance};
use std::path::Path;
use std::sync::Arc;

const FRICTION: f64 = 0.5;
/// Equilibria of the finite elements, and frames of the contact solver, for each step between two
/// states: friction depends on the way, and steps are part of it.
const STEPS: u32 = 2;

/// A press of a depth, dragged along x and then along y, mm.
fn scene(mesh: &str, effects: &str, indenter: &str, depth_mm: f64, drags: &[[f64; 2]]) -> Scene {
    let drag = |(i, [x, y]): (usize, &[f64; 2])| {
        let time_s = i + 2;
        format!(", {{ time_s = {time_s}.0, depth_mm = {depth_mm}, shift_mm = [{x:?}, {y:?}] }}")
    };
    let drags: String = drags.iter().enumerate().map(drag).collect();
    let text = format!(
        "effects = [{effects}]\n{indenter}\nfriction.coefficient = {FRICTION}\n\
         [geometry]\nkind = \"fingertip\"\ndensity = \"{mesh}\"\norder = \"linear\"\n\
         [motion]\npath = [{{ time_s = 1.0, depth_mm = {depth_mm} }}{drags}]"
    );
    Scene::parse(Path::new("scene.toml"), text).unwrap()
}

/// Records at the states, and where the indenter is in each.
fn truth(scene: &Scene) -> (Vec<IncrementRecord>, Arc<dyn SignedDistance>, Vec<Placement>) {
    let Simulation { body, approach, drive, .. } = Simulation::new(scene).unwrap();
    let moving = body.indenter(&approach, &drive).unwrap();
    let mut solver = body.solver(Options::default()).unwrap();
    let mut records = Vec::new();
    body.press(&mut solver, &approach, &drive, STEPS, &mut |_, record, _| {
        println!("state of {:.0} s: {:.0?}", record.time_s, record.seconds);
        records.push(record.clone());
    })
    .unwrap();
    let at = |(_, by): &(f64, [f64; 3])| {
        let mut place = moving.start;
        place.origin_mm.iter_mut().zip(by).for_each(|(o, by)| *o += by);
        place
    };
    let places = std::iter::once(moving.start).chain(moving.path.iter().map(at)).collect();
    (records, moving.shape, places)
}

/// What the contact solver finds in the same places, in frames between them.
fn found(
    model: &Arc<ContactModel>,
    method: Method,
    shape: &Arc<dyn SignedDistance>,
    places: &[Placement],
) -> Vec<Contact> {
    let settings = Settings { method, friction: true, ..Settings::default() };
    let mut solver = Solver::new(model.clone(), settings).unwrap();
    let mut out = Contact::new(model.vertices());
    let to = |ends: &[Placement]| {
        let way: [f64; 3] = std::array::from_fn(|i| ends[1].origin_mm[i] - ends[0].origin_mm[i]);
        let way_mm = way.iter().map(|w| w * w).sum::<f64>().sqrt();
        let to = DrivePoint { depth_mm: way_mm, ..DrivePoint::default() };
        let frames = STEPS * DrivePoint::default().steps_to(&to, FRICTION);
        for frame in 1..=frames {
            let part = f64::from(frame) / f64::from(frames);
            let mut place = ends[0];
            for i in 0..3 {
                place.origin_mm[i] += part * way[i];
            }
            let object = Object { friction: FRICTION, ..Object::rigid(shape.clone(), place) };
            solver.solve(&[object], &mut out).unwrap();
            assert!(out.quality.settled && !out.quality.out_of_range, "{:?}", out.quality);
        }
        out.clone()
    };
    places.windows(2).map(to).collect()
}

/// Errors of a state: force along the skin over the normal one, of both; relative L2 of shear and
/// of pressure.
#[derive(Debug)]
struct Errors {
    pull: [f64; 2],
    shear: f64,
    pressure: f64,
}

fn errors(record: &IncrementRecord, contact: &Contact) -> Errors {
    let pull = |f: [f64; 3]| f[0].hypot(f[1]) / f[2];
    let flat = |shear: &[[f64; 3]]| shear.as_flattened().to_vec();
    let shear: Vec<[f64; 3]> =
        contact.shear_pa.iter().map(|s| s.map(|v| f64::from(v) / PA_PER_MPA)).collect();
    let pressure: Vec<f64> =
        contact.pressure_pa.iter().map(|p| f64::from(*p) / PA_PER_MPA).collect();
    Errors {
        pull: [pull(record.force_n), pull(contact.force_n)],
        shear: relative_l2(&flat(&shear), &flat(&record.shear_mpa)),
        pressure: relative_l2(&pressure, &record.pressure_mpa),
    }
}

/// A small-strain finger of few vertices without second order.
fn small_strain_finger() -> Arc<ContactModel> {
    let body = influence::body(
        &Default::default(),
        Density::Coarse,
        Order::Linear,
        &TissueTable::default(),
    )
    .unwrap();
    let compliance = influence::compliance(&body, &mut |_| ()).unwrap();
    let (atlas, _) = body.atlas().unwrap().unwrap();
    let positions_mm = atlas.patch(Patch::Skin).positions_mm.as_flattened().to_vec();
    let triangles = atlas.triangles().as_flattened().to_vec();
    let v = compliance.area_mm2.len();
    let row = |i: usize| compliance.mm_per_n[(3 * v + 1) * i..3 * v * (i + 1)].to_vec();
    let header = Header {
        atlas_hash: compliance.atlas_hash.clone(),
        vertices: v,
        triangles: triangles.len() / 3,
        share_max: 1.0,
        ..Header::current()
    };
    let arrays = Arrays {
        positions_mm,
        normals: compliance.normal.as_flattened().to_vec(),
        areas_mm2: compliance.area_mm2.clone(),
        triangles,
        compliance_mm_per_n: (0..3 * v).flat_map(row).collect(),
        ..Arrays::default()
    };
    Arc::new(ContactModel::new(header, arrays).unwrap())
}

const BALL: &str = "indenter = { shape = \"sphere\", radius_mm = 12.0 }";
const PLATE: &str = "indenter = { shape = \"plate\" }";

/// On the same linear mesh both solve the same problem, but for how bounds follow the way: sticking
/// in part, slipping, and turned aside.
#[test]
fn friction_is_that_of_finite_elements_at_small_strain() {
    let scene = scene(
        "coarse",
        "\"layers\", \"friction\"",
        BALL,
        0.5,
        &[[0.05, 0.0], [0.6, 0.0], [0.6, 0.4]],
    );
    let (records, shape, places) = truth(&scene);
    let contacts = found(&small_strain_finger(), Method::SmallStrain, &shape, &places);
    let mut pulls = Vec::new();
    for (record, contact) in records.iter().zip(&contacts) {
        let errors = errors(record, contact);
        println!("{errors:.4?}");
        pulls.push(errors.pull);
        // Going straight in, what little shear there is depends on when vertices come into contact.
        let most = if pulls.len() == 1 { 0.12 } else { 0.04 };
        assert!(errors.pressure < 0.01 && errors.shear < most, "{errors:?}");
    }
    assert!(pulls[1][0] < 0.9 * pulls[2][0], "nothing sticks: {pulls:?}");
    for [due, found] in &pulls[1..] {
        assert!((found / due - 1.0).abs() < 0.02, "{pulls:?}");
    }
}

/// Figures of docs/concepts/contact.md: the finger that is served, and what SED owes to shear.
#[test]
#[ignore = "long: ./test --all"]
fn shear_and_what_it_costs_at_finite_strain() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/finger.contact");
    let model = Arc::new(ContactModel::read(&std::fs::read(path).unwrap()).unwrap());
    for (name, indenter) in [("ball", BALL), ("plate", PLATE)] {
        let drags = [[0.1, 0.0]];
        let press = |effects: &str| scene("medium", effects, indenter, 1.0, &drags);
        let rough = press("\"finite_strain\", \"layers\", \"friction\"");
        let (records, shape, places) = truth(&rough);
        let (slippery, ..) = truth(&press("\"finite_strain\", \"layers\""));
        let contacts = found(&model, Method::SecondOrder, &shape, &places);
        for ((record, contact), without) in records.iter().zip(&contacts).zip(&slippery) {
            let errors = errors(record, contact);
            let sed = relative_l2(&without.sed_dermis_mpa, &record.sed_dermis_mpa);
            let pressure = relative_l2(&without.pressure_mpa, &record.pressure_mpa);
            println!("{name}: {errors:.3?}; without friction pressure {pressure:.3}, SED {sed:.3}");
            assert!(errors.shear < 0.4 && errors.pressure < 0.1, "{errors:?}");
            let [due, found] = errors.pull;
            assert!((found - due).abs() < 0.1 * FRICTION, "{errors:?}");
        }
    }
}
