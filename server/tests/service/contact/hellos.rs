//! What a hello may ask for, what is mended of it, and what is refused by name.

use papilla_proto::HEADER_LEN;
use papilla_proto::contact::{POSE_LEN, Pose};
use serde_json::{Value, json};

use super::hear;
use crate::support::{
    Service,
    contact::{atlas, ball_hello, deep, model, rows, service},
    hello, model_folder, model_folder_on, write,
};

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
