//! Connections that are slow, half there, out of order or many: each ends in time with a word
//! where there is one, and nobody else notices.

use std::{cell::Cell, net::SocketAddr, time::Duration};

use papilla_proto::{FrameHeader, FrameStatus, HEADER_LEN_V2, MAP_LEN, SampleType, Window};
use serde_json::json;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, copy_bidirectional},
    net::{TcpListener, TcpSocket, TcpStream},
    time::{sleep, timeout},
};

use crate::{
    effects::hello_2,
    support::{
        Answer, Running, Service, Socket, assert_rendered, atlas_of_skin, bytes_of, floats_of,
        frame, hello, metric_at, model_folder, model_folder_on, ramp,
        raw::{HANDSHAKE, Raw, opcode, ws},
        raw_exchange,
    },
};

/// Longest wait for what ends within seconds; only a hang takes longer.
const HANG: Duration = Duration::from_secs(60);

async fn impatient() -> Service {
    Service::start_with(|config| {
        config.io_timeout_s = 1;
        config.idle_timeout_s = 3;
    })
    .await
}

/// A session beside the troublemakers. Every frame of it must be rendered.
struct Neighbour {
    socket: Socket,
    sequence: u32,
}

impl Neighbour {
    async fn of(service: &Service) -> Self {
        let mut socket = service.socket().await;
        socket.open(hello(&json!({}))).await;
        Self { socket, sequence: 0 }
    }

    /// Is served for as long as `trouble` lasts, and after it.
    async fn beside<T>(&mut self, trouble: impl Future<Output = T>) -> T {
        let over = Cell::new(false);
        let served = async {
            while !over.get() {
                self.is_served().await;
                sleep(Duration::from_millis(50)).await;
            }
        };
        let trouble = async {
            let result = trouble.await;
            over.set(true);
            result
        };
        let ((), result) = tokio::join!(served, trouble);
        self.is_served().await;
        result
    }

    async fn is_served(&mut self) {
        for _ in 0..5 {
            self.sequence += 1;
            self.socket.send(frame(self.sequence, 0, SampleType::F32, 1.0, &ramp())).await;
            let (header, payload) = self.socket.hear_frame().await;
            assert_eq!((header.sequence, header.status), (self.sequence, FrameStatus::Ok));
            assert_rendered(&ramp(), &floats_of(&payload), |_| 1e-2);
        }
    }
}

