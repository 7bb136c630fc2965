//! `--real-time`: the order of the threads, and what it is for.

use std::{
    fs,
    net::SocketAddr,
    os::unix::fs::PermissionsExt,
    process::Command,
    thread,
    time::{Duration, Instant},
};

use papilla_proto::{FrameHeader, FrameStatus, SampleType, Window};
use serde_json::json;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};
use tokio::{runtime::Builder, time::sleep_until};

use crate::support::{Logged, Socket, hello, metric_at, model_folder, program_by};

const FIFO: ThreadSchedulePolicy =
    ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);

/// Policies of threads, as sched(7) numbers them.
const SCHED_FIFO: u64 = 1;

/// Name, policy, real-time priority and niceness of each thread of a process (proc(5)).
fn threads_of(pid: u32) -> Vec<(String, u64, u64, i64)> {
    let tasks = fs::read_dir(format!("/proc/{pid}/task")).unwrap();
    tasks
        .filter_map(|task| {
            let stat = fs::read_to_string(task.ok()?.path().join("stat")).ok()?;
            let (head, tail) = stat.rsplit_once(") ")?;
            let name = head.split_once('(')?.1.to_owned();
            // The state is field 3; priorities are 19 (nice), 40 and 41.
            let field = |n: usize| tail.split_whitespace().nth(n - 3);
            let number = |n| field(n)?.parse().ok();
            Some((name, number(41)?, number(40)?, field(19)?.parse().ok()?))
        })
        .collect()
}

/// Whether this system lets us set real-time priorities; says so if not.
fn is_permitted(what: &str) -> bool {
    let tried = Command::new("chrt").args(["-f", "20", "true"]).output();
    let is_permitted = tried.is_ok_and(|tried| tried.status.success());
    if !is_permitted {
        eprintln!("skipped: {what}: `chrt -f 20 true` is refused or missing here");
    }
    is_permitted
}

