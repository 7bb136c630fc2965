//! Windows, timings, stale frames, and the effects of the session.

use papilla_proto::{
    FrameHeader, FrameKind, FrameStatus, HEADER_LEN, MAP_LEN, MAP_SIDE_PX, RuntimeEffect,
    SampleType, Summary, Window, flags,
};
use serde_json::{Value, json};

use crate::support::{
    GAIN, PRESSURE_MAX_PA, SED_MAX, Service, Socket, bytes_of, floats_of, hello, ramp,
};

/// A frame with the samples of `window`.
pub(crate) fn windowed(sequence: u32, time_us: u64, window: Window, map: &[f32]) -> Vec<u8> {
    let header = FrameHeader::pressure(sequence, time_us, 0, SampleType::F32, 1.0).windowed(window);
    let mut frame = header.encode().to_vec();
    frame.resize(HEADER_LEN + 4 * window.pixel_count(), 0);
    window.encode(SampleType::F32, map, 1.0, &mut frame[HEADER_LEN..]).unwrap();
    frame
}

fn whole(sequence: u32, map: &[f32]) -> Vec<u8> {
    windowed(sequence, 1000 * u64::from(sequence), Window::WHOLE, map)
}

impl Socket {
    /// The next answer: its header, and the whole message.
    async fn hear_whole(&mut self) -> (FrameHeader, Vec<u8>) {
        let (header, payload) = self.hear_frame().await;
        (header, [&header.encode()[..], &payload].concat())
    }
}

/// 5 kPa on columns 100..=119, rows 60..=69; the test models halve it into SED.
fn patch() -> Vec<f32> {
    let inside =
        |i: usize| (100..120).contains(&(i % MAP_SIDE_PX)) && (60..70).contains(&(i / MAP_SIDE_PX));
    (0..MAP_LEN).map(|i| if inside(i) { 5000.0 } else { 0.0 }).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_answer_says_how_it_fared() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let ready = socket.open(hello(&json!({"tier": "slow"}))).await;
    assert_eq!((&ready["version"], &ready["tier_number"]), (&json!(3), &json!(1)));
    assert_eq!(ready["sections"], json!([{"name": "map", "offset": 48, "bytes": 4 * MAP_LEN}]));
    assert_eq!(ready["session_effects"], json!([]));
    for sequence in 1..=3 {
        socket.send(whole(sequence, &ramp())).await;
    }
    let mut maps = 0;
    for _ in 0..3 {
        let (header, message) = socket.hear_whole().await;
        assert_eq!(header.client_time_us, 1000 * u64::from(header.sequence));
        // The ramp goes to the edge of the map.
        let due = if header.status == FrameStatus::Ok { flags::CUT_OFF } else { 0 };
        assert_eq!((header.tier, header.flags), (1, due));
        if header.status == FrameStatus::Ok {
            maps += 1;
            assert_eq!(header.window(), Window::WHOLE);
            let FrameHeader { queue_us, infer_us, time_us, .. } = header;
            assert!(infer_us > 1000 && queue_us + infer_us <= time_us, "{header:?}");
            let due = bytes_of(&ramp().iter().map(|p| GAIN * p).collect::<Vec<_>>());
            let found = floats_of(&message[HEADER_LEN..]);
            assert!(found.iter().zip(floats_of(&due)).all(|(f, d)| (f - d).abs() < 1e-2));
        } else {
            assert_eq!(header.status, FrameStatus::Superseded);
            assert_eq!((message.len(), header.infer_us), (HEADER_LEN, 0));
        }
    }
    assert!(maps >= 1);
    socket.send(whole(4, &vec![0.0; MAP_LEN])).await;
    let (header, message) = socket.hear_whole().await;
    assert_eq!((header.flags, header.infer_us), (flags::NO_CONTACT, 0));
    assert!(message[HEADER_LEN..].iter().all(|&b| b == 0));
}

