//! A TCP stream whose writes are timed: a client has a limited time to read anything at all.

use std::{
    io,
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::TcpStream,
    time::{Instant, Sleep, sleep_until},
};

use super::room;

/// A stream whose writes give up when the other side makes no room for a while.
pub(crate) struct TimeoutStream {
    stream: TcpStream,
    timeout: Duration,
    /// Set while a write waits: since when, and the time of the next look.
    waiting: Option<(Instant, Pin<Box<Sleep>>)>,
}

impl TimeoutStream {
    pub(crate) fn new(stream: TcpStream, timeout: Duration) -> Self {
        Self { stream, timeout, waiting: None }
    }

    /// The stream without its timer.
    pub(crate) fn into_stream(self) -> TcpStream {
        self.stream
    }

    /// Passes a write's outcome on; while there is none, `bytes` are offered now and then, and the
    /// clock runs.
    fn timed<T>(
        &mut self,
        outcome: Poll<io::Result<T>>,
        offer: impl Fn(&TcpStream) -> io::Result<Option<T>>,
        cx: &mut Context<'_>,
    ) -> Poll<io::Result<T>> {
        if outcome.is_ready() {
            self.waiting = None;
            return outcome;
        }
        let pause = room::pause(self.timeout);
        let (since, alarm) = self.waiting.get_or_insert_with(|| {
            let now = Instant::now();
            (now, Box::pin(sleep_until(now + pause)))
        });
        loop {
            ready!(alarm.as_mut().poll(cx));
            let now = Instant::now();
            let offered = offer(&self.stream).transpose();
            if offered.is_some() || now - *since >= self.timeout {
                self.waiting = None;
                let too_long =
                    || io::Error::new(io::ErrorKind::TimedOut, "the client does not read");
                return Poll::Ready(offered.unwrap_or_else(|| Err(too_long())));
            }
            alarm.as_mut().reset(now + pause);
        }
    }
}

/// Offers bytes; none if not one is taken.
fn offer(stream: &TcpStream, bytes: &[u8]) -> io::Result<Option<usize>> {
    Ok(Some(room::send(stream, bytes)?).filter(|&sent| sent > 0))
}

impl AsyncRead for TimeoutStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, buffer)
    }
}

impl AsyncWrite for TimeoutStream {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let outcome = Pin::new(&mut self.stream).poll_write(cx, bytes);
        self.timed(outcome, |stream| offer(stream, bytes), cx)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let outcome = Pin::new(&mut self.stream).poll_write_vectored(cx, bytes);
        let first = bytes.iter().find(|bytes| !bytes.is_empty()).map_or(&[][..], |bytes| bytes);
        self.timed(outcome, |stream| offer(stream, first), cx)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let outcome = Pin::new(&mut self.stream).poll_flush(cx);
        self.timed(outcome, |_| Ok(None), cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let outcome = Pin::new(&mut self.stream).poll_shutdown(cx);
        self.timed(outcome, |_| Ok(None), cx)
    }
}
