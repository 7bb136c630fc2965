//! Fingers that change while the service runs.

use std::{fs, time::Duration};

use papilla_proto::{FrameStatus, SampleType};
use serde_json::{Value, json};

use super::support::{THUMB_GAIN, add, folder, index, named, service, service_with, thumb_atlas};
use crate::support::{
    Answer, GAIN, Service, Socket, add_model_of_gain,
    contact::{atlas, atlas_of, ball_hello, deep, rows},
    floats_of, frame, hello, ramp, write,
};

async fn reload(service: &Service) -> Answer {
    service.post("/v1/admin/reload", "").send().await
}

/// What the session's first finger multiplies pressure by.
async fn gain(socket: &mut Socket, sequence: u32) -> f32 {
    socket.send(frame(sequence, 0, SampleType::F32, 1.0, &ramp())).await;
    let (header, sed) = socket.hear_frame().await;
    assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Ok));
    let at = 112 * 224 + 112;
    floats_of(&sed)[at] / ramp()[at]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_finger_is_reloaded_with_the_models_and_sessions_go_on() {
    let fingers = folder();
    let service = service(&fingers).await;
    let path = fingers.path().join("thumb");
    // One that was never named is not looked at.
    assert_eq!(reload(&service).await.json()["fingers"], Value::Null);
    let mut socket = service.socket().await;
    socket.open(hello(&named(&["thumb"]))).await;
    assert!((gain(&mut socket, 1).await - THUMB_GAIN).abs() < 1e-4);

    add_model_of_gain(&path, "own", thumb_atlas().hash(), 0, 0.1, 0.8);
    add_model_of_gain(&path, "new", thumb_atlas().hash(), 0, 0.05, 0.85);
    index(&path, &json!({"default": "own", "models": ["own", "new"]}));
    let answer = reload(&service).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let due = json!({"thumb": {"default": "own", "added": ["new"], "changed": ["own"],
        "removed": ["quick"], "unchanged": []}});
    assert_eq!(answer.json()["fingers"], due);
    assert!((gain(&mut socket, 2).await - 0.8).abs() < 1e-4);
    socket.open(hello(&json!({"fingers": [{"name": "thumb"}], "tier": "new"}))).await;
    assert!((gain(&mut socket, 3).await - 0.85).abs() < 1e-4);

    // Nothing changes if it cannot be served, neither of it nor of the models.
    add_model_of_gain(service.models.path(), "quick", atlas().hash(), 0, 0.2, 0.51);
    let bytes = fs::read(path.join("new.onnx")).unwrap();
    fs::write(path.join("new.onnx"), &bytes[..bytes.len() / 2]).unwrap();
    let answer = reload(&service).await;
    let error = &answer.json()["error"];
    assert_eq!(error["code"], "bad_model");
    let message = error["message"].as_str().unwrap();
    assert!(message.contains("finger 'thumb'") && message.contains("new.onnx"), "{message}");
    assert!((gain(&mut socket, 4).await - 0.85).abs() < 1e-4);
    // Another atlas is another finger, for which open sessions were told nothing.
    add(fingers.path(), "thumb", &atlas_of(0.2), 0.7);
    let answer = reload(&service).await;
    assert!(answer.text().contains("another atlas"), "{}", answer.text());
}

/// New hellos get the contact model that a reload has found; open sessions keep theirs.
#[tokio::test(flavor = "multi_thread")]
async fn a_contact_model_is_reloaded_too() {
    let fingers = folder();
    let service = service(&fingers).await;
    let mut old = service.socket().await;
    let hello = ball_hello(&named(&["thumb"]));
    old.open(hello.clone()).await;
    let force = async |socket: &mut Socket, sequence| {
        socket.send(rows(sequence, 0, &[deep(0.1)])).await;
        let (_, payload) = socket.hear_frame().await;
        papilla_proto::contact::Touch::decode(&payload).unwrap().force_n[2]
    };
    let before = force(&mut old, 1).await;
    let soft = crate::support::contact::model_on(&thumb_atlas(), 0.1);
    write(&fingers.path().join("thumb"), "finger.contact", &soft);
    assert_eq!(reload(&service).await.status, 200);
    assert!((force(&mut old, 2).await / before - 1.0).abs() < 0.01);
    let mut new = service.socket().await;
    new.open(hello).await;
    assert!(force(&mut new, 1).await < 0.5 * before);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_finger_whose_folder_is_gone_serves_its_sessions_and_nobody_else() {
    let fingers = folder();
    let service = service(&fingers).await;
    let mut socket = service.socket().await;
    socket.open(hello(&named(&["thumb"]))).await;
    let away = fingers.path().with_extension("away");
    fs::rename(fingers.path().join("thumb"), &away).unwrap();
    let changes = reload(&service).await.json();
    assert_eq!(changes["fingers"]["thumb"]["removed"], json!(["own", "quick"]));
    assert!((gain(&mut socket, 1).await - THUMB_GAIN).abs() < 1e-4);
    let mut other = service.socket().await;
    other.send(hello(&named(&["thumb"])).to_string()).await;
    other.hear_refusal("bad_contact").await;
    fs::rename(&away, fingers.path().join("thumb")).unwrap();
    let ready = other.open(hello(&named(&["thumb"]))).await;
    // In its old place.
    assert_eq!(ready["tier_number"], 64);
    assert!((gain(&mut other, 1).await - THUMB_GAIN).abs() < 1e-4);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_of_fingers_is_watched() {
    let fingers = folder();
    let service = service_with(&fingers, |config| config.watch_models = true).await;
    let mut socket = service.socket().await;
    socket.open(hello(&named(&["thumb"]))).await;
    add_model_of_gain(&fingers.path().join("thumb"), "own", thumb_atlas().hash(), 0, 0.1, GAIN);
    let found = async {
        for sequence in 1.. {
            if (gain(&mut socket, sequence).await - GAIN).abs() < 1e-4 {
                return;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(60), found).await.expect("nobody has noticed");
}
