//! Several fingers in one service, each with an atlas, a contact model and networks of its own.

mod refusals;
mod reload;
pub(crate) mod support;

use papilla_proto::{
    FrameHeader, FrameStatus, SampleType,
    atlas::{Patch, Raster},
    contact::{TOUCH_LEN, Touch},
    flags,
};
use serde_json::{Value, json};

use self::support::{THUMB_GAIN, add, folder, index, named, service, service_of, thumb_atlas};
use crate::support::{
    GAIN, PRESSURE_MAX_PA, Service, Socket, add_model_of_gain, bytes_of,
    contact::{atlas, atlas_of, ball_hello, deep, rows},
    floats_of, frame, hello, ramp, write,
};

/// The next answer but for what took how long: its flags, and its payload with no time of the solve.
async fn hear(socket: &mut Socket) -> (FrameHeader, Vec<u8>) {
    let (header, mut payload) = socket.hear_frame().await;
    assert_eq!(header.status, FrameStatus::Ok);
    payload[TOUCH_LEN - 4..TOUCH_LEN].fill(0);
    (header, payload)
}

/// What a session of these fingers answers to a ball that goes deeper, finger by finger.
async fn pressed(service: &Service, members: &Value, fingers: u8) -> Vec<Vec<(u8, Vec<u8>)>> {
    let mut socket = service.socket().await;
    let mut more = json!({"shear": true, "method": "second_order", "pressure": "vertices"});
    for (name, value) in members.as_object().unwrap() {
        more[name] = value.clone();
    }
    socket.open(ball_hello(&more)).await;
    let mut answers = vec![Vec::new(); fingers.into()];
    let mut sequence = 0;
    for depth in [0.05, 0.1, 0.15] {
        for finger in 0..fingers {
            sequence += 1;
            socket.send(rows(sequence, finger, &[deep(depth)])).await;
            let (header, payload) = hear(&mut socket).await;
            assert_eq!((header.sequence, header.finger), (sequence, finger));
            answers[usize::from(finger)].push((header.flags, payload));
        }
    }
    answers
}

/// Each finger of a session answers as a service would that has no other: to the bit.
#[tokio::test(flavor = "multi_thread")]
async fn two_fingers_in_one_session_answer_as_each_would_alone() {
    let fingers = folder();
    let service = service(&fingers).await;
    let own = named(&["default", "thumb", "thumb"]);
    let mut announced = own.clone();
    announced["fingers"][2] = json!({"name": "thumb", "width": 1.1, "stiffness": 1.5});
    let together = pressed(&service, &announced, 3).await;
    let default = pressed(&service, &json!({}), 1).await;
    let alone = service_of(&fingers, "thumb").await;
    let thumb = pressed(&alone, &json!({}), 1).await;
    let scaled = json!({"fingers": [{"width": 1.1, "stiffness": 1.5}]});
    let wide = pressed(&alone, &scaled, 1).await;
    for (finger, due) in [&default[0], &thumb[0], &wide[0]].into_iter().enumerate() {
        assert_eq!(together[finger].len(), due.len());
        for (frame, (found, due)) in together[finger].iter().zip(due).enumerate() {
            assert_eq!(found.0, due.0, "flags of finger {finger}, frame {frame}");
            assert!(found.1 == due.1, "finger {finger}, frame {frame}: the answers differ");
        }
    }
    assert_ne!(default, thumb);
    assert_ne!(thumb, wide);
    // A plane twice as stiff pushes back twice as much.
    let force = |answers: &[(u8, Vec<u8>)]| Touch::decode(&answers[2].1).unwrap().force_n[2];
    let ratio = force(&thumb[0]) / force(&default[0]);
    assert!((1.5..2.5).contains(&ratio), "{ratio}");
    assert_eq!(service.metric("papilla_fingers_loaded").await as u64, 2);
    let line = "papilla_stage_seconds_count{tier=\"thumb/own\",stage=\"total\"}";
    assert_eq!(service.metric(line).await as u64, 6);
}

