//! Lines that are dead or open in one direction.

use std::net::SocketAddr;

use papilla_proto::{MAP_LEN, SampleType};
use serde_json::json;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, copy_bidirectional},
    net::{TcpListener, TcpStream},
    time::{sleep, timeout},
};

use super::{HANG, Neighbour, assert_small_answer, small_frame, small_hello, until_open};
use crate::support::{
    Answer, Service, Socket, bytes_of, frame, hello, ramp,
    raw::{Raw, opcode, ws},
};

/// Passes bytes on until it is told to stop; from then on the line is dead, but neither side
/// hears of it.
async fn relay(to: SocketAddr) -> (SocketAddr, tokio::sync::oneshot::Sender<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
    tokio::spawn(async move {
        let (mut near, _) = listener.accept().await.unwrap();
        let mut far = TcpStream::connect(to).await.unwrap();
        tokio::select! {
            _ = copy_bidirectional(&mut near, &mut far) => {}
            _ = stopped => sleep(10 * HANG).await,
        }
    });
    (address, stop)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_line_that_goes_dead_gives_its_place_back() {
    let two = std::num::NonZeroUsize::new(2).unwrap();
    let service = Service::start_with(|config| {
        config.io_timeout_s = 1;
        config.idle_timeout_s = 2;
        config.max_sessions = two;
    })
    .await;
    let mut neighbour = Neighbour::of(&service).await;
    let (address, stop) = relay(service.address).await;
    let mut far = Socket::connect(address).await.unwrap();
    far.open(hello(&json!({"tier": "slow"}))).await;
    far.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(far.hear_frame().await.0.sequence, 1);
    // With a frame under way, whose answer goes into the dead line.
    far.send(frame(2, 0, SampleType::F32, 1.0, &ramp())).await;
    stop.send(()).unwrap();
    neighbour.is_served().await;
    assert!(Socket::connect(service.address).await.is_err(), "both places are taken");
    neighbour.beside(until_open(service.address, 1)).await;
    let mut next = service.socket().await;
    next.open(hello(&json!({}))).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn half_a_connection_is_none() {
    let service = Service::start().await;
    let mut neighbour = Neighbour::of(&service).await;
    // A post whose sender says at once that it will send no more: a whole answer or none.
    for tier in ["quick", "slow"] {
        let head = format!(
            "POST /v1/sed?tier={tier} HTTP/1.1\r\nhost: localhost\r\ncontent-length: 200704\r\n\r\n"
        );
        let mut stream = TcpStream::connect(service.address).await.unwrap();
        stream.write_all(&[head.as_bytes(), &bytes_of(&ramp())].concat()).await.unwrap();
        stream.shutdown().await.unwrap();
        let mut answer = Vec::new();
        let end = timeout(HANG, stream.read_to_end(&mut answer)).await;
        let _ = end.expect("the connection is still open");
        if !answer.is_empty() {
            let answer = Answer::parse(&answer);
            assert_eq!((answer.status, answer.body.len()), (200, 4 * MAP_LEN));
        }
    }
    // A session whose client will send no more is over, though the client still listens.
    let mut raw = Raw::open(service.address, &small_hello()).await;
    raw.send(&ws(opcode::FINAL | opcode::BINARY, &small_frame(1))).await;
    assert_small_answer(raw.receive().await, 1);
    raw.stream.shutdown().await.unwrap();
    assert!(raw.hear_all().await.iter().all(|(kind, _)| *kind == opcode::CLOSE));
    until_open(service.address, 1).await;
    neighbour.is_served().await;
}
