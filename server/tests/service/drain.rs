//! The end of the service: nothing that was accepted stays unanswered.

use std::time::Duration;

use papilla_proto::{FrameStatus, SampleType};
use serde_json::json;
use tokio::{net::TcpStream, time::sleep};

use crate::support::{Received, Service, bytes_of, frame, hello, ramp};

#[tokio::test(flavor = "multi_thread")]
async fn accepted_work_is_answered_and_sessions_are_told() {
    let service = Service::start().await;
    let mut busy = service.socket().await;
    busy.open(hello(&json!({"tier": "slow"}))).await;
    let mut idle = service.socket().await;
    idle.open(hello(&json!({}))).await;
    let mut new = service.socket().await;
    let posts =
        [1, 2].map(|_| tokio::spawn(service.post("/v1/sed?tier=slow", bytes_of(&ramp())).send()));
    // Both are accepted once one waits for the other, or both were answered.
    while service.metric("papilla_queue_length").await < 0.5
        && !posts.iter().all(|p| p.is_finished())
    {
        sleep(Duration::from_millis(5)).await;
    }
    let mapped = |sequence| frame(sequence, 0, SampleType::F32, 1.0, &ramp());
    let early = busy.send_until_taken([mapped(1), mapped(2)]).await;
    let address = service.address;
    let drain = tokio::spawn(service.server.drain());

    idle.hear_end("shutting_down", 1001).await;
    new.hear_end("shutting_down", 1001).await;
    let mut headers = early;
    while headers.len() < 2 {
        headers.push(busy.hear_frame().await.0);
    }
    let mut answered = Vec::new();
    for header in headers {
        assert!(matches!(header.status, FrameStatus::Ok | FrameStatus::Superseded), "{header:?}");
        answered.push(header.sequence);
    }
    answered.sort_unstable();
    assert_eq!(answered, [1, 2]);
    busy.hear_end("shutting_down", 1001).await;
    for post in posts {
        assert_eq!(post.await.unwrap().status, 200);
    }
    drain.await.unwrap().unwrap();
    assert!(TcpStream::connect(address).await.is_err(), "the port is still open");
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_that_come_during_the_drain_are_refused_by_name() {
    for _ in 0..20 {
        if is_refused_by_name().await {
            return;
        }
    }
    panic!("twenty drains ended before a second frame came");
}

/// Sends a frame while the drain waits for the one before it; false if that ended too soon.
async fn is_refused_by_name() -> bool {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "slow"}))).await;
    let slow = frame(1, 0, SampleType::F32, 1.0, &ramp());
    if !socket.send_until_taken([slow]).await.is_empty() {
        return false;
    }
    let drain = tokio::spawn(service.server.drain());
    sleep(Duration::from_millis(20)).await;
    socket.send(frame(2, 0, SampleType::F32, 1.0, &ramp())).await;
    // The answer to the first and the refusal of the second, whichever is sooner.
    let (mut refused, mut answered) = (0, 0);
    for _ in 0..2 {
        match socket.receive().await {
            Received::Json(problem) => {
                assert_eq!(problem["code"], "shutting_down");
                if problem["sequence"].is_null() {
                    return false;
                }
                assert_eq!(problem["sequence"], 2);
                refused += 1;
            }
            Received::Frame(header, _) => {
                assert_eq!((header.sequence, header.status), (1, FrameStatus::Ok));
                answered += 1;
            }
            Received::Sealed(_) => panic!("nobody asked for a state"),
            Received::Closed(code) => panic!("closed with {code:?} before both were answered"),
        }
    }
    assert_eq!((refused, answered), (1, 1));
    socket.hear_end("shutting_down", 1001).await;
    drain.await.unwrap().unwrap();
    true
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_kept_alive_does_not_hold_up_the_drain() {
    let service = Service::start().await;
    let _idle = TcpStream::connect(service.address).await.unwrap();
    sleep(Duration::from_millis(20)).await;
    service.server.drain().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_that_takes_too_long_says_so() {
    let service = Service::start_with(|config| config.drain_timeout_s = 0).await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "slow"}))).await;
    socket.send_until_taken([frame(1, 0, SampleType::F32, 1.0, &ramp())]).await;
    let error = service.server.drain().await.unwrap_err();
    assert!(error.to_string().contains("0 s"), "{error}");
}
