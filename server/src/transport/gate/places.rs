//! Places for connections, and whose they are.
//!
//! Where tokens are asked for, a connection is a newcomer until a request on it has shown one.
//! Newcomers have half of the places, few for each address, and beyond that the oldest of them
//! gives way to the next: so nobody without a token keeps a holder of one from coming in.
//!
//! ```text
//! accepted ──► newcomer ──(a token is shown)──► holder
//!                 └──(a later newcomer needs the place)──► ended
//! ```

use std::{
    collections::VecDeque,
    net::IpAddr,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use tokio::sync::{AcquireError, Notify, OwnedSemaphorePermit, Semaphore};

use super::rate::network_of;

/// Share of the places that newcomers may have.
const NEWCOMERS_SHARE: usize = 2;

/// Share of the places that newcomers of one address may have.
const ADDRESS_SHARE: usize = 16;

/// The places of a service.
pub(crate) struct Places {
    all: Arc<Semaphore>,
    /// None: no token is asked for, and everybody is alike.
    newcomers: Option<Arc<Newcomers>>,
}

struct Newcomers {
    max: usize,
    max_of_address: usize,
    /// The oldest first.
    queue: Mutex<VecDeque<Newcomer>>,
}

struct Newcomer {
    address: IpAddr,
    handle: Arc<PlaceHandle>,
}

/// What a connection and its requests share of its place.
#[derive(Default)]
pub(crate) struct PlaceHandle {
    is_newcomer: AtomicBool,
    newcomers: Option<Arc<Newcomers>>,
    /// Told when the connection has to give way.
    evicted: Notify,
}

/// A place of a connection; given back when it is dropped.
pub(crate) struct Place {
    _permit: OwnedSemaphorePermit,
    pub(crate) handle: Arc<PlaceHandle>,
}

impl Places {
    pub(crate) fn new(places: usize, are_tokens_asked: bool) -> Self {
        let newcomers = are_tokens_asked.then(|| {
            Arc::new(Newcomers {
                max: (places / NEWCOMERS_SHARE).max(1),
                max_of_address: (places / ADDRESS_SHARE).max(1),
                queue: Mutex::default(),
            })
        });
        Self { all: Arc::new(Semaphore::new(places)), newcomers }
    }

    /// Waits until a place is free.
    pub(crate) async fn free(&self) -> Result<OwnedSemaphorePermit, AcquireError> {
        Arc::clone(&self.all).acquire_owned().await
    }

    /// The place of a connection from `address`. An older newcomer, of the same address if that
    /// has all that it may have, gives way to it.
    pub(crate) fn take(&self, permit: OwnedSemaphorePermit, address: IpAddr) -> Place {
        let Some(newcomers) = &self.newcomers else {
            return Place { _permit: permit, handle: Arc::default() };
        };
        let address = network_of(address);
        let mut queue = newcomers.queue();
        let of_address = |newcomer: &Newcomer| newcomer.address == address;
        let gives_way =
            if queue.iter().filter(|n| of_address(n)).count() >= newcomers.max_of_address {
                queue.iter().position(of_address)
            } else {
                (queue.len() >= newcomers.max).then_some(0)
            };
        if let Some(oldest) = gives_way.and_then(|index| queue.remove(index)) {
            oldest.handle.evicted.notify_one();
        }
        let newcomers = Some(Arc::clone(newcomers));
        let is_newcomer = AtomicBool::new(true);
        let handle = Arc::new(PlaceHandle { is_newcomer, newcomers, evicted: Notify::new() });
        queue.push_back(Newcomer { address, handle: Arc::clone(&handle) });
        Place { _permit: permit, handle }
    }
}

impl Newcomers {
    fn queue(&self) -> MutexGuard<'_, VecDeque<Newcomer>> {
        // Every change leaves the queue whole, so a poisoned lock is usable.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PlaceHandle {
    /// A request has shown a token: the connection is no newcomer from now on.
    pub(crate) fn on_token(&self) {
        if let (true, Some(newcomers)) =
            (self.is_newcomer.swap(false, Ordering::Relaxed), &self.newcomers)
        {
            newcomers.queue().retain(|newcomer| !std::ptr::eq(&*newcomer.handle, self));
        }
    }

    /// Waits until the connection has to give way; for ever, as a rule.
    pub(crate) async fn evicted(&self) {
        self.evicted.notified().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.handle.on_token();
    }
}

#[cfg(test)]
mod tests {
    use futures_util::FutureExt;

    use super::*;

    fn place(places: &Places, address: [u8; 4]) -> Place {
        places.take(Arc::clone(&places.all).try_acquire_owned().unwrap(), address.into())
    }

    /// Whether each has to give way.
    fn evicted(held: &[Place]) -> Vec<bool> {
        let is_told = |place: &Place| std::pin::pin!(place.handle.evicted()).now_or_never();
        held.iter().map(|place| is_told(place).is_some()).collect()
    }

    #[test]
    fn an_address_has_few_places_until_it_shows_a_token() {
        let places = Places::new(64, true);
        let mut held: Vec<_> = (0..4).map(|_| place(&places, [10, 0, 0, 1])).collect();
        held.push(place(&places, [10, 0, 0, 2]));
        assert_eq!(evicted(&held), [false; 5]);
        held[0].handle.on_token();
        held.push(place(&places, [10, 0, 0, 1]));
        assert_eq!(evicted(&held), [false; 6]);
        held.push(place(&places, [10, 0, 0, 1]));
        assert_eq!(evicted(&held), [false, true, false, false, false, false, false]);
        held.clear();
        assert_eq!(places.all.available_permits(), 64);
        assert!(places.newcomers.unwrap().queue().is_empty());
    }

    #[test]
    fn the_oldest_newcomer_gives_way_and_a_holder_does_not() {
        let places = Places::new(8, true);
        let mut held: Vec<_> = (0..4).map(|n| place(&places, [10, 0, 0, n])).collect();
        held[0].handle.on_token();
        held.extend((4..6).map(|n| place(&places, [10, 0, 0, n])));
        assert_eq!(evicted(&held), [false, true, false, false, false, false]);
    }

    #[test]
    fn without_tokens_everybody_is_alike() {
        let places = Places::new(4, false);
        let held: Vec<_> = (0..4).map(|_| place(&places, [10, 0, 0, 1])).collect();
        assert_eq!(evicted(&held), [false; 4]);
    }
}
