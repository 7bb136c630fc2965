//! A frame costs no allocation once a session is warm: counted by the allocator itself.
//!
//! A test binary of its own, since an allocator serves a whole process. The client is a plain
//! socket on the test's thread, which is not counted; all other threads are the service's.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]
// An allocator is unsafe by its nature; this one hands everything to the system's.
#![allow(unsafe_code)]

// Shared with the service's tests, which use all of it.
#[allow(dead_code)]
#[path = "../service/fingers/support.rs"]
mod named_fingers;
#[allow(dead_code, unused_imports)]
#[path = "../service/support/mod.rs"]
mod support;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    fs,
    io::{Read, Write},
    net::TcpStream,
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
};

use papilla_proto::{
    FrameHeader, FrameStatus, HEADER_LEN, MAP_LEN, RuntimeEffect, SampleType, Window,
};
use serde_json::{Value, json};
use support::{GAIN, Service, bytes_of, contact, model_folder, ramp};

struct Counting;

static COUNTS: AtomicBool = AtomicBool::new(false);
static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

thread_local! {
    /// Whether what this thread allocates is left out.
    static LEFT_OUT: Cell<bool> = const { Cell::new(false) };
}

fn count() {
    let left_out = LEFT_OUT.try_with(Cell::get).unwrap_or(true);
    if COUNTS.load(Ordering::Relaxed) && !left_out && !is_harness() {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
    }
}

/// Whether this is the thread of the test harness, which says so when a test takes a minute.
#[cfg(target_os = "linux")]
fn is_harness() -> bool {
    rustix::thread::gettid() == rustix::process::getpid()
}

#[cfg(not(target_os = "linux"))]
fn is_harness() -> bool {
    false
}

// SAFETY: every method hands its arguments on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promised.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as the caller promised.
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations while `work` runs, on all threads but those left out.
fn allocations(work: impl FnOnce()) -> u64 {
    ALLOCATIONS.store(0, Ordering::SeqCst);
    COUNTS.store(true, Ordering::SeqCst);
    work();
    COUNTS.store(false, Ordering::SeqCst);
    ALLOCATIONS.load(Ordering::SeqCst)
}

/// A WebSocket client that sends messages made beforehand and reads into one buffer.
struct Client {
    stream: TcpStream,
    buffer: Vec<u8>,
}

impl Client {
    fn connect(service: &Service, hello: &Value) -> Self {
        let mut stream = TcpStream::connect(service.address).unwrap();
        stream.set_nodelay(true).unwrap();
        let handshake = "GET /v1/session HTTP/1.1\r\nhost: localhost\r\nconnection: upgrade\r\n\
                         upgrade: websocket\r\nsec-websocket-version: 13\r\n\
                         sec-websocket-key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
        stream.write_all(handshake.as_bytes()).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.extend(byte);
        }
        assert!(head.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&head));
        let mut client = Self { stream, buffer: vec![0; 1 << 20] };
        client.send(&masked(0x81, hello.to_string().as_bytes()));
        let ready: Value = serde_json::from_slice(client.receive()).unwrap();
        assert_eq!(ready["type"], "ready", "{ready}");
        client
    }

    fn send(&mut self, message: &[u8]) {
        self.stream.write_all(message).unwrap();
    }

    /// The payload of the next message.
    fn receive(&mut self) -> &[u8] {
        let mut head = [0; 2];
        self.stream.read_exact(&mut head).unwrap();
        let len = match head[1] {
            126 => self.number::<2>(),
            127 => self.number::<8>(),
            short => usize::from(short),
        };
        self.stream.read_exact(&mut self.buffer[..len]).unwrap();
        &self.buffer[..len]
    }

    fn number<const BYTES: usize>(&mut self) -> usize {
        let mut bytes = [0; BYTES];
        self.stream.read_exact(&mut bytes).unwrap();
        bytes.iter().fold(0, |number, &byte| number << 8 | usize::from(byte))
    }

    /// Sends each message in turn and waits for its answer.
    fn exchange(&mut self, messages: &[Vec<u8>]) {
        for message in messages {
            self.send(message);
            let header = FrameHeader::decode(self.receive()).unwrap();
            assert_eq!(header.status, FrameStatus::Ok, "{header:?}");
        }
    }

    /// Sends a frame of a whole map so many times, and waits for each answer.
    fn repeat(&mut self, message: &mut [u8], times: usize) {
        for _ in 0..times {
            number_anew(message);
            self.send(message);
            let header = FrameHeader::decode(self.receive()).unwrap();
            assert_eq!(header.status, FrameStatus::Ok, "{header:?}");
        }
    }
}

/// What the messages of these clients are masked with.
const MASK: [u8; 4] = [0x12, 0x34, 0x56, 0x78];