#[tokio::test(flavor = "multi_thread")]
async fn ready_tells_the_terms_of_each_finger() {
    let fingers = folder();
    let service = service(&fingers).await;
    let mut socket = service.socket().await;
    let plain = socket.open(ball_hello(&json!({"fingers": [{}, {"width": 2}]}))).await;
    assert_eq!((&plain["finger_terms"], &plain["tier_names"]), (&Value::Null, &Value::Null));
    let ready = socket.open(ball_hello(&named(&["thumb", "default"]))).await;
    // What is beside them is of the first.
    assert_eq!((&ready["tier"], &ready["fingers"]), (&json!("own"), &json!(2)));
    assert_eq!(ready["atlas_hash"], thumb_atlas().hash());
    let terms = ready["finger_terms"].as_array().unwrap();
    for (terms, (name, tier, hash)) in terms
        .iter()
        .zip([("thumb", "own", thumb_atlas().hash()), ("default", "quick", atlas().hash())])
    {
        let found = (&terms["name"], &terms["tier"], &terms["atlas_hash"], &terms["method"]);
        assert_eq!(found, (&json!(name), &json!(tier), &json!(hash), &json!("pixels")));
        assert_eq!((&terms["trained_on"], &terms["vertices"]), (&Value::Null, &json!(361)));
        // A client finds the name of an answer's tier as it does with a budget.
        let number = terms["tier_number"].as_u64().unwrap() as usize;
        assert_eq!(ready["tier_names"][number], tier);
    }
    for (finger, due) in [(0, "own"), (1, "quick")] {
        socket.send(rows(finger + 1, finger as u8, &[deep(0.1)])).await;
        let (header, _) = hear(&mut socket).await;
        assert_eq!(ready["tier_names"][usize::from(header.tier)], due);
    }
    // One tier by its name, of both.
    let mut hello = ball_hello(&named(&["default", "thumb"]));
    hello["tier"] = json!("quick");
    let ready = socket.open(hello).await;
    let tiers: Vec<&Value> =
        ready["finger_terms"].as_array().unwrap().iter().map(|terms| &terms["tier"]).collect();
    assert_eq!(tiers, ["quick", "quick"]);
}

