//! What answers hold, how they are laid out, and what is counted of them.

use papilla_proto::{
    ErrorEstimate, FrameHeader, FrameKind, HEADER_LEN, MAP_LEN, SampleType, contact::TOUCH_LEN,
    flags,
};
use serde_json::{Value, json};

use super::{VERTICES, hear};
use crate::support::{
    GAIN, Service,
    contact::{RADIUS_MM, atlas, ball_hello, deep, hertz_n, model, rows, service},
    floats_of, frame, hello, model_folder_on, write,
};

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
