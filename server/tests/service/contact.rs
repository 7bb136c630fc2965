//! Objects and gaps in, forces out, several fingers.

use papilla_proto::{
    ErrorEstimate, FrameHeader, FrameKind, FrameStatus, HEADER_LEN, MAP_LEN, SampleType,
    contact::{POSE_LEN, Pose, TOUCH_LEN, Touch},
    flags,
};
use serde_json::{Value, json};

use crate::support::{
    GAIN, Service, Socket,
    contact::{
        MODULUS_MPA, RADIUS_MM, atlas, ball_hello, deep, hertz_n, model, model_of, rows, service,
    },
    floats_of, frame, hello, model_folder, model_folder_on, write,
};

const VERTICES: usize = 361;

/// The next answer's header and touch, and the whole payload.
async fn hear(socket: &mut Socket) -> (FrameHeader, Touch, Vec<u8>) {
    let (header, payload) = socket.hear_frame().await;
    (header, Touch::decode(&payload).unwrap_or_default(), payload)
}

#[tokio::test(flavor = "multi_thread")]
async fn poses_go_in_and_forces_come_out_without_a_network() {
    let service = service().await;
    let mut socket = service.socket().await;
    let ready = socket.open(ball_hello(&json!({"map": false, "stiffness": true}))).await;
    assert_eq!(ready["sections"], json!([{"name": "touch", "offset": 48, "bytes": TOUCH_LEN}]));
    assert_eq!((&ready["vertices"], &ready["fingers"]), (&json!(VERTICES), &json!(1)));
    for (sequence, depth) in [(1, 0.2), (2, 0.3)] {
        socket.send(rows(sequence, 0, &[deep(depth)])).await;
        let (header, touch, payload) = hear(&mut socket).await;
        assert_eq!((header.sequence, payload.len()), (sequence, TOUCH_LEN));
        assert_eq!((header.infer_us, header.flags, header.finger), (0, 0, 0));
        assert!((touch.force_n[2] / hertz_n(depth) - 1.0).abs() < 0.1, "{touch:?}");
        assert!(touch.stiffness_n_per_mm > 0.0 && touch.area_mm2 > 1.0, "{touch:?}");
    }
    socket.send(rows(3, 0, &[deep(-9.0)])).await;
    let (header, touch, _) = hear(&mut socket).await;
    assert_eq!(header.flags, flags::NO_CONTACT);
    assert_eq!(touch.force_n.map(f32::to_bits), [0; 3]);
}

/// What goes deep presses on, is flagged, and is never told as air; what left presses no more.
#[tokio::test(flavor = "multi_thread")]
async fn a_session_feels_what_lies_deep_and_says_so() {
    const BALL_MM: f32 = 3.0;
    let service = service().await;
    let objects = json!([{"shape": {"shape": "sphere", "radius_mm": BALL_MM}}]);
    for method in ["springs", "second_order", "pixels"] {
        let mut socket = service.socket().await;
        let hello = json!({"objects": objects, "map": false, "method": method});
        socket.open(ball_hello(&hello)).await;
        let mut last_n = 0.0;
        for (sequence, depth) in (1..).zip([-0.5, 0.2, 1.0, 2.5, 4.0, 5.5, -3.0]) {
            let pose = Pose { origin_mm: [0.0, 0.0, depth - BALL_MM], ..Pose::default() };
            socket.send(rows(sequence, 0, &[pose])).await;
            let (header, touch, _) = hear(&mut socket).await;
            let told = header.flags;
            let is_air = told & flags::NO_CONTACT != 0;
            assert_eq!(is_air, depth < 0.0, "{method}, {depth} mm: {touch:?}");
            if depth > 2.1 {
                assert_ne!(told & flags::OUT_OF_RANGE, 0, "{method}, {depth} mm is silent");
            }
            assert!(is_air || touch.force_n[2] >= last_n, "{method}, {depth} mm: {touch:?}");
            last_n = touch.force_n[2];
        }
    }
}

