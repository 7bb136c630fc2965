//! A WebSocket client of a session.

use std::{net::SocketAddr, time::Duration};

use futures_util::{SinkExt, StreamExt};
use papilla_proto::{FrameHeader, HEADER_LEN, SampleType};
use serde_json::{Value, json};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::TcpStream,
    time::timeout,
};
use tokio_tungstenite::{
    WebSocketStream, client_async,
    tungstenite::{Error, Message, client::IntoClientRequest, protocol::CloseFrame},
};

const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) struct Socket<S = TcpStream> {
    stream: WebSocketStream<S>,
}

/// What the server said.
#[derive(Debug)]
pub(crate) enum Received {
    Json(Value),
    Frame(FrameHeader, Vec<u8>),
    /// What the session remembers.
    Sealed(Vec<u8>),
    Closed(Option<u16>),
}

impl Socket {
    /// Err: the status the server refused the handshake with, and its body.
    pub(crate) async fn connect(address: SocketAddr) -> Result<Self, (u16, Value)> {
        Self::connect_with(address, "", &[]).await
    }

    /// The same, with a query and headers.
    pub(crate) async fn connect_with(
        address: SocketAddr,
        query: &str,
        headers: &[(&'static str, &str)],
    ) -> Result<Self, (u16, Value)> {
        let url = format!("ws://{address}/v1/session{query}");
        let mut request = url.into_client_request().unwrap();
        for (name, value) in headers {
            request.headers_mut().insert(*name, value.parse().unwrap());
        }
        let stream = TcpStream::connect(address).await.unwrap();
        stream.set_nodelay(true).unwrap();
        match client_async(request, stream).await {
            Ok((stream, _)) => Ok(Self { stream }),
            Err(Error::Http(answer)) => {
                let body = answer.body().as_deref().unwrap_or_default();
                Err((answer.status().as_u16(), serde_json::from_slice(body).unwrap_or_default()))
            }
            Err(error) => panic!("{error}"),
        }
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> Socket<S> {
    /// Over a stream that is open already, such as one of TLS.
    pub(crate) async fn over(stream: S) -> Self {
        let (stream, _) = client_async("ws://localhost/v1/session", stream).await.unwrap();
        Self { stream }
    }

    pub(crate) async fn send(&mut self, message: impl Into<Message>) {
        timeout(PATIENCE, self.stream.send(message.into())).await.unwrap().unwrap();
    }

    /// Sends these with as few writes as can be.
    pub(crate) async fn send_burst<M: Into<Message>>(&mut self, burst: impl Iterator<Item = M>) {
        let all = async {
            for message in burst {
                self.stream.feed(message.into()).await.unwrap();
            }
            self.stream.flush().await.unwrap();
        };
        timeout(PATIENCE, all).await.unwrap();
    }

    /// Sends frames and waits until the service has taken them; returns what it answered to them
    /// meanwhile.
    pub(crate) async fn send_until_taken<M: Into<Message>>(
        &mut self,
        frames: impl IntoIterator<Item = M>,
    ) -> Vec<FrameHeader> {
        // The answer to what comes after a frame says that the frame was taken.
        let after = std::iter::once(Message::from("?"));
        self.send_burst(frames.into_iter().map(Into::into).chain(after)).await;
        let mut answered = Vec::new();
        loop {
            match self.receive().await {
                Received::Frame(header, _) => answered.push(header),
                Received::Json(problem) => {
                    assert_eq!(problem["code"], "unexpected_text", "{problem}");
                    return answered;
                }
                other => panic!("an answer is due, not {other:?}"),
            }
        }
    }

    /// As `send`, but the server may close meanwhile.
    pub(crate) async fn try_send(&mut self, message: impl Into<Message>) {
        let _ = timeout(PATIENCE, self.stream.send(message.into())).await.unwrap();
    }

    pub(crate) async fn close(&mut self, frame: Option<CloseFrame>) {
        let _ = self.stream.close(frame).await;
    }

    pub(crate) async fn receive(&mut self) -> Received {
        loop {
            let message = timeout(PATIENCE, self.stream.next()).await.expect("no answer");
            return match message {
                Some(Ok(Message::Text(text))) => {
                    Received::Json(serde_json::from_str(&text).unwrap())
                }
                Some(Ok(Message::Binary(bytes))) if bytes.starts_with(b"PPS") => {
                    Received::Sealed(bytes.to_vec())
                }
                Some(Ok(Message::Binary(bytes))) => {
                    let header = FrameHeader::decode(&bytes).unwrap();
                    Received::Frame(header, bytes[HEADER_LEN..].to_vec())
                }
                Some(Ok(Message::Close(frame))) => Received::Closed(frame.map(|f| f.code.into())),
                Some(Ok(_)) => continue,
                Some(Err(_)) | None => Received::Closed(None),
            };
        }
    }

    /// The next message as it came.
    pub(crate) async fn hear(&mut self) -> Message {
        timeout(PATIENCE, self.stream.next()).await.expect("no answer").unwrap().unwrap()
    }

    pub(crate) async fn hear_json(&mut self) -> Value {
        match self.receive().await {
            Received::Json(value) => value,
            other => panic!("text is due, not {other:?}"),
        }
    }

    pub(crate) async fn hear_frame(&mut self) -> (FrameHeader, Vec<u8>) {
        match self.receive().await {
            Received::Frame(header, payload) => (header, payload),
            other => panic!("a frame is due, not {other:?}"),
        }
    }

    /// Asks for what the session remembers.
    pub(crate) async fn seal(&mut self) -> Vec<u8> {
        self.send(r#"{"type": "seal"}"#).await;
        match self.receive().await {
            Received::Sealed(sealed) => sealed,
            other => panic!("a sealed state is due, not {other:?}"),
        }
    }

    /// Says a hello that brings a state; returns ready.
    pub(crate) async fn resume(&mut self, mut hello: Value, sealed: Vec<u8>) -> Value {
        hello["resume"] = json!(true);
        self.send(hello.to_string()).await;
        self.send(sealed).await;
        let ready = self.hear_json().await;
        assert_eq!(ready["type"], "ready", "{ready}");
        ready
    }

    /// Asserts that the next message is an error the session survives; returns it.
    pub(crate) async fn hear_refusal(&mut self, code: &str) -> Value {
        let error = self.hear_json().await;
        assert_eq!(error["type"], "error", "{error}");
        assert_eq!(error["code"], code, "{error}");
        assert_eq!(error["closes"], false, "{error}");
        error
    }

    /// Asserts that the server ends the session with this error.
    pub(crate) async fn hear_end(&mut self, code: &str, close_code: u16) {
        let error = self.hear_json().await;
        assert_eq!((&error["code"], &error["closes"]), (&json!(code), &json!(true)), "{error}");
        match self.receive().await {
            Received::Closed(found) => assert_eq!(found, Some(close_code)),
            other => panic!("a close is due, not {other:?}"),
        }
    }

    /// Says hello and asserts that the answer is ready; returns it.
    pub(crate) async fn open(&mut self, hello: Value) -> Value {
        self.send(hello.to_string()).await;
        let ready = self.hear_json().await;
        assert_eq!(ready["type"], "ready", "{ready}");
        ready
    }
}

/// A hello with these members beside its type.
pub(crate) fn hello(members: &Value) -> Value {
    let mut hello = json!({"type": "hello"});
    for (name, value) in members.as_object().unwrap() {
        hello[name] = value.clone();
    }
    hello
}

/// A pressure frame.
pub(crate) fn frame(
    sequence: u32,
    deadline_us: u32,
    sample_type: SampleType,
    scale: f32,
    map: &[f32],
) -> Vec<u8> {
    let client_time_us = 1_000_000 + u64::from(sequence);
    let header = FrameHeader::pressure(sequence, client_time_us, deadline_us, sample_type, scale);
    let mut frame = header.encode().to_vec();
    frame.resize(HEADER_LEN + map.len() * sample_type.bytes(), 0);
    sample_type.encode(map, scale, &mut frame[HEADER_LEN..]).unwrap();
    frame
}