/// What the networks of the fingers multiply pressure by, on pressure that clients send.
#[tokio::test(flavor = "multi_thread")]
async fn pressure_goes_to_the_network_of_its_finger() {
    let fingers = folder();
    let service = service(&fingers).await;
    let mut socket = service.socket().await;
    let mut hello = hello(&named(&["default", "thumb"]));
    hello["budget_us"] = json!(5_000_000);
    socket.open(hello).await;
    // By the cards the most accurate of each that meets the budget: `slow`, and `own`.
    for (sequence, finger, gain) in [(1, 0_u8, GAIN), (2, 1, THUMB_GAIN), (3, 0, GAIN)] {
        let bytes = frame(sequence, 0, SampleType::F32, 1.0, &ramp());
        let header = FrameHeader { finger, ..FrameHeader::decode(&bytes).unwrap() };
        let whole = [&header.encode()[..], &bytes[header.encode().len()..]].concat();
        socket.send(whole).await;
        let (header, sed) = socket.hear_frame().await;
        assert_eq!((header.finger, header.status), (finger, FrameStatus::Ok));
        let at = 112 * 224 + 112;
        assert!((floats_of(&sed)[at] / ramp()[at] - gain).abs() < 1e-4, "finger {finger}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_finger_answers_over_http_too() {
    let fingers = folder();
    let service = service(&fingers).await;
    let before = service.json("/v1/fingers").await;
    assert_eq!(before["max_loaded"], 8);
    let list = before["fingers"].as_array().unwrap();
    assert_eq!((&list[0]["name"], &list[0]["loaded"]), (&json!("default"), &json!(true)));
    assert_eq!(list[1], json!({"name": "thumb", "loaded": false}));
    let text = std::fs::read(fingers.path().join("thumb/atlas.json")).unwrap();
    let found = service.get("/v1/atlas?finger=thumb").send().await;
    assert_eq!((found.status, found.body), (200, text));
    let after = service.json("/v1/fingers").await;
    let thumb = &after["fingers"][1];
    assert_eq!((&thumb["loaded"], &thumb["contact"]), (&json!(true), &json!(true)));
    assert_eq!(thumb["atlas_hash"], thumb_atlas().hash());
    assert!(thumb["files_bytes"].as_u64().unwrap() > 1000, "{thumb}");
    for (query, default) in [("?finger=thumb", "own"), ("?finger=default", "quick"), ("", "quick")]
    {
        assert_eq!(service.json(&format!("/v1/tiers{query}")).await["default"], default);
        let models = service.json(&format!("/v1/models{query}")).await;
        assert_eq!(models["models"].as_array().unwrap().len(), 2);
        for path in ["/v1/atlas.obj", "/v1/atlas.glb", "/v1/atlas/mask.png"] {
            let answer = service.get(&format!("{path}{query}")).send().await;
            assert_eq!(answer.status, 200, "{path}{query}");
        }
    }
    let at = 112 * 224 + 112;
    for (query, gain) in [("?finger=thumb", THUMB_GAIN), ("?finger=default", GAIN), ("", GAIN)] {
        let sed = service.post(&format!("/v1/sed{query}"), bytes_of(&ramp())).send().await;
        assert!((floats_of(&sed.body)[at] / ramp()[at] - gain).abs() < 1e-4, "{query}");
    }
    for (path, status, code) in [
        ("/v1/atlas?finger=nobody", 404, "not_found"),
        ("/v1/tiers?finger=..%2Fmodels", 404, "not_found"),
        ("/v1/tiers?finger=thumb&finger=thumb", 400, "bad_query"),
        ("/v1/atlas/mask.png?finger=thumb&patch=nail", 400, "bad_query"),
    ] {
        let answer = service.get(path).send().await;
        assert_eq!(
            (answer.status, &answer.json()["error"]["code"]),
            (status, &json!(code)),
            "{path}"
        );
    }
}

/// Whatever tells of a finger tells of the one that is named.
#[tokio::test(flavor = "multi_thread")]
async fn presses_and_effects_are_those_of_the_named_finger() {
    let fingers = folder();
    let service = service(&fingers).await;
    let (of_default, of_thumb) = ("/v1/presses", "/v1/presses?finger=thumb");
    // The default finger's press is not shown for another one.
    assert_eq!(service.json(of_default).await["presses"].as_array().unwrap().len(), 1);
    let none = service.json(of_thumb).await;
    assert_eq!((&none["atlas_hash"], &none["presses"]), (&json!(thumb_atlas().hash()), &json!([])));
    for path in ["/v1/presses/0", "/v1/presses/0/pressure", "/v1/presses/0/sed"] {
        let answer = service.get(&format!("{path}?finger=thumb")).send().await;
        assert_eq!(answer.status, 404, "{path}");
        assert!(answer.text().contains("finger 'thumb' has no press"), "{}", answer.text());
        let answer = service.get(&format!("{path}?finger=nobody")).send().await;
        assert_eq!(answer.json()["error"]["field"], "finger", "{path}");
    }
    // One of its own is.
    let thumb = fingers.path().join("thumb");
    let pixels =
        [Patch::Skin, Patch::Interface].map(|p| Raster::new(&thumb_atlas(), p).pixels().len());
    let state = json!({"name": "own", "depth_mm": 0.5, "pressure_pa": vec![100.0; pixels[0]],
        "sed_j_per_m3": vec![100.0 * THUMB_GAIN; pixels[1]]});
    let replay = |hash: &str| json!({"atlas_hash": hash, "presses": [state]}).to_string();
    write(&thumb, "replay.json", replay(thumb_atlas().hash()).as_bytes());
    assert_eq!(service.post("/v1/admin/reload", "").send().await.status, 200);
    assert_eq!(service.json(of_thumb).await["presses"][0]["name"], "own");
    let sed = service.get("/v1/presses/0/sed?finger=thumb").send().await;
    let greatest = floats_of(&sed.body).into_iter().fold(0.0, f32::max);
    assert!((greatest - 100.0 * THUMB_GAIN).abs() < 1e-3, "{greatest}");
    // One of another atlas is not.
    write(&thumb, "replay.json", replay(atlas().hash()).as_bytes());
    let answer = service.post("/v1/admin/reload", "").send().await;
    assert!(answer.status == 422 && answer.text().contains("replay.json"), "{}", answer.text());

    let tiers = |listed: &Value| -> Vec<Value> {
        let effects = listed["effects"].as_array().unwrap();
        effects.iter().filter(|e| e["of"] == "tier").map(|e| e["tiers"].clone()).collect()
    };
    let own = tiers(&service.json("/v1/effects?finger=thumb").await);
    assert!(
        !own.is_empty() && own.iter().all(|tiers| *tiers == json!(["own", "quick"])),
        "{own:?}"
    );
    let default = tiers(&service.json("/v1/effects").await);
    assert!(default.iter().all(|tiers| *tiers == json!(["quick", "slow"])), "{default:?}");
    let answer = service.get("/v1/effects?finger=nobody").send().await;
    assert_eq!((answer.status, &answer.json()["error"]["code"]), (404, &json!("not_found")));
}

/// A finger that has no network of its own says so: in ready, and with every answer.
#[tokio::test(flavor = "multi_thread")]
async fn similarity_alone_is_never_silent() {
    let fingers = folder();
    // The same pixels on a larger finger, and the network of the default finger.
    let path = fingers.path().join("large");
    add(fingers.path(), "large", &atlas_of(0.15), GAIN);
    add_model_of_gain(&path, "lent", atlas().hash(), 0, 0.1, GAIN);
    let models = json!({"default": "lent", "models": ["lent", "quick"], "trained_on": "default"});
    index(&path, &models);
    let service = service(&fingers).await;
    let mut socket = service.socket().await;
    let mut hello = ball_hello(&named(&["large", "thumb"]));
    let ready = socket.open(hello.clone()).await;
    let terms = &ready["finger_terms"];
    let trained = [&terms[0]["trained_on"], &terms[1]["trained_on"]];
    assert_eq!(trained, [&json!("default"), &Value::Null]);
    // It is the finger's own atlas that the answers are drawn on.
    assert_eq!(terms[0]["atlas_hash"], atlas_of(0.15).hash());
    let warnings = ready["warnings"].as_array().unwrap();
    assert_eq!((warnings.len(), &warnings[0]["member"]), (1, &json!("fingers[0].name")));
    let question = warnings[0]["question"].as_str().unwrap();
    assert!(question.contains("similarity") && question.contains("'large'"), "{question}");
    for (sequence, finger, flag) in [(1, 0, flags::UNFAMILIAR), (2, 1, 0)] {
        socket.send(rows(sequence, finger, &[deep(0.1)])).await;
        let (header, _) = hear(&mut socket).await;
        assert_eq!(header.flags & flags::UNFAMILIAR, flag, "finger {finger}");
    }
    // Its other network is its own.
    hello["tier"] = json!("quick");
    let ready = socket.open(hello).await;
    assert_eq!(
        (&ready["warnings"], &ready["finger_terms"][0]["trained_on"]),
        (&Value::Null, &Value::Null)
    );
    let map = vec![0.5 * PRESSURE_MAX_PA; 224 * 224];
    let answer = service.post("/v1/sed?finger=large", bytes_of(&map)).send().await;
    assert!(answer.header("x-papilla-flags").is_some_and(|flags| flags.contains("unfamiliar")));
    let tiers = service.json("/v1/tiers?finger=large").await;
    let trained: Vec<&Value> =
        tiers["tiers"].as_array().unwrap().iter().map(|tier| &tier["trained_on"]).collect();
    assert_eq!(trained, [&json!("default"), &Value::Null]);
}