/// A ball between four vertices, none of which it touches.
#[tokio::test(flavor = "multi_thread")]
async fn on_pixels_a_session_feels_what_lies_between_vertices() {
    const BALL_MM: f32 = 2.0;
    let service = service().await;
    let listing = service.json("/v1/tiers").await;
    let names: Vec<&str> = listing["methods"]
        .as_array()
        .unwrap()
        .iter()
        .map(|m| m["name"].as_str().unwrap())
        .collect();
    let all = ["springs", "small_strain", "second_order", "coarse_pixels", "pixels"];
    assert_eq!(names, all);
    for method in listing["methods"].as_array().unwrap() {
        assert!(method["contact_us"].is_u64() && method["errors"] == json!([]), "{method}");
    }
    let objects = json!([{"shape": {"shape": "sphere", "radius_mm": BALL_MM}}]);
    let ball = Pose { origin_mm: [0.5, 0.5, 0.05 - BALL_MM], ..Pose::default() };
    let mut socket = service.socket().await;
    let hello = json!({"objects": objects, "out_of_range": "flag", "pressure": "map"});
    let mut by_vertices = hello.clone();
    by_vertices["method"] = json!("second_order");
    let ready = socket.open(ball_hello(&by_vertices)).await;
    assert_eq!((&ready["method"], ready.get("warnings")), (&json!("second_order"), None));
    socket.send(rows(1, 0, &[ball])).await;
    let (header, missed, _) = hear(&mut socket).await;
    assert_eq!(header.flags & flags::NO_CONTACT, flags::NO_CONTACT);
    assert_eq!(missed.force_n[2].to_bits(), 0);

    // Who names none gets pixels.
    for (sequence, method) in [(2, None), (3, Some("coarse_pixels")), (4, Some("pixels"))] {
        let mut hello = hello.clone();
        if let Some(method) = method {
            hello["method"] = json!(method);
        }
        let method = method.unwrap_or("pixels");
        let ready = socket.open(ball_hello(&hello)).await;
        assert_eq!(ready["method"], method);
        socket.send(rows(sequence, 0, &[ball])).await;
        let (header, felt, payload) = hear(&mut socket).await;
        assert_eq!(header.flags & flags::NO_CONTACT, 0);
        // Hertz: 4/3 E* sqrt(R) d^1.5.
        let due = 4.0 / 3.0 * MODULUS_MPA * BALL_MM.sqrt() * 0.05f32.powf(1.5);
        assert!((felt.force_n[2] / due - 1.0).abs() < 0.2, "{method}: {felt:?} for {due}");
        // The network is asked about the pixels' pressure, which is sent too.
        let maps = floats_of(&payload[TOUCH_LEN..]);
        let (pressure_pa, sed) = maps.split_at(MAP_LEN);
        let most = |map: &[f32]| map.iter().copied().fold(0.0, f32::max);
        assert!((most(pressure_pa) / felt.pressure_max_pa - 1.0).abs() < 1e-6, "{felt:?}");
        assert!((most(sed) / (GAIN * felt.pressure_max_pa) - 1.0).abs() < 1e-3, "{}", most(sed));
    }
}

/// Of gaps, or by a model without layers, it cannot be done: the session is refused, by member.
#[tokio::test(flavor = "multi_thread")]
async fn pixels_need_objects_and_layers() {
    let by_gaps = json!({"input": "gaps", "objects": null, "method": "pixels"});
    let folder = model_folder_on(&atlas());
    write(folder.path(), "finger.contact", &model_of(Vec::new()));
    let without_layers = Service::on(folder, |_| ()).await.unwrap();
    let methods = without_layers.json("/v1/tiers").await["methods"].clone();
    assert!(methods.as_array().unwrap().len() == 3, "{methods}");
    let mut socket = without_layers.socket().await;
    let ready = socket.open(ball_hello(&json!({}))).await;
    assert_eq!(ready["method"], "second_order");
    let warning = ready["warnings"][0]["question"].as_str().unwrap();
    assert!(warning.contains("layers") && warning.contains("second_order"), "{warning}");
    for (service, members) in
        [(service().await, by_gaps), (without_layers, json!({"method": "pixels"}))]
    {
        let mut socket = service.socket().await;
        socket.send(ball_hello(&members).to_string()).await;
        assert_eq!(socket.hear_refusal("bad_contact").await["field"], "method");
    }
}

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

