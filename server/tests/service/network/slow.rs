//! A byte at a time, without end, or never read.

use std::time::Duration;

use papilla_proto::{MAP_LEN, SampleType};
use serde_json::json;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpSocket, TcpStream},
    time::{sleep, timeout},
};

use super::{HANG, Neighbour, assert_small_answer, small_frame, small_hello, until_open};
use crate::{
    hostile::impatient,
    support::{
        Answer, Service, Socket, assert_rendered, floats_of, frame, hello, metric_at, ramp,
        raw::{HANDSHAKE, Raw, opcode, ws},
    },
};

#[tokio::test(flavor = "multi_thread")]
async fn a_byte_at_a_time_is_slow_but_right() {
    let service = Service::start().await;
    let mut neighbour = Neighbour::of(&service).await;
    // A whole post: head and body, a gray PNG of one colour.
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 224, 224);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&vec![255; MAP_LEN]).unwrap();
    let head = format!(
        "POST /v1/sed?pressure_max_pa=5000 HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\
         content-type: image/png\r\ncontent-length: {}\r\n\r\n",
        png.len()
    );
    let mut stream = TcpStream::connect(service.address).await.unwrap();
    stream.set_nodelay(true).unwrap();
    for byte in [head.as_bytes(), &png].concat() {
        stream.write_all(&[byte]).await.unwrap();
    }
    let mut answer = Vec::new();
    timeout(HANG, stream.read_to_end(&mut answer)).await.unwrap().unwrap();
    let answer = Answer::parse(&answer);
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_rendered(&vec![5000.0; MAP_LEN], &floats_of(&answer.body), |_| 1e-2);
    // A whole session: handshake, hello, frames.
    let mut raw = Raw { stream: TcpStream::connect(service.address).await.unwrap() };
    raw.stream.set_nodelay(true).unwrap();
    raw.dribble(HANDSHAKE.as_bytes()).await;
    let mut head = vec![0; 4];
    while !head.ends_with(b"\r\n\r\n") {
        head.push(raw.stream.read_u8().await.unwrap());
    }
    raw.dribble(&ws(opcode::FINAL | opcode::TEXT, small_hello().to_string().as_bytes())).await;
    assert_eq!(raw.receive().await.unwrap().0, opcode::TEXT);
    for sequence in 1..4 {
        raw.dribble(&ws(opcode::FINAL | opcode::BINARY, &small_frame(sequence))).await;
        assert_small_answer(raw.receive().await, sequence);
    }
    neighbour.is_served().await;
}

/// Sends `start` and then a byte every 50 ms for as long as it is let; what came back.
async fn drip(mut stream: TcpStream, start: &[u8]) -> Vec<u8> {
    stream.write_all(start).await.unwrap();
    let (mut reader, mut writer) = stream.into_split();
    let drip = tokio::spawn(async move {
        while writer.write_all(b"x").await.is_ok() {
            sleep(Duration::from_millis(50)).await;
        }
    });
    let mut answer = Vec::new();
    let end = timeout(HANG, reader.read_to_end(&mut answer)).await;
    let _ = end.expect("the connection is still open");
    timeout(HANG, drip).await.expect("bytes are still taken").unwrap();
    answer
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dribble_without_end_is_ended() {
    let service = impatient().await;
    let mut neighbour = Neighbour::of(&service).await;
    // Never silent for long, never done: a head, a body, the frame of a session.
    let connect = || TcpStream::connect(service.address);
    let trouble = async {
        drip(connect().await.unwrap(), b"GET /healthz HTTP/1.1\r\nx: ").await;
        let post = b"POST /v1/sed HTTP/1.1\r\nhost: localhost\r\ncontent-length: 200704\r\n\r\n";
        let answer = drip(connect().await.unwrap(), post).await;
        Answer::parse(&answer).assert_refused(408, "timeout");
        let raw = Raw::open(service.address, &hello(&json!({}))).await;
        let start = [opcode::FINAL | opcode::BINARY, 0x80 | 126, 0xff, 0xff, 0, 0, 0, 0];
        let heard = drip(raw.stream, &start).await;
        let heard = String::from_utf8_lossy(&heard);
        assert!(heard.contains("\"code\":\"timeout\""), "{heard}");
    };
    neighbour.beside(trouble).await;
    until_open(service.address, 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_reads_too_slowly_is_dropped_and_holds_up_nobody() {
    let service = impatient().await;
    let mut neighbour = Neighbour::of(&service).await;
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(4096).unwrap();
    let stream = socket.connect(service.address).await.unwrap();
    let mut slow = Socket::over(stream).await;
    slow.open(hello(&json!({}))).await;
    until_open(service.address, 2).await;
    // It never reads again; its answers pile up in the system's buffers and then nowhere.
    let flood = async {
        for sequence in 0.. {
            let frame = frame(sequence, 0, SampleType::F32, 1.0, &ramp());
            if timeout(Duration::from_millis(200), slow.try_send(frame)).await.is_err() {
                break;
            }
            if metric_at(service.address, "papilla_sessions_open").await < 1.5 {
                break;
            }
        }
        until_open(service.address, 1).await;
    };
    timeout(HANG, neighbour.beside(flood)).await.expect("somebody waits");
}
