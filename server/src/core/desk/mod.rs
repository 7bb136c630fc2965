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

/// Pieces of work that may wait, of all clients together and of one client.
const WAITING_MAX: usize = 128;
const OF_CLIENT_MAX: usize = 32;

/// Longest wait of a thread for work; every wait is timed.
const WAIT: Duration = Duration::from_millis(500);

/// A flag that tells a piece of work that nobody waits for its result any more.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Whether the result is no longer wanted.
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
    /// Too many pieces of work wait already.
    Busy,
    /// The work panicked, or the desk was closed.
    Broken,
}

/// Threads for work of clients that are told apart by `K`.
pub(crate) struct Desk<K> {
    shared: Arc<Shared<K>>,
}

struct Shared<K> {
    state: Mutex<State<K>>,
    arrival: Condvar,
    /// The most pieces of work of one client that may run at a time.
    of_client_max: usize,
}

struct State<K> {
    /// The clients that have work, waiting or running.
    clients: Vec<Client<K>>,
    waiting: usize,
    /// The last number given to a piece of work or to a turn.
    count: u64,
    closed: bool,
}

struct Client<K> {
    key: K,
    running: usize,
    waiting: VecDeque<Piece>,
    /// The number of its last turn; 0 before the first.
    turn: u64,
}

struct Piece {
    number: u64,
    cancel: Cancel,
    work: Box<dyn FnOnce(&Cancel) + Send>,
}

impl<K: Clone + PartialEq + Send + 'static> Desk<K> {
    /// Starts the threads. Each calls `begin` before it serves.
    ///
    /// # Errors
    /// The system cannot start a thread.
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

    /// Does a piece of work for a client. If this future is dropped, work that has not begun is
    /// removed, and work that has begun is told by its [`Cancel`].
    ///
    /// # Errors
    /// [`NoResult::Busy`] if too much waits already, [`NoResult::Broken`] if the work panicked or
    /// the desk was closed.
    pub(crate) async fn work<T: Send + 'static>(
        &self,
        client: K,
        work: impl FnOnce(&Cancel) -> T + Send + 'static,
    ) -> Result<T, NoResult> {
        let (result, waiting) = oneshot::channel();
        let work = Box::new(move |cancel: &Cancel| {
            // Fails if nobody waits for the result any more.
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

/// Cancels the work when it is dropped, and removes it if it has not begun.
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
        // The closure may hold much memory, so it is freed without the lock.
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
        // With two threads or more a client never has all of them, so that another client's first
        // hello need not wait for its work.
        let of_client_max = threads.saturating_sub(1).max(1);
        Self { state: Mutex::new(state), arrival: Condvar::new(), of_client_max }
    }

    /// Queues a piece of work. None: too much waits, or the desk is closed.
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

    /// The next piece of work of the client whose last turn was longest ago.
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

    /// Notes that a piece of work of this client has ended. A client without work is forgotten.
    fn end(&self, key: &K) {
        let mut state = self.state();
        if let Some(client) = state.clients.iter_mut().find(|client| client.key == *key) {
            client.running = client.running.saturating_sub(1);
        }
        state.clients.retain(Client::has_work);
    }

    /// What each thread runs: it does work until the desk is closed.
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
