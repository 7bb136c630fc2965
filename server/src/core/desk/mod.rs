//! The desk: threads for work that a client asks for before its frames, such as checking a hello
//! that holds a mesh. Such work takes long, so these few threads serve no frames.
//!
//! ```text
//! work ──► waiting (few of a client, bounded in all) ──► thread ──► result
//!             └──(whoever asked is gone)──► dropped        └──(gone)──► cancelled
//! ```

use std::{
    collections::VecDeque,
    io,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use tokio::sync::oneshot;

/// Pieces of work that may wait, in all and of one client.
const WAITING_MAX: usize = 128;
const OF_CLIENT_MAX: usize = 32;

/// Longest wait of a thread for work; every wait is timed.
const WAIT: Duration = Duration::from_millis(500);

/// Whether anybody still waits for a piece of work.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Whether the work is for nothing.
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Why there is no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoResult {
    /// Too much waits already.
    Busy,
    /// The work panicked, or the service ends.
    Broken,
}

/// Threads for work of clients that are told apart by `K`.
pub(crate) struct Desk<K> {
    shared: Arc<Shared<K>>,
}

struct Shared<K> {
    state: Mutex<State<K>>,
    arrival: Condvar,
    /// Pieces of work of one client that may be under way.
    of_client_max: usize,
}

struct State<K> {
    /// Those that have work, waiting or under way.
    clients: Vec<Client<K>>,
    waiting: usize,
    /// Numbers of pieces of work, and of turns.
    count: u64,
    closed: bool,
}

struct Client<K> {
    key: K,
    running: usize,
    waiting: VecDeque<Piece>,
    /// When it last had a turn.
    turn: u64,
}

struct Piece {
    number: u64,
    cancel: Cancel,
    work: Box<dyn FnOnce(&Cancel) + Send>,
}

impl<K: Clone + PartialEq + Send + 'static> Desk<K> {
    /// Starts the threads; each calls `begin` first.
    ///
    /// # Errors
    /// The system starts no more threads.
    pub(crate) fn start(
        threads: usize,
        begin: impl Fn() + Clone + Send + 'static,
    ) -> io::Result<Self> {
        let shared = Arc::new(Shared::new(threads));
        let desk = Self { shared: Arc::clone(&shared) };
        for number in 0..threads {
            let (shared, begin) = (Arc::clone(&shared), begin.clone());
            let serve = move || {
                begin();
                shared.serve();
            };
            thread::Builder::new().name(format!("papilla-desk-{number}")).spawn(serve)?;
        }
        Ok(desk)
    }

    /// Does a piece of work for a client. Dropped, it is taken back if it has not begun, and
    /// cancelled if it has.
    ///
    /// # Errors
    /// Too much waits already; the work panicked.
    pub(crate) async fn work<T: Send + 'static>(
        &self,
        client: K,
        work: impl FnOnce(&Cancel) -> T + Send + 'static,
    ) -> Result<T, NoResult> {
        let (result, waiting) = oneshot::channel();
        let work = Box::new(move |cancel: &Cancel| {
            // Err: nobody waits for it any more.
            let _ = result.send(work(cancel));
        });
        let _asked = self.shared.enter(client, work).ok_or(NoResult::Busy)?;
        waiting.await.map_err(|_| NoResult::Broken)
    }
}

impl<K> Drop for Desk<K> {
    fn drop(&mut self) {
        let mut state = self.shared.state();
        state.closed = true;
        state.clients.clear();
        drop(state);
        self.shared.arrival.notify_all();
    }
}

/// Takes the work back when it is dropped.
struct Asked<K> {
    shared: Arc<Shared<K>>,
    number: u64,
    cancel: Cancel,
}

impl<K> Drop for Asked<K> {
    fn drop(&mut self) {
        self.cancel.set();
        let mut state = self.shared.state();
        let mut taken_back = None;
        for client in &mut state.clients {
            let place = client.waiting.iter().position(|piece| piece.number == self.number);
            taken_back = place.and_then(|place| client.waiting.remove(place)).or(taken_back);
        }
        state.waiting -= usize::from(taken_back.is_some());
        state.clients.retain(Client::has_work);
        drop(state);
        // What it holds may be large, and is freed without the lock.
        drop(taken_back);
    }
}

impl<K> Client<K> {
    fn has_work(&self) -> bool {
        self.running > 0 || !self.waiting.is_empty()
    }
}

impl<K> Shared<K> {
    fn state(&self) -> MutexGuard<'_, State<K>> {
        // Every change leaves the state whole, so a poisoned lock is usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Clone + PartialEq> Shared<K> {
    fn new(threads: usize) -> Self {
        let state = State { clients: Vec::new(), waiting: 0, count: 0, closed: false };
        // A client never has all threads, so that another's first hello need not wait for its work.
        let of_client_max = threads.saturating_sub(1).max(1);
        Self { state: Mutex::new(state), arrival: Condvar::new(), of_client_max }
    }

    /// Takes a piece in; none: too much waits.
    fn enter(self: &Arc<Self>, key: K, work: Box<dyn FnOnce(&Cancel) + Send>) -> Option<Asked<K>> {
        let mut state = self.state();
        state.count += 1;
        let (number, cancel) = (state.count, Cancel::default());
        if state.closed || state.waiting >= WAITING_MAX {
            return None;
        }
        let place = state.clients.iter().position(|client| client.key == key);
        let place = place.unwrap_or_else(|| {
            state.clients.push(Client { key, running: 0, waiting: VecDeque::new(), turn: 0 });
            state.clients.len() - 1
        });
        let client = &mut state.clients[place];
        if client.waiting.len() >= OF_CLIENT_MAX {
            return None;
        }
        client.waiting.push_back(Piece { number, cancel: cancel.clone(), work });
        state.waiting += 1;
        drop(state);
        self.arrival.notify_one();
        Some(Asked { shared: Arc::clone(self), number, cancel })
    }

    /// The next piece of the client whose last turn is the longest ago.
    fn next(&self, state: &mut State<K>) -> Option<(K, Piece)> {
        let may = |client: &&mut Client<K>| {
            client.running < self.of_client_max && !client.waiting.is_empty()
        };
        let client = state.clients.iter_mut().filter(may).min_by_key(|client| client.turn)?;
        let piece = client.waiting.pop_front()?;
        client.running += 1;
        state.count += 1;
        client.turn = state.count;
        state.waiting -= 1;
        Some((client.key.clone(), piece))
    }

    /// The client has a thread less; one without work is forgotten.
    fn end(&self, key: &K) {
        let mut state = self.state();
        if let Some(client) = state.clients.iter_mut().find(|client| client.key == *key) {
            client.running = client.running.saturating_sub(1);
        }
        state.clients.retain(Client::has_work);
    }

    /// Works until the desk is closed.
    fn serve(&self) {
        loop {
            let mut state = self.state();
            if state.closed {
                return;
            }
            let Some((key, Piece { cancel, work, .. })) = self.next(&mut state) else {
                let waited = self.arrival.wait_timeout(state, WAIT);
                drop(waited.unwrap_or_else(PoisonError::into_inner));
                continue;
            };
            drop(state);
            if !cancel.is_set() && catch_unwind(AssertUnwindSafe(|| work(&cancel))).is_err() {
                tracing::error!("work at the desk panicked");
            }
            self.end(&key);
        }
    }
}

#[cfg(test)]
mod tests;
