//! A connection of a session.

use std::time::Duration;

use futures_util::{
    SinkExt, StreamExt,
    stream::{SplitSink, SplitStream},
};
use papilla_proto::{ClientMessage, Hello, Problem, Ready, ServerMessage};
use tokio::{net::TcpStream, time::timeout};
use tokio_tungstenite::{
    WebSocketStream, client_async,
    tungstenite::{
        Message,
        client::IntoClientRequest,
        http::{HeaderValue, header::AUTHORIZATION},
    },
};

use crate::{Address, PapillaError, dial::dial};

/// Pause before the next attempt to connect.
pub(super) const RETRY: Duration = Duration::from_millis(150);

/// Longest wait for the service's ready.
const PATIENCE: Duration = Duration::from_secs(30);

pub(super) type Sink = SplitSink<WebSocketStream<TcpStream>, Message>;
pub(super) type Stream = SplitStream<WebSocketStream<TcpStream>>;

/// An open connection on which hello was said.
pub(super) struct Link {
    pub(super) sink: Sink,
    pub(super) stream: Stream,
}

pub(super) fn hello_message(hello: &Hello) -> Result<Message, PapillaError> {
    text(&ClientMessage::Hello(hello.clone()))
}

pub(super) fn text(message: &ClientMessage) -> Result<Message, PapillaError> {
    serde_json::to_string(message)
        .map(Message::from)
        .map_err(|error| PapillaError::Protocol(error.to_string()))
}

pub(super) fn message(text: &str) -> Result<ServerMessage, PapillaError> {
    serde_json::from_str(text).map_err(|error| PapillaError::Protocol(error.to_string()))
}

impl Link {
    pub(super) async fn open(
        server: &Address,
        hello: &Hello,
    ) -> Result<(Self, Ready), PapillaError> {
        let opening = async { Self::connect(server).await?.say(server, hello, None).await };
        let silent = |_| PapillaError::unreachable(server, &"no ready came");
        timeout(PATIENCE, opening).await.map_err(silent)?
    }

    /// A connection on which nothing was said.
    pub(super) async fn connect(server: &Address) -> Result<Self, PapillaError> {
        let broke = |error| PapillaError::of_socket(server, &error);
        let raw =
            dial(&server.to_dial()).await.map_err(|e| PapillaError::unreachable(server, &e))?;
        let mut request = server.session().into_client_request().map_err(broke)?;
        if let Some(authorization) = server.authorization() {
            let value = HeaderValue::from_str(&authorization).map_err(|_| PapillaError::Token)?;
            request.headers_mut().insert(AUTHORIZATION, value);
        }
        let (socket, _) = client_async(request, raw).await.map_err(broke)?;
        let (sink, stream) = socket.split();
        Ok(Self { sink, stream })
    }

    /// Says hello, with the state that it announces, and waits for ready.
    pub(super) async fn say(
        mut self,
        server: &Address,
        hello: &Hello,
        sealed: Option<Vec<u8>>,
    ) -> Result<(Self, Ready), PapillaError> {
        let broke = |error| PapillaError::of_socket(server, &error);
        self.sink.send(hello_message(hello)?).await.map_err(broke)?;
        if let Some(sealed) = sealed {
            self.sink.send(Message::from(sealed)).await.map_err(broke)?;
        }
        while let Some(received) = self.stream.next().await {
            let Message::Text(text) = received.map_err(broke)? else { continue };
            return match message(&text)? {
                ServerMessage::Ready(ready) => Ok((self, *ready)),
                ServerMessage::Error(error) => Err(PapillaError::Refused(Problem {
                    code: error.code,
                    message: error.message,
                    field: error.field,
                })),
                _ => Err(PapillaError::Protocol(format!("ready is due, not {text}"))),
            };
        }
        Err(PapillaError::unreachable(server, &"it closed the connection"))
    }
}
