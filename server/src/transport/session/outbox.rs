//! The messages that a session sends, whether the task of the connection sends them or an inference
//! thread.

use std::{
    collections::VecDeque,
    io,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use bytes::Bytes;
use papilla_proto::contact::FINGERS_MAX;
use tokio::{net::TcpStream, sync::Notify};

use crate::transport::room;

/// Capacity for messages that the system's buffer has no room for. While one is left the task reads
/// nothing, so only its own last messages can follow, and answers to accepted frames: two of each
/// finger.
const LEFT: usize = 8 + 2 * FINGERS_MAX;

/// What a session sends through. Whole messages go in, and they leave in that order.
///
/// A sender writes at once as much as the system's buffer takes, without waiting, so that an answer
/// does not have to wake the task. The task writes what is left.
#[derive(Debug)]
pub(super) struct Outbox {
    /// None: the connection uses TLS, and only the task can write.
    stream: Option<Arc<TcpStream>>,
    state: Mutex<State>,
    /// Notified when the task has something to do.
    pub(super) call: Notify,
}

/// The progress of writing messages that were left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Written {
    /// Whether nothing is left.
    pub(super) is_all: bool,
    /// Bytes that the system took in this call.
    pub(super) bytes: usize,
}

#[derive(Debug)]
struct State {
    left: VecDeque<Bytes>,
    broken: Option<String>,
    /// The closing message was put in, and nothing may follow it.
    is_closed: bool,
}

impl Outbox {
    pub(super) fn new(stream: Option<Arc<TcpStream>>) -> Self {
        let left = VecDeque::with_capacity(LEFT);
        let state = State { left, broken: None, is_closed: false };
        Self { stream, state: Mutex::new(state), call: Notify::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change below leaves the state whole, so a poisoned lock is usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a message, at once or as soon as there is room.
    pub(super) fn send(&self, message: &Bytes) {
        self.put(message, false, |from| message.slice(from..));
    }

    /// Sends the message that closes the session. Answers that become ready later are dropped,
    /// since nothing may follow a close frame (RFC 6455, section 5.5.1).
    pub(super) fn send_last(&self, message: &Bytes) {
        self.put(message, true, |from| message.slice(from..));
    }

    /// Sends a message. It is copied only if the system's buffer has no room for it.
    pub(super) fn send_copy(&self, message: &[u8]) {
        self.put(message, false, |from| Bytes::copy_from_slice(&message[from..]));
    }

    fn put(&self, message: &[u8], is_last: bool, rest: impl FnOnce(usize) -> Bytes) {
        let mut state = self.state();
        if state.broken.is_some() || state.is_closed {
            return;
        }
        state.is_closed = is_last;
        let mut written = 0;
        if let Some(stream) = self.stream.as_ref().filter(|_| state.left.is_empty()) {
            match write(stream, message) {
                Ok(n) => written = n,
                Err(error) => state.broken = Some(error.to_string()),
            }
        }
        if state.broken.is_none() && written < message.len() {
            state.left.push_back(rest(written));
        }
        let is_done = state.left.is_empty() && state.broken.is_none();
        drop(state);
        if !is_done {
            self.call.notify_one();
        }
    }

    /// Writes as much of what is left as there is room for. With `insist` it offers bytes even if
    /// the socket is not reported writable ([`room::send`]).
    ///
    /// # Errors
    /// The connection is broken; the text says why.
    pub(super) fn go_on(&self, insist: bool) -> Result<Written, String> {
        let mut state = self.state();
        if let Some(error) = &state.broken {
            return Err(error.clone());
        }
        let Some(stream) = &self.stream else {
            return Ok(Written { is_all: state.left.is_empty(), bytes: 0 });
        };
        let mut bytes = 0;
        while let Some(mut message) = state.left.pop_front() {
            let mut written = write(stream, &message).map_err(|error| error.to_string())?;
            if insist && written < message.len() {
                let more = room::send(stream, &message[written..]);
                written += more.map_err(|error| error.to_string())?;
            }
            bytes += written;
            if written < message.len() {
                state.left.push_front(message.split_off(written));
                return Ok(Written { is_all: false, bytes });
            }
        }
        Ok(Written { is_all: true, bytes })
    }

    /// Takes the next message that is left, for a task that writes by itself (TLS).
    pub(super) fn take(&self) -> Option<Bytes> {
        self.state().left.pop_front()
    }
}

/// Writes as much as there is room for.
fn write(stream: &TcpStream, bytes: &[u8]) -> io::Result<usize> {
    let mut written = 0;
    while written < bytes.len() {
        match stream.try_write(&bytes[written..]) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(n) => written += n,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
            Err(error) => return Err(error),
        }
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_follows_the_close() {
        let out = Outbox::new(None);
        out.send(&Bytes::from_static(b"map"));
        out.send_last(&Bytes::from_static(b"close"));
        out.send(&Bytes::from_static(b"pong"));
        out.send_copy(b"late map");
        out.send_last(&Bytes::from_static(b"close again"));
        let sent: Vec<_> = std::iter::from_fn(|| out.take()).collect();
        assert_eq!(sent, ["map", "close"]);
    }
}
