//! Measures again the tiers that nobody uses.
//!
//! The frames of a tier that is used measure it. But a tier that seemed slow, because the machine
//! was busy at the time, is chosen for no budget. No frame would measure it, and it would seem slow
//! forever.

use std::{sync::Arc, time::Duration};

use tokio::{task::spawn_blocking, time::sleep};

use crate::{core::catalogue::calibrate, drain::begun, transport::app::App};

/// Time between two tiers, so that it costs an idle machine next to nothing.
const PAUSE: Duration = Duration::from_secs(10);

/// How often each tier is looked at; later those alone that have been faster than they seem.
const ROUNDS: usize = 3;

/// Measures one tier after the other, each time while nobody is served, until the drain begins.
pub(super) async fn until_drain(app: Arc<App>) {
    for round in 0.. {
        let (mut finger, mut place) = (0, 0);
        while let Some(catalogue) = app.reloader.catalogue_at(finger) {
            // Held no longer than the wait: a drain waits for whoever holds one.
            let mut drain = app.drain.subscribe();
            tokio::select! {
                () = begun(&mut drain) => return,
                () = sleep(PAUSE) => drop(drain),
            }
            if !app.is_idle() {
                continue;
            }
            let Some(tier) = catalogue.tiers.get(place) else {
                (finger, place) = (finger + 1, 0);
                continue;
            };
            if round >= ROUNDS && !tier.latency.has_been_faster() {
                place += 1;
                continue;
            }
            let measured = spawn_blocking(move || calibrate::remeasure(&catalogue.tiers[place]));
            if let Ok(Err(error)) = measured.await {
                tracing::warn!(%error, "a tier cannot be measured again");
            }
            place += 1;
        }
    }
}
