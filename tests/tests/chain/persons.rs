//! Other people's fingers: what sessions make of width and stiffness, held against finite elements of
//! such a finger.

use std::sync::Arc;

use bytes::BytesMut;
use papilla_contact::ContactModel;
use papilla_fingertip::{scene::Scene, simulation::record::relative_l2};
use papilla_proto::{
    Hello, SampleType,
    atlas::{Patch, Raster},
    contact::{AnnouncedFinger, AnnouncedObject, Input, Pose, SampleLayout, TOUCH_LEN, Touch},
    sdf::{AnnouncedShape, Sphere},
};
use papilla_session_contact::{Frame, Hand, Skin};
use papilla_tests::conformance::ContactRecorder;
use serde_json::Value;

use crate::{
    scene::{PRESSED, Pressed, SCENE},
    service::{Sample, tiny_models},
};

const WIDTH: f64 = 1.2;
const STIFFNESS: f64 = 1.5;
const RADIUS_MM: f64 = 10.0;
const DEPTH_MM: f32 = 0.4;
/// How far two FE solutions may lie apart, which stop at a residual.
const SOLVED: f64 = 1e-4;

/// Every length of a scene times `WIDTH`, every modulus times `STIFFNESS`.
fn grow(name: &str, value: &mut Value) {
    match value {
        Value::Object(members) => members.iter_mut().for_each(|(name, v)| grow(name, v)),
        Value::Array(values) => values.iter_mut().for_each(|v| grow(name, v)),
        Value::Number(number) => {
            let factor = match name.rsplit('_').next() {
                Some("mm") => WIDTH,
                Some("mpa") => STIFFNESS,
                _ => return,
            };
            *value = (factor * number.as_f64().unwrap()).into();
        }
        _ => {}
    }
}

/// The fingers of a session: the reference, and the other person's; a ball for each.
fn hand() -> (Hand, [f32; 3]) {
    let (atlas, samples) = (&PRESSED.atlas, PRESSED.samples());
    let models = tiny_models(atlas, samples.last().unwrap());
    let recorder = ContactRecorder::new(models.path()).unwrap();
    let model = Arc::new(ContactModel::read(recorder.file()).unwrap());
    let ball = |radius_mm| AnnouncedObject {
        shape: AnnouncedShape::Sphere(Sphere { radius_mm }),
        stiffness_mpa_per_mm: None,
        friction: None,
    };
    let other = AnnouncedFinger { name: None, width: WIDTH, stiffness: STIFFNESS };
    let hello = Hello {
        input: Some(Input::Objects),
        objects: Some(vec![ball(RADIUS_MM), ball(WIDTH * RADIUS_MM)]),
        fingers: Some(vec![AnnouncedFinger::default(), other]),
        stiffness: Some(true),
        pressure: Some(SampleLayout::Vertices),
        ..Hello::default()
    };
    let raster = Arc::new(Raster::new(atlas, Patch::Skin));
    let skin = Skin {
        atlas,
        raster: &raster,
        model: Some(&model),
        pixels: None,
        interface: None,
        errors: None,
        model_sha256: None,
    };
    (Hand::of(&hello, skin).unwrap(), model.lowest_mm().map(|v| v as f32))
}

/// What a finger feels with the balls at `origins_mm`, and the pressure at its vertices, Pa.
fn felt(hand: &Hand, finger: usize, origins_mm: [[f32; 3]; 2]) -> (Touch, Vec<f64>) {
    let pose = |origin_mm| Pose { origin_mm, ..Pose::default() }.encode();
    let mut finger = hand.fingers()[finger].lock().unwrap();
    let payload = origins_mm.map(pose).concat();
    let frame = Frame { payload: &payload, sample_type: SampleType::F32, scale: 1.0, time_us: 0 };
    finger.take(frame, None).unwrap();
    let mut bytes = BytesMut::new();
    finger.write(&mut bytes);
    let values = bytes[TOUCH_LEN..].as_chunks::<4>().0;
    let pressure = values.iter().map(|v| f64::from(f32::from_le_bytes(*v)));
    (Touch::decode(&bytes).unwrap(), pressure.take(PRESSED.atlas.vertex_count()).collect())
}

fn exact(values: &[f32]) -> Vec<f64> {
    values.iter().map(|v| f64::from(*v)).collect()
}

/// FE and sessions agree by which factors pressure, SED, force and stiffness grow.
#[test]
fn a_wider_and_stiffer_finger_answers_as_its_finite_elements_do() {
    let scene = Scene::parse("scene.toml".as_ref(), SCENE.into()).unwrap();
    let mut scene = serde_json::to_value(scene).unwrap();
    grow("", &mut scene);
    let grown = Pressed::solve(&serde_json::from_value(scene).unwrap());
    let (hand, [x, y, z]) = hand();
    let near = |w: f32| [w * x, w * y, w * (z + DEPTH_MM - RADIUS_MM as f32)];
    let away = [0.0, 0.0, -9e4];
    let (own, own_pa) = felt(&hand, 0, [near(1.0), away]);
    let (other, other_pa) = felt(&hand, 1, [away, near(WIDTH as f32)]);

    // Pressure on the network's way in, SED on its way out, as a session turns them.
    let finger = hand.fingers()[1].lock().unwrap();
    for (due, found) in PRESSED.samples().iter().zip(grown.samples()) {
        let Sample { mut pressure_pa, sed_j_per_m3, .. } = found;
        finger.to_reference(&mut pressure_pa);
        let miss = relative_l2(&exact(&pressure_pa), &exact(&due.pressure_pa));
        assert!(miss < SOLVED, "pressure: {miss}");
        let mut sed = due.sed_j_per_m3.clone();
        finger.to_person(&mut sed);
        let miss = relative_l2(&exact(&sed), &exact(&sed_j_per_m3));
        assert!(miss < SOLVED, "SED: {miss}");
    }
    let factor = other_pa.iter().sum::<f64>() / own_pa.iter().sum::<f64>();
    let of_fe = |p: &Pressed| p.records[1].pressure_mpa.iter().sum::<f64>();
    let size = |f: &[f64; 3]| f.iter().map(|v| v * v).sum::<f64>().sqrt();
    let forces = |p: &Pressed| [0, 1].map(|i| size(&p.records[i].force_n));
    let [[a, b], [c, d]] = [forces(&grown), forces(&PRESSED)];
    // Depths are WIDTH times as far apart.
    let stiffness = (b - a) / (d - c) / WIDTH;
    for (what, found, due) in [
        ("pressure", factor, of_fe(&grown) / of_fe(&PRESSED)),
        ("force", f64::from(other.force_n[2] / own.force_n[2]), b / d),
        ("stiffness", f64::from(other.stiffness_n_per_mm / own.stiffness_n_per_mm), stiffness),
    ] {
        println!("{what}: {found:.5} in a session, {due:.5} in FE");
        assert!((found / due - 1.0).abs() < SOLVED, "{what}: {found} for {due}");
    }
}
