//! Reading a request's body within bounds of size and time.

use std::time::Duration;

use axum::body::Body;
use bytes::{Bytes, BytesMut};
use http_body_util::BodyExt;
use papilla_proto::{ErrorCode, Problem};
use tokio::time::timeout;

/// Largest body, bytes: a JSON map with every digit of its f64 takes about 1.2 MB.
pub(super) const BODY_MAX: usize = 2 << 20;

/// So much more is read and thrown away, so that a client that is still sending gets to
/// read why it is refused.
const DISCARD_MAX: usize = 8 << 20;

/// The whole body.
///
/// # Errors
/// Larger than [`BODY_MAX`], slower than `patience`, or cut off.
pub(super) async fn read(body: Body, patience: Duration) -> Result<Bytes, Problem> {
    match timeout(patience, collect(body)).await {
        Ok(result) => result,
        Err(_) => {
            let message = format!("the body did not arrive within {patience:?}");
            Err(Problem::new(ErrorCode::Timeout, message))
        }
    }
}

async fn collect(mut body: Body) -> Result<Bytes, Problem> {
    let mut whole = BytesMut::new();
    let mut length = 0;
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|error| {
            Problem::new(ErrorCode::WrongLength, format!("the body broke off: {error}"))
        })?;
        let Ok(data) = frame.into_data() else { continue };
        length += data.len();
        if length <= BODY_MAX {
            whole.extend_from_slice(&data);
        } else {
            whole = BytesMut::new();
        }
        if length > DISCARD_MAX {
            break;
        }
    }
    if length > BODY_MAX {
        let message = format!("the body is larger than {BODY_MAX} bytes; a raw map has 200704");
        return Err(Problem::new(ErrorCode::TooLarge, message));
    }
    Ok(whole.freeze())
}
