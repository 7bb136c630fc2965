//! Accepting connections: bounded in number, timed in every wait, drained at the end.
//!
//! axum's own `serve` sets neither TCP_NODELAY nor a time for the request's head, and does
//! not bound the number of connections; so hyper is driven here.

use std::{io, net::SocketAddr, sync::Arc, time::Duration};

use hyper::{body::Incoming, server::conn::http1, service::service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use papilla_metrics::Metrics;
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpSocket, TcpStream},
    sync::watch,
    time::{Instant, sleep, timeout},
};
use tokio_rustls::TlsAcceptor;

use super::{
    front::Front,
    gate::{Peer, Place, PlaceHandle, Places},
    stream::TimeoutStream,
};
use crate::{config::Timeouts, drain::begun};

/// Read buffer of a connection, bytes: bounds the head, and keeps the reads of a body few.
pub(crate) const BUFFER_MAX: usize = 128 * 1024;

/// Pause after a failed accept: the usual cause, no free file descriptors, passes.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Room of the system for each direction of a connection, bytes: more than the largest frame (196
/// KiB). Linux begins with 128 KiB, so that a sender of f32 maps waits for room in the middle of a
/// frame; about one in a hundred then came 20 ms late, when the delayed acknowledgement ran out.
pub(crate) const SOCKET_BUFFER: u32 = 512 * 1024;

/// Connections that may wait to be accepted.
const BACKLOG: u32 = 1024;

/// Listens at `address`; every connection inherits the room of its buffers.
pub(crate) fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // As `TcpListener::bind` does: a restart need not wait for old connections to fade.
    socket.set_reuseaddr(true)?;
    socket.set_recv_buffer_size(SOCKET_BUFFER)?;
    socket.set_send_buffer_size(SOCKET_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// What every connection needs.
#[derive(Clone)]
pub(crate) struct ConnectionContext {
    pub(crate) front: Arc<Front>,
    pub(crate) metrics: Arc<Metrics>,
    /// True once the server drains.
    pub(crate) drain: Arc<watch::Sender<bool>>,
    pub(crate) timeouts: Timeouts,
    /// None: plain text.
    pub(crate) tls: Option<TlsAcceptor>,
}

/// Accepts until the drain begins.
pub(crate) async fn serve(listener: TcpListener, context: ConnectionContext, places: Places) {
    let mut drain = context.drain.subscribe();
    let mut warnings = Warnings::default();
    loop {
        let accepted = async {
            let permit = places.free().await;
            (permit, listener.accept().await)
        };
        let (permit, stream, peer) = tokio::select! {
            biased;
            () = begun(&mut drain) => return,
            (permit, accepted) = accepted => match (permit, accepted) {
                (Ok(permit), Ok((stream, peer))) => (permit, stream, peer),
                (Err(_), _) => return,
                (_, Err(error)) => {
                    warnings.tell(&error);
                    sleep(ACCEPT_PAUSE).await;
                    continue;
                }
            },
        };
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "TCP_NODELAY cannot be set");
        }
        let place = places.take(permit, peer.ip());
        tokio::spawn(connection(stream, Peer(peer.ip()), context.clone(), place));
    }
}

/// Shortest time between two warnings of the same.
const WARNING_PAUSE: Duration = Duration::from_secs(60);

/// What keeps a failure that repeats from filling the log.
#[derive(Default)]
struct Warnings {
    last: Option<Instant>,
    /// Failures since then.
    untold: u64,
}

impl Warnings {
    /// Whether a failure at `now` is to be told, and with how many that were not.
    fn due(&mut self, now: Instant) -> Option<u64> {
        if self.last.is_some_and(|last| now.duration_since(last) < WARNING_PAUSE) {
            self.untold += 1;
            return None;
        }
        self.last = Some(now);
        Some(std::mem::take(&mut self.untold))
    }

    fn tell(&mut self, error: &io::Error) {
        if let Some(untold) = self.due(Instant::now()) {
            tracing::warn!(%error, untold, "a connection cannot be accepted");
        }
    }
}

async fn connection(stream: TcpStream, peer: Peer, context: ConnectionContext, place: Place) {
    context.metrics.connections_open.inc();
    // Taken before anything is read: from here on the drain waits for this connection.
    let drain = context.drain.subscribe();
    let wait_max = context.timeouts.io;
    let stream = TimeoutStream::new(stream, wait_max);
    let handle = &place.handle;
    let serving = async {
        match &context.tls {
            None => converse(stream, peer, handle, &context, drain).await,
            Some(tls) => match timeout(wait_max, tls.accept(stream)).await {
                Ok(Ok(stream)) => converse(stream, peer, handle, &context, drain).await,
                Ok(Err(error)) => tracing::debug!(%error, "TLS handshake failed"),
                Err(_) => tracing::debug!("TLS handshake took too long"),
            },
        }
    };
    tokio::select! {
        () = serving => {}
        () = handle.evicted() => tracing::debug!("a connection without a token gave way"),
    }
    context.metrics.connections_open.dec();
}

async fn converse<S>(
    stream: S,
    peer: Peer,
    handle: &Arc<PlaceHandle>,
    context: &ConnectionContext,
    mut drain: watch::Receiver<bool>,
) where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let (front, handle) = (Arc::clone(&context.front), Arc::clone(handle));
    let service = service_fn(move |mut request: hyper::Request<Incoming>| {
        request.extensions_mut().insert(peer);
        request.extensions_mut().insert(Arc::clone(&handle));
        let front = Arc::clone(&front);
        async move { front.answer(request).await }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(context.timeouts.io)
        .max_buf_size(BUFFER_MAX)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    tokio::pin!(connection);
    let mut draining = false;
    loop {
        tokio::select! {
            result = &mut connection => {
                if let Err(error) = result {
                    tracing::debug!(%error, "connection ended");
                }
                return;
            }
            () = begun(&mut drain), if !draining => {
                draining = true;
                connection.as_mut().graceful_shutdown();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_that_repeats_is_told_once_a_minute() {
        let (mut warnings, start) = (Warnings::default(), Instant::now());
        let told = |warnings: &mut Warnings, ms| warnings.due(start + Duration::from_millis(ms));
        assert_eq!(told(&mut warnings, 0), Some(0));
        for n in 1..1200 {
            assert_eq!(told(&mut warnings, 50 * n), None, "after {} ms", 50 * n);
        }
        assert_eq!(told(&mut warnings, 60_000), Some(1199));
        assert_eq!(told(&mut warnings, 60_001), None);
    }
}
