//! The task that keeps a session connected.

use std::{mem::replace, sync::Arc, time::Duration};

use futures_util::{SinkExt, StreamExt};
use papilla_proto::ClientMessage;
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::Message;

use super::{
    Shared,
    link::{Link, RETRY, Sink, Stream, hello_message, message, text},
    moving::follow,
    state::Next,
};
use crate::Address;

/// Longest wait for the service to take a close.
const FAREWELL: Duration = Duration::from_secs(1);

/// Keeps a session until it is dropped, or until the service refuses it for good.
pub(super) async fn live(server: Address, shared: Arc<Shared>, link: Link) {
    let mut link = link;
    loop {
        let Link { sink, stream } = &mut link;
        let moved = tokio::select! {
            () = write(&shared, sink) => None,
            () = read(&shared, stream) => None,
            () = stalled(&shared) => None,
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

/// Looks whether the time of a frame is over, for as long as the session is there.
pub(super) async fn watch(shared: Arc<Shared>) {
    loop {
        let timeout = shared.state().timeout;
        sleep((timeout / 20).clamp(Duration::from_millis(5), Duration::from_millis(100))).await;
        if shared.state().expire() {
            shared.stalled.notify_one();
        }
    }
}

/// Waits until nothing more is to be expected of the connection.
async fn stalled(shared: &Shared) {
    while !shared.state().is_stalled {
        shared.stalled.notified().await;
    }
}

/// Opens another session after the connection broke; none: the service refuses it for good.
async fn reopen(server: &Address, shared: &Shared) -> Option<Link> {
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
