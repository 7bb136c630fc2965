//! Messages after the end, in pieces, against the protocol, or of contradicting lengths.

use tokio::io::AsyncWriteExt;

use super::{Neighbour, assert_small_answer, small_frame, small_hello, until_open};
use crate::support::{
    Answer, Service,
    raw::{Raw, opcode, ws},
    raw_exchange,
};

#[tokio::test(flavor = "multi_thread")]
async fn frames_after_a_close_are_not_rendered() {
    let service = Service::start().await;
    let mut neighbour = Neighbour::of(&service).await;
    let mut raw = Raw::open(service.address, &small_hello()).await;
    raw.send(&ws(opcode::FINAL | opcode::CLOSE, &1000_u16.to_be_bytes())).await;
    for sequence in 1..50 {
        let bytes = ws(opcode::FINAL | opcode::BINARY, &small_frame(sequence));
        // Err: the server has closed already.
        if raw.stream.write_all(&bytes).await.is_err() {
            break;
        }
    }
    let heard = raw.hear_all().await;
    assert!(heard.iter().all(|(kind, _)| *kind == opcode::CLOSE), "{heard:?}");
    until_open(service.address, 1).await;
    let ok = r#"papilla_maps_total{transport="session",outcome="ok"}"#;
    assert!(service.metric(ok).await < 0.5, "a frame after the close was rendered");
    neighbour.is_served().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_in_pieces_are_messages() {
    let service = Service::start().await;
    let mut raw = Raw::open(service.address, &small_hello()).await;
    let whole = small_frame(7);
    // A ping between two pieces is allowed, and answered at once.
    raw.send(&ws(opcode::BINARY, &whole[..1])).await;
    raw.send(&ws(opcode::FINAL | opcode::PING, b"there?")).await;
    assert_eq!(raw.receive().await, Some((opcode::PONG, b"there?".to_vec())));
    for piece in whole[1..].chunks(3) {
        raw.send(&ws(opcode::CONTINUATION, piece)).await;
    }
    raw.send(&ws(opcode::FINAL | opcode::CONTINUATION, b"")).await;
    assert_small_answer(raw.receive().await, 7);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_websocket_ends_the_session_with_the_code_for_it() {
    let service = Service::start().await;
    let mut neighbour = Neighbour::of(&service).await;
    let last = |first: u8| opcode::FINAL | first;
    let cases: [(&str, Vec<u8>); 9] = [
        ("a continuation of nothing", ws(last(opcode::CONTINUATION), b"x")),
        (
            "a message in a message",
            [ws(opcode::BINARY, b"x"), ws(last(opcode::BINARY), b"y")].concat(),
        ),
        ("a ping in pieces", ws(opcode::PING, b"x")),
        ("a ping too long", ws(last(opcode::PING), &[0; 126])),
        ("a reserved kind", ws(last(3), b"x")),
        ("a reserved bit", ws(last(opcode::BINARY) | 0x40, b"x")),
        ("no mask", vec![last(opcode::BINARY), 1, b'x']),
        ("a close code in one byte", ws(last(opcode::CLOSE), b"x")),
        ("half a frame", vec![last(opcode::BINARY), 0x80 | 5, 0, 0]),
    ];
    for (what, bytes) in cases {
        let mut raw = Raw::open(service.address, &small_hello()).await;
        raw.send(&bytes).await;
        let heard = if what == "half a frame" {
            raw.stream.shutdown().await.unwrap();
            raw.hear_all().await
        } else {
            raw.hear_all().await
        };
        match heard.last() {
            Some((opcode::CLOSE, reason)) => {
                assert_eq!(reason[..2], 1002_u16.to_be_bytes(), "{what}: {reason:?}");
            }
            None => assert_eq!(what, "half a frame", "{what} ended without a word"),
            other => panic!("{what}: {other:?}"),
        }
        neighbour.is_served().await;
    }
    // Lengths that no memory could hold, and messages that grow piece by piece.
    let huge = [&[last(opcode::BINARY), 0x80 | 127][..], &(1_u64 << 62).to_be_bytes(), &[0; 4]];
    let piece = [
        ws(opcode::BINARY, &vec![0; 60_000]),
        ws(opcode::CONTINUATION, &vec![0; 60_000]).repeat(20),
    ];
    for bytes in [huge.concat(), piece.concat()] {
        let mut raw = Raw::open(service.address, &small_hello()).await;
        let _ = raw.stream.write_all(&bytes).await;
        let heard = raw.hear_all().await;
        let text = String::from_utf8_lossy(&heard[0].1).into_owned();
        assert!(text.contains("\"code\":\"too_large\""), "{text}");
        assert_eq!(heard.last().unwrap().1[..2], 1009_u16.to_be_bytes());
        neighbour.is_served().await;
    }
    until_open(service.address, 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn lengths_that_contradict_each_other_are_refused() {
    let service = Service::start().await;
    let mut neighbour = Neighbour::of(&service).await;
    for length in [
        "content-length: 99999999999999999999",
        "content-length: -1",
        "content-length: 4\r\ncontent-length: 5",
        "transfer-encoding: chunked\r\n\r\nffffffffffffffffff",
        "transfer-encoding: chunked\r\n\r\n-1",
    ] {
        let head = format!("POST /v1/sed HTTP/1.1\r\nhost: localhost\r\n{length}\r\n\r\nabcde");
        let answer = raw_exchange(service.address, head.as_bytes()).await;
        let answer = Answer::parse(&answer);
        assert_eq!(answer.status, 400, "{length}: {}", answer.text());
    }
    // Routes that read no body do not wait for one either.
    let head = "POST /v1/session HTTP/1.1\r\nhost: localhost\r\ncontent-length: 200704\r\n\r\n";
    let answer = Answer::parse(&raw_exchange(service.address, head.as_bytes()).await);
    assert_eq!(answer.status, 405);
    neighbour.is_served().await;
}
