//! The memory that bodies and messages can claim, against the sum that `check` prints and
//! docs/guides/operating.md explains: a process of its own, its peak resident memory from the system.

use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use crate::support::{
    Request, Running, Socket, bytes_of, contact, hello, model_folder, model_folder_on, papilla,
    ramp, raw_exchange, write,
};

/// Clients at once.
const CLIENTS: usize = 4;

/// Most bytes of a body, the default.
const BODY_MAX: usize = 2 << 20;

/// Most bytes of a message of a session.
const MESSAGE_MAX: usize = 1 << 20;

/// What the allocator may keep beside what is asked of it: pages of its arenas.
const SLACK: usize = 4 << 20;

/// Settings under which the sum is that of [`CLIENTS`] connections with a request each.
const PLACES: [&str; 6] = ["--max-connections", "8", "--max-requests", "4", "--max-sessions", "1"];

/// Most bytes that the service holds of its own right after the start with the shipped models: half
/// of them are the compliance of the finger. The start itself uses twice as much.
const STARTED_MAX: usize = 90 << 20;

/// A field of `/proc/PID/status`, bytes.
fn status(id: u32, field: &str) -> usize {
    let text = fs::read_to_string(format!("/proc/{id}/status")).unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix(field)).unwrap();
    let kib: usize = line.trim_matches([':', ' ', '\t']).trim_end_matches(" kB").parse().unwrap();
    kib << 10
}

/// The greatest resident memory from now on is counted anew.
fn forget_peak(id: u32) {
    fs::write(format!("/proc/{id}/clear_refs"), "5").unwrap();
}

/// The sum for these settings, bytes.
fn documented(models: &Path, places: &[&str]) -> usize {
    let args = ["check", "--json", "--calibration-ms", "0", "--bind", "127.0.0.1:0", "--models"];
    let output = papilla(&args).arg(models).args(places).output().unwrap();
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let findings = report["findings"].as_array().unwrap();
    let memory = findings.iter().find(|finding| finding["what"] == "memory").unwrap();
    memory["values"]["clients_bytes_max"].as_u64().unwrap() as usize
}

/// `head`, then as many of `item` as fit into `most` bytes with commas between, then `tail`.
fn filled(head: &str, item: &str, tail: &str, most: usize) -> Vec<u8> {
    let count = (most - head.len() - tail.len()) / (item.len() + 1);
    let items = vec![item; count].join(",");
    [head, &items, tail].concat().into_bytes()
}

/// `head`, a text as long as fits made of `unit`, then `tail`.
fn stretched(head: &str, unit: &str, tail: &str) -> Vec<u8> {
    let count = (BODY_MAX - head.len() - tail.len()) / unit.len();
    [head, &unit.repeat(count), tail].concat().into_bytes()
}

fn npy(header: &[u8]) -> Vec<u8> {
    let length = (header.len() as u32).to_le_bytes();
    [&b"\x93NUMPY\x02\x00"[..], &length, header].concat()
}

/// A PNG of the right size whose other chunk unpacks to far more than it is.
fn png_bomb() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 224, 224);
    encoder.set_depth(png::BitDepth::Sixteen);
    for _ in 0..8 {
        encoder.add_ztxt_chunk("k".to_owned(), "x".repeat(16 << 20)).unwrap();
    }
    encoder.write_header().unwrap().write_image_data(&vec![0; 2 * 224 * 224]).unwrap();
    bytes
}

