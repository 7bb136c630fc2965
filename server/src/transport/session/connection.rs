//! The connection of a session: reads messages, writes answers, and closes it when it is idle.

use std::{
    io,
    pin::Pin,
    sync::Arc,
    time::{Duration, Instant},
};

use bytes::{Bytes, BytesMut};
use hyper::upgrade::Upgraded;
use hyper_util::rt::TokioIo;
use papilla_proto::{ErrorCode, Problem, ServerMessage, SessionError};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, Interest},
    net::TcpStream,
    sync::watch,
    time::{Instant as TokioInstant, Sleep, sleep, sleep_until, timeout},
};

use super::{
    End, close,
    limits::Limits,
    outbox::Outbox,
    reply::Reply,
    wire::{self, Fault, Inbound, MESSAGE_MAX, Message, Received, opcode},
};
use crate::{
    drain::begun,
    problem,
    transport::{app::App, gate::Key, room, stream::TimeoutStream},
};

/// The connection, with its buffers, timers and limits.
pub(super) struct Connection {
    stream: Stream,
    pub(super) inbound: Inbound,
    pub(super) reply: Arc<Reply>,
    pub(super) app: Arc<App>,
    /// The client that the connection belongs to; None if it is not known.
    pub(super) client: Option<Key>,
    drain: watch::Receiver<bool>,
    /// When the client's last message came, and whether a ping was sent since.
    heard: TokioInstant,
    is_pinged: bool,
    /// Fires when it is time to look whether the client has to be pinged or given up.
    alarm: Pin<Box<Sleep>>,
    /// Fires at the time of the next [`Event::Due`]: the session is to be asked to move, or its
    /// time to do so has passed. Only valid while `is_due_set`.
    due: Pin<Box<Sleep>>,
    is_due_set: bool,
    limits: Limits,
    /// Fires when the session may read again after it has used up its turn.
    pause: Pin<Box<Sleep>>,
}

enum Stream {
    Plain(Arc<TcpStream>),
    Tls(Box<TokioIo<Upgraded>>),
}

/// What a session has waited for.
#[derive(Debug)]
pub(super) enum Event {
    Text(Bytes),
    Binary(Bytes, Instant),
    /// The server begins to drain.
    Draining,
    /// An accepted frame may have been answered.
    Settled,
    /// The time set by [`Connection::call_after`] has come.
    Due,
}

/// Which events a session waits for beside messages and the timer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wait {
    /// The beginning of the drain.
    pub(super) drain: bool,
    /// Answers to accepted frames.
    pub(super) settled: bool,
}

impl Wait {
    pub(super) const FOR_DRAIN: Self = Self { drain: true, settled: false };
}

impl Connection {
    pub(super) fn new(
        upgraded: Upgraded,
        app: Arc<App>,
        drain: watch::Receiver<bool>,
        client: Option<Key>,
    ) -> Self {
        let (stream, inbound) = match upgraded.downcast::<TokioIo<TimeoutStream>>() {
            Ok(parts) => {
                let stream = Arc::new(parts.io.into_inner().into_stream());
                (Stream::Plain(stream), Inbound::new(&parts.read_buf))
            }
            Err(upgraded) => (Stream::Tls(Box::new(TokioIo::new(upgraded))), Inbound::default()),
        };
        let writer = match &stream {
            Stream::Plain(stream) => Some(Arc::clone(stream)),
            Stream::Tls(_) => None,
        };
        let reply = Arc::new(Reply::new(Outbox::new(writer), Arc::clone(&app)));
        let heard = TokioInstant::now();
        let alarm = Box::pin(sleep_until(heard + app.timeouts.idle / 3));
        let (limits, pause) = (Limits::new(heard.into_std()), Box::pin(sleep_until(heard)));
        let due = Box::pin(sleep_until(heard));
        Self {
            stream,
            inbound,
            reply,
            app,
            client,
            drain,
            heard,
            is_pinged: false,
            alarm,
            due,
            is_due_set: false,
            limits,
            pause,
        }
    }

    /// Sets when the next [`Event::Due`] comes; None: there will be none.
    pub(super) fn call_after(&mut self, wait: Option<Duration>) {
        self.is_due_set = wait.is_some();
        if let Some(wait) = wait {
            self.due.as_mut().reset(TokioInstant::now() + wait);
        }
    }

