//! Going on over another connection when the service asks for it.

use std::time::Duration;

use papilla_proto::{Hello, Ready};
use tokio::time::{sleep, timeout};

use super::{
    Shared,
    link::{Link, RETRY},
    state::Moving,
};
use crate::{Address, PapillaError};

/// Longest wait for what the service remembers; after it the session starts anew.
const SEAL_PATIENCE: Duration = Duration::from_secs(5);

/// Longest wait for the other connection, and for its ready.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

impl Shared {
    /// Calls [`follow`] where there is something for it to do.
    pub(super) fn tell_of_move(&self) {
        if matches!(self.state().moving, Moving::Asked | Moving::Sealed(_)) {
            self.moving.notify_one();
        }
    }
}

/// Waits until the service asks for it, and opens the session anew over another connection, with
/// what the service remembers. Frames go on over the old one until the new one is there; then they
/// wait for what was sent to be answered, and for ready.
pub(super) async fn follow(server: &Address, shared: &Shared) -> (Link, Ready) {
    loop {
        while shared.state().moving != Moving::Asked {
            shared.moving.notified().await;
        }
        if let Ok(moved) = attempt(server, shared).await {
            return moved;
        }
        // The old connection goes on for as long as it is there.
        shared.state().moving = Moving::Asked;
        shared.wake.notify_one();
        sleep(RETRY).await;
    }
}

async fn attempt(server: &Address, shared: &Shared) -> Result<(Link, Ready), PapillaError> {
    let silent = |_| PapillaError::unreachable(server, &"no ready came");
    let link = timeout(CONNECT_PATIENCE, Link::connect(server)).await.map_err(silent)??;
    shared.state().moving = Moving::SealDue;
    shared.wake.notify_one();
    // Err: the session starts anew.
    let sealed = timeout(SEAL_PATIENCE, sealed(shared)).await.ok();
    let resume = sealed.as_ref().map(|_| true);
    let hello = Hello { resume, ..shared.state().hello.clone() };
    timeout(CONNECT_PATIENCE, link.say(server, &hello, sealed)).await.map_err(silent)?
}

async fn sealed(shared: &Shared) -> Vec<u8> {
    loop {
        if let Moving::Sealed(state) = &mut shared.state().moving {
            return std::mem::take(state);
        }
        shared.moving.notified().await;
    }
}