#[tokio::test(flavor = "multi_thread")]
async fn stale_frames_are_told_at_once_and_counted() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"stale_after_us": 1_000_000}))).await;
    let mut fare = async |sequence, time_us| {
        socket.send(windowed(sequence, time_us, Window::WHOLE, &ramp())).await;
        let (header, message) = socket.hear_whole().await;
        assert_eq!((header.sequence, header.client_time_us), (sequence, time_us));
        assert_eq!(message.len() > HEADER_LEN, header.status == FrameStatus::Ok);
        header.status
    };
    let minutes = 60_000_000;
    assert_eq!(fare(7, 10 * minutes).await, FrameStatus::Ok);
    assert_eq!(fare(7, 10 * minutes).await, FrameStatus::Stale, "the same number again");
    assert_eq!(fare(6, 10 * minutes).await, FrameStatus::Stale, "an older number");
    assert_eq!(fare(8, 10 * minutes).await, FrameStatus::Ok);
    assert_eq!(fare(9, 9 * minutes).await, FrameStatus::Stale, "a minute on its way");
    assert_eq!(fare(10, 11 * minutes).await, FrameStatus::Ok);
    let stale = r#"papilla_maps_total{transport="session",outcome="stale"}"#;
    assert_eq!(service.metric(stale).await as u64, 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn windows_go_both_ways() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let wish = json!({"effects": ["contact_window"], "contact_window": {"margin_px": 3}});
    socket.open(hello(&wish)).await;
    // A request that is wider than the contact; an answer that is the contact and its margin.
    let sent = Window { x: 90, y: 50, width: 50, height: 30 };
    socket.send(windowed(1, 0, sent, &patch())).await;
    let (header, message) = socket.hear_whole().await;
    let window = Window { x: 97, y: 57, width: 26, height: 16 };
    assert_eq!((header.status, header.window()), (FrameStatus::Ok, window));
    let mut map = vec![f32::NAN; MAP_LEN];
    window.decode(SampleType::F32, &message[HEADER_LEN..], 1.0, &mut map).unwrap();
    assert!(map.iter().zip(patch()).all(|(found, p)| (found - GAIN * p).abs() < 1e-3));
    // Without contact there is nothing to send.
    socket.send(windowed(2, 0, Window::EMPTY, &patch())).await;
    let (header, message) = socket.hear_whole().await;
    assert_eq!((header.window(), message.len()), (Window::EMPTY, HEADER_LEN));
    assert_eq!(header.flags, flags::NO_CONTACT);
    // Errors name the place in the map, not in the window.
    let mut bad = patch();
    bad[61 * MAP_SIDE_PX + 91] = -1.0;
    socket.send(windowed(3, 0, sent, &bad)).await;
    let error = socket.hear_refusal("negative_pressure").await;
    assert!(error["message"].as_str().unwrap().contains("row 61, column 91"), "{error}");
    for (at, bytes, code) in [(32, [200, 0], "wrong_shape"), (12, [49, 0], "wrong_length")] {
        let mut bad = windowed(4, 0, sent, &patch());
        bad[at..at + 2].copy_from_slice(&bytes);
        socket.send(bad).await;
        assert_eq!(socket.hear_refusal(code).await["sequence"], 4);
    }
    let mut old = windowed(5, 0, sent, &patch());
    old[4] = 2;
    socket.send(old).await;
    assert_eq!(socket.hear_refusal("unknown_version").await["field"], "version");
}

