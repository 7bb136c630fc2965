//! Accepting connections: bounded in number, timed in every wait, drained at the end.
//!
//! axum's own `serve` sets neither TCP_NODELAY nor a time for the request's head, and does
//! not bound the number of connections; so hyper is driven here.

mod places;

use std::{
    io,
    net::SocketAddr,
    pin::Pin,
    sync::Arc,
    task::{Context, Poll, ready},
    time::Duration,
};

use hyper::{body::Incoming, server::conn::http1, service::service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::{TcpListener, TcpSocket, TcpStream},
    sync::watch,
    time::{Sleep, sleep, timeout},
};
use tokio_rustls::TlsAcceptor;

use self::places::Place;
pub(crate) use self::places::{Places, Standing};
use crate::{
    config::Timeouts,
    core::metrics::Metrics,
    transport::{app::begun, front::Front, gate::Peer},
};

/// Read buffer of a connection, bytes: bounds the head, and keeps the reads of a body few.
pub(crate) const BUFFER_MAX: usize = 128 * 1024;

/// Pause after a failed accept: the usual cause, no free file descriptors, passes.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Room of the system for each direction of a connection, bytes: more than the largest frame (196 KiB).
/// Linux begins with 128 KiB, so that a sender of f32 maps waits for room in the middle of a frame;
/// about one in a hundred then came 20 ms late, when the delayed acknowledgement ran out.
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
pub(crate) struct Line {
    pub(crate) front: Arc<Front>,
    pub(crate) metrics: Arc<Metrics>,
    /// True once the server drains.
    pub(crate) drain: Arc<watch::Sender<bool>>,
    pub(crate) timeouts: Timeouts,
    /// None: plain text.
    pub(crate) tls: Option<TlsAcceptor>,
}

/// Accepts until the drain begins.
pub(crate) async fn serve(listener: TcpListener, line: Line, places: Places) {
    let mut drain = line.drain.subscribe();
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
                    tracing::warn!(%error, "a connection cannot be accepted");
                    sleep(ACCEPT_PAUSE).await;
                    continue;
                }
            },
        };
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "TCP_NODELAY cannot be set");
        }
        let place = places.take(permit, peer.ip());
        tokio::spawn(connection(stream, Peer(peer.ip()), line.clone(), place));
    }
}

async fn connection(stream: TcpStream, peer: Peer, line: Line, place: Place) {
    line.metrics.connections_open.inc();
    // Taken before anything is read: from here on the drain waits for this connection.
    let drain = line.drain.subscribe();
    let patience = line.timeouts.io;
    let stream = Patient::new(stream, patience);
    let standing = &place.standing;
    let serving = async {
        match &line.tls {
            None => converse(stream, peer, standing, &line, drain).await,
            Some(tls) => match timeout(patience, tls.accept(stream)).await {
                Ok(Ok(stream)) => converse(stream, peer, standing, &line, drain).await,
                Ok(Err(error)) => tracing::debug!(%error, "TLS handshake failed"),
                Err(_) => tracing::debug!("TLS handshake took too long"),
            },
        }
    };
    tokio::select! {
        () = serving => {}
        () = standing.evicted() => tracing::debug!("a connection without a token gave way"),
    }
    line.metrics.connections_open.dec();
}

async fn converse<S>(
    stream: S,
    peer: Peer,
    standing: &Arc<Standing>,
    line: &Line,
    mut drain: watch::Receiver<bool>,
) where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let (front, standing) = (Arc::clone(&line.front), Arc::clone(standing));
    let service = service_fn(move |mut request: hyper::Request<Incoming>| {
        request.extensions_mut().insert(peer);
        request.extensions_mut().insert(Arc::clone(&standing));
        let front = Arc::clone(&front);
        async move { front.answer(request).await }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(line.timeouts.io)
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

/// A stream whose writes give up when the other side makes no room for a while.
pub(crate) struct Patient {
    stream: TcpStream,
    patience: Duration,
    /// Set while a write waits.
    alarm: Option<Pin<Box<Sleep>>>,
}

impl Patient {
    fn new(stream: TcpStream, patience: Duration) -> Self {
        Self { stream, patience, alarm: None }
    }

    /// The stream, for whoever watches the clock without help.
    pub(crate) fn into_stream(self) -> TcpStream {
        self.stream
    }

    /// Passes a write's outcome on, and watches the clock while there is none.
    fn timed<T>(
        &mut self,
        outcome: Poll<io::Result<T>>,
        cx: &mut Context<'_>,
    ) -> Poll<io::Result<T>> {
        if outcome.is_ready() {
            self.alarm = None;
            return outcome;
        }
        let patience = self.patience;
        let alarm = self.alarm.get_or_insert_with(|| Box::pin(sleep(patience)));
        ready!(alarm.as_mut().poll(cx));
        Poll::Ready(Err(io::Error::new(io::ErrorKind::TimedOut, "the client does not read")))
    }
}

impl AsyncRead for Patient {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, buffer)
    }
}

impl AsyncWrite for Patient {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let outcome = Pin::new(&mut self.stream).poll_write(cx, bytes);
        self.timed(outcome, cx)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let outcome = Pin::new(&mut self.stream).poll_write_vectored(cx, bytes);
        self.timed(outcome, cx)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let outcome = Pin::new(&mut self.stream).poll_flush(cx);
        self.timed(outcome, cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let outcome = Pin::new(&mut self.stream).poll_shutdown(cx);
        self.timed(outcome, cx)
    }
}
