//! Sessions that move: to another service and back to nothing, asked for by age and by a drain.

use std::{io::Write, path::PathBuf};

use papilla_proto::{FrameStatus, MAP_LEN, Window, contact::TOUCH_LEN};
use papilla_server::Config;
use serde_json::{Value, json};
use tempfile::NamedTempFile;

use crate::{
    effects::windowed,
    support::{
        PRESSURE_MAX_PA, Received, Service, Socket, add_model, contact, hello, model_folder,
    },
};

/// A file of one key, and settings that name it.
struct Shared(NamedTempFile);

impl Shared {
    fn new() -> Self {
        let mut file = NamedTempFile::new().unwrap();
        writeln!(file, "{}", "5e".repeat(32)).unwrap();
        Self(file)
    }

    fn configure(&self) -> impl Fn(&mut Config) {
        let file: PathBuf = self.0.path().to_owned();
        move |config| config.state_keys = Some(file.clone())
    }
}

/// A hello whose answers depend on every frame before.
fn creeping() -> Value {
    hello(&json!({"effects": ["relaxation", "afferents", "spikes", "summary"], "reconnect": true}))
}

/// A patch that moves and breathes, Pa.
fn press(sequence: u32) -> Vec<f32> {
    let (step, side) = (sequence as f32, 224);
    let at = |i: usize| [(i % side) as f32 - 100.0 - step, (i / side) as f32 - 90.0];
    let height = 0.6 * PRESSURE_MAX_PA * (0.3 + (0.7 * step).sin().powi(2));
    let pressure = |[x, y]: [f32; 2]| height * (1.0 - (x * x + y * y) / 400.0).max(0.0);
    (0..MAP_LEN).map(|i| pressure(at(i))).collect()
}