/// A client's WebSocket message.
fn masked(opcode: u8, payload: &[u8]) -> Vec<u8> {
    let mut message = vec![opcode];
    match payload.len() {
        len @ 0..126 => message.push(0x80 | len as u8),
        len @ 126..65_536 => {
            message.push(0x80 | 126);
            message.extend((len as u16).to_be_bytes());
        }
        len => {
            message.push(0x80 | 127);
            message.extend((len as u64).to_be_bytes());
        }
    }
    message.extend(MASK);
    message.extend(payload.iter().zip(MASK.iter().cycle()).map(|(byte, mask)| byte ^ mask));
    message
}

/// A frame of a whole map as a WebSocket message.
fn whole(map: &[f32]) -> Vec<u8> {
    let header = FrameHeader::pressure(0, 0, 0, SampleType::F32, 1.0);
    masked(0x82, &[&header.encode()[..], &bytes_of(map)].concat())
}

/// Gives a frame of a whole map the next number: one that is not newer would be stale.
fn number_anew(message: &mut [u8]) {
    // Behind the head of the WebSocket, 10 bytes and the mask: bytes 8 to 11 of the header.
    let at = 10 + MASK.len() + 8;
    let masked = <[u8; 4]>::try_from(&message[at..at + 4]).unwrap();
    let plain = [0, 1, 2, 3].map(|i| masked[i] ^ MASK[i]);
    let next = (u32::from_le_bytes(plain) + 1).to_le_bytes();
    message[at..at + 4].copy_from_slice(&[0, 1, 2, 3].map(|i| next[i] ^ MASK[i]));
}

/// A frame of a window; every one of a list has a sequence of its own.
fn windowed(sequence: u32, window: Window, map: &[f32]) -> Vec<u8> {
    let time_us = 11_111 * u64::from(sequence);
    let header = FrameHeader::pressure(sequence, time_us, 0, SampleType::F32, 1.0).windowed(window);
    let mut frame = header.encode().to_vec();
    frame.resize(HEADER_LEN + 4 * window.pixel_count(), 0);
    window.encode(SampleType::F32, map, 1.0, &mut frame[HEADER_LEN..]).unwrap();
    masked(0x82, &frame)
}

/// What the engine itself allocates for a map: that is its own affair.
fn engines_own() -> u64 {
    let models = model_folder();
    let onnx = fs::read(models.path().join("quick.onnx")).unwrap();
    let mut session = papilla_engine::load(&onnx, None).unwrap().session().unwrap();
    let (map, mut sed) = (ramp(), vec![0.0; MAP_LEN]);
    let mut run = |maps| (0..maps).for_each(|_| session.infer(&map, &mut sed).unwrap());
    run(8);
    LEFT_OUT.set(false);
    let counts = [1, 100].map(|maps| allocations(|| run(maps)));
    LEFT_OUT.set(true);
    assert!((sed[MAP_LEN - 1] - GAIN * map[MAP_LEN - 1]).abs() < 1e-2);
    assert_eq!(counts[1], 100 * counts[0], "the engine allocates the same for every map");
    // What would see nothing could not fail.
    assert!(counts[0] > 0, "nothing is counted");
    counts[0]
}

/// Frames until everything has its place, and frames counted.
const WARM_UP: usize = 100;
const FRAMES: usize = 400;

fn plain_hello() -> Value {
    json!({"type": "hello", "tier": "quick"})
}

#[test]
fn a_warm_session_allocates_nothing_for_a_frame() {
    LEFT_OUT.set(true);
    // Before the service starts: nothing else runs that could be counted.
    let engines_own = engines_own();
    let runtime =
        tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
    let service = runtime.block_on(Service::start());
    one_frame_at_a_time(&service, engines_own);
    frames_that_wait(&service, engines_own);
    every_effect(&service, engines_own, ("formula", 1));
    every_effect(&service, engines_own, ("corrected", 2));
    runtime.block_on(service.server.drain()).unwrap();
    let service = runtime.block_on(contact::service());
    fingers(&service);
    felt_traction(&service, engines_own);
    runtime.block_on(service.server.drain()).unwrap();
    let folder = named_fingers::folder();
    let service = runtime.block_on(named_fingers::service(&folder));
    fingers_of(&service, &json!([{"name": "default"}, {"name": "thumb"}]));
    runtime.block_on(service.server.drain()).unwrap();
}

