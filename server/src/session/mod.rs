//! `GET /v1/session`: a WebSocket on which frames go in and SED maps come out.

mod frames;
mod fresh;
mod hello;

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::{
    extract::{
        Extension, State, WebSocketUpgrade,
        ws::{CloseFrame, Message, Utf8Bytes, WebSocket, rejection::WebSocketUpgradeRejection},
    },
    response::Response,
};
use bytes::Bytes;
use papilla_proto::{ErrorCode, HEADER_LEN_V2, MAP_LEN, Problem, ServerMessage, SessionError};
use tokio::{
    sync::{mpsc, watch},
    time::{Instant as TokioInstant, sleep_until, timeout},
};

use self::fresh::Freshness;
use crate::{
    app::{App, SessionPlace, begun},
    gate::Guest,
    pool::{Done, Recycler, Slot},
    problem::{self, HttpProblem},
};

/// Largest message read, bytes. Five times a frame, so that a frame that is too long is read,
/// refused and survived; beyond this the connection is closed.
const MESSAGE_MAX: usize = 1 << 20;

/// Most bytes of one read. The library fills this room with zeros before every read, and loopback
/// hands over 64 KiB at a time: more is zeroed in vain.
const READ_MAX: usize = 64 * 1024;

/// RFC 6455 close codes.
mod close {
    pub(super) const NORMAL: u16 = 1000;
    pub(super) const GOING_AWAY: u16 = 1001;
    pub(super) const PROTOCOL: u16 = 1002;
    pub(super) const POLICY: u16 = 1008;
    pub(super) const TOO_BIG: u16 = 1009;
}

