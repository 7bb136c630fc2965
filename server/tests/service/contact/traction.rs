//! Pressure and traction that are sent, and that are felt.

use papilla_proto::{
    FrameHeader, FrameKind, FrameStatus, MAP_LEN, SampleType,
    contact::{Pose, TOUCH_LEN},
    flags,
};
use serde_json::{Value, json};

use super::{VERTICES, hear};
use crate::support::{
    Service,
    contact::{RADIUS_MM, atlas, ball_hello, model_of, rows, service},
    floats_of, frame, hello, model_folder_on, write,
};

/// A ball that is dragged: its traction is felt where the hello names the effect, and only there.
#[tokio::test(flavor = "multi_thread")]
async fn traction_is_felt_by_name() {
    let service = service().await;
    let rough = json!([{"shape": {"shape": "sphere", "radius_mm": RADIUS_MM}, "friction": 0.5}]);
    let mut maps = Vec::new();
    for effects in [json!(["shear_energy"]), json!([])] {
        let mut socket = service.socket().await;
        let members = json!({"objects": rough, "effects": effects, "out_of_range": "flag"});
        let ready = socket.open(ball_hello(&members)).await;
        assert_eq!(ready["session_effects"], effects);
        let mut sed = Vec::new();
        for sequence in 1..=4u32 {
            let x = 0.05 * sequence as f32;
            let pose = Pose { origin_mm: [x, 0.0, 0.3 - RADIUS_MM], ..Pose::default() };
            socket.send(rows(sequence, 0, &[pose])).await;
            let (_, touch, payload) = hear(&mut socket).await;
            assert!(touch.force_n[0] > 0.0 || sequence == 1, "{touch:?}");
            sed = floats_of(&payload[TOUCH_LEN..]);
        }
        maps.push(sed);
    }
    let most = |map: &[f32]| map.iter().copied().fold(0.0, f32::max);
    let apart: Vec<f32> = maps[0].iter().zip(&maps[1]).map(|(a, b)| (a - b).abs()).collect();
    assert!(most(&apart) > 1.0 && maps[0].iter().all(|sed| *sed >= 0.0), "{}", most(&apart));

    let effects = service.json("/v1/effects").await;
    let listed = effects["effects"].as_array().unwrap();
    let of = listed.iter().find(|effect| effect["name"] == "shear_energy").unwrap();
    assert!(of["cost_us"].as_f64().is_some_and(|us| us > 0.0), "{of}");
    // Slippery things pull at nothing; without layers nothing is known of the interface.
    let folder = model_folder_on(&atlas());
    write(folder.path(), "finger.contact", &model_of(Vec::new()));
    let without_layers = Service::on(folder, |_| ()).await.unwrap();
    let named = json!({"effects": ["shear_energy"]});
    let with_friction = json!({"effects": ["shear_energy"], "objects": rough});
    for (service, members) in [(&service, named), (&without_layers, with_friction)] {
        let mut socket = service.socket().await;
        socket.send(ball_hello(&members).to_string()).await;
        assert_eq!(socket.hear_refusal("bad_effect").await["field"], "shear_energy");
    }
}

/// Pressure at the vertices, and traction behind it, as a frame.
fn pulled(sequence: u32, pressure_pa: f32, traction_pa: f32) -> Vec<u8> {
    let header =
        FrameHeader::pressure(sequence, 1000 * u64::from(sequence), 0, SampleType::F32, 1.0);
    let header = header.of_finger(FrameKind::Pressure, 0, [4 * VERTICES as u16, 1]);
    let mut samples = vec![pressure_pa; VERTICES];
    for vertex in 0..VERTICES {
        // Pulled on one half, so that not all of it is a shift of the whole skin.
        samples.extend([if vertex % 19 < 9 { traction_pa } else { 0.0 }, 0.0, 0.0]);
    }
    let samples = samples.into_iter().flat_map(f32::to_le_bytes);
    header.encode().iter().copied().chain(samples).collect()
}

fn pulled_hello(members: &Value) -> Value {
    let mut hello = ball_hello(&json!({"input": "pressure", "input_layout": "vertices",
        "traction": true, "effects": ["shear_energy", "summary"]}));
    hello.as_object_mut().unwrap().remove("objects");
    for (name, value) in members.as_object().unwrap() {
        hello[name] = value.clone();
    }
    hello
}