/// One in the air, two in contact; a session that sends pressure is not counted.
#[tokio::test(flavor = "multi_thread")]
async fn solves_are_counted_by_what_they_came_to() {
    let service = service().await;
    assert!(service.json("/v1/tiers").await["methods"].is_array());
    let mut socket = service.socket().await;
    socket.open(ball_hello(&json!({"map": false}))).await;
    for (sequence, depth) in [(1, -9.0), (2, 0.2), (3, 0.3)] {
        socket.send(rows(sequence, 0, &[deep(depth)])).await;
        hear(&mut socket).await;
    }
    let mut other = service.socket().await;
    other.open(hello(&json!({}))).await;
    other.send(frame(1, 0, SampleType::F32, 1.0, &vec![5e3; MAP_LEN])).await;
    other.hear_frame().await;
    let of = |outcome| format!("papilla_contact_solves_total{{outcome=\"{outcome}\"}}");
    for (outcome, due) in [("in_air", 1), ("settled", 2), ("unsettled", 0)] {
        assert_eq!(service.metric(&of(outcome)).await as u32, due, "{outcome}");
    }
    assert!(service.metric("papilla_contact_iterations_total").await >= 2.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_are_laid_out_apart_from_what_is_sent() {
    let service = service().await;
    let mut socket = service.socket().await;
    let ready = socket
        .open(ball_hello(
            &json!({"pressure": "vertices", "answer_layout": "vertices", "effects": ["summary"],
                "out_of_range": "flag", "method": "second_order"}),
        ))
        .await;
    let at = |name: &str| {
        let sections = ready["sections"].as_array().unwrap();
        let section = sections.iter().find(|s| s["name"] == name).unwrap();
        let number = |member: &str| section[member].as_u64().unwrap() as usize;
        number("offset") - HEADER_LEN..number("offset") - HEADER_LEN + number("bytes")
    };
    socket.send(rows(1, 0, &[deep(0.3)])).await;
    let (_, touch, payload) = hear(&mut socket).await;
    let pressure_pa = floats_of(&payload[at("pressure")]);
    let sed = floats_of(&payload[at("vertices")]);
    assert_eq!((pressure_pa.len(), sed.len()), (VERTICES, VERTICES));
    let peak = pressure_pa.iter().copied().fold(0.0, f32::max);
    assert!((peak - touch.pressure_max_pa).abs() <= 1e-3 * peak, "{touch:?}");
    // The test model halves the map, and a vertex lies between four pixels.
    let most = sed.iter().copied().fold(0.0, f32::max);
    assert!(most > 0.9 * GAIN * peak && most <= GAIN * peak, "{most} of {peak}");
    let summary = papilla_proto::Summary::decode(&payload[at("summary")]).unwrap();
    assert!((summary.force_n / touch.force_n[2] - 1.0).abs() < 0.1, "{summary:?} {touch:?}");
    // The map as ever, behind the touch.
    let ready = socket.open(ball_hello(&json!({"out_of_range": "flag"}))).await;
    assert_eq!(ready["sections"][1], json!({"name": "map", "offset": 112, "bytes": 4 * MAP_LEN}));
    socket.send(rows(2, 0, &[deep(0.3)])).await;
    let (_, _, payload) = hear(&mut socket).await;
    let map = floats_of(&payload[TOUCH_LEN..]);
    let most = map.iter().copied().fold(0.0, f32::max);
    assert!(most > 0.9 * GAIN * peak && most <= GAIN * peak, "{most} of {peak}");
}

/// Pressure at the vertices is what the map of it is.
#[tokio::test(flavor = "multi_thread")]
async fn pressure_and_gaps_may_be_told_at_the_vertices() {
    let service = service().await;
    let mut socket = service.socket().await;
    let members = json!({"input_layout": "vertices", "answer_layout": "vertices"});
    socket.open(hello(&members)).await;
    let frame = |sequence: u32, kind, values: &[f32]| {
        let header = FrameHeader::pressure(sequence, 0, 0, SampleType::F32, 1.0);
        let header = header.of_finger(kind, 0, [values.len() as u16, 1]);
        let values = values.iter().flat_map(|v| v.to_le_bytes());
        header.encode().iter().copied().chain(values).collect::<Vec<u8>>()
    };
    socket.send(frame(1, FrameKind::Pressure, &[1000.0; VERTICES])).await;
    let (_, _, payload) = hear(&mut socket).await;
    assert!(floats_of(&payload).iter().all(|s| (s - 1000.0 * GAIN).abs() < 1.0), "{payload:?}");
    let mut bad = [1000.0; VERTICES];
    bad[7] = f32::NAN;
    socket.send(frame(2, FrameKind::Pressure, &bad)).await;
    assert!(
        socket.hear_refusal("not_finite").await["message"].as_str().unwrap().contains("vertex 7")
    );
    let members = json!({"input": "gaps", "input_layout": "vertices", "map": false});
    socket.open(hello(&members)).await;
    let depths: Vec<f32> = atlas()
        .patch(papilla_proto::atlas::Patch::Skin)
        .positions_mm
        .iter()
        .map(|p| 20.0 - (p[0] * p[0] + p[1] * p[1] + 19.7 * 19.7).sqrt())
        .collect();
    socket.send(frame(3, FrameKind::Gaps, &depths)).await;
    let (_, touch, _) = hear(&mut socket).await;
    assert!((touch.force_n[2] / hertz_n(0.3) - 1.0).abs() < 0.1, "{touch:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn fingers_have_slots_and_states_of_their_own() {
    let service = service().await;
    let mut socket = service.socket().await;
    let fingers = json!([{}, {"stiffness": 2.0}, {"width": 1.5}]);
    socket.open(ball_hello(&json!({"map": false, "fingers": fingers}))).await;
    // The same sequence on each finger: none supersedes another, none is stale.
    for finger in 0..3 {
        socket.send(rows(5, finger, &[deep(0.2)])).await;
    }
    let mut found = [0.0; 3];
    for _ in 0..3 {
        let (header, touch, _) = hear(&mut socket).await;
        assert_eq!((header.status, header.sequence), (FrameStatus::Ok, 5));
        found[usize::from(header.finger)] = touch.force_n[2];
    }
    assert!((found[1] / found[0] - 2.0).abs() < 1e-3 && found[2] > 0.0, "{found:?}");
    socket.send(rows(6, 3, &[deep(0.2)])).await;
    assert_eq!(socket.hear_refusal("bad_contact").await["field"], "finger");
    socket.send(rows(5, 0, &[deep(0.2)])).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Stale);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_net_force_is_met() {
    let service = service().await;
    let mut socket = service.socket().await;
    socket.open(ball_hello(&json!({"map": false, "force_target": true}))).await;
    let net = |force_n| Pose { origin_mm: [0.0, 0.0, 1.0], quaternion: [force_n, 0.0, 0.0, 0.0] };
    for (sequence, force) in [(1, 0.03), (2, 0.04)] {
        socket.send(rows(sequence, 0, &[deep(-1.0), net(force)])).await;
        let (_, touch, _) = hear(&mut socket).await;
        assert!((touch.force_n[2] / force - 1.0).abs() < 0.01, "{touch:?}");
        assert!(touch.travel_mm > 1.0, "{touch:?}");
    }
    socket.send(rows(3, 0, &[deep(-1.0), net(0.0)])).await;
    assert_eq!(hear(&mut socket).await.1.force_n.map(f32::to_bits), [0; 3]);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_is_named_and_nobody_else_notices() {
    let service = service().await;
    let (mut good, mut bad) = (service.socket().await, service.socket().await);
    good.open(ball_hello(&json!({"map": false}))).await;
    let sheet = json!({"shape": "mesh",
        "vertices_mm": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0]],
        "triangles": [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]]});
    let crowd = json!({"shape": "mesh", "vertices_mm": [], "triangles": vec![[0, 0, 0]; 30_000]});
    let shape = |shape: Value| json!({"objects": [{"shape": shape}]});
    let refused = [
        (shape(json!({"shape": "sphere", "radius_mm": 0.0})), "bad_contact", "objects[0].shape"),
        (shape(sheet), "bad_contact", "objects[0].shape"),
        (shape(crowd), "bad_contact", "objects[0].shape"),
        (json!({"fingers": []}), "bad_contact", "fingers"),
        (json!({"version": 2}), "unknown_version", "version"),
        (json!({"input": "pressure"}), "bad_contact", "objects"),
    ];
    for (members, code, field) in refused {
        bad.send(ball_hello(&members).to_string()).await;
        assert_eq!(bad.hear_refusal(code).await["field"], field, "{members}");
    }
    bad.open(ball_hello(&json!({"map": false}))).await;
    let nan = Pose { origin_mm: [f32::NAN; 3], ..deep(0.2) };
    let turned = Pose { quaternion: [1.0; 4], ..deep(0.2) };
    let frames = [
        (rows(1, 0, &[nan]), "bad_contact", "objects[0].origin_mm"),
        (rows(2, 0, &[turned]), "bad_contact", "objects[0].quaternion"),
        (rows(3, 0, &[deep(0.2); 2]), "wrong_shape", "width"),
        (rows(4, 9, &[deep(0.2)]), "bad_contact", "finger"),
        (rows(5, 0, &[deep(0.2)])[..HEADER_LEN + POSE_LEN - 1].to_vec(), "wrong_length", "payload"),
    ];
    for (sequence, (frame, code, field)) in (1..).zip(frames) {
        bad.send(frame).await;
        let error = bad.hear_refusal(code).await;
        assert_eq!((&error["field"], &error["sequence"]), (&json!(field), &json!(sequence)));
        good.send(rows(sequence, 0, &[deep(0.2)])).await;
        assert!(hear(&mut good).await.1.force_n[2] > 0.0);
    }
    bad.send(rows(9, 0, &[deep(0.2)])).await;
    assert!(hear(&mut bad).await.1.force_n[2] > 0.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_open_mesh_is_closed_and_the_client_is_told() {
    let service = service().await;
    let mut socket = service.socket().await;
    let corner = |i: u32| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 3.0 } else { -3.0 });
    let vertices: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let sides =
        [[4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5], [0, 2, 3, 1]];
    let triangles = |sides: &[[u32; 4]]| -> Vec<[u32; 3]> {
        sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
    };
    let mut forces = Vec::new();
    for (sides, done) in [(&sides[..], 0), (&sides[..5], 1)] {
        let shape =
            json!({"shape": "mesh", "vertices_mm": vertices, "triangles": triangles(sides)});
        let hello = ball_hello(&json!({"map": false, "objects": [{"shape": shape}]}));
        let ready = socket.open(hello).await;
        let warnings = ready["warnings"].as_array().cloned().unwrap_or_default();
        assert_eq!(warnings.len(), done, "{warnings:?}");
        for warning in warnings {
            assert_eq!(warning["member"], "objects[0].shape");
            let question = warning["question"].as_str().unwrap();
            assert!(question.contains("1 hole was closed"), "{question}");
        }
        let pose = Pose { origin_mm: [0.0, 0.0, -2.8], ..Pose::default() };
        socket.send(rows(1, 0, &[pose])).await;
        forces.push(hear(&mut socket).await.1.force_n.map(f32::to_bits));
    }
    assert_eq!(forces[0], forces[1], "the hole is on the far side");
}

#[tokio::test(flavor = "multi_thread")]
async fn places_for_fingers_are_bounded_and_come_back() {
    let service = service().await;
    let mut socket = service.socket().await;
    let ten: Vec<Value> = vec![json!({}); 10];
    let mut open = Vec::new();
    for _ in 0..6 {
        let mut socket = service.socket().await;
        socket.open(ball_hello(&json!({"map": false, "fingers": ten}))).await;
        open.push(socket);
    }
    socket.send(ball_hello(&json!({"map": false, "fingers": ten})).to_string()).await;
    assert_eq!(socket.hear_refusal("overloaded").await["field"], "fingers");
    socket.open(ball_hello(&json!({"map": false, "fingers": [{}, {}, {}, {}]}))).await;
    // All are taken now. One finger whose pressure comes as a map needs none, further ones do.
    let mut maps = service.socket().await;
    maps.open(hello(&json!({}))).await;
    for members in [json!({"fingers": [{}, {}]}), json!({"input_layout": "vertices"})] {
        maps.send(hello(&members).to_string()).await;
        assert_eq!(maps.hear_refusal("overloaded").await["field"], "fingers", "{members}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_contact_model_objects_are_refused() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.send(ball_hello(&json!({})).to_string()).await;
    let error = socket.hear_refusal("bad_contact").await;
    assert!(error["message"].as_str().unwrap().contains("--contact"), "{error}");
}

/// The models' own is served unasked, another one by name; either has to be of their finger.
#[tokio::test(flavor = "multi_thread")]
async fn a_contact_model_lies_among_the_models_or_is_named() {
    let elsewhere = tempfile::tempdir().unwrap();
    write(elsewhere.path(), "mine.contact", &model());
    let file = elsewhere.path().join("mine.contact");
    let named = |config: &mut papilla_server::Config| config.contact = Some(file.clone());
    let service = Service::on(model_folder_on(&atlas()), named).await.unwrap();
    assert!(service.json("/v1/tiers").await["methods"].is_array());
    let other = model_folder();
    write(other.path(), "finger.contact", &model());
    let error = Service::on(other, |_| ()).await.err().unwrap().to_string();
    assert!(error.contains("finger.contact") && error.contains("atlas"), "{error}");
    let error = Service::on(model_folder(), named).await.err().unwrap().to_string();
    assert!(error.contains("mine.contact") && error.contains("--contact"), "{error}");
}

/// A law that states the same of every answer.
fn law(median: f32) -> Value {
    json!({"median": median.ln(), "bound": 2f32.ln(), "terms": []})
}

/// What was calibrated is stated, in a session that asks for it and of a posted map; all else is not.
#[tokio::test(flavor = "multi_thread")]
async fn an_answer_states_its_error_where_that_was_calibrated() {
    let folder = model_folder_on(&atlas());
    write(folder.path(), "finger.contact", &model());
    let read = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(folder.path().join(name)).unwrap()).unwrap()
    };
    let name = read("index.json")["default"].as_str().unwrap().to_owned();
    let card = read(&format!("{name}.json"));
    let laws = json!({
        "format": 1, "atlas_hash": atlas().hash(),
        "contact_sha256": papilla_session_contact::model_sha256(&model()),
        "networks": [{
            "name": name, "onnx_sha256": card["onnx_sha256"], "given": law(0.05),
            "contact": [{"method": "pixels", "law": law(0.1)}],
        }],
        "force": [{"method": "pixels", "law": law(0.01)}],
    });
    write(folder.path(), "errors.json", laws.to_string().as_bytes());
    let service = Service::on(folder, |_| ()).await.unwrap();
    let mut socket = service.socket().await;
    let asked = |members: Value| {
        let mut hello = ball_hello(&json!({"error_estimate": true, "out_of_range": "flag"}));
        for (name, value) in members.as_object().unwrap() {
            hello[name] = value.clone();
        }
        hello
    };
    let stated = |payload: &[u8]| {
        let ErrorEstimate { sed, force } = ErrorEstimate::decode(&payload[TOUCH_LEN..]).unwrap();
        [sed.median, sed.p90, force.median, force.p90]
    };
    let ready = socket.open(asked(json!({}))).await;
    assert_eq!(ready["sections"][1], json!({"name": "error_estimate", "offset": 112, "bytes": 16}));
    socket.send(rows(1, 0, &[deep(0.05)])).await;
    let (_, touch, payload) = hear(&mut socket).await;
    for (found, due) in stated(&payload).into_iter().zip([0.1, 0.2, 0.01, 0.02]) {
        assert!((found / due - 1.0).abs() < 1e-5, "{found}, {due} is due; {touch:?}");
    }
    socket.send(rows(2, 0, &[deep(-9.0)])).await;
    let (header, _, payload) = hear(&mut socket).await;
    assert_eq!(header.flags, flags::NO_CONTACT);
    assert!(stated(&payload).iter().all(|of| of.is_infinite()));
    // Forces alone: no network is asked.
    socket.open(asked(json!({"map": false}))).await;
    socket.send(rows(3, 0, &[deep(0.05)])).await;
    let (_, _, payload) = hear(&mut socket).await;
    assert!(stated(&payload)[1].is_infinite() && stated(&payload)[3] < 0.021);
    let ball = |members: Value| {
        let mut ball = json!({"shape": {"shape": "sphere", "radius_mm": RADIUS_MM}});
        ball.as_object_mut().unwrap().extend(members.as_object().unwrap().clone());
        json!([ball])
    };
    for members in [
        json!({"method": "second_order"}),
        json!({"objects": ball(json!({"friction": 0.5}))}),
        json!({"objects": ball(json!({"stiffness_mpa_per_mm": 1.0}))}),
        json!({"effects": ["relaxation"]}),
    ] {
        socket.open(asked(members.clone())).await;
        socket.send(rows(4, 0, &[deep(0.05)])).await;
        let (_, touch, payload) = hear(&mut socket).await;
        assert!(stated(&payload).iter().all(|of| of.is_infinite()), "{members} {touch:?}");
    }
    let is_pressed = |i: usize| (100..120).contains(&(i / 224)) && (100..120).contains(&(i % 224));
    let pressure_pa = (0..MAP_LEN).map(|i| if is_pressed(i) { 500.0_f32 } else { 0.0 });
    let map: Vec<u8> = pressure_pa.flat_map(f32::to_le_bytes).collect();
    let answer = service.post("/v1/sed", map).send().await;
    let found: f32 = answer.header("x-papilla-sed-error-p90").unwrap().parse().unwrap();
    assert!((found / 0.1 - 1.0).abs() < 1e-5, "{found}");
}
