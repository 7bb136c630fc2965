//! A client of a session.

use std::{io, time::Duration};

use futures_util::{
    SinkExt, StreamExt,
    stream::{SplitSink, SplitStream},
};
use papilla_client::dial;
use papilla_proto::{
    ClientMessage, FrameError, FrameHeader, HEADER_LEN, Hello, Ready, ServerMessage, SessionError,
};
use tokio::{net::TcpStream, time::timeout};
use tokio_tungstenite::{
    WebSocketStream, client_async,
    tungstenite::{self, Bytes, Message},
};

/// Longest wait for the server's ready, s.
const PATIENCE_S: u64 = 30;

/// Why a session cannot be opened or used.
#[derive(Debug, thiserror::Error)]
pub enum SocketError {
    /// Nobody listens.
    #[error("{server}: {source}; is the service running there?")]
    Connect {
        /// Host and port.
        server: String,
        /// What the system says.
        source: io::Error,
    },
    /// The connection is no WebSocket, was refused, or broke.
    #[error("WebSocket: {0}")]
    WebSocket(Box<tungstenite::Error>),
    /// The server refused the hello.
    #[error("the server refuses the session: {}: {}", .0.code, .0.message)]
    Refused(Box<SessionError>),
    /// What the server said is not of the protocol.
    #[error("the server said what is not of the protocol: {0}")]
    Text(String),
    /// A frame of the server's is damaged.
    #[error("a frame of the server's is damaged: {0}")]
    Frame(#[from] FrameError),
    /// The server closed the session.
    #[error("the server closed the session")]
    Closed,
    /// No answer in time.
    #[error("the server has been silent for {0} s")]
    Silent(u64),
}

impl From<tungstenite::Error> for SocketError {
    fn from(error: tungstenite::Error) -> Self {
        match error {
            tungstenite::Error::ConnectionClosed | tungstenite::Error::AlreadyClosed => {
                Self::Closed
            }
            error => Self::WebSocket(Box::new(error)),
        }
    }
}

/// The sending half of a session.
#[derive(Debug)]
pub struct Sender(SplitSink<WebSocketStream<TcpStream>, Message>);

/// The hearing half of a session.
#[derive(Debug)]
pub struct Receiver(SplitStream<WebSocketStream<TcpStream>>);

/// What the server said.
#[derive(Clone, Debug)]
pub enum Received {
    /// An answer: its header and its samples (none unless the status is ok).
    Frame(FrameHeader, Bytes),
    /// A refusal; `closes` says whether the session ends.
    Error(SessionError),
}

/// Opens a session at `server` (host and port), `TCP_NODELAY` set.
///
/// # Errors
/// [`SocketError`]: nobody listens, the handshake or the hello is refused.
pub async fn open(server: &str, hello: &Hello) -> Result<(Ready, Sender, Receiver), SocketError> {
    let (sender, receiver) = connect(server).await?;
    say(sender, receiver, hello, None).await
}

/// A connection to `server` on which nothing was said, `TCP_NODELAY` set.
///
/// # Errors
/// [`SocketError`]: nobody listens, or the handshake is refused.
pub async fn connect(server: &str) -> Result<(Sender, Receiver), SocketError> {
    let connect = |source| SocketError::Connect { server: server.to_owned(), source };
    in_time(async {
        let stream = dial(server).await.map_err(connect)?;
        let (stream, _) = client_async(format!("ws://{server}/v1/session"), stream).await?;
        let (sender, receiver) = stream.split();
        Ok((Sender(sender), Receiver(receiver)))
    })
    .await
}

/// Says hello, with the state that it announces, and waits for ready.
///
/// # Errors
/// [`SocketError`]: the hello is refused, or the connection breaks.
pub async fn say(
    mut sender: Sender,
    mut receiver: Receiver,
    hello: &Hello,
    sealed: Option<Vec<u8>>,
) -> Result<(Ready, Sender, Receiver), SocketError> {
    in_time(async {
        let hello = serde_json::to_string(&ClientMessage::Hello(hello.clone()))
            .map_err(|error| SocketError::Text(error.to_string()))?;
        sender.send(hello).await?;
        if let Some(sealed) = sealed {
            sender.send(sealed).await?;
        }
        match receiver.text_or_frame().await? {
            Said::Text(ServerMessage::Ready(ready)) => Ok((*ready, sender, receiver)),
            Said::Text(ServerMessage::Error(error)) => Err(SocketError::Refused(Box::new(error))),
            Said::Text(_) | Said::Frame(..) => Err(SocketError::Text("ready is due".to_owned())),
        }
    })
    .await
}

async fn in_time<T>(work: impl Future<Output = Result<T, SocketError>>) -> Result<T, SocketError> {
    let done = timeout(Duration::from_secs(PATIENCE_S), work).await;
    done.map_err(|_| SocketError::Silent(PATIENCE_S))?
}

/// The connection of an open session with nothing under way, for whoever speaks over it by themselves.
///
/// # Errors
/// The connection is broken.
pub fn into_stream(sender: Sender, receiver: Receiver) -> io::Result<std::net::TcpStream> {
    let whole = sender.0.reunite(receiver.0).map_err(io::Error::other)?;
    whole.into_inner().into_std()
}

/// A frame: header and samples.
#[must_use]
pub fn frame(header: &FrameHeader, payload: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(HEADER_LEN + payload.len());
    frame.extend_from_slice(&header.encode());
    frame.extend_from_slice(payload);
    frame
}

impl Sender {
    /// Sends one message: a frame (bytes) or text.
    ///
    /// # Errors
    /// The session is closed or broken.
    pub async fn send(&mut self, message: impl Into<Message>) -> Result<(), SocketError> {
        Ok(self.0.send(message.into()).await?)
    }

    /// Says goodbye.
    pub async fn close(&mut self) {
        // Err: it is closed already.
        let _ = self.0.close().await;
    }
}

enum Said {
    Text(ServerMessage),
    Frame(FrameHeader, Bytes),
}

impl Receiver {
    /// Waits for the next answer or refusal, as long as it takes.
    ///
    /// # Errors
    /// The session is closed or broken, or the server leaves the protocol.
    pub async fn receive(&mut self) -> Result<Received, SocketError> {
        match self.text_or_frame().await? {
            Said::Frame(header, payload) => Ok(Received::Frame(header, payload)),
            Said::Text(ServerMessage::Error(error)) => Ok(Received::Error(error)),
            Said::Text(_) => Err(SocketError::Text("a second ready".to_owned())),
        }
    }

    async fn text_or_frame(&mut self) -> Result<Said, SocketError> {
        loop {
            match self.0.next().await.ok_or(SocketError::Closed)?? {
                Message::Text(text) => {
                    let message = serde_json::from_str(&text);
                    return message.map(Said::Text).map_err(|e| SocketError::Text(e.to_string()));
                }
                Message::Binary(bytes) => {
                    let header = FrameHeader::decode(&bytes)?;
                    return Ok(Said::Frame(header, bytes.slice(HEADER_LEN..)));
                }
                Message::Close(_) => return Err(SocketError::Closed),
                Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
            }
        }
    }
}