/// Sends a frame, and takes what its answer says but for times and the tier's number.
async fn render(socket: &mut Socket, sequence: u32) -> Vec<u8> {
    let time_us = 11_111 * u64::from(sequence);
    socket.send(windowed(sequence, time_us, Window::WHOLE, &press(sequence))).await;
    let (header, payload) = socket.hear_frame().await;
    assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Ok));
    let flags = header.flags;
    [&[flags][..], &payload[..]].concat()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_moved_answers_what_it_would_have_answered() {
    let shared = Shared::new();
    let one = Service::start_with(shared.configure()).await;
    let other = Service::start_with(shared.configure()).await;
    let (mut stays, mut moves) = (one.socket().await, one.socket().await);
    let ready = moves.open(creeping()).await;
    assert_eq!(ready.get("state"), None, "nobody brought one: {ready}");
    stays.open(creeping()).await;
    for sequence in 1..=5 {
        assert_eq!(render(&mut stays, sequence).await, render(&mut moves, sequence).await);
    }
    let sealed = moves.seal().await;
    let mut moved = other.socket().await;
    let ready = moved.resume(creeping(), sealed.clone()).await;
    assert_eq!(ready["state"], "resumed", "{ready}");
    // As much of the map as could move is sealed, and no more.
    assert!((1000..200_000).contains(&sealed.len()), "{} bytes", sealed.len());
    let mut anew = other.socket().await;
    anew.open(creeping()).await;
    let mut differs = 0;
    for sequence in 6..=10 {
        let due = render(&mut stays, sequence).await;
        assert!(render(&mut moved, sequence).await == due, "frame {sequence} is another");
        differs += u32::from(render(&mut anew, sequence).await != due);
    }
    assert_eq!(differs, 5, "the state made no difference");
    // The session that was asked goes on as if nothing had been.
    assert!(render(&mut moves, 6).await != render(&mut moves, 7).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn fingers_that_moved_start_as_warm_as_they_were() {
    let shared = Shared::new();
    let one = contact::service_with(shared.configure()).await;
    let other = contact::service_with(shared.configure()).await;
    for method in ["second_order", "pixels", "coarse_pixels"] {
        let hello = contact::ball_hello(&json!({
            "reconnect": true, "map": false, "pressure": "vertices", "stiffness": true,
            "fingers": [{}, {}], "method": method,
        }));
        stays_and_moves_alike(&one, &other, hello).await;
    }
}

async fn stays_and_moves_alike(one: &Service, other: &Service, hello: Value) {
    let (mut stays, mut moves) = (one.socket().await, one.socket().await);
    stays.open(hello.clone()).await;
    moves.open(hello.clone()).await;
    for sequence in 1..=6 {
        let finger = (sequence % 2) as u8;
        let due = touch(&mut stays, sequence, finger).await;
        assert_eq!(touch(&mut moves, sequence, finger).await, due);
    }
    let mut moved = other.socket().await;
    let ready = moved.resume(hello.clone(), moves.seal().await).await;
    assert_eq!(ready["state"], "resumed", "{ready}");
    for sequence in 7..=14 {
        let finger = (sequence % 2) as u8;
        let due = touch(&mut stays, sequence, finger).await;
        assert!(touch(&mut moved, sequence, finger).await == due, "frame {sequence} is another");
    }
}

/// Sends a pose, and takes what pushes back but for the time of the solve.
async fn touch(socket: &mut Socket, sequence: u32, finger: u8) -> Vec<u8> {
    let depth_mm = 0.25 + 0.2 * (0.9 * sequence as f32).sin();
    socket.send(contact::rows(sequence, finger, &[contact::deep(depth_mm)])).await;
    let (header, mut payload) = socket.hear_frame().await;
    assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Ok));
    payload[TOUCH_LEN - 4..TOUCH_LEN].fill(0);
    payload
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_resumed_starts_anew_and_is_told_why() {
    let shared = Shared::new();
    let one = Service::start_with(shared.configure()).await;
    let stranger = Service::start().await;
    let mut socket = one.socket().await;
    socket.open(creeping()).await;
    let cold = render(&mut socket, 1).await;
    render(&mut socket, 2).await;
    let sealed = socket.seal().await;
    let mut forged = sealed.clone();
    *forged.last_mut().unwrap() ^= 1;
    let mut other_tier = creeping();
    other_tier["tier"] = json!("slow");
    let mut other_effects = creeping();
    other_effects["relaxation"] = json!({"tissue": "skin"});
    for (service, hello, sealed, due) in [
        (&one, creeping(), forged, "unreadable"),
        (&stranger, creeping(), sealed.clone(), "unreadable"),
        (&one, other_tier, sealed.clone(), "other_terms"),
        (&one, other_effects, sealed.clone(), "other_terms"),
    ] {
        let mut anew = service.socket().await;
        let ready = anew.resume(hello, sealed).await;
        assert_eq!(ready["state"], due, "{ready}");
        if ready["tier"] == "quick" && due == "unreadable" {
            assert!(render(&mut anew, 1).await == cold, "{due}: not from nothing");
        }
    }
    let mut plain = one.socket().await;
    plain.open(hello(&json!({"reconnect": true}))).await;
    let nothing = plain.seal().await;
    let mut anew = one.socket().await;
    let ready = anew.resume(hello(&json!({"reconnect": true})), nothing).await;
    assert_eq!(ready["state"], "nothing", "{ready}");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_request_for_a_state_is_answered() {
    let one = Service::start().await;
    let mut socket = one.socket().await;
    let mut hello = creeping();
    hello["tier"] = json!("slow");
    socket.open(hello).await;
    // Both requests come while the frame is rendered, as from a client that gave up on the first.
    socket.send(windowed(1, 11_111, Window::WHOLE, &press(1))).await;
    for _ in 0..2 {
        socket.send(r#"{"type": "seal"}"#).await;
    }
    let (header, _) = socket.hear_frame().await;
    assert_eq!((header.sequence, header.status), (1, FrameStatus::Ok));
    for _ in 0..2 {
        assert!(matches!(socket.receive().await, Received::Sealed(_)), "a sealed state is due");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_left_the_tier_to_the_service_keeps_it() {
    let shared = Shared::new();
    let one = Service::start_with(shared.configure()).await;
    // The default of the other one is another tier.
    let folder = model_folder();
    let hash = crate::support::atlas().hash().to_owned();
    add_model(folder.path(), "spare", &hash, 0, 0.3);
    let index = json!({"default": "spare", "models": ["spare", "quick", "slow"]});
    crate::support::write(folder.path(), "index.json", index.to_string().as_bytes());
    let other = Service::on(folder, shared.configure()).await.unwrap();
    let mut socket = one.socket().await;
    assert_eq!(socket.open(creeping()).await["tier"], "quick");
    let mut moved = other.socket().await;
    let ready = moved.resume(creeping(), socket.seal().await).await;
    assert_eq!((&ready["tier"], &ready["state"]), (&json!("quick"), &json!("resumed")));
    let mut new = other.socket().await;
    assert_eq!(new.open(creeping()).await["tier"], "spare");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_asks_those_who_follow_and_answers_them_meanwhile() {
    let one = Service::start().await;
    let (mut follows, mut does_not) = (one.socket().await, one.socket().await);
    follows.open(creeping()).await;
    does_not.open(hello(&json!({}))).await;
    let drain = tokio::spawn(one.server.drain());
    let ask = follows.hear_json().await;
    // Two thirds of the 15 s that a drain may take.
    assert_eq!(ask, json!({"type": "reconnect", "reason": "drain", "within_ms": 10_000}));
    does_not.hear_end("shutting_down", 1001).await;
    for sequence in 1..=3 {
        render(&mut follows, sequence).await;
    }
    follows.seal().await;
    follows.close(None).await;
    drain.await.unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn who_was_asked_and_stays_is_drained_like_others() {
    let one = Service::start_with(|config| config.drain_timeout_s = 3).await;
    let mut follows = one.socket().await;
    follows.open(creeping()).await;
    let drain = tokio::spawn(one.server.drain());
    assert_eq!(follows.hear_json().await["within_ms"], 2000);
    follows.hear_end("shutting_down", 1001).await;
    drop(follows);
    drain.await.unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn an_old_session_is_asked_again_and_again_but_only_if_it_follows() {
    let one = Service::start_with(|config| config.reconnect_after_s = 1).await;
    let (mut follows, mut does_not) = (one.socket().await, one.socket().await);
    follows.open(creeping()).await;
    does_not.open(hello(&json!({}))).await;
    for _ in 0..2 {
        let ask = follows.hear_json().await;
        assert_eq!(ask, json!({"type": "reconnect", "reason": "age", "within_ms": null}));
    }
    render(&mut follows, 1).await;
    // What it hears next is the answer to its own frame.
    render(&mut does_not, 1).await;
    does_not.send(r#"{"type": "seal"}"#).await;
    does_not.hear_refusal("unexpected_text").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_is_due_after_a_hello_that_announces_one_and_nowhere_else() {
    let one = Service::start().await;
    let mut socket = one.socket().await;
    let announces = hello(&json!({"resume": true}));
    for said in [announces.to_string(), "?".to_owned()] {
        socket.send(announces.to_string()).await;
        socket.send(said).await;
        assert_eq!(socket.hear_refusal("bad_json").await["field"], "resume");
    }
    let ready = socket.resume(hello(&json!({})), b"PPS\x01\x00".to_vec()).await;
    assert_eq!(ready["state"], "unreadable", "{ready}");
    socket.send(announces.to_string()).await;
    assert_eq!(socket.hear_refusal("bad_json").await["field"], "resume");
}
