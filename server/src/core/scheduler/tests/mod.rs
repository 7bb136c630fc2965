//! The pool with models that stop and go as the tests tell them.

mod gated;

use std::{
    sync::{
        Arc, Mutex,
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread::sleep,
    time::{Duration, Instant},
};

use bytes::Bytes;
use papilla_codec::{Input, Output};
use papilla_metrics::{Metrics, Stage};
use papilla_proto::{ErrorCode, FrameHeader, HEADER_LEN, MAP_LEN, SampleType};
use tokio::sync::mpsc;

use self::gated::{Act, FREE_PA, Gate, Gated};
use super::{Account, Done, Job, JobOptions, Outcome, Pool, PoolHandle, Slot, account::Weight};
use crate::core::{
    buffers::{HEADROOM, Recycler},
    catalogue::testing,
};
use crate::priority::Priorities;

/// A pool and the handles of its gate.
struct Bench {
    pool: Pool,
    handle: PoolHandle,
    metrics: Arc<Metrics>,
    begun: Receiver<()>,
    go: SyncSender<Act>,
}

/// A pool of one thread.
fn bench() -> Bench {
    bench_of(1, 4)
}

fn bench_of(threads: usize, places: usize) -> Bench {
    let (begun_in, begun) = sync_channel(16);
    let (go, go_out) = sync_channel(16);
    let gate = Arc::new(Gate { begun: begun_in, go: Mutex::new(go_out) });
    let gated = Gated { info: testing::info("gated"), gate };
    let catalogue = Arc::new(testing::catalogue(vec![testing::tier(Arc::new(gated), 0.1)]));
    let metrics = Metrics::new();
    metrics.name_tiers(catalogue.tier_labels());
    let pool = Pool::start(&catalogue, &metrics, threads, places, &Priorities::none()).unwrap();
    let handle = pool.handle(&metrics);
    Bench { pool, handle, metrics, begun, go }
}

/// A frame that is all `pressure_pa`.
fn job(sequence: u32, pressure_pa: f32, deadline: Option<Duration>) -> Job {
    let received = Instant::now();
    Job {
        tier: 0,
        payload: Bytes::from(pressure_pa.to_le_bytes().repeat(MAP_LEN)),
        input: Input::Samples { sample_type: SampleType::F32, scale: 1.0 },
        output: Output::Samples(SampleType::F32),
        received,
        deadline: deadline.map(|d| received + d),
        options: JobOptions {
            headroom: HEADROOM + HEADER_LEN,
            header: Some(FrameHeader::pressure(sequence, 0, 0, SampleType::F32, 1.0)),
            ..JobOptions::default()
        },
    }
}

fn client() -> (Arc<Slot>, mpsc::Receiver<Done>) {
    finger(&Account::new(1))
}

/// One finger of a session.
fn finger(account: &Arc<Account>) -> (Arc<Slot>, mpsc::Receiver<Done>) {
    let (sink, answers) = mpsc::channel(4);
    let slot = Slot::new(Recycler::default(), Arc::new(sink), Arc::clone(account));
    (Arc::new(slot), answers)
}

fn sequence(done: &Done) -> u32 {
    done.header.unwrap().sequence
}

/// Far more than a busy machine needs: a lost answer must fail a test, not hold it up for ever.
const WAIT_MAX: Duration = Duration::from_secs(120);

fn wait(answers: &mut mpsc::Receiver<Done>) -> Done {
    let end = Instant::now() + WAIT_MAX;
    loop {
        match answers.try_recv() {
            Ok(done) => return done,
            Err(mpsc::error::TryRecvError::Disconnected) => panic!("nobody will answer any more"),
            Err(mpsc::error::TryRecvError::Empty) => {}
        }
        assert!(Instant::now() < end, "no answer came in {WAIT_MAX:?}");
        sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_newer_frame_replaces_the_unstarted_one_and_only_that() {
    let bench = bench();
    let (slot, mut answers) = client();
    let submit = |n| bench.handle.submit(&slot, job(n, 1.0, None));
    assert!(submit(1).unwrap().is_none());
    bench.begun.recv_timeout(WAIT_MAX).expect("no inference began");
    // 1 is started: it stays. 2 waits, and gives way to 3, and 3 to 4.
    assert!(submit(2).unwrap().is_none());
    assert_eq!(submit(3).unwrap().unwrap().options.header.unwrap().sequence, 2);
    assert_eq!(submit(4).unwrap().unwrap().options.header.unwrap().sequence, 3);
    bench.go.send(Act::Finish).unwrap();
    bench.go.send(Act::Finish).unwrap();
    assert_eq!(sequence(&wait(&mut answers)), 1);
    assert_eq!(sequence(&wait(&mut answers)), 4);
    assert!(answers.try_recv().is_err());
}

#[test]
fn slots_are_served_in_turn_however_fast_one_client_sends() {
    let bench = bench();
    let (greedy, mut greedy_answers) = client();
    let (modest, mut modest_answers) = client();
    bench.handle.submit(&greedy, job(1, 1.0, None)).unwrap();
    bench.begun.recv_timeout(WAIT_MAX).expect("no inference began");
    bench.handle.submit(&modest, job(7, 1.0, None)).unwrap();
    bench.handle.submit(&greedy, job(2, 1.0, None)).unwrap();
    bench.go.send(Act::Finish).unwrap();
    assert_eq!(sequence(&wait(&mut greedy_answers)), 1);
    bench.begun.recv_timeout(WAIT_MAX).expect("no inference began");
    bench.go.send(Act::Finish).unwrap();
    // The modest client's frame came before the greedy one's second.
    assert_eq!(sequence(&wait(&mut modest_answers)), 7);
    assert!(greedy_answers.try_recv().is_err());
    bench.go.send(Act::Finish).unwrap();
    assert_eq!(sequence(&wait(&mut greedy_answers)), 2);
}

/// Ten fingers of a session whose frames do not end, and a neighbour: it is served meanwhile.
#[test]
fn ten_fingers_do_not_hold_the_last_thread_while_a_light_session_is_about() {
    let bench = bench_of(2, 16);
    bench.pool.queue.remember_light();
    let account = Account::new(1);
    let (light, mut light_answers) = finger(&account);
    let begun = || bench.begun.recv_timeout(WAIT_MAX).expect("no inference began");
    let mut rendered = 0;
    let mut serve = || {
        rendered += 1;
        bench.handle.submit(&light, job(rendered, FREE_PA, None)).unwrap();
        begun();
        assert_eq!(sequence(&wait(&mut light_answers)), rendered);
    };
    // Nothing is known of a session until one of its frames has been measured.
    let end = Instant::now() + WAIT_MAX;
    serve();
    while account.ledger().weight(Instant::now()) != Weight::Light {
        assert!(Instant::now() < end, "short frames do not make a session light");
        sleep(Duration::from_millis(1));
    }
    let hostile = Account::new(10);
    let fingers: Vec<_> = (0..10).map(|_| finger(&hostile)).collect();
    for (slot, _) in &fingers {
        bench.handle.submit(slot, job(1, 1.0, None)).unwrap();
    }
    begun();
    for _ in 0..5 {
        serve();
    }
    assert!(bench.begun.try_recv().is_err(), "the hostile session got the last thread");
    for _ in &fingers {
        bench.go.send(Act::Finish).unwrap();
    }
    for (_, mut answers) in fingers {
        wait(&mut answers);
    }
}

#[test]
fn late_frames_are_dropped_at_the_dequeue_without_work() {
    let bench = bench();
    let (first, mut first_answers) = client();
    let (second, mut second_answers) = client();
    bench.handle.submit(&first, job(1, 1.0, None)).unwrap();
    bench.begun.recv_timeout(WAIT_MAX).expect("no inference began");
    bench.handle.submit(&second, job(2, 1.0, Some(Duration::from_millis(5)))).unwrap();
    sleep(Duration::from_millis(6));
    bench.go.send(Act::Finish).unwrap();
    wait(&mut first_answers);
    let late = wait(&mut second_answers);
    assert!(matches!(late.outcome, Outcome::Late(Stage::Dequeue)), "{:?}", late.outcome);
    assert!(bench.begun.try_recv().is_err(), "the network was asked");
}

#[test]
fn a_panic_costs_one_frame_and_nothing_else() {
    let bench = bench();
    let (slot, mut answers) = client();
    bench.handle.submit(&slot, job(1, 1.0, None)).unwrap();
    bench.go.send(Act::Panic).unwrap();
    match wait(&mut answers).outcome {
        Outcome::Failed(problem) => assert_eq!(problem.code, ErrorCode::Internal),
        other => panic!("{other:?}"),
    }
    // The fresh session that takes its place has a free run, as for a warm-up.
    bench.handle.submit(&slot, job(2, 2.0, None)).unwrap();
    match wait(&mut answers).outcome {
        Outcome::Map { bytes, .. } => {
            assert_eq!(bytes[HEADROOM + HEADER_LEN..], 2f32.to_le_bytes().repeat(MAP_LEN));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_zero_map_asks_no_network() {
    let bench = bench();
    let (slot, mut answers) = client();
    bench.handle.submit(&slot, job(1, 0.0, None)).unwrap();
    let done = wait(&mut answers);
    assert!(matches!(&done.outcome, Outcome::Map { bytes, .. } if bytes.iter().all(|&b| b == 0)));
    assert_eq!(done.times.infer, Duration::ZERO);
    assert_eq!(bench.metrics.zero_maps.get(), 1);
    assert!(bench.begun.try_recv().is_err(), "the network was asked");
}

#[test]
fn what_was_accepted_before_the_stop_is_answered_and_nothing_after() {
    let mut bench = bench();
    let (slot, mut answers) = client();
    let (other, mut other_answers) = client();
    bench.handle.submit(&slot, job(1, 1.0, None)).unwrap();
    bench.begun.recv_timeout(WAIT_MAX).expect("no inference began");
    bench.handle.submit(&slot, job(2, 1.0, None)).unwrap();
    bench.handle.submit(&other, job(3, 1.0, None)).unwrap();
    for _ in 0..3 {
        bench.go.send(Act::Finish).unwrap();
    }
    bench.pool.stop();
    assert_eq!((sequence(&wait(&mut answers)), sequence(&wait(&mut answers))), (1, 2));
    assert_eq!(sequence(&wait(&mut other_answers)), 3);
    assert!(bench.handle.submit(&slot, job(4, 1.0, None)).is_err());
    assert!(bench.handle.submit(&slot, job(5, 1.0, None)).is_err(), "the slot is idle again");
}

#[test]
fn the_queue_is_bounded() {
    let bench = bench();
    let clients: Vec<_> = (0..6).map(|_| client()).collect();
    bench.handle.submit(&clients[0].0, job(0, 1.0, None)).unwrap();
    bench.begun.recv_timeout(WAIT_MAX).expect("no inference began");
    let results: Vec<bool> = (1..6)
        .map(|n| bench.handle.submit(&clients[n].0, job(n as u32, 1.0, None)).is_ok())
        .collect();
    assert_eq!(results, [true, true, true, true, false]);
    for _ in 0..5 {
        bench.go.send(Act::Finish).unwrap();
    }
}

#[test]
fn answers_reuse_their_memory() {
    let bench = bench();
    let (slot, mut answers) = client();
    let mut places = std::collections::HashSet::new();
    for n in 0..10 {
        bench.handle.submit(&slot, job(n, 0.0, None)).unwrap();
        match wait(&mut answers).outcome {
            Outcome::Map { bytes, .. } => places.insert(bytes.freeze().as_ptr()),
            other => panic!("{other:?}"),
        };
    }
    assert!(places.len() <= 3, "{} buffers for ten frames", places.len());
}