    /// Waits for the next event. A silent client is pinged after a third of the idle time, and the
    /// session ends after all of it.
    ///
    /// **Invariant:** between two waits it handles no more than a turn's worth of frames and bytes
    /// ([`Limits`]), so that a flood from one client does not keep the thread from others.
    pub(super) async fn next(&mut self, wait: Wait) -> Result<Event, End> {
        loop {
            self.flush().await?;
            if wait.drain && *self.drain.borrow() {
                return Ok(Event::Draining);
            }
            let resume_at = self.limits.resume_at(Instant::now());
            if resume_at.is_none() {
                match self.inbound.next() {
                    Ok(Some(received)) => {
                        self.limits.on_frame();
                        if let Received::Message(message) = received
                            && let Some(event) = self.on_message(message)?
                        {
                            return Ok(event);
                        }
                        continue;
                    }
                    Ok(None) => {}
                    Err(Fault::Protocol(what)) => return Err(End::Garbled(what.to_owned())),
                    Err(Fault::TooLarge) => {
                        let message = format!("a message is larger than {MESSAGE_MAX} bytes");
                        let problem = Problem::new(ErrorCode::TooLarge, message);
                        return Err(End::Refused(problem, close::TOO_BIG));
                    }
                }
            }
            if let Some(resume_at) = resume_at {
                self.pause.as_mut().reset(resume_at.into());
            }
            tokio::select! {
                biased;
                () = self.reply.out.call.notified() => {
                    if wait.settled {
                        return Ok(Event::Settled);
                    }
                }
                () = begun(&mut self.drain), if wait.drain => return Ok(Event::Draining),
                () = &mut self.due, if self.is_due_set => {
                    self.is_due_set = false;
                    return Ok(Event::Due);
                }
                () = &mut self.alarm => self.on_idle()?,
                () = &mut self.pause, if resume_at.is_some() => {}
                // Inside the future, so that room is made only if this branch is enabled.
                read = async { self.stream.read(self.inbound.room()).await },
                    if resume_at.is_none() => self.on_read(read)?,
            }
        }
    }

    /// Handles a message. Some: the session has to act on it.
    fn on_message(&mut self, message: Message) -> Result<Option<Event>, End> {
        let received = Instant::now();
        (self.heard, self.is_pinged) = (received.into(), false);
        Ok(match message {
            Message::Text(text) if str::from_utf8(&text).is_ok() => {
                self.limits.on_text(received);
                Some(Event::Text(text))
            }
            Message::Text(_) => {
                let message = "a text message is not UTF-8";
                return Err(End::Refused(
                    Problem::new(ErrorCode::BadJson, message),
                    close::PROTOCOL,
                ));
            }
            Message::Binary(bytes) => Some(Event::Binary(bytes, received)),
            Message::Ping(payload) => {
                self.count_control()?;
                self.reply.out.send(&wire::frame(opcode::PONG, &payload));
                None
            }
            Message::Pong => {
                self.count_control()?;
                None
            }
            Message::Close(code) => return Err(End::Client(code)),
        })
    }

    fn count_control(&self) -> Result<(), End> {
        self.limits.on_control().map_err(|problem| End::Refused(problem, close::POLICY))
    }

    /// Counts a read.
    ///
    /// # Errors
    /// The connection has ended, with the reason.
    fn on_read(&mut self, read: io::Result<usize>) -> Result<(), End> {
        match read {
            Ok(0) if self.inbound.is_amid() => {
                Err(End::Garbled("the connection ended in the middle of a message".to_owned()))
            }
            Ok(0) => Err(End::Garbled("the connection ended without a close".to_owned())),
            Ok(bytes) => {
                self.limits.on_read(bytes);
                Ok(())
            }
            Err(error) => Err(End::Garbled(error.to_string())),
        }
    }

    /// Pings a silent client, and ends the session if it stays silent.
    fn on_idle(&mut self) -> Result<(), End> {
        let idle = self.app.timeouts.idle;
        let silence = self.heard.elapsed();
        if silence >= idle {
            let message = format!("the client was silent for {idle:?}");
            return Err(End::Refused(Problem::new(ErrorCode::Timeout, message), close::POLICY));
        }
        if silence >= idle / 3 && !self.is_pinged {
            self.is_pinged = true;
            self.reply.out.send(&wire::frame(opcode::PING, &[]));
        }
        let next = self.heard + if self.is_pinged { idle } else { idle / 3 };
        self.alarm.as_mut().reset(next);
        Ok(())
    }

    /// Waits for work that the client has asked for. It is dropped, with an error, if the client
    /// leaves.
    pub(super) async fn while_there<T>(&mut self, work: impl Future<Output = T>) -> Result<T, End> {
        tokio::select! {
            biased;
            done = work => Ok(done),
            error = self.stream.left(&mut self.inbound) => {
                Err(End::Garbled(error.map_or_else(
                    || "the client left before its hello was worked out".to_owned(),
                    |error| error.to_string(),
                )))
            }
        }
    }

