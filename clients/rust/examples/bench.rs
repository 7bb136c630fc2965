//! Round trips of the Rust client at a steady rate, as one line of JSON (docs/reports/clients.md).
//!
//! `cargo run --release -p papilla-client --example bench -- [--rate-hz 90] [--duration-s 60]`;
//! `PAPILLA_URL` names the service.

use std::{
    env,
    time::{Duration, Instant},
};

use papilla_client::{
    Session,
    proto::{Hello, MAP_LEN, MAP_SIDE_PX},
};
use tokio::{sync::mpsc, time};

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = env::args().collect();
    let option = |name: &str, otherwise: f64| {
        let value = arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
        value.map_or(Ok(otherwise), |text| text.parse::<f64>())
    };
    let (rate_hz, duration_s) = (option("--rate-hz", 90.0)?, option("--duration-s", 60.0)?);
    let (frames, warm_up) = ((rate_hz * duration_s) as u32, rate_hz as u32);
    let server = env::var("PAPILLA_URL").unwrap_or_else(|_| "127.0.0.1:7224".to_owned());
    let hello = Hello { tier: Some("half-space".to_owned()), ..Hello::default() };
    let session = Session::open(&server, hello).await?;
    let bump = |i: usize| {
        let (x, y) = ((i % MAP_SIDE_PX) as f32 - 112.0, (i / MAP_SIDE_PX) as f32 - 112.0);
        2e4 * (-(x * x + y * y) / 288.0).exp()
    };
    let pressure_pa: Vec<f32> = (0..MAP_LEN).map(bump).collect();
    let start = Instant::now() + Duration::from_millis(20);
    let (done, mut times) = mpsc::unbounded_channel();
    for frame in 0..warm_up + frames {
        let due = start + Duration::from_secs_f64(f64::from(frame) / rate_hz);
        // The runtime's timers are good to a millisecond only: the last of it is waited for.
        time::sleep_until((due - Duration::from_micros(1500)).into()).await;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let outcome = session.send(&pressure_pa)?;
        let done = done.clone();
        tokio::spawn(async move {
            if outcome.await.is_ok_and(|answer| answer.is_ok()) && frame >= warm_up {
                // Err: the measurement is over.
                let _ = done.send(due.elapsed().as_micros() as u64);
            }
        });
    }
    time::sleep(Duration::from_secs(1)).await;
    drop((session, done));
    let mut times_us = Vec::new();
    while let Some(time_us) = times.recv().await {
        times_us.push(time_us);
    }
    times_us.sort_unstable();
    let share = |of: f64| times_us.get((of * (times_us.len().max(1) - 1) as f64) as usize);
    let [p50, p99, max] = [0.5, 0.99, 1.0].map(|of| share(of).copied().unwrap_or_default());
    println!(
        r#"{{"client": "rust", "rate_hz": {rate_hz}, "frames": {}, "p50_us": {p50}, "p99_us": {p99}, "max_us": {max}, "missing": {}}}"#,
        times_us.len(),
        (frames as usize).saturating_sub(times_us.len()),
    );
    Ok(())
}
