//! Finds out whether a client reads what it is sent.
//!
//! A client that reads slowly must not be taken for one that does not read. Linux reports a
//! connection as writable only when a third of its send buffer is free, and at 30 kB/s that takes
//! more than ten seconds. So while a write waits, bytes are offered to the system again and again.
//! It takes some of them as soon as the client's system has confirmed any, which happens when the
//! client has read.

use std::{io, time::Duration};

use tokio::net::TcpStream;

/// Time between two offers, where a client may take `wait_max` to read anything at all.
pub(crate) fn pause(wait_max: Duration) -> Duration {
    (wait_max / 16).clamp(Duration::from_millis(20), Duration::from_millis(500))
}

/// Offers bytes to the system whatever is known of its room; how many it takes, without waiting.
///
/// # Errors
/// The connection is broken.
pub(crate) fn send(stream: &TcpStream, bytes: &[u8]) -> io::Result<usize> {
    #[cfg(unix)]
    let sent = rustix::net::send(stream, bytes, FLAGS).map_err(io::Error::from);
    #[cfg(not(unix))]
    let sent = stream.try_write(bytes);
    match sent {
        Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(0),
        result => result,
    }
}

/// Without waiting, and without a signal where the client is gone.
#[cfg(target_os = "linux")]
const FLAGS: rustix::net::SendFlags =
    rustix::net::SendFlags::DONTWAIT.union(rustix::net::SendFlags::NOSIGNAL);
#[cfg(all(unix, not(target_os = "linux")))]
const FLAGS: rustix::net::SendFlags = rustix::net::SendFlags::DONTWAIT;