/// The worst bodies of every route that takes one: name, path, content type, body.
fn bodies() -> Vec<(&'static str, &'static str, &'static str, Vec<u8>)> {
    let (sed, infer) = ("/v1/sed", "/v2/models/quick/infer");
    let (json, numpy) = ("application/json", "application/x-npy");
    let fill = |head, item, tail| filled(head, item, tail, BODY_MAX);
    let input = r#"{"name":"","shape":[],"datatype":"","data":[]}"#;
    let control = "\\u0001";
    let long_shape = || {
        let head = "{'descr': '<f4', 'fortran_order': False, 'shape': (";
        npy(&[head.as_bytes(), "1,".repeat((BODY_MAX - 200) / 2).as_bytes(), b")}"].concat())
    };
    vec![
        ("empty inputs", infer, json, fill(r#"{"inputs":["#, input, "]}")),
        ("outputs", infer, json, fill(r#"{"inputs":[],"outputs":["#, r#"{"name":""}"#, "]}")),
        ("parameters", infer, json, fill(r#"{"inputs":[],"parameters":{"a":["#, "0", "]}}")),
        ("names", infer, json, fill(r#"{"inputs":[],"parameters":{"#, r#""":[]"#, "}}")),
        ("a shape", infer, json, fill(r#"{"inputs":[{"name":"","shape":["#, "1", "]}]}")),
        ("numbers", infer, json, fill(r#"{"inputs":[{"name":"","data":["#, "1", "]}]}")),
        ("nested lists", infer, json, fill(r#"{"inputs":[{"data":["#, "[[[[[]]]]]", "]}]}")),
        ("a long id", infer, json, stretched(r#"{"id":""#, control, r#"","inputs":[]}"#)),
        ("a long name", infer, json, stretched(r#"{"inputs":[{"name":""#, control, r#""}]}"#)),
        ("a long type", infer, json, stretched(r#"{"inputs":[{"shape":""#, control, r#""}]}"#)),
        ("numbers", sed, json, fill(r#"{"pressure_pa":["#, "0", "]}")),
        ("a long member", sed, json, stretched(r#"{""#, control, r#"":1}"#)),
        ("a long text", sed, json, stretched(r#"{"pressure_pa":""#, control, r#""}"#)),
        ("a long shape", sed, numpy, long_shape()),
        ("a long header", sed, numpy, npy(&stretched("{", "\u{1}", "}")[..BODY_MAX - 200])),
        ("unpacked text", sed, "image/png", png_bomb()),
        ("a body", "/v1/admin/reload", json, vec![b'x'; BODY_MAX]),
        ("a body", "/v1/nowhere", json, vec![b'x'; BODY_MAX]),
    ]
}

/// Sends a body from all clients at once.
async fn send(running: &Running, path: &str, content_type: &str, body: &[u8]) {
    let length = body.len();
    let head = format!(
        "POST {path}?pressure_max_pa=1 HTTP/1.1\r\nhost: test\r\nconnection: close\r\n\
         content-type: {content_type}\r\ncontent-length: {length}\r\n\r\n"
    );
    let whole = [head.as_bytes(), body].concat();
    let clients: Vec<_> = (0..CLIENTS)
        .map(|_| {
            let (address, whole) = (running.address, whole.clone());
            tokio::spawn(async move { raw_exchange(address, &whole).await })
        })
        .collect();
    for client in clients {
        client.await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn no_body_takes_more_than_the_documented_sum() {
    if !cfg!(target_os = "linux") {
        eprintln!("skipped: peak resident memory is read from /proc, which Linux has");
        return;
    }
    let models = model_folder();
    let sum = documented(models.path(), &PLACES);
    let running = Running::start_with(models.path(), &PLACES);
    let id = running.child.id();
    // Everything that is made on first use.
    send(&running, "/v1/sed", "application/octet-stream", &bytes_of(&ramp())).await;
    let data = json!({"inputs": [{"name": "pressure_pa", "shape": [1, 1, 224, 224],
        "datatype": "FP32", "data": ramp()}]});
    send(&running, "/v2/models/quick/infer", "application/json", data.to_string().as_bytes()).await;
    let before = status(id, "VmRSS");
    let mut beyond = Vec::new();
    for (name, path, content_type, body) in bodies() {
        assert!(body.len() <= BODY_MAX, "{name} at {path}: {} bytes", body.len());
        forget_peak(id);
        send(&running, path, content_type, &body).await;
        let grown = status(id, "VmHWM").saturating_sub(before);
        eprintln!("{path}, {name}: {:.1} MiB", grown as f64 / (1 << 20) as f64);
        if grown > sum + SLACK {
            beyond.push(format!("{path}, {name}: {} MiB", grown >> 20));
        }
    }
    assert!(beyond.is_empty(), "more than {} MiB: {beyond:#?}", sum >> 20);
    let answer = Request::new(running.address, "POST", "/v1/sed").body(bytes_of(&ramp()));
    assert_eq!(answer.send().await.status, 200);
}

/// The worst messages of a session.
fn messages() -> Vec<(&'static str, String)> {
    let fill = |head: &str, item: &str, tail: &str| {
        String::from_utf8(filled(head, item, tail, MESSAGE_MAX)).unwrap()
    };
    let start = r#"{"type":"hello","#;
    let with = |members: &str| format!("{start}{members}");
    // As many pixels in receptive fields as a session may have.
    let wide = vec![json!({"at": {"px": [110.5, 110.5]}}); 32];
    let display = json!({"actuators": wide, "radius_mm": 1000.0, "gain": 1.0});
    let all = hello(&json!({"actuators": display,
        "effects": ["actuators", "relaxation", "afferents", "spikes", "summary"],
        "relaxation": {"prony": (1..=6).map(|n| json!({"g": 0.1, "tau_s": n})).collect::<Vec<_>>()}}));
    vec![
        ("effects", fill(&with(r#""effects":["#), r#""""#, "]}")),
        ("points", fill(&with(r#""points":["#), r#"{"px":[1,1]}"#, "]}")),
        (
            "actuators",
            fill(&with(r#""actuators":{"actuators":["#), r#"{"at":{"px":[1,1]}}"#, "]}}"),
        ),
        ("terms", fill(&with(r#""relaxation":{"prony":["#), r#"{"g":0,"tau_s":0}"#, "]}}")),
        ("numbers", fill(&with(r#""tier":["#), "0", "]}")),
        ("lists", fill(&with(r#""what":["#), "[]", "]}")),
        ("no object", fill("[", "0", "]")),
        ("a long name", with(&format!(r#""tier":"{}"}}"#, "\\u0001".repeat(170_000)))),
        ("every effect", all.to_string()),
        ("every effect again", all.to_string()),
    ]
}

#[tokio::test(flavor = "multi_thread")]
async fn no_message_takes_more_than_the_documented_sum() {
    if !cfg!(target_os = "linux") {
        eprintln!("skipped: peak resident memory is read from /proc, which Linux has");
        return;
    }
    let models = model_folder();
    let places = ["--max-connections", "4", "--max-requests", "1", "--max-sessions", "4"];
    let sum = documented(models.path(), &places);
    let running = Running::start_with(models.path(), &places);
    let id = running.child.id();
    let mut sockets = Vec::new();
    for _ in 0..CLIENTS {
        let mut socket = Socket::connect(running.address).await.unwrap();
        socket.open(hello(&json!({"effects": ["summary"]}))).await;
        sockets.push(socket);
    }
    let before = status(id, "VmRSS");
    let mut beyond = Vec::new();
    for (name, message) in messages() {
        assert!(message.len() <= MESSAGE_MAX, "{name}: {} bytes", message.len());
        forget_peak(id);
        let clients: Vec<_> = std::mem::take(&mut sockets)
            .into_iter()
            .map(|mut socket| {
                let message = message.clone();
                tokio::spawn(async move {
                    socket.send(message).await;
                    (socket.hear_json().await, socket)
                })
            })
            .collect();
        for client in clients {
            let (answer, socket) = client.await.unwrap();
            let due = if name.starts_with("every effect") { "ready" } else { "error" };
            assert_eq!(answer["type"], due, "{name}: {answer}");
            sockets.push(socket);
        }
        let grown = status(id, "VmHWM").saturating_sub(before);
        eprintln!("{name}: {:.1} MiB", grown as f64 / (1 << 20) as f64);
        if grown > sum + SLACK {
            beyond.push(format!("{name}: {} MiB", grown >> 20));
        }
    }
    assert!(beyond.is_empty(), "more than {} MiB: {beyond:#?}", sum >> 20);
}

/// What the start uses to load models, and does not keep, is the system's when it is over.
#[tokio::test(flavor = "multi_thread")]
async fn the_start_holds_little_beside_what_it_keeps() {
    if !cfg!(target_os = "linux") {
        eprintln!("skipped: resident memory is read from /proc, which Linux has");
        return;
    }
    let running = Running::start(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../models"));
    let held = status(running.child.id(), "RssAnon");
    eprintln!("{:.1} MiB after the start", held as f64 / (1 << 20) as f64);
    assert!(held <= STARTED_MAX, "{} MiB", held >> 20);
}

/// What fingers took is the system's again once their sessions are over.
#[tokio::test(flavor = "multi_thread")]
async fn the_memory_of_sessions_that_are_over_is_given_back() {
    if !cfg!(target_os = "linux") {
        eprintln!("skipped: resident memory is read from /proc, which Linux has");
        return;
    }
    const SESSIONS: usize = 4;
    let folder = model_folder_on(&contact::atlas());
    write(folder.path(), "finger.contact", &contact::model());
    let running = Running::start_with(folder.path(), &[]);
    let id = running.child.id();
    let fingers = vec![json!({}); 10];
    let hello = contact::ball_hello(&json!({"method": "pixels", "map": false, "fingers": fingers}));
    let press = async |sessions: usize| {
        let mut open = Vec::new();
        for _ in 0..sessions {
            let mut socket = Socket::connect(running.address).await.unwrap();
            socket.open(hello.clone()).await;
            for finger in 0..10u8 {
                socket.send(contact::rows(1, finger, &[contact::deep(0.3)])).await;
                socket.hear_frame().await;
            }
            open.push(socket);
        }
        status(id, "VmRSS")
    };
    // Everything that is made on first use.
    press(1).await;
    let settled = async |below: usize| {
        let begun = Instant::now();
        loop {
            let now = status(id, "VmRSS");
            if now <= below || begun.elapsed() > Duration::from_secs(60) {
                return now;
            }
            // As a balancer or a scraper does: somebody always asks.
            Request::new(running.address, "GET", "/healthz").send().await;
            tokio::time::sleep(Duration::from_millis(200)).await;
        }
    };
    tokio::time::sleep(Duration::from_secs(2)).await;
    let before = status(id, "VmRSS");
    let pressed = press(SESSIONS).await;
    let taken = pressed.saturating_sub(before);
    assert!(taken > (SESSIONS * 10) << 20, "ten fingers take {} MiB", (taken / SESSIONS) >> 20);
    let left = settled(before + taken / 8).await.saturating_sub(before);
    assert!(left <= taken / 8, "{} MiB of {} stay", left >> 20, taken >> 20);
}
