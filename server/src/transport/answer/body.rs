//! Reading a request's body within bounds of size and time.

use std::time::Duration;

use axum::{
    body::{Body, HttpBody},
    http::{HeaderMap, HeaderValue, header},
};
use bytes::{Bytes, BytesMut};
use http_body_util::BodyExt;
use papilla_proto::{ErrorCode, Problem, error::shortened};
use tokio::time::timeout;

use super::refusal::CODING;

/// So much more than is taken is read and thrown away, so that a client that is still sending
/// gets to read why it is refused.
const DISCARD_MAX: usize = 8 << 20;

/// Longest time for that.
const DISCARD_WAIT: Duration = Duration::from_secs(1);

/// The whole body.
///
/// # Errors
/// Larger than `bytes_max`, slower than `wait_max`, or cut off.
pub(crate) async fn read(
    headers: &HeaderMap,
    body: Body,
    bytes_max: usize,
    wait_max: Duration,
) -> Result<Bytes, Problem> {
    let announced = body.size_hint().lower();
    if announced > bytes_max as u64 {
        // Whoever waits for `100 Continue` sends nothing yet, and reading would ask for it.
        if !headers.contains_key(header::EXPECT) {
            let _ = timeout(wait_max.min(DISCARD_WAIT), discard(body)).await;
        }
        return Err(too_large(bytes_max));
    }
    match timeout(wait_max, collect(body, bytes_max)).await {
        Ok(result) => result,
        Err(_) => {
            let message = format!("the body did not arrive within {wait_max:?}");
            Err(Problem::new(ErrorCode::Timeout, message))
        }
    }
}

/// Whether the body is what it says: no coding of content is undone here.
///
/// # Errors
/// `Content-Encoding` names one.
pub(crate) fn require_plain(headers: &HeaderMap) -> Result<(), Problem> {
    let codings = headers.get_all(header::CONTENT_ENCODING).iter();
    let is_plain = |value: &HeaderValue| value.as_bytes().eq_ignore_ascii_case(b"identity");
    let Some(coding) = codings.into_iter().find(|value| !is_plain(value)) else { return Ok(()) };
    let coding = shortened(coding.to_str().unwrap_or("?"));
    let message = format!("a body coded as '{coding}' is not taken; send it as it is");
    Err(Problem::new(ErrorCode::WrongType, message).at(CODING))
}

async fn collect(mut body: Body, bytes_max: usize) -> Result<Bytes, Problem> {
    let mut whole = BytesMut::new();
    let mut length = 0;
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|error| {
            Problem::new(ErrorCode::WrongLength, format!("the body broke off: {error}"))
        })?;
        let Ok(data) = frame.into_data() else { continue };
        length += data.len();
        if length <= bytes_max {
            whole.extend_from_slice(&data);
        } else {
            whole = BytesMut::new();
        }
        if length > bytes_max + DISCARD_MAX {
            break;
        }
    }
    if length > bytes_max { Err(too_large(bytes_max)) } else { Ok(whole.freeze()) }
}

/// Reads a body that is refused already, as far as that is done.
async fn discard(mut body: Body) {
    let mut length = 0;
    while let Some(Ok(frame)) = body.frame().await {
        length += frame.data_ref().map_or(0, Bytes::len);
        if length > DISCARD_MAX {
            break;
        }
    }
}

fn too_large(bytes_max: usize) -> Problem {
    let message = format!("the body is larger than {bytes_max} bytes; a raw map has 200704");
    Problem::new(ErrorCode::TooLarge, message)
}
