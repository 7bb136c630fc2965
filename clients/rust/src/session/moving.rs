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

/// Longest wait for what the service remembers; after it the session stays.
const SEAL_PATIENCE: Duration = Duration::from_secs(5);

/// Longest wait for the other connection, and for its ready.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

impl Shared {
    /// Calls [`follow`] where there is something for it to do.
    pub(super) fn tell_of_move(&self) {
        if matches!(self.state().moving, Moving::Asked | Moving::Sealed(_) | Moving::Refused(_)) {
            self.moving.notify_one();
        }
    }
}

/// Waits until the service asks for it, and opens the session anew over another connection, with
/// what the service remembers. Frames go on over the old one until the new one is there; then they
/// wait for what was sent to be answered, and for ready. If the service does not say what it
/// remembers, the session stays until it is asked again.
pub(super) async fn follow(server: &Address, shared: &Shared) -> (Link, Ready) {
    loop {
        while shared.state().moving != Moving::Asked {
            shared.moving.notified().await;
        }
        match attempt(server, shared).await {
            Ok(Some(moved)) => return moved,
            Ok(None) => shared.wake.notify_one(),
            Err(_) => {
                // The old connection goes on for as long as it is there.
                shared.state().moving = Moving::Asked;
                shared.wake.notify_one();
                sleep(RETRY).await;
            }
        }
    }
}

/// None: the session stays.
async fn attempt(server: &Address, shared: &Shared) -> Result<Option<(Link, Ready)>, PapillaError> {
    let silent = |_| PapillaError::unreachable(server, &"no ready came");
    let link = timeout(CONNECT_PATIENCE, Link::connect(server)).await.map_err(silent)??;
    shared.state().moving = Moving::SealDue;
    shared.wake.notify_one();
    let late = |_| Err(format!("nothing came within {} s", SEAL_PATIENCE.as_secs()));
    let sealed = match timeout(SEAL_PATIENCE, sealed(shared)).await.unwrap_or_else(late) {
        Ok(sealed) => sealed,
        Err(why) => {
            shared.state().stay(&why);
            return Ok(None);
        }
    };
    let hello = Hello { resume: Some(true), ..shared.state().hello.clone() };
    let saying = link.say(server, &hello, Some(sealed));
    timeout(CONNECT_PATIENCE, saying).await.map_err(silent)?.map(Some)
}

/// What the service remembers; or why it does not say it.
async fn sealed(shared: &Shared) -> Result<Vec<u8>, String> {
    loop {
        match &mut shared.state().moving {
            Moving::Sealed(state) => return Ok(std::mem::take(state)),
            Moving::Refused(why) => return Err(std::mem::take(why)),
            Moving::Stays | Moving::Asked | Moving::SealDue | Moving::SealSaid => {}
        }
        shared.moving.notified().await;
    }
}
