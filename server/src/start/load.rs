//! The load: thread time that all frames asked for, over the thread time that there is. Autoscalers
//! go by it.

use std::{
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use papilla_metrics::{BUNDLES_MAX, TIERS_MAX};
use tokio::time::{Instant, sleep};

use crate::{drain::begun, transport::app::App};

/// Time between two looks, and how many are summed up: ten seconds.
const LOOK: Duration = Duration::from_secs(1);
const LOOKS: usize = 10;

/// What was asked for at a look: maps of each tier by its number, time of contact solves. A look
/// allocates nothing.
struct Asked {
    maps: Box<[u64]>,
    contact_us: u64,
}

impl Asked {
    fn none() -> Self {
        Self { maps: vec![0; BUNDLES_MAX * TIERS_MAX].into_boxed_slice(), contact_us: 0 }
    }

    /// Takes note of what was asked for until now; thread time that what came since the last look
    /// asks for, s, as long as each takes here now.
    fn look(&mut self, app: &App) -> f64 {
        let contact_us = app.metrics.contact.asked_us.load(Ordering::Relaxed);
        let mut us = contact_us - std::mem::replace(&mut self.contact_us, contact_us);
        let mut finger = 0;
        while let Some(catalogue) = app.reloader.catalogue_at(finger) {
            for place in 0..catalogue.tiers.len().min(TIERS_MAX) {
                let number = catalogue.tier_number(place);
                let asked = app.metrics.tier(number).asked.load(Ordering::Relaxed);
                let new = asked - std::mem::replace(&mut self.maps[number], asked);
                us += new * catalogue.predicted_latency_us(place);
            }
            finger += 1;
        }
        us as f64 * 1e-6
    }
}

/// Keeps the figure up to date until the drain begins.
pub(super) async fn until_drain(app: Arc<App>, threads: usize) {
    // Nothing was asked for before the start.
    let (mut asked, mut looked) = (Asked::none(), Instant::now());
    let mut shares = [0.0; LOOKS];
    for look in 0.. {
        // Held no longer than the wait: a drain waits for whoever holds one.
        let mut drain = app.drain.subscribe();
        tokio::select! {
            () = begun(&mut drain) => return,
            () = sleep(LOOK) => drop(drain),
        }
        let there_is_s = looked.elapsed().as_secs_f64() * threads as f64;
        shares[look % LOOKS] = asked.look(&app) / there_is_s;
        app.metrics.load.set(shares.iter().sum::<f64>() / LOOKS as f64);
        looked = Instant::now();
    }
}