/// The range holds for traction as for pressure, and no answer holds a number that is none.
#[tokio::test(flavor = "multi_thread")]
async fn traction_beyond_the_range_is_refused_flagged_or_clamped_as_pressure_is() {
    let service = service().await;
    let mut clamped = Vec::new();
    for (beyond, least_refused) in [("refuse", 1.1e4), ("flag", 1.1e5), ("clamp", 1.1e8)] {
        let mut socket = service.socket().await;
        socket.open(pulled_hello(&json!({"out_of_range": beyond}))).await;
        let tractions = [9e3, 1e4, 5e4, 1e6, 1e7, 1e10, 1e13, 1e16, 1e19, 1e20, 3e38, -3e38];
        for (sequence, traction_pa) in (1u32..).zip(tractions) {
            socket.send(pulled(sequence, 5e3, traction_pa)).await;
            if traction_pa.abs() > least_refused {
                let refused = socket.hear_refusal("out_of_range").await;
                assert_eq!(refused["field"], "traction_pa[0]", "{beyond} {traction_pa}");
                assert!(!refused["message"].as_str().unwrap().contains("inf"), "{refused}");
                continue;
            }
            let (header, _, payload) = hear(&mut socket).await;
            let is_flagged = header.flags & flags::OUT_OF_RANGE != 0;
            assert_eq!(is_flagged, traction_pa > 1.01e4, "{beyond} {traction_pa}");
            let numbers = floats_of(&payload);
            assert!(numbers.iter().all(|v| v.is_finite()), "{beyond} {traction_pa}");
            if beyond == "clamp" && traction_pa > 9.9e3 {
                clamped.push(numbers[numbers.len() - MAP_LEN..].to_vec());
            }
        }
    }
    // Whatever is clamped is felt as the greatest traction that is known.
    let peak = clamped[0].iter().copied().fold(0.0, f32::max);
    for map in &clamped[1..] {
        let apart = map.iter().zip(&clamped[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-3 * peak, "{apart} of {peak}");
    }
}

/// What a soft finger makes of the greatest f32 is beyond f32; the refusal names what was sent.
#[tokio::test(flavor = "multi_thread")]
async fn pressure_on_a_soft_finger_is_refused_by_the_value_that_was_sent() {
    let service = service().await;
    let soft = json!([{"stiffness": 0.25}]);
    let mut socket = service.socket().await;
    socket.open(pulled_hello(&json!({"fingers": soft, "out_of_range": "refuse"}))).await;
    for (sequence, pressure_pa, traction_pa) in [(1, 3.4e38, 0.0), (2, 2.6e3, 0.0), (3, 1e3, 2.6e3)]
    {
        socket.send(pulled(sequence, pressure_pa, traction_pa)).await;
        let refused = socket.hear_refusal("out_of_range").await;
        let message = refused["message"].as_str().unwrap();
        assert!(!message.contains("inf") && message.contains("2500 Pa"), "{message}");
    }
    // As maps, the same.
    let hello = json!({"input": "pressure", "fingers": soft, "out_of_range": "refuse"});
    let mut socket = service.socket().await;
    let mut hello = ball_hello(&hello);
    hello.as_object_mut().unwrap().remove("objects");
    socket.open(hello).await;
    for (sequence, pressure_pa) in [(1, 3.4e38), (2, 2.6e3)] {
        let header = FrameHeader::pressure(sequence, 1000, 0, SampleType::F32, 1.0);
        let header = header.of_finger(FrameKind::Pressure, 0, [224, 224]);
        let samples = std::iter::repeat_n(f32::to_le_bytes(pressure_pa), MAP_LEN).flatten();
        socket.send(header.encode().iter().copied().chain(samples).collect::<Vec<u8>>()).await;
        let refused = socket.hear_refusal("out_of_range").await;
        assert!(!refused["message"].as_str().unwrap().contains("inf"), "{refused}");
    }
}

/// Frames that show no SED are not judged by the map that the frame before them left.
#[tokio::test(flavor = "multi_thread")]
async fn a_refused_map_of_one_session_refuses_no_frame_of_another() {
    let service = service().await;
    let mut bad = service.socket().await;
    bad.open(hello(&json!({}))).await;
    let mut good = service.socket().await;
    good.open(pulled_hello(&json!({"map": false, "effects": []}))).await;
    for sequence in 1..4 {
        bad.send(frame(sequence, 0, SampleType::F32, 1.0, &vec![f32::NAN; MAP_LEN])).await;
        bad.hear_refusal("not_finite").await;
        good.send(pulled(sequence, 5e3, 0.0)).await;
        let (header, _) = good.hear_frame().await;
        assert_eq!(header.status, FrameStatus::Ok);
    }
}
