use serde_json::Value;

use super::*;

const LEVEL: Place = Place { at: [0.0, 1.0, 0.0], turn: [0.0, 0.0, 0.0, 2.0] };

fn near(found: [f32; 3], due: [f32; 3]) {
    let off = found.iter().zip(due).map(|(f, d)| (f - d).abs()).fold(0.0, f32::max);
    assert!(off < 1e-3, "{found:?}, not {due:?}");
}

/// Ahead, level, nail up; the object 11.25 mm behind its end, 2 to the right, 8 below. As each
/// engine's manual has the axes, written by hand.
#[test]
fn a_level_finger_is_what_each_engine_s_manual_says() {
    for (convention, unit, object) in [
        (Convention::METRES, 1.0, [0.01125, 1.002, -0.008]),
        (Convention::OPENXR, 1.0, [0.002, 0.992, 0.01125]),
        (Convention::UNITY, 1.0, [0.002, 0.992, -0.01125]),
        (Convention::UNREAL, 100.0, [-1.125, 100.2, -0.8]),
    ] {
        let finger = Place { at: LEVEL.at.map(|v| unit * v), ..LEVEL };
        let object = Place { at: object, ..LEVEL };
        let pose = convention.pose(finger, object, 1.0).unwrap();
        near(pose.origin_mm, [11.25, 2.0, -8.0]);
        assert!(pose.quaternion[3] > 0.999_999, "{convention:?}: {pose:?}");
        let mm = [11.25, 2.0, -6.5];
        let drawn = convention.vertex_drawn(mm);
        let back = convention.vertex_mm(drawn);
        assert!(back.iter().zip(mm).all(|(b, m)| (b - m).abs() < 1e-9), "{back:?}");
        let there = convention.pose(Place::default(), Place { at: drawn, ..LEVEL }, 1.0).unwrap();
        near(there.origin_mm, [11.25, 2.0, -6.5]);
    }
}

/// The uneven wedge of the conformance script, where five engines say that it is.
#[test]
fn the_wedge_of_the_script_is_where_every_engine_has_it() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../proto/conformance-contact.json");
    let file: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let mut checked = 0;
    for case in file["cases"].as_array().unwrap() {
        for step in case["steps"].as_array().unwrap().iter().filter(|s| s["engines"].is_object()) {
            for (name, convention, up) in [
                ("right_handed", Convention::METRES, None),
                ("openxr", Convention::OPENXR, None),
                ("godot", Convention::OPENXR, Some([0.0, 0.0, -1.0])),
                ("unity", Convention::UNITY, None),
                ("unreal", Convention::UNREAL, None),
            ] {
                check_step(step, name, convention, up);
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 20);
}

fn numbers(of: &Value) -> Vec<f64> {
    of.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn place(of: &Value) -> Place {
    let v = numbers(of);
    Place { at: [v[0], v[1], v[2]], turn: [v[3], v[4], v[5], v[6]] }
}

fn check_step(step: &Value, name: &str, convention: Convention, up: Option<[f64; 3]>) {
    let said = &step["engines"][name];
    let mut fingers = vec![place(&said["finger"])];
    if said["joints"].is_object() {
        let (distal, tip) = (place(&said["joints"]["distal"]), place(&said["joints"]["tip"]));
        let inside_mm = said["joints"]["inside_mm"].as_f64().unwrap();
        fingers.push(convention.finger_of_joints(distal, tip, up, inside_mm).unwrap());
    }
    let due = numbers(&step["poses"][0]);
    for finger in &fingers {
        let found = convention.pose(*finger, place(&said["objects"][0]), 1.0).unwrap();
        let q = found.quaternion.map(f64::from);
        let dot: f64 = q.iter().zip(&due[3..]).map(|(f, d)| f * d).sum();
        near(found.origin_mm, [due[0] as f32, due[1] as f32, due[2] as f32]);
        assert!(dot.abs() > 1.0 - 1e-6, "{name}: {found:?}, not {due:?}");
    }
    // What was recorded of the touch, in the engine's world.
    let t: Vec<f32> =
        (0..10).map(|i| step["expect"]["touch"][i][0].as_f64().unwrap() as f32).collect();
    let touch = Touch {
        force_n: [t[0], t[1], t[2]],
        torque_n_mm: [t[3], t[4], t[5]],
        centre_mm: [t[7], t[8], t[9]],
        ..Touch::default()
    };
    let felt = convention.felt(fingers[0], &touch, 1.0).unwrap();
    let wanted = &step["expect"]["engines"][name];
    for (what, found) in
        [("force_n", felt.force_n), ("torque_n_m", felt.torque_n_m), ("centre", felt.centre)]
    {
        for (axis, found) in found.iter().enumerate() {
            let [due, off] = [0, 1].map(|k| wanted[what][axis][k].as_f64().unwrap());
            assert!((found - due).abs() <= 0.1 * off, "{name}: {what} {axis}: {found}, {due}");
        }
    }
}

#[test]
fn what_is_no_place_is_refused() {
    let xr = Convention::OPENXR;
    let nowhere = Place { at: [0.0, f64::NAN, 0.0], ..LEVEL };
    let turnless = Place { turn: [0.0; 4], ..LEVEL };
    assert_eq!(xr.pose(nowhere, LEVEL, 1.0), Err(PlaceError::NotFinite { of: "finger" }));
    assert_eq!(xr.pose(LEVEL, turnless, 1.0), Err(PlaceError::NoTurn { of: "object" }));
    assert_eq!(xr.pose(LEVEL, LEVEL, 0.0), Err(PlaceError::Scale(0.0)));
    assert!(xr.felt(turnless, &Touch::default(), 1.0).is_err());
    assert_eq!(xr.finger_of_joints(LEVEL, LEVEL, None, 0.0), Err(PlaceError::SamePlace));
    let below = Place { at: [0.0, 0.97, 0.0], ..LEVEL };
    assert_eq!(xr.finger_of_joints(below, LEVEL, None, 0.0), Err(PlaceError::Along));
    assert!(xr.finger_of_joints(nowhere, LEVEL, None, 0.0).is_err());
}
