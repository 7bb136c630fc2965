//! Sessions whose frames are hard, beside a session that is none of theirs. The soak test measures the
//! same ones on the shipped models (`tests/soak/run --hostile`).

use std::time::Duration;

use papilla_proto::{
    FrameHeader, FrameKind, FrameStatus, MAP_SIDE_PX, SampleType,
    contact::{POSE_LEN, ROW},
};
use serde_json::{Map, Value, json};
use tokio::{
    task::JoinSet,
    time::{sleep, timeout},
};

use crate::support::{
    Received, Service, Socket,
    contact::{ball_hello, deep, rows, service_with},
    hello,
    raw::{Raw, opcode, ws},
};

/// What they say and send, for the shipped finger.
const SESSIONS: &str = include_str!("../../../tests/soak/hostile-sessions.json");

/// From the shipped finger's pad to the middle of the plane that stands for it here, mm.
const TO_PLANE_MM: [f32; 3] = [-11.25, 0.0, 6.3];

/// Hostile sessions of a kind, and round trips of their neighbour.
const HOSTILE: usize = 4;
const TRIPS: u32 = 12;

/// Forty fingers that wait less than this for a thread are not hard, s.
const LEAST_WAIT_S: f64 = 5e-3;

/// A closed mesh of thin triangles whose boxes all overlap: two tips and a ring between them.
fn slivers(count: u64) -> Value {
    let n = count / 2;
    let (sqrt_2, sqrt_6, tip) = (2f64.sqrt(), 6f64.sqrt(), 5.0 / 3f64.sqrt());
    let (u, v) = ([1.0 / sqrt_2, -1.0 / sqrt_2, 0.0], [1.0 / sqrt_6, 1.0 / sqrt_6, -2.0 / sqrt_6]);
    let at = |k: u64| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
        // In digits it must not be longer than a hello may be.
        [0, 1, 2].map(|i| (5e4 * (cos * u[i] + sin * v[i])).round() * 1e-5)
    };
    let mut vertices: Vec<[f64; 3]> = (0..n).map(at).collect();
    vertices.extend([[tip; 3], [-tip; 3]]);
    let next = |k: u64| (k + 1) % n;
    let triangles: Vec<[u64; 3]> =
        (0..n).flat_map(|k| [[k, next(k), n], [next(k), k, n + 1]]).collect();
    json!({"shape": "mesh", "vertices_mm": vertices, "triangles": triangles})
}

/// What a value of the file stands for.
fn whole(value: &Value) -> Value {
    match value {
        Value::Object(members) if members.len() == 1 && members.contains_key("repeat") => {
            let [count, one] = [0, 1].map(|i| &members["repeat"][i]);
            vec![whole(one); count.as_u64().unwrap() as usize].into()
        }
        Value::Object(members) if members.contains_key("slivers") => {
            slivers(members["slivers"].as_u64().unwrap())
        }
        Value::Object(members) => {
            let members = members.iter().map(|(name, member)| (name.clone(), whole(member)));
            Value::Object(members.collect::<Map<_, _>>())
        }
        Value::Array(all) => all.iter().map(whole).collect(),
        other => other.clone(),
    }
}

/// A hostile session of a kind.
struct Hostile {
    hello: Value,
    kind: FrameKind,
    size: [u16; 2],
    payload: Vec<u8>,
}

impl Hostile {
    fn of(session: &Value) -> Self {
        let session = whole(session);
        let hello = ball_hello(&session["hello"]);
        let Some(rows) = session["rows"].as_array() else {
            let gap_mm = session["gaps_mm"].as_f64().unwrap() as f32;
            let side = MAP_SIDE_PX as u16;
            let payload = gap_mm.to_le_bytes().repeat(MAP_SIDE_PX * MAP_SIDE_PX);
            let mut hello = hello;
            hello.as_object_mut().unwrap().remove("objects");
            return Self { hello, kind: FrameKind::Gaps, size: [side; 2], payload };
        };
        let objects = hello["objects"].as_array().unwrap().len();
        let numbers = |row: &Value| -> Vec<f32> {
            row.as_array().unwrap().iter().map(|n| n.as_f64().unwrap() as f32).collect()
        };
        let mut payload = Vec::new();
        for (at, row) in rows.iter().enumerate() {
            let mut row = numbers(row);
            if at < objects {
                // The last one is a net force.
                row.iter_mut().zip(TO_PLANE_MM).for_each(|(x, by)| *x += by);
            }
            payload.extend(row.iter().flat_map(|x| x.to_le_bytes()));
        }
        assert_eq!(payload.len(), rows.len() * POSE_LEN);
        let size = [ROW as u16, rows.len() as u16];
        Self { hello, kind: FrameKind::Objects, size, payload }
    }

    fn frame(&self, sequence: u32, finger: u8) -> Vec<u8> {
        let time_us = 11_111 * u64::from(sequence);
        let header = FrameHeader::pressure(sequence, time_us, 0, SampleType::F32, 1.0);
        let header = header.of_finger(self.kind, finger, self.size);
        header.encode().iter().copied().chain(self.payload.iter().copied()).collect()
    }

