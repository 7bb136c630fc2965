//! The connection of a session, and the task that keeps one.

use std::{sync::Arc, time::Duration};

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

use super::{Shared, state::Next};
use crate::{PapillaError, dial::dial};

/// Pause before the next attempt to connect.
const RETRY: Duration = Duration::from_millis(150);

/// Longest wait for the service's ready.
const PATIENCE: Duration = Duration::from_secs(30);

type Sink = SplitSink<WebSocketStream<TcpStream>, Message>;
type Stream = SplitStream<WebSocketStream<TcpStream>>;

/// An open connection on which hello was said.
pub(super) struct Link {
    sink: Sink,
    stream: Stream,
}

fn hello_message(hello: &Hello) -> Result<Message, PapillaError> {
    serde_json::to_string(&ClientMessage::Hello(hello.clone()))
        .map(Message::from)
        .map_err(|error| PapillaError::Protocol(error.to_string()))
}

fn message(text: &str) -> Result<ServerMessage, PapillaError> {
    serde_json::from_str(text).map_err(|error| PapillaError::Protocol(error.to_string()))
}

impl Link {
    pub(super) async fn open(server: &str, hello: &Hello) -> Result<(Self, Ready), PapillaError> {
        let opening = async {
            let broke = |error| PapillaError::of_socket(server, &error);
            let raw = dial(server).await.map_err(|e| PapillaError::unreachable(server, &e))?;
            let (socket, _) =
                client_async(format!("ws://{server}/v1/session"), raw).await.map_err(broke)?;
            let (mut sink, mut stream) = socket.split();
            sink.send(hello_message(hello)?).await.map_err(broke)?;
            while let Some(received) = stream.next().await {
                let Message::Text(text) = received.map_err(broke)? else { continue };
                return match message(&text)? {
                    ServerMessage::Ready(ready) => Ok((Self { sink, stream }, ready)),
                    ServerMessage::Error(error) => Err(PapillaError::Refused(Problem {
                        code: error.code,
                        message: error.message,
                        field: error.field,
                    })),
                    _ => Err(PapillaError::Protocol(format!("ready is due, not {text}"))),
                };
            }
            Err(PapillaError::unreachable(server, &"it closed the connection"))
        };
        let silent = |_| PapillaError::unreachable(server, &"no ready came");
        timeout(PATIENCE, opening).await.map_err(silent)?
    }
}

/// Keeps a session until it is dropped, or until the service refuses it for good.
pub(super) async fn live(server: String, shared: Arc<Shared>, link: Link) {
    let Link { mut sink, mut stream } = link;
    loop {
        tokio::select! {
            () = write(&shared, &mut sink) => {}
            () = read(&shared, &mut stream) => {}
        }
        shared.state().lose();
        (sink, stream) = loop {
            sleep(RETRY).await;
            let hello = shared.state().hello.clone();
            match Link::open(&server, &hello).await {
                Ok((link, ready)) => {
                    shared.state().agree(Arc::new(ready));
                    break (link.sink, link.stream);
                }
                Err(error) if error.passes() => {}
                Err(_) => return shared.state().end(),
            }
        };
        shared.opened.send_modify(|opened| *opened += 1);
    }
}

/// Sends what waits, one message at a time, until the connection breaks.
async fn write(shared: &Shared, sink: &mut Sink) {
    loop {
        let next = shared.state().next();
        let message = match next {
            Some(Next::Frame(message)) => Ok(Message::from(message)),
            Some(Next::Hello(hello)) => hello_message(&hello),
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
                if shared.state().on_binary(&bytes).is_err() {
                    return;
                }
            }
            Message::Text(text) => {
                let Ok(message) = message(&text) else { return };
                shared.state().on_text(message);
                // Frames may have waited for the terms.
                shared.wake.notify_one();
            }
            Message::Close(_) => return,
            Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
        }
    }
}
