//! What the machine can do at all: the floor under every latency measured on it.

use std::{
    fmt, io,
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    thread,
    time::{Duration, Instant},
};

use papilla_client::dial;
use papilla_proto::{HEADER_LEN, MAP_LEN};
use serde::{Deserialize, Serialize};

use super::{report::Percentiles, tally::Times};

/// Length of the sleeps.
const SLEEP: Duration = Duration::from_millis(1);

/// Time between two exchanges: some frames in a second, as a session has them.
const GAP: Duration = Duration::from_millis(5);

/// Bytes there and back: a frame of float32 with its header.
const FRAME_BYTES: usize = HEADER_LEN + 4 * MAP_LEN;

/// What a machine does without any service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Floor {
    /// Threads that slept, one a core.
    pub cores: usize,
    /// How much later than asked sleeps of a millisecond ended, us.
    pub sleeps_late_us: Percentiles,
    /// Sleeps that ended more than 1 and more than 2 ms late, percent.
    pub sleeps_late_percent: [f64; 2],
    /// `bytes` over loopback TCP and back, between two blocking threads, us.
    pub exchange_us: Percentiles,
    /// Bytes in each direction.
    pub bytes: usize,
}

/// Measures for about `seconds`.
///
/// # Errors
/// Loopback TCP does not work.
pub async fn floor(seconds: f64) -> io::Result<Floor> {
    let half = Duration::from_secs_f64(seconds / 2.0);
    let cores = thread::available_parallelism()?.get();
    let late = tokio::task::spawn_blocking(move || sleeps(cores, half)).await?;
    let exchange = echo([FRAME_BYTES; 2], half).await?;
    let none = || io::Error::other("no time to measure anything");
    let beyond = |us: u64| {
        let (count, all) = (late.0.count_between(us, u64::MAX), late.0.len());
        100.0 * count as f64 / all.max(1) as f64
    };
    Ok(Floor {
        cores,
        sleeps_late_us: Percentiles::new(&late).ok_or_else(none)?,
        sleeps_late_percent: [1000, 2000].map(beyond),
        exchange_us: Percentiles::new(&exchange).ok_or_else(none)?,
        bytes: FRAME_BYTES,
    })
}

/// So many bytes over loopback TCP, and so many back, between two blocking threads.
pub(super) async fn echo(bytes: [usize; 2], time: Duration) -> io::Result<Times> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let near = dial(&listener.local_addr()?.to_string()).await?.into_std()?;
    let exchange = tokio::task::spawn_blocking(move || {
        let (far, _) = listener.accept()?;
        exchanges(near, far, bytes, time)
    });
    exchange.await?
}

fn sleeps(cores: usize, time: Duration) -> Times {
    let sleeper = || {
        let (mut late, begun) = (Times::default(), Instant::now());
        while begun.elapsed() < time {
            let start = Instant::now();
            thread::sleep(SLEEP);
            late.record(start.elapsed().saturating_sub(SLEEP));
        }
        late
    };
    let mut all = Times::default();
    thread::scope(|scope| {
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(sleeper)).collect();
        for thread in threads {
            // Err: it panicked, and its sleeps are not counted.
            if let Ok(late) = thread.join() {
                all.add(&late);
            }
        }
    });
    all
}

fn exchanges(
    mut near: TcpStream,
    mut far: TcpStream,
    [there, back]: [usize; 2],
    time: Duration,
) -> io::Result<Times> {
    near.set_nonblocking(false)?;
    far.set_nodelay(true)?;
    let echo = thread::spawn(move || -> io::Result<()> {
        let (mut heard, said) = (vec![0; there], vec![0; back]);
        loop {
            far.read_exact(&mut heard)?;
            far.write_all(&said)?;
        }
    });
    let (said, mut heard) = (vec![0; there], vec![0; back]);
    let (mut times, begun) = (Times::default(), Instant::now());
    while begun.elapsed() < time {
        thread::sleep(GAP);
        let start = Instant::now();
        near.write_all(&said)?;
        near.read_exact(&mut heard)?;
        times.record(start.elapsed());
    }
    drop(near);
    // It ends with an error: the other end is gone.
    let _ = echo.join();
    Ok(times)
}

impl fmt::Display for Floor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:32}{:>9}{:>9}{:>9}{:>9}{:>9}", "us", "p50", "p90", "p99", "p99.9", "max")?;
        let exchange = format!("{} bytes there and back", self.bytes);
        for (name, p) in [
            ("a sleep of 1 ms is late by", self.sleeps_late_us),
            (exchange.as_str(), self.exchange_us),
        ] {
            write!(f, "{name:32}")?;
            for us in [p.p50, p.p90, p.p99, p.p99_9, p.max] {
                write!(f, "{us:>9}")?;
            }
            writeln!(f)?;
        }
        let [one, two] = self.sleeps_late_percent;
        writeln!(f, "{one:.3} % of the sleeps are more than 1 ms late, {two:.3} % more than 2 ms")
    }
}
