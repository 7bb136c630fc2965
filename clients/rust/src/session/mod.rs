//! A session that reconnects by itself.

mod hand;
mod link;
mod live;
mod moving;
mod state;
mod told;

use std::{
    sync::{Arc, OnceLock},
    time::{Duration, Instant},
};

use papilla_proto::{Hello, Ready, Window};
use tokio::{
    sync::{Notify, oneshot, watch},
    task::JoinHandle,
};

use crate::{Answer, PapillaError, ToAddress};
pub use hand::NetForce;
use link::Link;
use state::{Asked, State};

/// A frame to be sent.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Pressure of the window's pixels, Pa, row by row.
    pub pressure_pa: &'a [f32],
    /// The pixels that are sent; all others are 0.
    pub window: Window,
    /// Time by the client's clock, us; none: the session's own.
    pub client_time_us: Option<u64>,
    /// Deadline from receipt, us; 0: the session's budget.
    pub deadline_us: u32,
}

impl<'a> From<&'a [f32]> for Frame<'a> {
    /// A whole map, or no contact if it is empty.
    fn from(pressure_pa: &'a [f32]) -> Self {
        let window = if pressure_pa.is_empty() { Window::EMPTY } else { Window::WHOLE };
        Self { pressure_pa, window, client_time_us: None, deadline_us: 0 }
    }
}

impl<'a> From<&'a Vec<f32>> for Frame<'a> {
    fn from(pressure_pa: &'a Vec<f32>) -> Self {
        pressure_pa.as_slice().into()
    }
}

/// What task and user share.
#[derive(Debug)]
struct Shared {
    state: std::sync::Mutex<State>,
    /// The writer has something to do.
    wake: Notify,
    /// The session is to move, or has what it takes along.
    moving: Notify,
    /// The connection owed an answer for too long.
    stalled: Notify,
    /// Sessions opened so far; odd things happen between two of them.
    opened: watch::Sender<u64>,
}

impl Shared {
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        // Nothing that holds the lock can panic halfway.
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// A session: pressure maps in, SED maps out, the latest frame wins.
///
/// When the connection breaks, or the service asks for it, it opens another by itself, with the same
/// hello; where the service asked, no frame is lost and what it remembers goes along. Needs a tokio
/// runtime; dropping it ends the session.
///
/// A frame that has no answer after five seconds ([`set_timeout`](Self::set_timeout)) is
/// [lost](crate::Status::Lost), whether it waits for a connection or for the service; in the second
/// case the connection is given up and another opened. Set the actuators to zero then.
#[derive(Debug)]
pub struct Session {
    shared: Arc<Shared>,
    task: JoinHandle<()>,
    watch: JoinHandle<()>,
}

/// The hello of a client that moves when it is asked to.
fn following(hello: Hello) -> Hello {
    Hello { reconnect: Some(true), ..hello }
}

/// Microseconds of a steady clock.
fn now_us() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_micros() as u64
}

impl Session {
    /// Opens a session at `server` (an [`Address`](crate::Address)).
    ///
    /// # Errors
    /// `server` is no address, nobody listens, or the hello is refused: [`PapillaError::code`] says why.
    pub async fn open(
        server: &(impl ToAddress + ?Sized),
        hello: Hello,
    ) -> Result<Self, PapillaError> {
        let server = server.to_address()?.plain()?;
        let hello = following(hello);
        let (link, ready) = Link::open(&server, &hello).await?;
        let shared = Arc::new(Shared {
            state: std::sync::Mutex::new(State::new(hello, ready)),
            wake: Notify::new(),
            moving: Notify::new(),
            stalled: Notify::new(),
            opened: watch::Sender::new(1),
        });
        let task = tokio::spawn(live::live(server, Arc::clone(&shared), link));
        let watch = tokio::spawn(live::watch(Arc::clone(&shared)));
        Ok(Self { shared, task, watch })
    }

    /// What the service agreed to.
    #[must_use]
    pub fn ready(&self) -> Arc<Ready> {
        Arc::clone(&self.shared.state().ready)
    }

    /// Hands over one frame; its outcome comes in the receiver. Never waits: a frame that has
    /// not left is replaced and its outcome is superseded.
    ///
    /// # Errors
    /// The session is over, or there are not as many samples as the window has pixels.
    pub fn send<'a>(
        &self,
        frame: impl Into<Frame<'a>>,
    ) -> Result<oneshot::Receiver<Answer>, PapillaError> {
        let frame = frame.into();
        let time_us = frame.client_time_us.unwrap_or_else(now_us);
        let outcome = self.shared.state().put(&frame, time_us)?;
        self.shared.wake.notify_one();
        Ok(outcome)
    }

    /// [`send`](Self::send), and waits for the outcome.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub async fn render<'a>(&self, frame: impl Into<Frame<'a>>) -> Result<Answer, PapillaError> {
        let outcome = self.send(frame)?;
        outcome.await.map_err(|_| PapillaError::Closed)
    }

    /// Says hello again in the open session: new tier, budget, sample type or effects.
    ///
    /// # Errors
    /// It is refused, and the old terms stand; or the connection broke meanwhile.
    pub async fn renew(&self, hello: Hello) -> Result<Arc<Ready>, PapillaError> {
        let (reply, answer) = oneshot::channel();
        self.shared.state().asked = Some(Asked { hello: following(hello), said: false, reply });
        self.shared.wake.notify_one();
        answer.await.map_err(|_| PapillaError::Closed)?
    }

    /// Times that a session was opened: more than 1 after a reconnect. The receiver tells when
    /// the next one is.
    #[must_use]
    pub fn connections(&self) -> watch::Receiver<u64> {
        self.shared.opened.subscribe()
    }

    /// Time within which a frame has an outcome, from now on.
    pub fn set_timeout(&self, timeout: Duration) {
        self.shared.state().timeout = timeout;
    }

    /// What people were told on standard error so far, each thing once: the first refused frame, the
    /// first one out of range, the first timeout, a budget that the service cannot meet, a move that
    /// it asked for and did not make possible.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.shared.state().told.words.clone()
    }

    /// Frames that a newer one replaced before they left.
    #[must_use]
    pub fn superseded_by_client(&self) -> u64 {
        self.shared.state().superseded_by_client
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.task.abort();
        self.watch.abort();
        self.shared.state().end();
    }
}
