//! The connection of a session, and the task that keeps one.

use std::{mem::replace, sync::Arc, time::Duration};

use futures_util::{
    SinkExt, StreamExt,
    stream::{SplitSink, SplitStream},
};
use papilla_proto::{ClientMessage, Hello, Problem, Ready, ServerMessage};
use tokio::{
    net::TcpStream,
    time::{sleep, timeout},
};
use tokio_tungstenite::{WebSocketStream, client_async, tungstenite::Message};

use super::{Shared, moving::follow, state::Next};
use crate::{PapillaError, dial::dial};

/// Pause before the next attempt to connect.
pub(super) const RETRY: Duration = Duration::from_millis(150);

/// Longest wait for the service's ready.
const PATIENCE: Duration = Duration::from_secs(30);

/// Longest wait for the service to take a close.
const FAREWELL: Duration = Duration::from_secs(1);

type Sink = SplitSink<WebSocketStream<TcpStream>, Message>;
type Stream = SplitStream<WebSocketStream<TcpStream>>;

/// An open connection on which hello was said.
pub(super) struct Link {
    sink: Sink,
    stream: Stream,
}

fn hello_message(hello: &Hello) -> Result<Message, PapillaError> {
    text(&ClientMessage::Hello(hello.clone()))
}

fn text(message: &ClientMessage) -> Result<Message, PapillaError> {
    serde_json::to_string(message)
        .map(Message::from)
        .map_err(|error| PapillaError::Protocol(error.to_string()))
}

fn message(text: &str) -> Result<ServerMessage, PapillaError> {
    serde_json::from_str(text).map_err(|error| PapillaError::Protocol(error.to_string()))
}

impl Link {
    pub(super) async fn open(server: &str, hello: &Hello) -> Result<(Self, Ready), PapillaError> {
        let opening = async { Self::connect(server).await?.say(server, hello, None).await };
        let silent = |_| PapillaError::unreachable(server, &"no ready came");
        timeout(PATIENCE, opening).await.map_err(silent)?
    }

    /// A connection on which nothing was said.
    pub(super) async fn connect(server: &str) -> Result<Self, PapillaError> {
        let broke = |error| PapillaError::of_socket(server, &error);
        let raw = dial(server).await.map_err(|e| PapillaError::unreachable(server, &e))?;
        let url = format!("ws://{server}/v1/session");
        let (socket, _) = client_async(url, raw).await.map_err(broke)?;
        let (sink, stream) = socket.split();
        Ok(Self { sink, stream })
    }

    /// Says hello, with the state that it announces, and waits for ready.
    pub(super) async fn say(
        mut self,
        server: &str,
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
                ServerMessage::Ready(ready) => Ok((self, ready)),
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

/// Keeps a session until it is dropped, or until the service refuses it for good.
pub(super) async fn live(server: String, shared: Arc<Shared>, link: Link) {
    let mut link = link;
    loop {
        let Link { sink, stream } = &mut link;
        let moved = tokio::select! {
            () = write(&shared, sink) => None,
            () = read(&shared, stream) => None,
            moved = follow(&server, &shared) => Some(moved),
        };
        link = match moved {
            Some((new, ready)) => {
                shared.state().moved(Arc::new(ready));
                let mut old = replace(&mut link, new);
                tokio::spawn(async move { timeout(FAREWELL, old.sink.close()).await });
                link
            }
            None => match reopen(&server, &shared).await {
                Some(new) => new,
                None => return shared.state().end(),
            },
        };
        shared.opened.send_modify(|opened| *opened += 1);
    }
}

/// Opens another session after the connection broke; none: the service refuses it for good.
async fn reopen(server: &str, shared: &Shared) -> Option<Link> {
    shared.state().lose();
    loop {
        sleep(RETRY).await;
        let hello = shared.state().hello.clone();
        match Link::open(server, &hello).await {
            Ok((link, ready)) => {
                shared.state().agree(Arc::new(ready));
                return Some(link);
            }
            Err(error) if error.passes() => {}
            Err(_) => return None,
        }
    }
}

/// Sends what waits, one message at a time, until the connection breaks.
async fn write(shared: &Shared, sink: &mut Sink) {
    loop {
        let next = shared.state().next();
        let message = match next {
            Some(Next::Frame(message)) => Ok(Message::from(message)),
            Some(Next::Hello(hello)) => hello_message(&hello),
            Some(Next::Seal) => text(&ClientMessage::Seal),
            None => {
                shared.wake.notified().await;
                continue;
            }
        };
        let Ok(message) = message else { return };
        if sink.send(message).await.is_err() {
            return;
        }
    }
}

/// Takes what the service says until the connection breaks or the service leaves the protocol.
async fn read(shared: &Shared, stream: &mut Stream) {
    while let Some(Ok(received)) = stream.next().await {
        match received {
            Message::Binary(bytes) => {
                let result = shared.state().on_binary(&bytes);
                if result.is_err() {
                    return;
                }
                shared.tell_of_move();
            }
            Message::Text(text) => {
                let Ok(message) = message(&text) else { return };
                shared.state().on_text(message);
                // Frames may have waited for the terms.
                shared.wake.notify_one();
                shared.tell_of_move();
            }
            Message::Close(_) => return,
            Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
        }
    }
}