    /// Opens a session and asks for all that can be had; ends when the server closes. Refused at the
    /// hello, with words, it has nothing to ask for.
    async fn run(&self, mut socket: Socket) {
        socket.send(self.hello.to_string()).await;
        let said = socket.hear_json().await;
        if said["type"] == "error" {
            assert!(said["message"].as_str().is_some_and(|message| !message.is_empty()), "{said}");
            return;
        }
        assert_eq!(said["type"], "ready", "{said}");
        let fingers = self.hello["fingers"].as_array().unwrap().len() as u8;
        for finger in 0..fingers {
            socket.try_send(self.frame(1, finger)).await;
        }
        // A finger has its next frame as soon as one is answered, or refused.
        for sequence in 2.. {
            let finger = match socket.receive().await {
                Received::Frame(header, _) => header.finger,
                Received::Json(_) => (sequence % u32::from(fingers)) as u8,
                Received::Closed(_) => return,
                Received::Sealed(_) => panic!("nobody asked for the state"),
            };
            socket.try_send(self.frame(sequence, finger)).await;
        }
    }
}

/// Frames that threads have taken so far, and how long all of them together had waited, s.
async fn waited(service: &Service) -> (f64, f64) {
    let of = |what: &str| format!("papilla_stage_seconds_{what}{{tier=\"quick\",stage=\"queue\"}}");
    (service.metric(&of("count")).await, service.metric(&of("sum")).await)
}

/// Round trips of a light session, each a touch that is found; how long each waited for a thread, s,
/// the shortest first.
async fn trips(socket: &mut Socket, first: u32) -> Vec<f64> {
    let mut waits = Vec::new();
    for sequence in first..first + TRIPS {
        socket.send(rows(sequence, 0, &[deep(0.2)])).await;
        let (header, _) = socket.hear_frame().await;
        assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Ok));
        waits.push(1e-6 * f64::from(header.queue_us));
    }
    waits.sort_by(f64::total_cmp);
    waits
}

/// Opens hostile sessions and returns once their frames are under way; none if all are refused.
async fn besiege(service: &Service, session: &Value) -> Option<JoinSet<()>> {
    let mut hostile = JoinSet::new();
    for _ in 0..HOSTILE {
        let (one, socket) = (Hostile::of(session), service.socket().await);
        hostile.spawn(async move { one.run(socket).await });
    }
    let (before, _) = waited(service).await;
    while waited(service).await.0 < before + 4.0 {
        if let Ok(ended) = timeout(Duration::from_millis(20), hostile.join_next()).await {
            ended?.unwrap();
        }
    }
    Some(hostile)
}

/// By comparison: served by turns of fingers, a neighbour's frame waits as long as any other.
#[tokio::test(flavor = "multi_thread")]
async fn nobody_waits_for_the_hard_frames_of_others() {
    let sessions: Map<String, Value> = serde_json::from_str(SESSIONS).unwrap();
    for (kind, session) in &sessions {
        let service = service_with(|config| config.threads = std::num::NonZeroUsize::new(2)).await;
        let mut neighbour = service.socket().await;
        // At vertices: in a build of tests a frame on pixels is long itself.
        neighbour.open(ball_hello(&json!({"map": false, "method": "second_order"}))).await;
        trips(&mut neighbour, 1).await;
        let begin = timeout(Duration::from_secs(240), besiege(&service, session));
        let Some(mut hostile) = begin.await.expect(kind) else { continue };
        let before = waited(&service).await;
        let own = trips(&mut neighbour, 1 + TRIPS).await;
        // Until enough of the others have had a turn as well.
        let all = async {
            loop {
                let now = waited(&service).await;
                let (count, sum) = (now.0 - before.0, now.1 - before.1);
                if count >= f64::from(TRIPS) + 6.0 {
                    return (sum - own.iter().sum::<f64>()) / (count - f64::from(TRIPS));
                }
                sleep(Duration::from_millis(20)).await;
            }
        };
        let others = timeout(Duration::from_secs(240), all).await.expect(kind);
        hostile.shutdown().await;
        let median = own[own.len() / 2];
        // Where frames are not hard on this finger, there is no queue to speak of.
        assert!(
            median <= others / 4.0 || others < LEAST_WAIT_S,
            "{kind}: a frame of the neighbour waited {median} s, one of the others {others}"
        );
    }
}

/// Clients that say a hello which takes long to work out, and leave.
#[tokio::test(flavor = "multi_thread")]
async fn nobody_works_for_clients_that_have_left() {
    const CLIENTS: u32 = 20;
    let service = service_with(|_| ()).await;
    let long = ball_hello(&json!({"map": false, "objects": [{"shape": slivers(8192)}]}));
    let long = ws(opcode::FINAL | opcode::TEXT, long.to_string().as_bytes());
    for _ in 0..CLIENTS {
        let mut client = Raw::connect(service.address).await;
        client.send(&long).await;
    }
    let gone = async {
        while service.metric("papilla_sessions_open").await > 0.5 {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(Duration::from_secs(120), gone).await.expect("sessions of clients that left");
    // Some are worked out before the service hears that their client is gone.
    let left = service.metric("papilla_hellos_left_total").await;
    assert!(left >= f64::from(CLIENTS / 2), "{left} of {CLIENTS}");
    service.socket().await.open(hello(&json!({}))).await;
}