fn one_frame_at_a_time(service: &Service, engines_own: u64) {
    // Frames of nothing ask no network: what is counted is the path of the frame alone.
    let mut client = Client::connect(service, &plain_hello());
    let mut zero = whole(&vec![0.0; MAP_LEN]);
    client.repeat(&mut zero, WARM_UP);
    assert_eq!(allocations(|| client.repeat(&mut zero, FRAMES)), 0, "without contact");
    let mut client = Client::connect(service, &plain_hello());
    let mut frame = whole(&ramp());
    client.repeat(&mut frame, WARM_UP);
    let all = allocations(|| client.repeat(&mut frame, FRAMES));
    assert_eq!(all, FRAMES as u64 * engines_own, "beyond what the engine itself does");
}

/// Two sessions, each three frames ahead of its answers, on one inference thread: frames wait, and
/// some are superseded.
fn frames_that_wait(service: &Service, engines_own: u64) {
    let mut clients = [(); 2].map(|()| Client::connect(service, &plain_hello()));
    let mut frame = whole(&ramp());
    let mut maps = 0;
    let mut exchange = |rounds: usize| {
        maps = 0;
        for _ in 0..rounds {
            for _ in 0..3 {
                number_anew(&mut frame);
                clients.iter_mut().for_each(|client| client.send(&frame));
            }
            for client in &mut clients {
                for _ in 0..3 {
                    let header = FrameHeader::decode(client.receive()).unwrap();
                    maps += u64::from(header.status == FrameStatus::Ok);
                }
            }
        }
    };
    exchange(WARM_UP);
    let all = allocations(|| exchange(FRAMES));
    assert!(maps < 6 * FRAMES as u64, "some frames were superseded");
    assert_eq!(all, maps * engines_own, "frames that wait");
}

/// Two fingers under a ball that moves, forces out alone: nothing is left to the engine.
fn fingers(service: &Service) {
    fingers_of(service, &json!([{}, {}]));
}

/// The same of these fingers, which may be of different bundles; each keeps its budget.
fn fingers_of(service: &Service, fingers: &Value) {
    let budget_us = 5_000_000;
    let members =
        json!({"map": false, "stiffness": true, "fingers": fingers, "budget_us": budget_us});
    let mut client = Client::connect(service, &contact::ball_hello(&members));
    let frame = |n: u32| {
        let depth_mm = 0.2 + 0.001 * (n % 20) as f32;
        masked(0x82, &contact::rows(n, (n % 2) as u8, &[contact::deep(depth_mm)]))
    };
    let frames: Vec<_> = (1..=(WARM_UP + FRAMES) as u32).map(frame).collect();
    client.exchange(&frames[..WARM_UP]);
    assert_eq!(allocations(|| client.exchange(&frames[WARM_UP..])), 0, "poses in, forces out");
}

/// A ball that is dragged to and fro, whose traction is felt.
fn felt_traction(service: &Service, engines_own: u64) {
    let objects = json!([{"shape": {"shape": "sphere", "radius_mm": 20.0}, "friction": 0.5}]);
    let members = json!({"objects": objects, "effects": ["shear_energy"], "tier": "quick"});
    let mut client = Client::connect(service, &contact::ball_hello(&members));
    let frame = |n: u32| {
        let mut pose = contact::deep(0.2);
        pose.origin_mm[0] = 0.01 * (n % 20) as f32;
        masked(0x82, &contact::rows(n, 0, &[pose]))
    };
    let frames: Vec<_> = (1..=(WARM_UP + FRAMES) as u32).map(frame).collect();
    client.exchange(&frames[..WARM_UP]);
    let all = allocations(|| client.exchange(&frames[WARM_UP..]));
    assert_eq!(all, FRAMES as u64 * engines_own, "with traction");
}

/// Every effect at once, windows both ways.
///
/// Pins whose drive is corrected ask the network twice.
fn every_effect(service: &Service, engines_own: u64, (drive, asked): (&str, u64)) {
    // Windows of pressure hold no traction.
    let of_windows = |effect: &RuntimeEffect| *effect != RuntimeEffect::ShearEnergy;
    let effects: Vec<_> = RuntimeEffect::ALL.into_iter().filter(of_windows).collect();
    let hello = json!({
        "type": "hello", "effects": effects, "tier": "quick",
        "points": [{"px": [110.0, 65.0]}],
        "actuators": {"drive": drive, "radius_mm": 1.0, "gain": 1.0,
                      "actuators": [{"at": {"px": [110.0, 65.0]}}]}
    });
    let mut client = Client::connect(service, &hello);
    let window = Window { x: 60, y: 50, width: 100, height: 80 };
    let frames: Vec<_> =
        (1..=(WARM_UP + FRAMES) as u32).map(|n| windowed(n, window, &ramp())).collect();
    client.exchange(&frames[..WARM_UP]);
    let all = allocations(|| client.exchange(&frames[WARM_UP..]));
    assert_eq!(all, FRAMES as u64 * asked * engines_own, "with every effect, {drive}");
}