/// Takes the upgrade, or says why not.
pub(crate) async fn open(
    State(app): State<Arc<App>>,
    Extension(guest): Extension<Guest>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, HttpProblem> {
    let refuse = |problem: Problem| {
        app.metrics.error(problem.code);
        HttpProblem(problem)
    };
    let upgrade = upgrade.map_err(|rejection| {
        let message = format!("a WebSocket handshake is due here: {rejection}");
        refuse(Problem::new(ErrorCode::UpgradeRequired, message))
    })?;
    let place = app.admit_session(&guest).map_err(refuse)?;
    // Taken before the upgrade: from here on the drain waits for this session.
    let drain = app.drain.subscribe();
    Ok(upgrade
        .read_buffer_size(READ_MAX)
        .max_message_size(MESSAGE_MAX)
        .max_frame_size(MESSAGE_MAX)
        .max_write_buffer_size(MESSAGE_MAX)
        .on_failed_upgrade(|error| tracing::debug!(%error, "upgrade failed"))
        .on_upgrade(move |socket| run(socket, app, drain, place)))
}

async fn run(socket: WebSocket, app: Arc<App>, drain: watch::Receiver<bool>, _place: SessionPlace) {
    app.metrics.sessions.inc();
    app.metrics.sessions_open.inc();
    let number = app.session_number();
    let mut line = Line { socket, app: Arc::clone(&app), drain };
    let end = converse(&mut line, number).await;
    match &end {
        End::Client => tracing::debug!(session = number, "the client ended the session"),
        End::Broken(reason) | End::Garbled(reason) => {
            tracing::debug!(session = number, reason, "session broken");
        }
        End::Refused(problem, _) => tracing::debug!(session = number, %problem, "session ended"),
    }
    line.part(&end).await;
    app.metrics.sessions_open.dec();
}

async fn converse(line: &mut Line, number: u64) -> End {
    let terms = match hello::agree(line, number).await {
        Ok(terms) => terms,
        Err(end) => return end,
    };
    let (slot, answers) = Slot::new(Recycler::with_room(terms.answer_len_max()));
    let session = frames::Session {
        number,
        fresh: Freshness::new(terms.stale_after_us),
        terms,
        slot: Arc::new(slot),
        answers,
        outstanding: 0,
        short_answers: Recycler::with_room(HEADER_LEN_V2),
        waiting: Recycler::with_room(4 * MAP_LEN),
    };
    frames::serve(line, session).await
}

/// Why a session ends.
#[derive(Debug)]
enum End {
    /// The client closed, or is gone.
    Client,
    /// The client does not take what it is sent, or the connection broke.
    Broken(String),
    /// What came is not WebSocket, or the connection broke in the middle of it.
    Garbled(String),
    /// The server says so, with this error and this close code.
    Refused(Problem, u16),
}

/// The socket and what it takes to speak over it.
struct Line {
    socket: WebSocket,
    app: Arc<App>,
    drain: watch::Receiver<bool>,
}

/// What a session waits for.
enum Event {
    Message(Message, Instant),
    Answer(Done),
    Draining,
}

impl Line {
    /// The next event. A silent client is pinged after a third of the idle time,
    /// and given up after all of it.
    async fn next(
        &mut self,
        answers: Option<&mut mpsc::Receiver<Done>>,
        draining: bool,
    ) -> Result<Event, End> {
        let idle = self.app.timeouts.idle;
        let silent_since = TokioInstant::now();
        let mut ping_at = silent_since + idle / 3;
        let answer = async {
            match answers {
                Some(answers) => answers.recv().await,
                None => std::future::pending().await,
            }
        };
        tokio::pin!(answer);
        loop {
            tokio::select! {
                biased;
                // The slot's sender lives as long as the session, so this is never None.
                Some(done) = &mut answer => return Ok(Event::Answer(done)),
                () = begun(&mut self.drain), if !draining => return Ok(Event::Draining),
                message = self.socket.recv() => return heard(message),
                () = sleep_until(silent_since + idle) => {
                    let message = format!("the client was silent for {idle:?}");
                    return Err(End::Refused(Problem::new(ErrorCode::Timeout, message), close::POLICY));
                }
                () = sleep_until(ping_at) => {}
            }
            self.send(Message::Ping(Bytes::new())).await?;
            ping_at = silent_since + idle;
        }
    }

    /// Sends within the time a client may take to make room.
    async fn send(&mut self, message: Message) -> Result<(), End> {
        match timeout(self.app.timeouts.io, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(error)) => Err(End::Broken(error.to_string())),
            Err(_) => Err(End::Broken("the client does not read its answers".to_owned())),
        }
    }

    async fn say(&mut self, message: &ServerMessage) -> Result<(), End> {
        let text = serde_json::to_string(message)
            .map_err(|error| End::Broken(format!("a message cannot be encoded: {error}")))?;
        self.send(Message::Text(text.into())).await
    }

    /// Tells the client of an error the session survives.
    async fn complain(&mut self, problem: Problem, sequence: Option<u32>) -> Result<(), End> {
        self.app.metrics.error(problem.code);
        self.say(&ServerMessage::Error(SessionError::new(problem, sequence, false))).await
    }

    /// Says why the session ends, closes, and waits a moment for the client to close too.
    async fn part(&mut self, end: &End) {
        let (code, reason) = match end {
            End::Broken(_) => return,
            // There may be nobody left to read it.
            End::Garbled(_) => (close::PROTOCOL, "what came is not WebSocket"),
            End::Client => (close::NORMAL, ""),
            End::Refused(problem, code) => {
                self.app.metrics.error(problem.code);
                let error = SessionError::new(problem.clone(), None, true);
                if self.say(&ServerMessage::Error(error)).await.is_err() {
                    return;
                }
                (*code, problem.code.as_str())
            }
        };
        let frame = CloseFrame { code, reason: Utf8Bytes::from_static(reason) };
        // Err: the client has closed already.
        let _ = self.send(Message::Close(Some(frame))).await;
        let farewell = async { while let Some(Ok(_)) = self.socket.recv().await {} };
        let _ = timeout(Duration::from_secs(1), farewell).await;
    }
}

/// What a received message means for the session.
fn heard(message: Option<Result<Message, axum::Error>>) -> Result<Event, End> {
    match message {
        None | Some(Ok(Message::Close(_))) => Err(End::Client),
        Some(Ok(message)) => Ok(Event::Message(message, Instant::now())),
        Some(Err(error)) => {
            let text = error.to_string();
            // The library's own words for a message over the limit; a test holds it to them.
            if text.contains("Space limit exceeded") {
                let message = format!("a message is larger than {MESSAGE_MAX} bytes");
                Err(End::Refused(Problem::new(ErrorCode::TooLarge, message), close::TOO_BIG))
            } else if text.contains("UTF-8") {
                let message = "a text message is not UTF-8";
                Err(End::Refused(Problem::new(ErrorCode::BadJson, message), close::PROTOCOL))
            } else {
                Err(End::Garbled(text))
            }
        }
    }
}

/// The end of a session because the server drains.
fn drained() -> End {
    End::Refused(problem::shutting_down(), close::GOING_AWAY)
}
