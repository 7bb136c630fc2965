//! How much of its capacity the service is asked for: what autoscalers scale by.

use std::{
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use papilla_metrics::TIERS_MAX;
use tokio::time::{Instant, sleep};

use crate::{drain::begun, transport::app::App};

/// Time between two looks, and how many are summed up: ten seconds.
const LOOK: Duration = Duration::from_secs(1);
const LOOKS: usize = 10;

/// What was asked for at a look: maps of each tier, time of contact solves. A look allocates nothing.
struct Asked {
    maps: [u64; TIERS_MAX],
    contact_us: u64,
}

impl Asked {
    fn now(app: &App) -> Self {
        let of_tier = |place| app.metrics.tier(place).asked.load(Ordering::Relaxed);
        let maps = std::array::from_fn(of_tier);
        Self { maps, contact_us: app.metrics.contact.asked_us.load(Ordering::Relaxed) }
    }

    /// Thread time that what came since asks for, s, as long as each takes here now.
    fn seconds_since(&self, before: &Self, app: &App) -> f64 {
        let (catalogue, mut us) = (app.catalogue(), self.contact_us - before.contact_us);
        for tier in 0..catalogue.tiers.len().min(TIERS_MAX) {
            let new = self.maps[tier] - before.maps[tier];
            us += new * catalogue.predicted_latency_us(tier);
        }
        us as f64 * 1e-6
    }
}

/// Keeps the figure up to date until the drain begins.
pub(super) async fn until_drain(app: Arc<App>, threads: usize) {
    let (mut before, mut looked) = (Asked::now(&app), Instant::now());
    let mut shares = [0.0; LOOKS];
    for look in 0.. {
        // Held no longer than the wait: a drain waits for whoever holds one.
        let mut drain = app.drain.subscribe();
        tokio::select! {
            () = begun(&mut drain) => return,
            () = sleep(LOOK) => drop(drain),
        }
        let asked = Asked::now(&app);
        let there_is_s = looked.elapsed().as_secs_f64() * threads as f64;
        shares[look % LOOKS] = asked.seconds_since(&before, &app) / there_is_s;
        app.metrics.load.set(shares.iter().sum::<f64>() / LOOKS as f64);
        (before, looked) = (asked, Instant::now());
    }
}
