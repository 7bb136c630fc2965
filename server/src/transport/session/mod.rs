//! `GET /v1/session`: a WebSocket on which frames go in and SED maps come out.
//!
//! The handshake is axum's; the framing is our own (`wire`), since a library would fill memory with
//! zeros before it reads, and copy every map before it writes.

mod budget;
mod connection;
mod frames;
mod fresh;
mod hello;
mod limits;
mod moving;
mod outbox;
mod reply;
mod terms;
mod wire;

use std::sync::Arc;

use axum::{
    body::Body,
    extract::{Extension, State, WebSocketUpgrade, ws::rejection::WebSocketUpgradeRejection},
    http::{HeaderMap, StatusCode, header},
    response::Response,
};
use hyper::upgrade::OnUpgrade;
use papilla_proto::{ErrorCode, HEADER_LEN, MAP_LEN, Problem};
use tungstenite::handshake::derive_accept_key;

use self::connection::Connection;
use crate::{
    problem,
    transport::{
        answer::{Answer, HttpProblem},
        app::{App, SessionPlace},
        gate::Principal,
    },
};

/// RFC 6455 close codes.
mod close {
    pub(super) const NORMAL: u16 = 1000;
    pub(super) const GOING_AWAY: u16 = 1001;
    pub(super) const PROTOCOL: u16 = 1002;
    pub(super) const POLICY: u16 = 1008;
    pub(super) const TOO_BIG: u16 = 1009;
}

/// Accepts the upgrade to a WebSocket, or answers why not.
pub(crate) async fn open(
    State(app): State<Arc<App>>,
    Extension(principal): Extension<Principal>,
    headers: HeaderMap,
    on_upgrade: Option<Extension<OnUpgrade>>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Answer {
    let refuse = |problem: Problem| {
        app.metrics.error(problem.code);
        HttpProblem(problem)
    };
    let not_a_handshake = |why: &dyn std::fmt::Display| {
        let message = format!("a WebSocket handshake is due here: {why}");
        refuse(Problem::new(ErrorCode::UpgradeRequired, message))
    };
    // axum checks the handshake; the connection itself is taken over below.
    let _ = upgrade.map_err(|rejection| not_a_handshake(&rejection))?;
    let key = headers.get(header::SEC_WEBSOCKET_KEY);
    let (Some(key), Some(Extension(on_upgrade))) = (key, on_upgrade) else {
        return Err(not_a_handshake(&"the connection cannot be upgraded"));
    };
    let place = app.admit_session(&principal).map_err(refuse)?;
    let client = principal.client;
    // Subscribed before the upgrade, so that the drain waits for this session from here on.
    let drain = app.drain.subscribe();
    let accept = derive_accept_key(key.as_bytes());
    tokio::spawn(async move {
        match on_upgrade.await {
            Ok(upgraded) => run(Connection::new(upgraded, app, drain, client), place).await,
            Err(error) => tracing::debug!(%error, "upgrade failed"),
        }
    });
    let switching = Response::builder()
        .status(StatusCode::SWITCHING_PROTOCOLS)
        .header(header::CONNECTION, "upgrade")
        .header(header::UPGRADE, "websocket")
        .header(header::SEC_WEBSOCKET_ACCEPT, accept)
        .body(Body::empty());
    switching.map_err(|error| HttpProblem(problem::internal("the handshake failed", &error)))
}

async fn run(mut connection: Connection, _place: SessionPlace) {
    let app = Arc::clone(&connection.app);
    app.metrics.sessions.inc();
    app.metrics.sessions_open.inc();
    let number = app.session_number();
    let end = converse(&mut connection, number).await;
    connection.reply.end();
    match &end {
        End::Client(_) => tracing::debug!(session = number, "the client ended the session"),
        End::Broken(reason) | End::Garbled(reason) => {
            tracing::debug!(session = number, reason, "session broken");
        }
        End::Refused(problem, _) => tracing::debug!(session = number, %problem, "session ended"),
    }
    connection.close(&end).await;
    connection.inbound.end(&app.store);
    app.metrics.sessions_open.dec();
}

async fn converse(connection: &mut Connection, number: u64) -> End {
    let terms = match hello::agree(connection, number).await {
        Ok(terms) => terms,
        Err(end) => return end,
    };
    let frame_len = HEADER_LEN + MAP_LEN * terms.sample_type.bytes();
    let fingers = terms.hand.fingers().len();
    connection.inbound.expect(frame_len, fingers, &connection.app.store);
    let session = frames::Session::new(number, terms, connection);
    frames::serve(connection, session).await
}

/// Why a session ends.
#[derive(Debug)]
enum End {
    /// The client closed the session, with this code if it gave one.
    Client(Option<u16>),
    /// The client does not read, or the connection broke while the server wrote.
    Broken(String),
    /// The bytes received are not WebSocket, or the connection broke or ended without a close while
    /// the server read.
    Garbled(String),
    /// The server ends it, with this error and this close code.
    Refused(Problem, u16),
}

/// The end of a session because the server drains.
fn drained() -> End {
    End::Refused(problem::shutting_down(), close::GOING_AWAY)
}
