//! Maps over plain HTTP: one request at a time on one connection, as a client without a
//! session has it.
//!
//! Frames keep their instants here too. While a request is under way newer frames replace
//! the one that waits; those that never leave count as superseded. So a slow service is not
//! flattered by a client that waits for it, nor drowned in requests no client would send.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use http_body_util::{BodyExt, Full};
use hyper::{
    HeaderMap, Method, Request,
    body::Bytes,
    client::conn::http1::{self, SendRequest},
};
use hyper_util::rt::TokioIo;
use papilla_client::dial;
use papilla_proto::{FrameHeader, FrameStatus, MAP_LEN, MAP_SIDE_PX};
use serde_json::json;
use tokio::{sync::mpsc::UnboundedReceiver, time::timeout};

use super::{
    Speak,
    session::{Ear, Shared},
    tally::Tally,
    tally::Times,
};
use crate::http::HttpError;

/// What is said to the service.
#[derive(Clone, Debug)]
pub(super) struct Letter {
    server: String,
    path: String,
    /// Before the samples in every body.
    head: Bytes,
}

/// Length of the JSON before the binary tensors of an Open Inference Protocol body.
const JSON_LENGTH: &str = "inference-header-content-length";

impl Letter {
    pub(super) fn new(server: &str, speak: Speak, tier: &str, budget_us: Option<u32>) -> Self {
        let (path, head) = match speak {
            Speak::Oip => {
                let bytes = 4 * MAP_LEN;
                let shape = [1, 1, MAP_SIDE_PX, MAP_SIDE_PX];
                let json = json!({
                    "inputs": [{"name": "pressure_pa", "shape": shape, "datatype": "FP32",
                                "parameters": {"binary_data_size": bytes}}],
                    "outputs": [{"name": "sed_j_per_m3", "parameters": {"binary_data": true}}],
                });
                (format!("/v2/models/{tier}/infer"), Bytes::from(json.to_string()))
            }
            Speak::Session | Speak::Http => {
                let budget = budget_us.map_or_else(String::new, |us| format!("&budget_us={us}"));
                (format!("/v1/sed?tier={tier}{budget}"), Bytes::new())
            }
        };
        Self { server: server.to_owned(), path, head }
    }

    fn request(&self, samples: &[u8]) -> Result<Request<Full<Bytes>>, hyper::http::Error> {
        let mut request = Request::builder()
            .method(Method::POST)
            .uri(&self.path)
            .header("host", &self.server)
            .header("content-type", "application/octet-stream");
        if !self.head.is_empty() {
            request = request.header(JSON_LENGTH, self.head.len());
        }
        request.body(Full::new([&self.head[..], samples].concat().into()))
    }

    pub(super) async fn connect(&self) -> Result<Post, HttpError> {
        let io = |source| HttpError::Io { server: self.server.clone(), source };
        let stream = dial(&self.server).await.map_err(io)?;
        let (sender, connection) = http1::handshake(TokioIo::new(stream))
            .await
            .map_err(|error| io(std::io::Error::other(error)))?;
        // Its errors come back through the requests.
        tokio::spawn(connection);
        Ok(Post { letter: self.clone(), sender })
    }
}

/// A connection that is kept.
#[derive(Debug)]
pub(super) struct Post {
    letter: Letter,
    sender: SendRequest<Full<Bytes>>,
}

/// Sends the newest due frame whenever the connection is free, until the beat ends.
pub(super) async fn run(
    shared: Arc<Shared>,
    session: usize,
    mut post: Post,
    mut beat: UnboundedReceiver<u32>,
) -> Tally {
    let mut ear = Ear::new(&shared, session);
    let mut delay = Times::default();
    while let Some(mut number) = beat.recv().await {
        while let Ok(newer) = beat.try_recv() {
            let header = header(&shared, number).answer(FrameStatus::Superseded, 0, 1.0);
            ear.frame(Instant::now(), &header, &[]);
            number = newer;
        }
        if number >= shared.plan.warmup {
            delay.record(shared.plan.intended(session, number).elapsed());
        }
        let header = header(&shared, number);
        let samples = &shared.encoded.payloads[shared.encoded.index(session, number, 1)];
        match timeout(shared.drain, post.exchange(samples)).await {
            Ok(Ok(answer)) => {
                ear.frame(Instant::now(), &answer.header(header), &answer.samples);
            }
            Ok(Err(reason)) => ear.refused(number, &reason),
            // Lost; what comes on this connection from now on belongs to no request.
            Err(_) => break,
        }
    }
    let mut tally = ear.tally();
    tally.send_delay = delay;
    tally
}

fn header(shared: &Shared, number: u32) -> FrameHeader {
    let time_us = shared.plan.start.elapsed().as_micros() as u64;
    let encoded = &shared.encoded;
    FrameHeader::pressure(number, time_us, 0, encoded.sample_type, encoded.scale)
}

/// A map, and what the service says of it, if it is Papilla.
struct Answer {
    samples: Bytes,
    queue: Duration,
    infer: Duration,
    total: Duration,
}

impl Answer {
    fn header(&self, request: FrameHeader) -> FrameHeader {
        let us = |time: Duration| time.as_micros() as u32;
        let header = request.answer(FrameStatus::Ok, us(self.total), 1.0);
        FrameHeader { queue_us: us(self.queue), infer_us: us(self.infer), ..header }
    }
}

impl Post {
    async fn exchange(&mut self, samples: &[u8]) -> Result<Answer, String> {
        let request = self.letter.request(samples).map_err(|error| error.to_string())?;
        let text = |error: hyper::Error| error.to_string();
        self.sender.ready().await.map_err(text)?;
        let (head, body) = self.sender.send_request(request).await.map_err(text)?.into_parts();
        let body = body.collect().await.map_err(text)?.to_bytes();
        if !head.status.is_success() {
            return Err(format!("status {}", head.status.as_u16()));
        }
        let json = number(&head.headers, JSON_LENGTH).unwrap_or(0) as usize;
        if body.len() != json + 4 * MAP_LEN {
            return Err(format!("an answer of {} bytes", body.len()));
        }
        let time = |name| Duration::from_micros(number(&head.headers, name).unwrap_or(0));
        Ok(Answer {
            samples: body.slice(json..),
            queue: time("x-papilla-queue-us"),
            infer: time("x-papilla-infer-us"),
            total: time("x-papilla-total-us"),
        })
    }
}

fn number(headers: &HeaderMap, name: &str) -> Option<u64> {
    headers.get(name)?.to_str().ok()?.parse().ok()
}