#[tokio::test(flavor = "multi_thread")]
async fn sample_types_may_differ_by_direction() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let ready = socket.open(hello(&json!({"answer_sample_type": "u8"}))).await;
    assert_eq!(
        (&ready["sample_type"], &ready["answer_sample_type"]),
        (&json!("f32"), &json!("u8"))
    );
    assert_eq!(ready["sections"][0]["bytes"], MAP_LEN);
    socket.send(whole(1, &ramp())).await;
    let (header, message) = socket.hear_whole().await;
    assert_eq!((header.sample_type, message.len()), (SampleType::U8, HEADER_LEN + MAP_LEN));
    assert!((header.scale - SED_MAX / 255.0).abs() < 1e-3, "the ramp reaches the greatest SED");
    for (unit, p) in message[HEADER_LEN..].iter().zip(ramp()) {
        assert!((f32::from(*unit) * header.scale - GAIN * p).abs() <= 0.51 * header.scale);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn windows_keep_their_precision_however_light_the_touch() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let wish = json!({"answer_sample_type": "u8", "effects": ["contact_window"]});
    socket.open(hello(&wish)).await;
    for (sequence, share) in (1..).zip([1e-6, 5e-4, 1.0]) {
        let map: Vec<f32> = patch().iter().map(|p| share * p).collect();
        socket.send(whole(sequence, &map)).await;
        let (header, _) = socket.hear_whole().await;
        let unit = GAIN * share * 5000.0 / 255.0;
        assert!((header.scale / unit - 1.0).abs() < 1e-5, "{share}: {header:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn pressure_beyond_the_range_is_clamped_and_flagged_unless_the_hello_says_otherwise() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let beyond = vec![3.0 * PRESSURE_MAX_PA; MAP_LEN];
    for (sequence, members, seen) in [
        (1, json!({"effects": ["summary"]}), 1.0),
        (2, json!({"effects": ["summary"], "out_of_range": "clamp"}), 1.0),
        (3, json!({"effects": ["summary"], "out_of_range": "flag"}), 3.0),
    ] {
        socket.open(hello(&members)).await;
        socket.send(whole(sequence, &beyond)).await;
        let (header, message) = socket.hear_whole().await;
        assert_eq!(header.status, FrameStatus::Ok, "{members}");
        assert_ne!(header.flags & flags::OUT_OF_RANGE, 0, "{members}");
        let summary = Summary::decode(&message[HEADER_LEN..]).unwrap();
        assert!((summary.pressure_max_pa / beyond[0] - 1.0).abs() < 1e-6, "as it was sent");
        let sed = floats_of(&message[HEADER_LEN + 64..]);
        assert!(sed.iter().all(|e| (e - GAIN * seen * PRESSURE_MAX_PA).abs() < 1.0), "{members}");
    }
    socket.open(hello(&json!({"out_of_range": "refuse"}))).await;
    socket.send(whole(4, &beyond)).await;
    socket.hear_refusal("out_of_range").await;
    // Each way ends somewhere.
    for (sequence, way, times) in [(5, "flag", 11.0), (6, "clamp", 1.1e4)] {
        socket.open(hello(&json!({"out_of_range": way}))).await;
        socket.send(whole(sequence, &ramp())).await;
        assert_eq!(socket.hear_whole().await.0.flags, flags::CUT_OFF);
        socket.send(whole(sequence + 2, &vec![times * PRESSURE_MAX_PA; MAP_LEN])).await;
        socket.hear_refusal("out_of_range").await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_that_no_press_makes_is_rendered_and_flagged() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    // Squares of `side_px`, as high as what the test models' card knows.
    let board = |side_px: usize| -> Vec<f32> {
        let is_on = |i: usize| (i / 224 / side_px + i % 224 / side_px).is_multiple_of(2);
        let is_rim = |x: usize| x == 0 || x == MAP_SIDE_PX - 1;
        let is_off = |i: usize| is_rim(i / MAP_SIDE_PX) || is_rim(i % MAP_SIDE_PX);
        let pressure_pa = |i| if is_on(i) && !is_off(i) { PRESSURE_MAX_PA } else { 0.0 };
        (0..MAP_LEN).map(pressure_pa).collect()
    };
    for (sequence, (side_px, due)) in [(1, flags::UNFAMILIAR), (8, 0)].into_iter().enumerate() {
        socket.send(whole(sequence as u32, &board(side_px))).await;
        let (header, _) = socket.hear_whole().await;
        assert_eq!((header.status, header.flags), (FrameStatus::Ok, due), "{side_px} px");
        let name = (due > 0).then_some("unfamiliar");
        let answer = service.post("/v1/sed", bytes_of(&board(side_px))).send().await;
        assert_eq!((answer.status, answer.header("x-papilla-flags")), (200, name), "{side_px} px");
    }
    let nothing = service.post("/v1/sed", bytes_of(&vec![0.0; MAP_LEN])).send().await;
    assert_eq!(nothing.header("x-papilla-flags"), Some("no_contact"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_contact_at_the_edge_of_the_atlas_is_flagged_as_cut_off() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    // Twenty rows that end so many before the last one; the test skin is all of the map.
    for (sequence, (before, due)) in (1..).zip([(0, flags::CUT_OFF), (1, 0), (60, 0)]) {
        let rows = MAP_SIDE_PX - 20 - before..MAP_SIDE_PX - before;
        let inside = |i: usize| rows.contains(&(i / MAP_SIDE_PX)) && (90..130).contains(&(i % 224));
        let map: Vec<f32> = (0..MAP_LEN).map(|i| if inside(i) { 5000.0 } else { 0.0 }).collect();
        socket.send(whole(sequence, &map)).await;
        assert_eq!(socket.hear_whole().await.0.flags, due, "{before} rows before the edge");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_can_ask_for_less_than_a_map() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let wish = json!({
        "effects": ["layers", "summary", "points", "actuators"], "map": false,
        "points": [{"px": [110.0, 65.0]}, {"px": [60.0, 90.0]}],
        "actuators": {"radius_mm": 0.3, "gain": 0.0004, "threshold": 500,
                      "actuators": [{"at": {"px": [110.0, 65.0]}}, {"at": {"px": [60, 90]}}]}
    });
    let ready = socket.open(hello(&wish)).await;
    let names: Vec<_> =
        ready["sections"].as_array().unwrap().iter().map(|s| s["name"].clone()).collect();
    assert_eq!(names, ["summary", "points", "actuators"]);
    assert_eq!(ready["session_effects"], json!(["summary", "points", "actuators"]));
    let window = Window { x: 100, y: 60, width: 20, height: 10 };
    socket.send(windowed(1, 0, window, &patch())).await;
    let (header, message) = socket.hear_whole().await;
    assert_eq!((header.window(), message.len()), (Window::EMPTY, 128 + 8));
    let summary = Summary::decode(&message[48..]).unwrap();
    // 200 pixels; the test atlas has 0.1 mm a pixel.
    assert!((summary.contact_area_mm2 - 2.0).abs() < 0.01, "{summary:?}");
    assert!((summary.force_n - 0.01).abs() < 1e-4, "5 kPa on 2 mm2: {summary:?}");
    assert!((summary.sed_max_j_per_m3 - 2500.0).abs() < 0.1, "{summary:?}");
    assert!((summary.sed_u_px - 110.0).abs() < 0.01 && (summary.sed_v_px - 65.0).abs() < 0.01);
    let [near, far] = floats_of(&message[112..120])[..] else { panic!("two points") };
    assert!((near - 2500.0).abs() < 0.1 && far.abs() < 1e-3);
    let [near, far] = floats_of(&message[128..136])[..] else { panic!("two actuators") };
    assert!((near - 0.8).abs() < 1e-3 && far.abs() < 1e-6, "0.0004 (2500 - 500): {near}");
}

#[tokio::test(flavor = "multi_thread")]
async fn drives_of_pins_are_fitted_to_the_sed_of_the_frame() {
    let service = Service::start().await;
    let mut nearest = Vec::new();
    for drive in ["fitted", "corrected"] {
        let mut socket = service.socket().await;
        let pins = json!([{"at": {"px": [110.5, 65.5]}}, {"at": {"px": [60, 90]}}]);
        let wish = json!({
            "effects": ["layers", "actuators"], "map": false,
            "actuators": {"drive": drive, "radius_mm": 0.5, "gain": 1e-6, "actuators": pins}
        });
        socket.open(hello(&wish)).await;
        let window = Window { x: 100, y: 60, width: 20, height: 10 };
        socket.send(windowed(1, 0, window, &patch())).await;
        let message = socket.hear_whole().await.1;
        let [near, far] = floats_of(&message[48..56])[..] else { panic!("two pins") };
        assert!(near > 0.0 && near < 1.0 && far.abs() < 1e-3 * near, "{drive}: {near} {far}");
        socket.send(windowed(2, 0, Window::EMPTY, &[])).await;
        let message = socket.hear_whole().await.1;
        assert_eq!(floats_of(&message[48..56]), [0.0, 0.0], "nothing touches");
        nearest.push(near);
    }
    // The test network's SED is not a half-space's.
    assert!((nearest[0] / nearest[1] - 1.0).abs() > 0.01, "{nearest:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn time_dependent_effects_follow_the_clients_clock() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let wish = json!({
        "effects": ["relaxation", "afferents", "points"], "map": false,
        "points": [{"px": [110.5, 65.5]}],
        "relaxation": {"prony": [{"g": 0.5, "tau_s": 1.0}]},
        "afferents": {"theta_kpa": 0, "k_d_hz_s_per_kpa": 0}
    });
    socket.open(hello(&wish)).await;
    let mut rate = async |sequence, seconds: f64, map: &[f32]| {
        socket.send(windowed(sequence, (1e6 * seconds) as u64, Window::WHOLE, map)).await;
        let (header, message) = socket.hear_whole().await;
        assert_eq!(header.kind, FrameKind::Sed);
        // Points are SED; the next section has their rates.
        let sed = floats_of(&message[48..52])[0];
        let hz = floats_of(&message[64..68])[0];
        assert!((hz - (0.16 * sed).sqrt()).abs() < 1e-3 * hz.max(1.0), "{hz} Hz of {sed} J/m3");
        hz
    };
    // G = 0.5 + 0.5 exp(-t): J = 2 - exp(-t / 2). SED is half the pressure that was filtered.
    let due = |t: f64| (0.16 * 2500.0 * (2.0 - (-0.5 * t).exp())).sqrt();
    for (n, t) in (1..).zip([0.0, 0.011, 1.5, 40.0]) {
        let found = f64::from(rate(n, t, &patch()).await);
        assert!((found - due(t)).abs() < 1e-3 * due(t), "{found}, not {} at {t} s", due(t));
    }
    let after = rate(5, 40.0, &vec![0.0; MAP_LEN]).await;
    assert!(after > 10.0, "what crept is still there: {after}");
    // A new hello begins anew.
    let mut fresh = wish.clone();
    fresh["effects"] = json!(["relaxation", "points"]);
    fresh.as_object_mut().unwrap().remove("afferents");
    let ready = socket.open(hello(&fresh)).await;
    assert_eq!(ready["session_effects"], json!(["relaxation", "points"]));
    socket.send(windowed(6, 50_000_000, Window::WHOLE, &patch())).await;
    let (header, message) = socket.hear_whole().await;
    assert_eq!(header.kind, FrameKind::Sed);
    assert!((floats_of(&message[48..52])[0] - 2500.0).abs() < 1.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn wishes_that_cannot_be_met_are_named() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    for (bad, code, field) in [
        (hello(&json!({"version": 2, "map": false})), "unknown_version", "version"),
        (hello(&json!({"effects": ["friction"]})), "unknown_effect", "effects"),
        (hello(&json!({"effects": ["points"]})), "bad_effect", "points"),
        (
            hello(&json!({"effects": ["points"], "points": [{"px": [1, 1]}]})),
            "bad_effect",
            "points",
        ),
        (hello(&json!({"relaxation": {}})), "bad_effect", "relaxation"),
        (hello(&json!({"effects": ["shear_energy"]})), "bad_effect", "shear_energy"),
    ] {
        socket.send(bad.to_string()).await;
        assert_eq!(socket.hear_refusal(code).await["field"], field);
    }
    socket.open(hello(&json!({"effects": ["finite_strain", "summary"]}))).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn effects_are_listed_with_what_they_cost() {
    let service = Service::start().await;
    let list = service.json("/v1/effects").await;
    let effects = list["effects"].as_array().unwrap();
    let of = |kind: &str| effects.iter().filter(|e| e["of"] == kind).collect::<Vec<_>>();
    assert_eq!(of("session").len(), RuntimeEffect::ALL.len());
    for effect in of("session") {
        // What traction costs is known where there is a contact model.
        let has_cost = effect["name"] != "shear_energy";
        assert_eq!(effect["cost_us"].as_f64().is_some(), has_cost, "{effect}");
        assert!(effect["what"].as_str().is_some_and(|what| what.len() > 20), "{effect}");
    }
    assert_eq!(
        of("tier")[0],
        &json!({"name": "finite_strain", "of": "tier", "tiers": ["quick", "slow"]})
    );
    let service = Service::start_with(|config| config.calibration_ms = 0).await;
    assert_eq!(service.json("/v1/effects").await["effects"][0]["cost_us"], Value::Null);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_contact_pressure_is_looked_at_whoever_uses_it() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    for effects in [json!([]), json!(["summary"])] {
        socket.send(hello(&json!({"effects": effects, "contact_pa": -1.0})).to_string()).await;
        let error = socket.hear_refusal("bad_effect").await;
        assert_eq!(error["field"], "contact_pa", "{error}");
    }
    socket.open(hello(&json!({"contact_pa": 1.0}))).await;
}

/// A client that does not know what presses says so: the answer is zero, and nothing of it is felt.
#[tokio::test(flavor = "multi_thread")]
async fn a_frame_that_is_not_tracked_shows_nothing_and_changes_nothing() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let wish = json!({
        "effects": ["relaxation", "afferents", "points", "summary"], "map": false,
        "points": [{"px": [110.5, 65.5]}],
        "relaxation": {"prony": [{"g": 0.5, "tau_s": 1.0}]},
    });
    socket.open(hello(&wish)).await;
    let mut hear = async |frame: Vec<u8>| {
        socket.send(frame).await;
        let (header, message) = socket.hear_whole().await;
        let summary = Summary::decode(&message[48..]).unwrap();
        let [sed, hz] = [112, 128].map(|at| floats_of(&message[at..at + 4])[0]);
        (header.flags, summary.force_n, sed, hz)
    };
    let press = |n: u32| windowed(n, 10_000 * u64::from(n), Window::WHOLE, &patch());
    for n in 1..100 {
        hear(press(n)).await;
    }
    let (flags_before, force_n, sed, hz) = hear(press(100)).await;
    assert!(flags_before == 0 && force_n > 0.0 && hz > 0.0, "{flags_before} {force_n} {hz}");
    for n in 101..110 {
        let header = FrameHeader::pressure(n, 10_000 * u64::from(n), 0, SampleType::F32, 1.0);
        let (found, force_n, sed, hz) = hear(header.not_tracked().encode().to_vec()).await;
        assert_eq!(found, flags::NOT_TRACKED | flags::NO_CONTACT);
        assert_eq!([force_n, sed, hz].map(f32::to_bits), [0; 3]);
    }
    let (flags_after, found_n, found_sed, found_hz) = hear(press(110)).await;
    assert_eq!(flags_after, 0);
    assert!((found_n - force_n).abs() < 1e-4 * force_n, "{found_n}, not {force_n}");
    // Creep goes on where it was, and no jump is felt.
    assert!((found_sed - sed).abs() < 0.02 * sed, "{found_sed}, not {sed}");
    assert!((found_hz - hz).abs() < 0.05 * hz, "{found_hz}, not {hz}");
}