/// Waits until so many sessions are open.
async fn until_open(address: SocketAddr, sessions: i64) {
    let wait = async {
        while metric_at(address, "papilla_sessions_open").await as i64 != sessions {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(HANG, wait).await.expect("a dead session is still open");
}

/// A frame of version 2 that carries 5 x 4 pixels of 100 units.
fn small_frame(sequence: u32) -> Vec<u8> {
    let window = Window { x: 60, y: 70, width: 5, height: 4 };
    let header = FrameHeader::pressure(sequence, 0, 0, SampleType::U8, 10.0).windowed(window);
    let mut frame = header.encode().to_vec();
    frame.resize(HEADER_LEN_V2 + 20, 100);
    frame
}

fn small_hello() -> serde_json::Value {
    hello_2(&json!({"sample_type": "u8", "effects": ["contact_window"],
        "contact_window": {"margin_px": 0}}))
}

/// Asserts that a message is the answer to [`small_frame`].
fn assert_small_answer(message: Option<(u8, Vec<u8>)>, sequence: u32) {
    let (kind, message) = message.expect("the session is over");
    assert_eq!(kind, opcode::BINARY, "{}", String::from_utf8_lossy(&message));
    let header = FrameHeader::decode(&message).unwrap();
    assert_eq!((header.status, header.sequence), (FrameStatus::Ok, sequence));
    assert_eq!((header.width, header.height, message.len()), (5, 4, HEADER_LEN_V2 + 20));
}

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
        "POST /v1/sed?pressure_max_pa=5000 HTTP/1.1\r\nhost: t\r\nconnection: close\r\n\
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
    assert_eq!(raw.hear().await.unwrap().0, opcode::TEXT);
    for sequence in 1..4 {
        raw.dribble(&ws(opcode::FINAL | opcode::BINARY, &small_frame(sequence))).await;
        assert_small_answer(raw.hear().await, sequence);
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
        let post = b"POST /v1/sed HTTP/1.1\r\nhost: t\r\ncontent-length: 200704\r\n\r\n";
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
            "POST /v1/sed?tier={tier} HTTP/1.1\r\nhost: t\r\ncontent-length: 200704\r\n\r\n"
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
    assert_small_answer(raw.hear().await, 1);
    raw.stream.shutdown().await.unwrap();
    assert!(raw.hear_all().await.iter().all(|(kind, _)| *kind == opcode::CLOSE));
    until_open(service.address, 1).await;
    neighbour.is_served().await;
}

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
    assert_eq!(raw.hear().await, Some((opcode::PONG, b"there?".to_vec())));
    for piece in whole[1..].chunks(3) {
        raw.send(&ws(opcode::CONTINUATION, piece)).await;
    }
    raw.send(&ws(opcode::FINAL | opcode::CONTINUATION, b"")).await;
    assert_small_answer(raw.hear().await, 7);
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
        let head = format!("POST /v1/sed HTTP/1.1\r\nhost: t\r\n{length}\r\n\r\nabcde");
        let answer = raw_exchange(service.address, head.as_bytes()).await;
        let answer = Answer::parse(&answer);
        assert_eq!(answer.status, 400, "{length}: {}", answer.text());
    }
    // Routes that read no body do not wait for one either.
    let head = "POST /v1/session HTTP/1.1\r\nhost: t\r\ncontent-length: 200704\r\n\r\n";
    let answer = Answer::parse(&raw_exchange(service.address, head.as_bytes()).await);
    assert_eq!(answer.status, 405);
    neighbour.is_served().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn pressure_off_the_skin_is_on_no_finger() {
    let atlas = atlas_of_skin(50.0, 150.0);
    let service = Service::on(model_folder_on(&atlas), |_| ()).await.unwrap();
    let inside = |i: &usize| (50..150).contains(&(i % 224)) && (50..150).contains(&(i / 224));
    let masked: Vec<f32> =
        ramp().into_iter().enumerate().map(|(i, p)| if inside(&i) { p } else { 0.0 }).collect();
    let answer = service.post("/v1/sed", bytes_of(&ramp())).send().await;
    assert_rendered(&masked, &floats_of(&answer.body), |_| 1e-2);
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    socket.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_rendered(&masked, &floats_of(&socket.hear_frame().await.1), |_| 1e-2);
    // A press beside the finger touches nothing, and asks no network.
    let beside: Vec<f32> = (0..MAP_LEN).map(|i| if inside(&i) { 0.0 } else { 9000.0 }).collect();
    let answer = service.post("/v1/sed", bytes_of(&beside)).send().await;
    assert_eq!(answer.header("x-papilla-infer-us"), Some("0"));
    assert!(floats_of(&answer.body).iter().all(|e| e.to_bits() == 0));
    // What is no pressure is refused wherever it lies.
    for (at, value, code) in [
        (0, f32::NAN, "not_finite"),
        (MAP_LEN - 1, -1.0, "negative_pressure"),
        (223, 1e30, "out_of_range"),
    ] {
        let mut bad = masked.clone();
        bad[at] = value;
        service.post("/v1/sed", bytes_of(&bad)).send().await.assert_refused(422, code);
    }
}

/// How many times `clients_come_and_go` reconnects; 10 000 in the long form.
fn reconnects() -> u32 {
    std::env::var("PAPILLA_RECONNECTS").map_or(1000, |n| n.parse().unwrap())
}

/// Connects once and leaves in one of seven ways.
async fn come_and_go(address: SocketAddr, n: u32) {
    if n.is_multiple_of(7) {
        // Half a handshake.
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(&HANDSHAKE.as_bytes()[..40]).await.unwrap();
        return;
    }
    let mut socket = loop {
        match Socket::connect(address).await {
            Ok(socket) => break socket,
            // The places of those that just left are given back in a moment.
            Err((status, _)) => assert_eq!(status, 503),
        }
        sleep(Duration::from_millis(1)).await;
    };
    if n % 7 == 1 {
        return;
    }
    socket.open(hello(&json!({"sample_type": "u8"}))).await;
    match n % 7 {
        2 => {}
        3 => socket.close(None).await,
        4 => socket.send(frame(1, 0, SampleType::U8, 30.0, &ramp())).await,
        5 => {
            socket.send(frame(1, 0, SampleType::U8, 30.0, &ramp())).await;
            assert_eq!(socket.hear_frame().await.0.sequence, 1);
            socket.close(None).await;
        }
        _ => {
            for sequence in 0..3 {
                socket.send(frame(sequence, 0, SampleType::U8, 30.0, &ramp())).await;
            }
        }
    }
}

/// `PAPILLA_RECONNECTS=10000 cargo test --release -p papilla-server clients_come_and_go`
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn clients_come_and_go_and_nothing_of_them_stays() {
    let models = model_folder();
    let running = Running::start(models.path());
    let address = running.address;
    let settled = async || {
        until_open(address, 0).await;
        // The one that asks is counted too.
        let wait = async {
            while metric_at(address, "papilla_connections_open").await > 1.5 {
                sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(HANG, wait).await.expect("a connection is still open");
        let fds = metric_at(address, "process_open_fds").await;
        (fds, metric_at(address, "process_resident_memory_bytes").await)
    };
    for n in 0..210 {
        come_and_go(address, n).await;
    }
    let (fds, bytes) = settled().await;
    for n in 0..reconnects() {
        come_and_go(address, n).await;
    }
    let (fds_after, bytes_after) = settled().await;
    println!("{fds} and {fds_after} descriptors, {bytes} and {bytes_after} bytes");
    assert!(fds_after <= fds, "{fds} descriptors became {fds_after}");
    // A session takes 1.2 MB; one in a hundred that stayed would show.
    assert!(bytes_after - bytes < 12e6, "{bytes} bytes became {bytes_after}");
    let opened = metric_at(address, "papilla_sessions_total").await;
    // A client that leaves before the answer to its handshake may never become a session.
    let due = f64::from(210 + reconnects());
    assert!((0.7 * due..due).contains(&opened), "{opened} sessions of {due} connections");
    let mut socket = Socket::connect(address).await.unwrap();
    socket.open(hello(&json!({}))).await;
    socket.send(frame(9, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Ok);
}