    /// Writes all messages that are left. There is no limit for the whole, but the connection
    /// counts as broken if the client reads no byte for `timeouts.io`.
    pub(super) async fn flush(&mut self) -> Result<(), End> {
        let out = &self.reply.out;
        // Nearly always nothing is left, and no timer needs to be set.
        if out.go_on(false).map_err(End::Broken)?.is_all {
            return Ok(());
        }
        let broken = |error: io::Error| End::Broken(error.to_string());
        match &mut self.stream {
            Stream::Plain(stream) => {
                let wait_max = self.app.timeouts.io;
                let mut read = Instant::now();
                loop {
                    // On a timeout the system may have some room, but too little for it to report
                    // the socket writable.
                    let woken = timeout(room::pause(wait_max), stream.writable()).await;
                    let insist = woken.is_err();
                    woken.unwrap_or(Ok(())).map_err(broken)?;
                    let written = out.go_on(insist).map_err(End::Broken)?;
                    if written.is_all {
                        return Ok(());
                    }
                    if written.bytes > 0 {
                        read = Instant::now();
                    } else if read.elapsed() >= wait_max {
                        return Err(End::Broken("the client does not read its answers".to_owned()));
                    }
                }
            }
            // The stream below TLS limits its writes in the same way.
            Stream::Tls(stream) => {
                while let Some(message) = out.take() {
                    stream.write_all(&message).await.map_err(broken)?;
                }
                stream.flush().await.map_err(broken)
            }
        }
    }

    /// Tells the client why the session ends, sends the close frame, and waits a moment for the
    /// client to close too.
    pub(super) async fn close(&mut self, end: &End) {
        let (code, reason) = match end {
            End::Broken(_) => return,
            // The client may have gone already.
            End::Garbled(_) => (close::PROTOCOL, "what came is not WebSocket"),
            End::Client(code) => (code.unwrap_or(close::NORMAL), ""),
            End::Refused(problem, code) => {
                self.app.metrics.error(problem.code);
                let error = SessionError::new(problem::bounded(problem.clone()), None, true);
                self.reply.send_message(&ServerMessage::Error(error));
                (*code, problem.code.as_str())
            }
        };
        let mut payload = BytesMut::from(&code.to_be_bytes()[..]);
        payload.extend_from_slice(reason.as_bytes());
        self.reply.out.send_last(&wire::frame(opcode::CLOSE, &payload));
        if self.flush().await.is_err() || matches!(end, End::Client(_)) {
            return;
        }
        // What still comes is read and dropped. If a socket is closed with unread bytes, the system
        // resets the connection, and the client may never see why the session ended.
        let mut unread = BytesMut::with_capacity(FAREWELL_ROOM);
        let farewell = async {
            while let Ok(1..) = self.stream.read(&mut unread).await {
                unread.clear();
                sleep(FAREWELL_PAUSE).await;
            }
        };
        // Fails if the client does not close in time.
        let _ = timeout(FAREWELL, farewell).await;
    }
}

/// Time between two checks whether a client is still connected, and the most bytes that may be read
/// ahead meanwhile where a check has to read.
const LOOK: Duration = Duration::from_millis(50);
const AHEAD_MAX: usize = 256 * 1024;

/// Longest wait for the client's own close; size of the buffer that is read into until then, bytes;
/// and the pause between two reads, which limits a client that goes on sending to 8 MB/s.
const FAREWELL: Duration = Duration::from_secs(1);
const FAREWELL_ROOM: usize = 16 * 1024;
const FAREWELL_PAUSE: Duration = Duration::from_millis(2);

impl Stream {
    /// Waits until the client has closed its side, or the connection breaks; as a rule neither
    /// happens. None: it has closed. What it sends meanwhile stays in the system's buffer, or goes
    /// into `inbound` where only a read can tell.
    async fn left(&mut self, inbound: &mut Inbound) -> Option<io::Error> {
        let mut ahead = 0;
        loop {
            sleep(LOOK).await;
            match self {
                // A timeout means that there is nothing to read.
                Self::Plain(stream) => {
                    match timeout(LOOK, stream.ready(Interest::READABLE)).await {
                        Ok(Ok(ready)) if ready.is_read_closed() => return None,
                        Ok(Err(error)) => return Some(error),
                        Ok(Ok(_)) | Err(_) => {}
                    }
                }
                // With TLS only a read shows whether the client has closed.
                Self::Tls(_) if ahead >= AHEAD_MAX => {}
                Self::Tls(stream) => match stream.read_buf(inbound.room()).await {
                    Ok(0) => return None,
                    Ok(bytes) => ahead += bytes,
                    Err(error) => return Some(error),
                },
            }
        }
    }

    /// Appends the bytes that have arrived to `buffer`. It is cancel safe: nothing is lost if the
    /// future is dropped while it waits.
    async fn read(&mut self, buffer: &mut BytesMut) -> io::Result<usize> {
        match self {
            Self::Plain(stream) => loop {
                stream.readable().await?;
                match stream.try_read_buf(buffer) {
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    result => return result,
                }
            },
            Self::Tls(stream) => stream.read_buf(buffer).await,
        }
    }
}
