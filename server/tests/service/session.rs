//! `GET /v1/session`: hello, ready, frames, and what a session survives.

use std::collections::BTreeMap;

use papilla_proto::{FrameHeader, FrameKind, FrameStatus, HEADER_LEN, MAP_LEN, SampleType, flags};
use serde_json::{Value, json};

use crate::support::{
    GAIN, PRESSURE_MAX_PA, Received, SED_MAX, Service, Socket, assert_rendered, bytes_of, frame,
    hello, ramp,
};

fn outcome(name: &str) -> String {
    format!("papilla_maps_total{{transport=\"session\",outcome=\"{name}\"}}")
}

#[tokio::test(flavor = "multi_thread")]
async fn every_sample_type_renders_within_its_error() {
    let service = Service::start().await;
    let map = ramp();
    for (name, sample_type) in [
        ("f32", SampleType::F32),
        ("f16", SampleType::F16),
        ("u16", SampleType::U16),
        ("u8", SampleType::U8),
    ] {
        let scale =
            if sample_type.is_scaled() { PRESSURE_MAX_PA / sample_type.unit_max() } else { 1.0 };
        let mut socket = service.socket().await;
        let ready = socket.open(hello(&json!({"sample_type": name}))).await;
        assert_eq!(ready["sample_type"], name);
        socket.send(frame(7, 0, sample_type, scale, &map)).await;
        let (header, payload) = socket.hear_frame().await;
        assert_eq!((header.kind, header.status), (FrameKind::Sed, FrameStatus::Ok));
        assert_eq!((header.sequence, header.client_time_us), (7, 1_000_007));
        assert_eq!((header.width, header.height, header.sample_type), (224, 224, sample_type));
        if sample_type.is_scaled() {
            let announced = ready["sed_scale_j_per_m3"].as_f64().unwrap() as f32;
            assert!((announced * sample_type.unit_max() - SED_MAX).abs() < 0.01);
        }
        let mut sed = vec![0.0; MAP_LEN];
        sample_type.decode(&payload, header.scale, &mut sed).unwrap();
        assert_rendered(&map, &sed, |e| {
            // In, times the gain, and out again.
            0.5 * sample_type.error_max(2.0 * e, scale)
                + sample_type.error_max(e, header.scale)
                + 2e-3
        });
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn ready_says_what_was_agreed() {
    let service = Service::start().await;
    let hash = service.json("/v1/atlas").await["hash"].clone();
    let mut socket = service.socket().await;
    let wish =
        json!({"effects": ["layers"], "budget_us": 60_000_000, "tier": null, "atlas_hash": hash});
    let ready = socket.open(hello(&wish)).await;
    assert_eq!(ready["version"], 3);
    assert_eq!(ready["tier"], "slow", "the most accurate tier that meets the budget");
    assert_eq!(ready["effects"], json!(["finite_strain", "layers"]));
    assert_eq!((&ready["width"], &ready["height"]), (&json!(224), &json!(224)));
    assert_eq!(ready["atlas_hash"], hash);
    assert_eq!(ready["budget_us"], 60_000_000);
    assert_eq!(ready["meets_budget"], true);
    assert!(ready["predicted_latency_us"].as_u64().unwrap() > 1000);
    assert!(ready["session"].as_u64().unwrap() > 0);
    // No tier can meet 1 us: the fastest is taken, and said to miss it.
    for (budget_us, meets) in
        [(Value::Null, Value::Null), (json!(0), Value::Null), (json!(1), json!(false))]
    {
        let mut socket = service.socket().await;
        let ready = socket.open(hello(&json!({"budget_us": budget_us}))).await;
        assert_eq!(ready["tier"], "quick", "{budget_us}");
        assert_eq!(ready["meets_budget"], meets, "{budget_us}");
    }
    // A tier by name is taken at its word, with the same warning.
    let mut socket = service.socket().await;
    let ready = socket.open(hello(&json!({"tier": "slow", "budget_us": 1}))).await;
    assert_eq!((&ready["tier"], &ready["meets_budget"]), (&json!("slow"), &json!(false)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_can_change_its_terms() {
    let service = Service::start().await;
    let sessions = async || {
        let tiers = service.json("/v1/tiers").await;
        [0, 1].map(|tier: usize| tiers["tiers"][tier]["sessions"].as_u64().unwrap())
    };
    let mut socket = service.socket().await;
    let first = socket.open(hello(&json!({"tier": "quick"}))).await;
    assert_eq!(sessions().await, [1, 0]);
    let second = socket.open(hello(&json!({"tier": "slow", "sample_type": "u16"}))).await;
    assert_eq!((&second["tier"], &second["session"]), (&json!("slow"), &first["session"]));
    assert_eq!(sessions().await, [0, 1]);
    let scale = PRESSURE_MAX_PA / 65_535.0;
    socket.send(frame(1, 0, SampleType::U16, scale, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Ok);
    let done = r#"papilla_stage_seconds_count{tier="slow",stage="infer"}"#;
    assert_eq!(service.metric(done).await as u64, 1);
    // What cannot be met changes nothing.
    socket.send(hello(&json!({"tier": "nobody"})).to_string()).await;
    socket.hear_refusal("unknown_tier").await;
    socket.send(frame(2, 0, SampleType::U16, scale, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.sequence, 2);
    assert_eq!(sessions().await, [0, 1]);
    drop(socket);
    while sessions().await != [0, 0] {
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hello_that_cannot_be_met_may_be_said_again() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let atlas_hash = "0".repeat(64);
    for (bad, code, field) in [
        (hello(&json!({"version": 2})), "unknown_version", json!("version")),
        (hello(&json!({"tier": "nobody"})), "unknown_tier", json!("tier")),
        (hello(&json!({"effects": ["layers", "summry"]})), "unknown_effect", json!("effects")),
        (hello(&json!({"atlas_hash": atlas_hash})), "atlas_mismatch", json!("atlas_hash")),
        (hello(&json!({"pressure_scale_pa": 0})), "bad_scale", json!("pressure_scale_pa")),
        (hello(&json!({"colour": "red"})), "bad_json", Value::Null),
    ] {
        socket.send(bad.to_string()).await;
        let error = socket.hear_refusal(code).await;
        assert_eq!(error["field"], field, "{error}");
        // Of a misspelt effect all that there are, and the nearest.
        let told = error["message"].as_str().unwrap();
        let listed = told.contains("was 'summary' meant?") && told.contains("spikes");
        assert_eq!(listed, code == "unknown_effect", "{told}");
    }
    // A decimal comma, as programs of a German desktop print it, is no JSON.
    let comma = hello(&json!({"objects": []})).to_string();
    socket.send(comma.replace("[]", r#"[{"radius_mm": 10,5}]"#)).await;
    socket.hear_refusal("bad_json").await;
    socket.open(hello(&json!({}))).await;
    socket.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Ok);
}

#[tokio::test(flavor = "multi_thread")]
async fn hellos_without_end_are_ended() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    for _ in 0..4 {
        socket.send("hello?".to_owned()).await;
        socket.hear_refusal("bad_json").await;
        socket.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
        socket.hear_refusal("unexpected_binary").await;
    }
    socket.hear_end("bad_json", 1008).await;
}

/// Sends `bad`, expects `code` with `sequence`, and that a frame `next` is rendered all the same.
async fn assert_survives(
    socket: &mut Socket,
    bad: Vec<u8>,
    code: &str,
    sequence: Value,
    next: u32,
) {
    socket.send(bad).await;
    let error = socket.hear_refusal(code).await;
    assert_eq!(error.get("sequence").cloned().unwrap_or_default(), sequence, "{error}");
    socket.send(frame(next, 0, SampleType::F32, 1.0, &ramp())).await;
    let (header, payload) = socket.hear_frame().await;
    assert_eq!((header.status, header.sequence), (FrameStatus::Ok, next), "after {code}");
    assert_eq!(payload.len(), 4 * MAP_LEN);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_survives_wrong_frames_and_says_so() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"out_of_range": "refuse"}))).await;
    let good = frame(5, 0, SampleType::F32, 1.0, &ramp());
    let with = |at: usize, bytes: &[u8]| {
        let mut bad = good.clone();
        bad[at..at + bytes.len()].copy_from_slice(bytes);
        bad
    };
    let longer = [&good[..], &vec![0; 100_000]].concat();
    let first = HEADER_LEN + 4;
    for (n, (bad, code, is_named)) in (5..).step_by(2).zip([
        (vec![], "truncated_header", false),
        (good[..47].to_vec(), "truncated_header", true),
        (with(0, b"GIF8"), "bad_magic", false),
        (with(4, &[2]), "unknown_version", true),
        (with(5, &[2]), "wrong_type", true),
        (with(5, &[77]), "wrong_type", true),
        (with(6, &[3]), "wrong_type", true),
        (with(6, &[9]), "wrong_type", true),
        (with(7, &[1]), "wrong_type", true),
        (with(12, &[225]), "wrong_shape", true),
        (with(34, &[1]), "wrong_shape", true),
        (good[..48].to_vec(), "wrong_length", true),
        (good[..good.len() - 1].to_vec(), "wrong_length", true),
        (longer, "wrong_length", true),
        (with(first, &f32::NAN.to_le_bytes()), "not_finite", true),
        (with(first, &f32::INFINITY.to_le_bytes()), "not_finite", true),
        (with(first, &(-1.0_f32).to_le_bytes()), "negative_pressure", true),
        (with(first, &1e6_f32.to_le_bytes()), "out_of_range", true),
    ]) {
        // Each frame is newer than those before it.
        let mut bad = bad;
        if let Some(sequence) = bad.get_mut(8..12) {
            sequence.copy_from_slice(&u32::to_le_bytes(n));
        }
        let sequence = if is_named { json!(n) } else { Value::Null };
        assert_survives(&mut socket, bad, code, sequence, n + 1).await;
    }
    socket.send(r#"{"type":"helo"}"#).await;
    socket.hear_refusal("unexpected_text").await;
    socket.send(frame(99, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.sequence, 99);
    assert_eq!(service.metric(&outcome("error")).await as u64, 18);
}

#[tokio::test(flavor = "multi_thread")]
async fn scales_come_from_the_header_or_the_hello() {
    let service = Service::start().await;
    let map: Vec<f32> = (0..MAP_LEN).map(|i| 2.0 * (i % 256) as f32).collect();
    let unscaled = {
        let mut unscaled = frame(1, 0, SampleType::U8, 2.0, &map);
        unscaled[28..32].fill(0);
        unscaled
    };
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"sample_type": "u8", "pressure_scale_pa": 2.0}))).await;
    for frame in [unscaled.clone(), frame(2, 0, SampleType::U8, 2.0, &map)] {
        socket.send(frame).await;
        let (header, payload) = socket.hear_frame().await;
        let mut sed = vec![0.0; MAP_LEN];
        SampleType::U8.decode(&payload, header.scale, &mut sed).unwrap();
        assert_rendered(&map, &sed, |e| SampleType::U8.error_max(e, header.scale) + 1e-3);
    }
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"sample_type": "u8"}))).await;
    socket.send(unscaled).await;
    assert_eq!(socket.hear_refusal("bad_scale").await["sequence"], 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_keep_their_precision_however_light_the_touch() {
    let service = Service::start().await;
    for (name, sample_type) in [("u8", SampleType::U8), ("u16", SampleType::U16)] {
        let mut socket = service.socket().await;
        socket.open(hello(&json!({"sample_type": name}))).await;
        for (sequence, share) in (1..).zip([1e-6, 5e-4, 0.05, 1.005]) {
            let map: Vec<f32> = ramp().iter().map(|p| share * p).collect();
            let scale = share * PRESSURE_MAX_PA / sample_type.unit_max();
            socket.send(frame(sequence, 0, sample_type, scale, &map)).await;
            let (header, payload) = socket.hear_frame().await;
            let unit = GAIN * scale;
            assert!((header.scale / unit - 1.0).abs() < 1e-5, "{name} {share}: {header:?}");
            let mut sed = vec![0.0; MAP_LEN];
            sample_type.decode(&payload, header.scale, &mut sed).unwrap();
            assert_rendered(&map, &sed, |_| 1.01 * unit);
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_of_zeros_has_a_scale_that_can_be_used() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"sample_type": "u16"}))).await;
    // A pressure whose SED has no unit of its own is nothing.
    for (sequence, value) in [(1, 0.0), (2, 1e-37)] {
        socket.send(frame(sequence, 0, SampleType::U16, 1e-37, &vec![value; MAP_LEN])).await;
        let (header, payload) = socket.hear_frame().await;
        assert_eq!((header.status, header.scale.to_bits()), (FrameStatus::Ok, 1_f32.to_bits()));
        assert!(payload.iter().all(|&byte| byte == 0), "{value}");
    }
}

