//! Clients that are broken, slow or malicious.

use std::{net::SocketAddr, time::Duration};

use papilla_proto::{FrameHeader, MAP_LEN, SampleType, Window};
use serde_json::json;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
    time::{sleep, timeout},
};
use tokio_tungstenite::tungstenite::Message;

use crate::support::{
    Answer, Service, bytes_of, frame, hello, ramp,
    raw::{Raw, opcode, ws},
    raw_exchange,
};

/// A service that waits for nobody longer than 3 s.
pub(crate) async fn impatient() -> Service {
    Service::start_with(|config| {
        config.io_timeout_s = 1;
        config.idle_timeout_s = 3;
    })
    .await
}

/// The service is none the worse: it still renders.
async fn assert_serves(service: &Service) {
    assert_eq!(service.post("/v1/sed", bytes_of(&ramp())).send().await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn bodies_too_large_are_refused_and_the_client_gets_to_read_why() {
    let service = Service::start().await;
    for bytes in [(2 << 20) + 1, 7 << 20] {
        let answer = service.post("/v1/sed", vec![0; bytes]).send().await;
        answer.assert_refused(413, "too_large");
    }
    // Without a length, in chunks without end: cut off.
    let mut endless =
        b"POST /v1/sed HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\n".to_vec();
    let chunk = [&b"10000\r\n"[..], &vec![0; 65_536], b"\r\n"].concat();
    for _ in 0..400 {
        endless.extend(&chunk);
    }
    raw_exchange(service.address, &endless).await;
    // One that is only announced, and never asked for.
    for path in ["/v1/sed", "/v2/models/quick/infer"] {
        let head = format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\
             content-length: 99999999\r\n"
        );
        for expect in ["expect: 100-continue\r\n", ""] {
            let bytes =
                raw_exchange(service.address, format!("{head}{expect}\r\n").as_bytes()).await;
            assert!(bytes.starts_with(b"HTTP/1.1 413"), "{}", String::from_utf8_lossy(&bytes));
            assert!(String::from_utf8_lossy(&bytes).contains("too_large"), "{path}");
        }
    }
    assert_serves(&service).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn slow_clients_are_dropped() {
    let service = impatient().await;
    // A head that never ends, and one that never begins.
    for start in ["GET /healthz HTTP/1.1\r\nhost", ""] {
        let closed = raw_exchange(service.address, start.as_bytes());
        timeout(Duration::from_secs(120), closed).await.expect("the connection is still open");
    }
    // A body that never ends.
    let head = "POST /v1/sed HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-length: 200704\r\n\r\n1234";
    let answer = Answer::parse(&raw_exchange(service.address, head.as_bytes()).await);
    answer.assert_refused(408, "timeout");
    // A body that breaks off.
    let mut stream = TcpStream::connect(service.address).await.unwrap();
    stream.write_all(head.as_bytes()).await.unwrap();
    drop(stream);
    assert_serves(&service).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_never_reads_is_dropped() {
    let service = impatient().await;
    // Pipelined posts whose answers, 200 kB each, go nowhere.
    let mut stream = TcpStream::connect(service.address).await.unwrap();
    let head = "POST /v1/sed HTTP/1.1\r\nhost: localhost\r\ncontent-length: 200704\r\n\r\n";
    let post = [head.as_bytes(), &bytes_of(&ramp())].concat();
    let flood = async { while stream.write_all(&post).await.is_ok() {} };
    timeout(Duration::from_secs(60), flood).await.expect("the connection is still open");
    // The same in a session.
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    let flood = async {
        let mut sequence = 0;
        while service.metric("papilla_sessions_open").await > 0.5 {
            for _ in 0..8 {
                sequence += 1;
                let frame = frame(sequence, 0, SampleType::F32, 1.0, &ramp());
                let _ = timeout(Duration::from_millis(100), socket.try_send(frame)).await;
            }
        }
    };
    timeout(Duration::from_secs(60), flood).await.expect("the session is still open");
    assert_serves(&service).await;
}

/// It asks for large answers by small frames and has the system's own buffers. 80 kB/s is enough for
/// the system to confirm some bytes every two seconds, and too slow for it to have a third of the
/// service's room free within the three that a client may take.
#[tokio::test(flavor = "multi_thread")]
async fn a_slow_reader_is_waited_for() {
    let service = Service::start_with(|config| config.io_timeout_s = 3).await;
    let terms = json!({"sample_type": "u8", "answer_sample_type": "f32"});
    let mut raw = Raw::open(service.address, &hello(&terms)).await;
    let mut read = vec![0; 8192];
    for sequence in 1..=80 {
        let header = FrameHeader::pressure(sequence, 0, 0, SampleType::U8, 50.0);
        let window = Window { x: 100, y: 100, width: 4, height: 4 };
        let head = header.windowed(window).encode();
        let small: Vec<u8> = head.iter().copied().chain([20; 16]).collect();
        raw.send(&ws(opcode::FINAL | opcode::BINARY, &small)).await;
        let reading = raw.stream.read_exact(&mut read);
        timeout(Duration::from_secs(60), reading)
            .await
            .expect("no answer")
            .expect("it was dropped");
        sleep(Duration::from_millis(100)).await;
    }
    assert!(service.metric("papilla_sessions_open").await > 0.5);
}

#[tokio::test(flavor = "multi_thread")]
async fn noise_is_no_http() {
    let service = Service::start().await;
    for noise in
        [&b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"[..], b"hello\r\n\r\n", &[0; 4096]]
    {
        raw_exchange(service.address, noise).await;
    }
    let long = format!("GET /{} HTTP/1.1\r\nhost: localhost\r\n\r\n", "x".repeat(100_000));
    raw_exchange(service.address, long.as_bytes()).await;
    for path in
        ["/v1/presses/%ff", "/%00", "/../Cargo.toml", "/v1/../../etc/passwd", "//", "/v1/sed/"]
    {
        service.get(path).send().await.assert_refused(404, "not_found");
    }
    assert_serves(&service).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_is_a_websocket() {
    let service = Service::start().await;
    service.get("/v1/session").send().await.assert_refused(426, "upgrade_required");
    let half = service.get("/v1/session").header("upgrade", "websocket").send().await;
    half.assert_refused(426, "upgrade_required");
    for (name, value) in [("sec-websocket-version", "13"), ("upgrade", "websocket")] {
        assert_eq!(half.header(name), Some(value), "RFC 6455 4.4, RFC 9110 15.5.22");
    }
    service.post("/v1/session", "x").send().await.assert_refused(405, "method_not_allowed");
}

#[tokio::test(flavor = "multi_thread")]
async fn silence_instead_of_a_hello_ends_the_session() {
    let service = impatient().await;
    let mut socket = service.socket().await;
    socket.hear_end("timeout", 1008).await;
    assert_serves(&service).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_answers_pings_lives_on_and_one_that_does_not_ends() {
    let service = impatient().await;
    let mut live = service.socket().await;
    live.open(hello(&json!({}))).await;
    let mut dead = service.socket().await;
    dead.open(hello(&json!({}))).await;
    // Reading answers pings; `dead` does not read.
    let _ = timeout(Duration::from_secs(5), live.receive()).await.expect_err("nothing is due");
    live.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    live.hear_frame().await;
    let wait = async {
        while service.metric("papilla_sessions_open").await > 1.5 {
            sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(Duration::from_secs(30), wait).await.expect("the dead session is still open");
    dead.hear_end("timeout", 1008).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_too_large_end_the_session_with_a_word() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    socket.try_send(vec![0_u8; (1 << 20) + 1]).await;
    socket.hear_end("too_large", 1009).await;
    assert_serves(&service).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn noise_in_a_session_harms_nobody_else() {
    let service = Service::start().await;
    let mut other = service.socket().await;
    other.open(hello(&json!({}))).await;
    // Text that is not UTF-8, a reserved opcode, an unmasked frame.
    for noise in
        [&[0x81, 0x82, 0, 0, 0, 0, 0xff, 0xfe][..], &[0x83, 0x80, 0, 0, 0, 0], &[0x82, 0x01, 0x00]]
    {
        let mut stream = TcpStream::connect(service.address).await.unwrap();
        let head = "GET /v1/session HTTP/1.1\r\nhost: localhost\r\nconnection: upgrade\r\nupgrade: websocket\r\n\
            sec-websocket-version: 13\r\nsec-websocket-key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
        stream.write_all(head.as_bytes()).await.unwrap();
        stream.write_all(noise).await.unwrap();
        let mut answer = Vec::new();
        let read = timeout(Duration::from_secs(30), stream.read_to_end(&mut answer));
        let _ = read.await.expect("the connection is still open");
        assert!(answer.starts_with(b"HTTP/1.1 101 "), "{:?}", String::from_utf8_lossy(&answer));
    }
    // A client that vanishes with a frame under way.
    let mut gone = service.socket().await;
    gone.open(hello(&json!({"tier": "slow"}))).await;
    gone.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    drop(gone);
    other.send(frame(2, 0, SampleType::F32, 1.0, &vec![1.0; MAP_LEN])).await;
    assert_eq!(other.hear_frame().await.0.sequence, 2);
    other.send(Message::Ping(vec![1].into())).await;
    other.send(frame(3, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(other.hear_frame().await.0.sequence, 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_leaves_is_no_fault_of_the_service() {
    let service = Service::start().await;
    let count = |outcome: &str| {
        let line = format!("papilla_maps_total{{transport=\"session\",outcome=\"{outcome}\"}}");
        let service = &service;
        async move { service.metric(&line).await }
    };
    let leave = async {
        // The second frame waits for the first, which takes longer than leaving does.
        while count("gone").await + count("error").await < 0.5 {
            let mut gone = service.socket().await;
            gone.open(hello(&json!({"tier": "slow"}))).await;
            for sequence in [1, 2] {
                gone.send(frame(sequence, 0, SampleType::F32, 1.0, &ramp())).await;
            }
            drop(gone);
            while service.metric("papilla_sessions_open").await > 0.5 {
                sleep(Duration::from_millis(20)).await;
            }
            assert_serves(&service).await;
        }
    };
    timeout(Duration::from_secs(120), leave).await.expect("no frame was left behind");
    assert!(count("gone").await > 0.5 && count("error").await < 0.5);
    assert!(service.metric("papilla_errors_total{code=\"internal\"}").await < 0.5);
}

/// What a client sent is repeated to it in part.
#[tokio::test(flavor = "multi_thread")]
async fn long_input_is_cut_in_errors() {
    let service = Service::start().await;
    let long = "x".repeat(5000);
    let map = bytes_of(&ramp());
    let json = format!("{{\"{long}\": 1}}");
    let tensor = json!({"inputs": [{"name": long, "shape": [1], "datatype": "FP32", "data": [1]}]});
    let answers = [
        service.get(&format!("/{long}")),
        service.get(&format!("/v1/{long}")),
        service.get(&format!("/v1/presses/{long}")),
        service.get("/v1/tiers").header("origin", &long),
        service.post(&format!("/v1/sed?tier={long}"), map.clone()),
        service.post(&format!("/v1/sed?tier={}", "a+".repeat(2500)), map.clone()),
        service.post(&format!("/v1/sed?{long}=1"), map.clone()),
        service.post(&format!("/v1/sed?budget_us={long}"), map.clone()),
        service.post(&format!("/v1/sed?pressure_max_pa={long}"), map.clone()),
        service.post("/v1/sed", map.clone()).header("content-type", &long),
        service.post("/v1/sed", json).header("content-type", "application/json"),
        service.get(&format!("/v2/models/{long}")),
        service.get(&format!("/v2/models/quick/versions/{long}")),
        service.post("/v2/models/quick/infer", tensor.to_string()),
        service
            .post("/v2/models/quick/infer", map)
            .header("inference-header-content-length", &long),
        crate::support::Request::new(service.address, &long, "/v1/sed"),
    ];
    for answer in answers {
        let text = answer.send().await.text();
        assert!(!text.contains(&"x".repeat(101)), "{text}");
        assert!(!text.contains(&"a ".repeat(51)), "{text}");
    }
    let mut socket = service.socket().await;
    for members in [
        json!({"tier": long}),
        json!({"effects": [long]}),
        json!({"atlas_hash": long}),
        json!({"sample_type": long}),
        json!({"effects": ["points"], "points": {"names": [long]}}),
    ] {
        socket.send(hello(&members).to_string()).await;
        let error = socket.hear_json().await.to_string();
        assert!(error.contains("\"error\"") && !error.contains(&"x".repeat(101)), "{error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_compressed_body_is_not_taken_for_a_map() {
    let service = Service::start().await;
    let map = || bytes_of(&ramp());
    for coding in ["gzip", "br", "gzip, identity", "x"] {
        let post = service.post("/v1/sed", map()).header("content-encoding", coding).send().await;
        assert_eq!(post.assert_refused(415, "wrong_type").as_deref(), Some("content-encoding"));
        assert_eq!(post.header("accept-encoding"), Some("identity"), "RFC 9110 12.5.3");
        let infer = service.post("/v2/models/quick/infer", map());
        let infer = infer.header("content-encoding", coding).send().await;
        assert_eq!((infer.status, infer.header("x-papilla-code")), (415, Some("wrong_type")));
    }
    let plain = service.post("/v1/sed", map()).header("content-encoding", "Identity").send().await;
    assert_eq!(plain.status, 200);
}

/// Requests of one client, sent ahead of their answers, without end; what comes back is thrown away.
async fn pipeline(address: SocketAddr, request: String) {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let (mut read, mut write) = stream.split();
    let asking = async { while write.write_all(request.as_bytes()).await.is_ok() {} };
    let mut sink = tokio::io::sink();
    let _ = tokio::join!(asking, tokio::io::copy(&mut read, &mut sink));
}

/// Neighbours of clients that ask for large answers without a pause are served all the same.
#[tokio::test(flavor = "multi_thread")]
async fn information_is_not_computed_at_the_cost_of_neighbours() {
    let service = Service::start_with(|config| config.rate_per_s = 0).await;
    for (path, accept) in
        [("/v1/presses/0/sed", "application/json"), ("/v1/atlas.glb", "*/*"), ("/metrics", "*/*")]
    {
        let request = format!("GET {path} HTTP/1.1\r\nhost: localhost\r\naccept: {accept}\r\n\r\n");
        let flood: Vec<_> =
            (0..4).map(|_| tokio::spawn(pipeline(service.address, request.clone()))).collect();
        let neighbour = async {
            for _ in 0..50 {
                assert_eq!(service.get("/healthz").send().await.status, 200);
            }
        };
        timeout(Duration::from_secs(10), neighbour).await.expect("the neighbour waits");
        flood.iter().for_each(tokio::task::JoinHandle::abort);
    }
}

/// A connection that asks ahead of the answers has the rate of one that waits for them.
#[tokio::test(flavor = "multi_thread")]
async fn requests_sent_ahead_count_in_the_rate() {
    let service = Service::start_with(|config| {
        config.rate_per_s = 1;
        config.rate_burst = std::num::NonZeroU32::new(5);
    })
    .await;
    let one = "GET /v1/atlas.obj HTTP/1.1\r\nhost: localhost\r\n\r\n";
    let last = "GET /healthz HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n";
    let answers = raw_exchange(service.address, (one.repeat(100) + last).as_bytes()).await;
    let text = String::from_utf8_lossy(&answers);
    let taken = text.matches("HTTP/1.1 200 ").count();
    assert!((5..50).contains(&taken), "{taken}");
    assert_eq!(text.matches("HTTP/1.1 429 ").count(), 101 - taken);
}
