//! More work than the service can do: every frame is still answered, and nothing grows.

use std::{net::SocketAddr, ops::AddAssign};

use papilla_proto::{FrameStatus, SampleType};
use serde_json::json;

use crate::support::{
    Received, Running, Service, Socket, bytes_of, frame, hello, metric_at, model_folder, ramp,
};

const SESSIONS: usize = 8;
const FRAMES: u32 = 60;

/// How frames were answered.
#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    ok: u32,
    superseded: u32,
    late: u32,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.ok += other.ok;
        self.superseded += other.superseded;
        self.late += other.late;
    }
}

/// Sends frames without waiting for answers, up to `ahead` of them, and counts how each was
/// answered. Asserts that every frame is answered once and maps come in order.
async fn flood(mut socket: Socket, deadline_us: u32, ahead: u32) -> Tally {
    let mut tally = Tally::default();
    let mut answered = vec![false; FRAMES as usize];
    let (mut sent, mut heard, mut newest) = (0, 0, None);
    while heard < FRAMES {
        if sent < FRAMES && sent - heard < ahead {
            socket.send(frame(sent, deadline_us, SampleType::U8, 40.0, &ramp())).await;
            sent += 1;
            continue;
        }
        let header = match socket.receive().await {
            Received::Frame(header, _) => header,
            other => panic!("{other:?} after {heard} of {sent} frames"),
        };
        let known = std::mem::replace(&mut answered[header.sequence as usize], true);
        assert!(!known, "frame {} is answered twice", header.sequence);
        match header.status {
            FrameStatus::Ok => {
                assert!(newest < Some(header.sequence), "{newest:?} before {}", header.sequence);
                newest = Some(header.sequence);
                tally.ok += 1;
            }
            FrameStatus::Superseded => tally.superseded += 1,
            FrameStatus::Late => tally.late += 1,
            other => panic!("{other:?}"),
        }
        heard += 1;
    }
    tally
}

async fn flood_all(address: SocketAddr, deadline_us: u32, ahead: u32) -> Tally {
    let mut floods = Vec::new();
    for _ in 0..SESSIONS {
        let mut socket = Socket::connect(address).await.unwrap();
        let hello = hello(&json!({"tier": "slow", "sample_type": "u8", "budget_us": 0}));
        socket.open(hello).await;
        floods.push(tokio::spawn(flood(socket, deadline_us, ahead)));
    }
    let mut sum = Tally::default();
    for flood in floods {
        let tally = flood.await.unwrap();
        // No session starves: the newest frame of each is always rendered.
        assert!(deadline_us > 0 || tally.ok > 0, "{tally:?}");
        sum += tally;
    }
    assert_eq!(sum.ok + sum.superseded + sum.late, SESSIONS as u32 * FRAMES);
    sum
}

#[tokio::test(flavor = "multi_thread")]
async fn every_frame_of_a_flood_is_answered_and_counted() {
    let service = Service::start().await;
    // Far more than one thread can render: each session has 16 frames on their way.
    let tally = flood_all(service.address, 0, 16).await;
    assert!(tally.superseded > tally.ok, "{tally:?}");
    for (outcome, due) in [("ok", tally.ok), ("superseded", tally.superseded), ("late", tally.late)]
    {
        let line = format!("papilla_maps_total{{transport=\"session\",outcome=\"{outcome}\"}}");
        assert_eq!(service.metric(&line).await as u32, due, "{outcome}");
    }
    // And it is over when it is over.
    assert_eq!(service.metric("papilla_queue_length").await as i64, 0);
    let map = service.post("/v1/sed?tier=quick", bytes_of(&ramp())).send().await;
    assert_eq!(map.status, 200);
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn a_flood_leaves_no_memory_behind() {
    let models = model_folder();
    let running = Running::start(models.path());
    let resident = || metric_at(running.address, "process_resident_memory_bytes");
    flood_all(running.address, 0, 16).await;
    let before = resident().await;
    for _ in 0..4 {
        flood_all(running.address, 0, 16).await;
    }
    let after = resident().await;
    // Each flood brings 480 frames of 50 KB and takes as many answers: 190 MB altogether.
    assert!(after - before < 32e6, "{before} grew to {after}");
    assert!(metric_at(running.address, "process_open_fds").await < 64.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn work_that_cannot_be_in_time_is_dropped_before_it_is_done() {
    let service = Service::start().await;
    let tiers = service.json("/v1/tiers").await;
    let infer_us = tiers["tiers"][1]["predicted_latency_us"].as_u64().unwrap();
    // Eight sessions wait for one thread, and each would have to be next but one.
    let tally = flood_all(service.address, u32::try_from(infer_us * 2).unwrap(), 4).await;
    let line = "papilla_stage_seconds_count{tier=\"slow\",stage=\"infer\"}";
    let inferred = service.metric(line).await as u32;
    assert!(tally.late > 0, "{tally:?}");
    assert!(inferred < SESSIONS as u32 * FRAMES / 2, "{inferred} inferences, {tally:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn posted_maps_beyond_the_places_are_refused_at_once() {
    let service = Service::start_with(|config| {
        config.max_requests = std::num::NonZeroUsize::new(2).unwrap();
    })
    .await;
    let posts: Vec<_> = (0..8)
        .map(|_| tokio::spawn(service.post("/v1/sed?tier=slow", bytes_of(&ramp())).send()))
        .collect();
    let (mut ok, mut shed) = (0, 0);
    for post in posts {
        let answer = post.await.unwrap();
        match answer.status {
            200 => ok += 1,
            _ => {
                assert_eq!(answer.header("retry-after"), Some("1"));
                answer.assert_refused(503, "overloaded");
                shed += 1;
            }
        }
    }
    assert_eq!(ok + shed, 8);
    assert!(ok >= 2 && shed >= 1, "{ok} {shed}");
    let counted = service.metric("papilla_shed_total{reason=\"requests\"}").await;
    assert_eq!(counted as i32, shed);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_figure_that_machines_are_added_by_rises_above_one() {
    let service = Service::start().await;
    assert!(service.metric("papilla_load_ratio").await < 0.01, "nobody asks for anything");
    flood_all(service.address, 0, FRAMES).await;
    // Every map asks for its time, whether it is rendered or superseded; the look comes within a
    // second.
    let mut most = 0.0;
    for _ in 0..100 {
        most = service.metric("papilla_load_ratio").await.max(most);
        if most > 1.0 {
            return;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    panic!("{most} of the capacity, though most maps were superseded");
}
