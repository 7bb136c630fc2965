//! Going on over another connection: when the service asks for it, and after a connection broke.

use std::{
    net::TcpStream,
    sync::{Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use papilla_proto::Hello;
use tokio::{
    runtime::Handle,
    sync::oneshot::{self, error::TryRecvError},
};

use super::wire::Hearer;
use crate::socket::{self, Receiver, Sender, SocketError};

/// Pause before the next attempt to connect.
const RETRY: Duration = Duration::from_millis(150);

type Halves = (Sender, Receiver);

/// How a session opens another connection.
#[derive(Debug)]
pub(super) struct Follow {
    pub(super) server: String,
    pub(super) hello: Hello,
    pub(super) runtime: Handle,
}

impl Follow {
    /// Begins to connect while the session goes on.
    fn dial(&self) -> oneshot::Receiver<Halves> {
        let (found, dialing) = oneshot::channel();
        let server = self.server.clone();
        self.runtime.spawn(async move {
            loop {
                if let Ok(halves) = socket::connect(&server).await {
                    // Err: the session has ended meanwhile.
                    let _ = found.send(halves);
                    return;
                }
                tokio::time::sleep(RETRY).await;
            }
        });
        dialing
    }

    /// Opens the session on a connection.
    fn say(&self, halves: Halves, sealed: Option<Vec<u8>>) -> Result<TcpStream, SocketError> {
        let hello = Hello { resume: sealed.as_ref().map(|_| true), ..self.hello.clone() };
        self.runtime.block_on(async {
            let (_, sender, receiver) = socket::say(halves.0, halves.1, &hello, sealed).await?;
            socket::into_stream(sender, receiver).map_err(|_| SocketError::Closed)
        })
    }

    /// Opens the session anew until it is there; false: not before `until`.
    pub(super) fn reopen(&self, hearer: &mut Hearer, until: Instant) -> bool {
        while Instant::now() < until {
            thread::sleep(RETRY);
            let connected = self.runtime.block_on(socket::connect(&self.server));
            let stream = connected.and_then(|halves| self.say(halves, None));
            if stream.is_ok_and(|stream| hearer.move_to(stream).is_ok()) {
                return true;
            }
        }
        false
    }
}

/// A move that is under way.
pub(super) struct Move<'a> {
    follow: &'a Follow,
    hold: &'a Mutex<()>,
    dialing: Option<oneshot::Receiver<Halves>>,
    /// The other connection, and what keeps frames from being sent meanwhile.
    next: Option<(Halves, MutexGuard<'a, ()>)>,
    /// Since when.
    held: Instant,
}

impl<'a> Move<'a> {
    pub(super) fn new(follow: &'a Follow, hold: &'a Mutex<()>) -> Self {
        Self { follow, hold, dialing: None, next: None, held: Instant::now() }
    }

    /// The service asks for it.
    pub(super) fn begin(&mut self) {
        if self.dialing.is_none() && self.next.is_none() {
            self.dialing = Some(self.follow.dial());
        }
    }

    /// Once the other connection is there, holds frames back and asks for what is remembered.
    pub(super) fn go_on(&mut self, hearer: &mut Hearer) {
        match self.dialing.as_mut().map(oneshot::Receiver::try_recv) {
            None | Some(Err(TryRecvError::Empty)) => {}
            Some(Err(TryRecvError::Closed)) => self.dialing = None,
            Some(Ok(halves)) => {
                self.dialing = None;
                self.held = Instant::now();
                let held = self.hold.lock().unwrap_or_else(PoisonError::into_inner);
                // Err: the hearer hears of it too.
                if hearer.seal().is_ok() {
                    self.next = Some((halves, held));
                }
            }
        }
    }

    /// Moves with what is remembered, and says for how long frames were held back; none: the old
    /// connection goes on.
    pub(super) fn end(&mut self, hearer: &mut Hearer, sealed: Vec<u8>) -> Option<Duration> {
        let (halves, _held) = self.next.take()?;
        let stream = self.follow.say(halves, Some(sealed));
        let moved = stream.is_ok_and(|stream| hearer.move_to(stream).is_ok());
        if moved {
            return Some(self.held.elapsed());
        }
        self.begin();
        None
    }

    /// The connection broke.
    pub(super) fn give_up(&mut self) {
        (self.dialing, self.next) = (None, None);
    }
}