fn assert_ordered(pid: u32, reading: u64) {
    let threads = threads_of(pid);
    let of = |prefix: &str| {
        let of: Vec<_> = threads.iter().filter(|thread| thread.0.starts_with(prefix)).collect();
        assert!(!of.is_empty(), "no {prefix} in {threads:?}");
        of
    };
    let readers = of("papilla-io").into_iter().filter(|thread| thread.1 == SCHED_FIFO);
    let readers: Vec<_> = readers.map(|thread| thread.2).collect();
    assert_eq!(readers, [reading; 2], "{threads:?}");
    for thread in of("infer-") {
        assert!(thread.1 != SCHED_FIFO || thread.2 < reading, "{threads:?}");
    }
    for thread in of("papilla-desk") {
        assert_eq!((thread.1, thread.2, thread.3), (0, 0, 10), "{threads:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn reading_goes_before_rendering_however_the_service_was_started() {
    let folder = model_folder();
    if !is_permitted("the order of threads") {
        return;
    }
    let service = Logged::start_by(&[], folder.path(), &["--real-time"], 1);
    assert_ordered(service.running.child.id(), 20);
    let granted = metric_at(service.running.address, "papilla_real_time{what=\"reading\"}").await;
    assert!(granted > 0.5, "{}", service.log());
    assert!(service.log().contains("real time: reading SCHED_FIFO 20"), "{}", service.log());
    drop(service);
    // As documents once advised: all threads would have one priority.
    let inherited = Logged::start_by(&["chrt", "-f", "17"], folder.path(), &[], 1);
    assert_ordered(inherited.running.child.id(), 17);
    assert!(inherited.log().contains("started at real-time priority 17"), "{}", inherited.log());
}

#[test]
fn what_the_system_refuses_is_said() {
    let folder = model_folder();
    // The folder of a test belongs to whoever runs it.
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let starter = [
        "prlimit",
        "--rtprio=0:0",
        "--nice=0:0",
        "--memlock=65536:65536",
        "setpriv",
        "--reuid=65534",
        "--clear-groups",
        "--bounding-set=-all",
        "--inh-caps=-all",
    ];
    let tried = program_by(&starter, &["--version"]).output();
    if !tried.is_ok_and(|tried| tried.status.success()) {
        eprintln!("skipped: refusals: no program can be run without rights here");
        return;
    }
    let service = Logged::start_by(&starter, folder.path(), &["--real-time"], 1);
    let real_time = &service.running.started["real_time"];
    for (what, word) in
        [("reading", "LimitRTPRIO"), ("rendering", "LimitNICE"), ("memory", "LimitMEMLOCK")]
    {
        let refused = real_time[what]["refused"].as_str().unwrap_or_else(|| panic!("{real_time}"));
        assert!(refused.contains(word), "{what}: {refused}");
        let log = service.log();
        assert!(log.contains(&format!("real time: {what} refused")), "{log}");
    }
}

/// A frame under a window of 4 x 4 pixels.
fn small(sequence: u32, sent: Duration) -> Vec<u8> {
    let window = Window { x: 100, y: 100, width: 4, height: 4 };
    let sent_us = sent.as_micros() as u64;
    let header = FrameHeader::pressure(sequence, sent_us, 0, SampleType::U8, 50.0).windowed(window);
    header.encode().iter().copied().chain([100; 16]).collect()
}

/// Sends frames at a pace. Ages of the maps that come back, less the time in the network, and how
/// many frames were superseded.
async fn ages(address: SocketAddr, period: Duration, frames: u32) -> (Vec<Duration>, usize) {
    let mut socket = Socket::connect(address).await.unwrap();
    let terms = json!({"tier": "slow", "sample_type": "u8"});
    socket.open(hello(&terms)).await;
    let (begun, mut sent, mut answered) = (Instant::now(), 0, 0);
    let (mut ages, mut superseded) = (Vec::new(), 0);
    while answered < frames {
        tokio::select! {
            () = sleep_until((begun + period * sent).into()), if sent < frames => {
                sent += 1;
                socket.send(small(sent, begun.elapsed())).await;
            }
            (header, _) = socket.hear_frame() => {
                answered += 1;
                let age = begun.elapsed() - Duration::from_micros(header.client_time_us);
                let map = Duration::from_micros(header.infer_us.into());
                match header.status {
                    // Nothing newer takes the place of the last one.
                    FrameStatus::Ok if sent == frames => {}
                    FrameStatus::Ok => ages.push(age.saturating_sub(map)),
                    FrameStatus::Superseded => superseded += 1,
                    other => panic!("{other:?}"),
                }
            }
        }
    }
    (ages, superseded)
}

/// More sessions than the threads can serve, at a pace: what is rendered is the newest frame.
///
/// Times are in periods of the clients, and the clients go before what they judge.
#[tokio::test(flavor = "multi_thread")]
async fn an_overloaded_service_renders_the_newest_frames() {
    const SESSIONS: usize = 6;
    const PERIOD: Duration = Duration::from_millis(50);
    const FRAMES: u32 = 60;
    if !is_permitted("the age of frames under load") {
        return;
    }
    let folder = model_folder();
    let cores = thread::available_parallelism().unwrap().get();
    let ways: [(&[&str], &[&str], usize); 3] = [
        (&[], &["--real-time"], cores),
        (&[], &["--real-time"], 1),
        (&["chrt", "-f", "10"], &[], cores),
    ];
    for (starter, more, threads) in ways {
        let service = Logged::start_by(starter, folder.path(), more, threads);
        let address = service.running.address;
        let judge = move || {
            let (priority, own) = (ThreadPriority::Crossplatform(15.try_into().unwrap()), FIFO);
            set_thread_priority_and_policy(thread_native_id(), priority, own).unwrap();
            let runtime = Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(ages(address, PERIOD, FRAMES))
        };
        let sessions: Vec<_> = (0..SESSIONS).map(|_| thread::spawn(judge)).collect();
        let judged = sessions.into_iter().map(|session| session.join().unwrap());
        let (ages, superseded): (Vec<_>, Vec<_>) = judged.unzip();
        let superseded: usize = superseded.iter().sum();
        assert!(superseded > FRAMES as usize, "{superseded} superseded: this was no overload");
        let oldest = ages.iter().flatten().max().unwrap();
        // Frames that wait in turn would grow older through all of the run.
        assert!(*oldest <= FRAMES / 10 * PERIOD, "{starter:?} {more:?} {threads}: {oldest:?}");
    }
}
