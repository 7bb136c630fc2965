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

/// The connection and what it takes to speak over it.
pub(super) struct Connection {
    stream: Stream,
    pub(super) inbound: Inbound,
    pub(super) reply: Arc<Reply>,
    pub(super) app: Arc<App>,
    /// Whose connection it is, if that is known.
    pub(super) client: Option<Key>,
    drain: watch::Receiver<bool>,
    /// When the client's last message came, and whether it was pinged since.
    heard: TokioInstant,
    is_pinged: bool,
    /// Goes off when a ping or the end may be due.
    alarm: Pin<Box<Sleep>>,
    /// Goes off when the session is to be asked to move, or has had its time to.
    due: Pin<Box<Sleep>>,
    is_due_set: bool,
    limits: Limits,
    /// Goes off when the next turn begins.
    pause: Pin<Box<Sleep>>,
}

enum Stream {
    Plain(Arc<TcpStream>),
    Tls(Box<TokioIo<Upgraded>>),
}

/// What a session waits for.
#[derive(Debug)]
pub(super) enum Event {
    Text(Bytes),
    Binary(Bytes, Instant),
    /// The server begins to drain.
    Draining,
    /// An accepted frame may have been answered.
    Settled,
    /// The time that was set has come.
    Due,
}

/// What a session waits for beside messages.
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

    /// Sets the time of the next [`Event::Due`]; none: there is none.
    pub(super) fn call_after(&mut self, wait: Option<Duration>) {
        self.is_due_set = wait.is_some();
        if let Some(wait) = wait {
            self.due.as_mut().reset(TokioInstant::now() + wait);
        }
    }

    /// The next event. A silent client is pinged after a third of the idle time,
    /// and given up after all of it.
    ///
    /// **Invariant:** between two waits, no more than a turn's worth of frames and bytes is worked
    /// off ([`Limits`]), so that one client's flood does not hold a thread up for others.
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
                // In a future of its own: room is made only where there will be a read.
                read = async { self.stream.read(self.inbound.room()).await },
                    if resume_at.is_none() => self.on_read(read)?,
            }
        }
    }

    /// Handles a message; an event if the session has to act on it.
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

    /// Counts a read; the end of the session if the connection has ended.
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

    /// Pings a client that is silent, and ends the session of one that stays so.
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

    /// Waits for work that the client has asked for; given up with the client.
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

    /// Writes what is left, as long as the client reads: it may take a while for the first byte and
    /// for each that follows, and as long as it needs for all.
    pub(super) async fn flush(&mut self) -> Result<(), End> {
        let out = &self.reply.out;
        // Nearly always there is nothing left, and no clock to be set.
        if out.go_on(false).map_err(End::Broken)?.is_all {
            return Ok(());
        }
        let broken = |error: io::Error| End::Broken(error.to_string());
        match &mut self.stream {
            Stream::Plain(stream) => {
                let wait_max = self.app.timeouts.io;
                let mut read = Instant::now();
                loop {
                    // Err: there may be less room than the system wakes anybody for.
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
            // The stream below the cipher times its writes the same way.
            Stream::Tls(stream) => {
                while let Some(message) = out.take() {
                    stream.write_all(&message).await.map_err(broken)?;
                }
                stream.flush().await.map_err(broken)
            }
        }
    }

    /// Says why the session ends, closes, and waits a moment for the client to close too.
    pub(super) async fn close(&mut self, end: &End) {
        let (code, reason) = match end {
            End::Broken(_) => return,
            // There may be nobody left to read it.
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
        // Read, and not understood: a connection that is dropped with bytes unread is reset, and
        // the client may never see what it was told.
        let mut unread = BytesMut::with_capacity(FAREWELL_ROOM);
        let farewell = async {
            while let Ok(1..) = self.stream.read(&mut unread).await {
                unread.clear();
                sleep(FAREWELL_PAUSE).await;
            }
        };
        // Err: the client does not close.
        let _ = timeout(FAREWELL, farewell).await;
    }
}

/// Time between two looks at whether a client is still there, and bytes read meanwhile where they
/// have to be read for that.
const LOOK: Duration = Duration::from_millis(50);
const AHEAD_MAX: usize = 256 * 1024;

/// Longest wait for the client's own close; room to read until then, bytes, and the pause between
/// two reads: a client that goes on sending is listened to at 8 MB/s.
const FAREWELL: Duration = Duration::from_secs(1);
const FAREWELL_ROOM: usize = 16 * 1024;
const FAREWELL_PAUSE: Duration = Duration::from_millis(2);

impl Stream {
    /// Waits until the client sends nothing more, or the connection breaks; for ever, as a rule.
    /// What it sends meanwhile waits, in the system's room or in `inbound`.
    async fn left(&mut self, inbound: &mut Inbound) -> Option<io::Error> {
        let mut ahead = 0;
        loop {
            sleep(LOOK).await;
            match self {
                // Err: there is nothing to be read.
                Self::Plain(stream) => {
                    match timeout(LOOK, stream.ready(Interest::READABLE)).await {
                        Ok(Ok(ready)) if ready.is_read_closed() => return None,
                        Ok(Err(error)) => return Some(error),
                        Ok(Ok(_)) | Err(_) => {}
                    }
                }
                // Only a read tells, behind the cipher.
                Self::Tls(_) if ahead >= AHEAD_MAX => {}
                Self::Tls(stream) => match stream.read_buf(inbound.room()).await {
                    Ok(0) => return None,
                    Ok(bytes) => ahead += bytes,
                    Err(error) => return Some(error),
                },
            }
        }
    }

    /// Reads some bytes behind those of `buffer`; nothing is lost if it is dropped while it waits.
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