/// Hears `count` frames; each sequence with its status, and the order of the maps.
async fn hear_all(socket: &mut Socket, count: usize) -> (BTreeMap<u32, FrameStatus>, Vec<u32>) {
    let (mut all, mut maps) = (BTreeMap::new(), Vec::new());
    for _ in 0..count {
        let (header, payload) = socket.hear_frame().await;
        let is_map = header.status == FrameStatus::Ok;
        assert_eq!(payload.len(), if is_map { 4 * MAP_LEN } else { 0 });
        assert!(all.insert(header.sequence, header.status).is_none(), "answered twice");
        if is_map {
            maps.push(header.sequence);
        }
    }
    (all, maps)
}

#[tokio::test(flavor = "multi_thread")]
async fn the_latest_frame_wins() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "slow"}))).await;
    let (mut superseded, mut rendered) = (0, 0);
    // A round whose frames a busy machine brings later than it renders them tells nothing.
    for round in 1..=50 {
        let burst: Vec<u32> = (5 * round - 4..=5 * round).collect();
        let frames = burst.iter().map(|&k| frame(k, 0, SampleType::F32, 1.0, &ramp()));
        socket.send_burst(frames).await;
        let (all, maps) = hear_all(&mut socket, 5).await;
        assert!(all.keys().eq(&burst), "{all:?}");
        assert_eq!(all[&(5 * round)], FrameStatus::Ok);
        let in_vain = all.values().filter(|s| **s == FrameStatus::Superseded).count();
        assert_eq!(in_vain + maps.len(), 5, "{all:?}");
        assert!(maps.is_sorted(), "{maps:?}");
        superseded += in_vain;
        rendered += maps.len();
        assert_eq!(service.metric(&outcome("superseded")).await as usize, superseded);
        assert_eq!(service.metric(&outcome("ok")).await as usize, rendered);
        // One was started before the last came; all between were superseded.
        if in_vain >= 3 {
            return;
        }
    }
    panic!("of 50 bursts of 5 frames none was superseded but for two: {superseded}, {rendered}");
}

