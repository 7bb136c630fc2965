//! Clients that send without a pause: each as fast as the service lets it, and no neighbour waits.

use std::time::Duration;

use papilla_proto::ErrorCode;
use serde_json::json;
use tokio::time::timeout;

use super::{HANG, Neighbour, small_frame, small_hello};
use crate::support::{
    Running, Service,
    flood::{Flood, Flooding},
    hello, model_folder,
    raw::{HANDSHAKE, Raw, opcode, ws},
};

/// What each flooding client may send, bytes: far more than the service takes from it while it
/// answers a few frames of a neighbour.
const BUDGET_BYTES: u64 = 256 << 20;

const BINARY: u8 = opcode::FINAL | opcode::BINARY;
const TEXT: u8 = opcode::FINAL | opcode::TEXT;

fn in_a_session(opening: &[u8], block: Vec<u8>) -> Flood {
    Flood { opening: [HANDSHAKE.as_bytes(), opening].concat(), block }
}

fn saying_hello(block: Vec<u8>) -> Flood {
    in_a_session(&ws(TEXT, small_hello().to_string().as_bytes()), block)
}

fn windows() -> Flood {
    // Sequences run on, and begin again with the block: old frames are as good a flood.
    saying_hello((1..1000).flat_map(|sequence| ws(BINARY, &small_frame(sequence))).collect())
}

fn pings() -> Flood {
    saying_hello(ws(opcode::FINAL | opcode::PING, b"").repeat(4096))
}

fn pongs_before_the_hello() -> Flood {
    in_a_session(b"", ws(opcode::FINAL | opcode::PONG, b"").repeat(4096))
}

/// Hellos of almost the longest message there may be.
fn hellos() -> Flood {
    let mut hello = hello(&json!({})).to_string();
    hello.pop();
    hello.push_str(&format!(r#","effects":["{}"]}}"#, "x".repeat(1_000_000)));
    saying_hello(ws(TEXT, hello.as_bytes()))
}

/// A message that has begun and never ends, in pieces of nothing.
fn empty_pieces() -> Flood {
    in_a_session(&ws(opcode::BINARY, b""), ws(opcode::CONTINUATION, b"").repeat(4096))
}

/// Requests one behind the other.
fn requests(path: &str) -> Flood {
    let request = format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n");
    Flood { opening: Vec::new(), block: request.repeat(64).into_bytes() }
}

/// A neighbour gets its maps, and a balancer its health, while four clients flood the service.
async fn nobody_waits_beside(flood: Flood) {
    let service = Service::start().await;
    let mut neighbour = Neighbour::of(&service).await;
    let flooding = Flooding::start(service.address, &flood, 4, BUDGET_BYTES);
    flooding.until_under_way().await;
    for _ in 0..4 {
        neighbour.is_served().await;
        // Answered, if only by a refusal: floods of requests come from the same address.
        assert!(matches!(service.get("/healthz").send().await.status, 200 | 429));
    }
    assert!(flooding.is_going_on(), "the neighbour waited until a flood was over");
    timeout(HANG, service.server.drain()).await.expect("the drain waits for the flood").unwrap();
    assert!(flooding.is_going_on(), "the drain waited until a flood was over");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_neighbour_is_served_beside_endless_windows() {
    nobody_waits_beside(windows()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_neighbour_is_served_beside_endless_pings() {
    nobody_waits_beside(pings()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_neighbour_is_served_beside_endless_pongs_before_the_hello() {
    nobody_waits_beside(pongs_before_the_hello()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_neighbour_is_served_beside_endless_hellos() {
    nobody_waits_beside(hellos()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_neighbour_is_served_beside_endless_pieces() {
    nobody_waits_beside(empty_pieces()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_neighbour_is_served_beside_endless_requests() {
    nobody_waits_beside(requests("/v1/atlas.obj")).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_pings_without_end_is_told_and_closed() {
    let service = Service::start().await;
    let mut raw = Raw::open(service.address, &small_hello()).await;
    // A fast measurement of the round trip is no flood.
    for _ in 0..100 {
        raw.send(&ws(opcode::FINAL | opcode::PING, b"")).await;
        assert_eq!(raw.receive().await.unwrap().0, opcode::PONG);
    }
    raw.send(&ws(opcode::FINAL | opcode::PING, b"").repeat(2000)).await;
    let last: Vec<_> =
        raw.hear_all().await.into_iter().filter(|(kind, _)| *kind != opcode::PONG).collect();
    let [(opcode::TEXT, error), (opcode::CLOSE, close)] = &last[..] else { panic!("{last:?}") };
    let error: serde_json::Value = serde_json::from_slice(error).unwrap();
    assert_eq!(error["code"], ErrorCode::RateLimited.as_str(), "{error}");
    assert!(error["message"].as_str().unwrap().contains("control frames a second"), "{error}");
    assert_eq!(close[..2], 1008_u16.to_be_bytes());
}

#[tokio::test(flavor = "multi_thread")]
async fn sigterm_ends_the_service_beside_floods() {
    for flood in [windows(), hellos()] {
        let models = model_folder();
        let mut running = Running::start_with(models.path(), &["--drain-timeout-s", "5"]);
        let flooding = Flooding::start(running.address, &flood, 4, BUDGET_BYTES);
        flooding.until_under_way().await;
        running.signal("TERM");
        let ended = async {
            while running.child.try_wait().unwrap().is_none() {
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(HANG, ended).await.expect("it outlives SIGTERM");
        assert!(flooding.is_going_on(), "it ended with the flood, not with the signal");
    }
}
