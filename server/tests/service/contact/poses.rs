//! Objects in, forces out: how deep, on pixels, on several fingers, by a net force.

use papilla_proto::{
    FrameStatus, MAP_LEN,
    contact::{Pose, TOUCH_LEN},
    flags,
};
use serde_json::json;

use super::{VERTICES, hear};
use crate::support::{
    GAIN, Service,
    contact::{MODULUS_MPA, atlas, ball_hello, deep, hertz_n, model_of, rows, service},
    floats_of, model_folder_on, write,
};

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