#[tokio::test(flavor = "multi_thread")]
async fn late_frames_are_dropped_answered_and_counted() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "slow"}))).await;
    // Over at once; less than any run takes.
    for (sequence, deadline_us) in [(1, 1), (2, 3000)] {
        socket.send(frame(sequence, deadline_us, SampleType::F32, 1.0, &ramp())).await;
        let (header, payload) = socket.hear_frame().await;
        assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Late));
        assert!(payload.is_empty() && header.time_us >= 1);
    }
    let infer = r#"papilla_stage_seconds_count{tier="slow",stage="infer"}"#;
    assert_eq!(service.metric(infer).await as u64, 0, "no work went into late frames");
    assert_eq!(service.metric(&outcome("late")).await as u64, 2);
    // The session's budget stands in where a frame names no deadline.
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "slow", "budget_us": 3000}))).await;
    socket.send(frame(3, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Late);
    socket.send(frame(4, 60_000_000, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Ok);
    // A zero map needs no network: it is in time where no other could be.
    socket.send(frame(5, 500_000, SampleType::F32, 1.0, &vec![0.0; MAP_LEN])).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Ok);
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_beyond_the_bound_are_turned_away() {
    let one = std::num::NonZeroUsize::MIN;
    let service = Service::start_with(|config| config.max_sessions = one).await;
    let mut first = service.socket().await;
    first.open(hello(&json!({}))).await;
    let (status, body) = Socket::connect(service.address).await.err().unwrap();
    assert_eq!((status, &body["error"]["code"]), (503, &json!("overloaded")));
    first.close(None).await;
    while !matches!(first.receive().await, Received::Closed(_)) {}
    let mut second = loop {
        // The place is free a moment after the close.
        match Socket::connect(service.address).await {
            Ok(socket) => break socket,
            Err((status, _)) => assert_eq!(status, 503),
        }
    };
    second.open(hello(&json!({}))).await;
    assert_eq!(service.metric("papilla_sessions_open").await as i64, 1);
    assert_eq!(service.metric("papilla_sessions_total").await as i64, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn many_sessions_share_the_threads_and_keep_to_themselves() {
    let service = Service::start_with(|c| c.threads = std::num::NonZeroUsize::new(2)).await;
    let clients: Vec<_> = (1..=8_u32)
        .map(|client| {
            let address = service.address;
            tokio::spawn(async move {
                let mut socket = Socket::connect(address).await.unwrap();
                socket.open(hello(&json!({}))).await;
                let map = vec![100.0 * client as f32; MAP_LEN];
                for sequence in 0..30 {
                    socket.send(frame(sequence, 0, SampleType::F32, 1.0, &map)).await;
                    let (header, payload) = socket.hear_frame().await;
                    assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Ok));
                    let due = bytes_of(&[50.0 * client as f32]).repeat(MAP_LEN);
                    assert!(payload == due, "client {client} was sent another's map");
                }
            })
        })
        .collect();
    for client in clients {
        client.await.unwrap();
    }
    assert_eq!(service.metric(&outcome("ok")).await as u64, 240);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_header_is_the_documented_one() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    // Written out by hand, as a client in another language would.
    let mut bytes = b"PPL1".to_vec();
    bytes.extend([3, 1, 0, 0]);
    bytes.extend(42_u32.to_le_bytes());
    bytes.extend(224_u16.to_le_bytes());
    bytes.extend(224_u16.to_le_bytes());
    bytes.extend(123_456_789_012_u64.to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(1_f32.to_le_bytes());
    bytes.extend([0; 16]);
    bytes.extend(bytes_of(&ramp()));
    socket.send(bytes).await;
    let (header, _) = socket.hear_frame().await;
    let due = FrameHeader {
        kind: FrameKind::Sed,
        sample_type: SampleType::F32,
        status: FrameStatus::Ok,
        sequence: 42,
        width: 224,
        height: 224,
        client_time_us: 123_456_789_012,
        time_us: header.time_us,
        scale: 1.0,
        x: 0,
        y: 0,
        queue_us: header.queue_us,
        infer_us: header.infer_us,
        tier: 0,
        flags: flags::CUT_OFF,
        finger: 0,
    };
    assert_eq!(header, due);
    assert!(header.time_us > 0 && header.infer_us > 0);
}
