//! What is done with bodies from outside, and what must hold of it whatever the bytes are.
//!
//! Here for the fuzz targets in `server/fuzz` (`tests/fuzz/run`) and the test below alone: no
//! other build has this module.

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use bytes::Bytes;
use papilla_proto::{MAP_LEN, Problem};

use crate::transport::{
    negotiate::{self, Query},
    oip::fuzz::read as read_oip,
};

/// A refusal tells a client what to do: a code of its own making and words.
fn is_typed(problem: &Problem) -> bool {
    (400..500).contains(&problem.code.http_status()) && problem.message.len() > 10
}

/// `data` with its part from `start` brought to the length of a map of f4.
fn extended(data: &[u8], start: usize) -> Vec<u8> {
    let mut data = data.to_vec();
    data.resize(start + 4 * MAP_LEN, 0);
    data
}

/// A request of the Open Inference Protocol. The first two bytes, little-endian, say how long the
/// JSON before the bytes of the tensor is; 65535: there are none, and no header says so. Bytes are
/// taken as they are, and brought to the length of a whole map.
pub fn oip(data: &[u8]) {
    let Some((length, data)) = data.split_first_chunk::<2>() else { return };
    let length = u16::from_le_bytes(*length);
    let head = (length < u16::MAX).then(|| HeaderValue::from(length));
    let whole = extended(data, usize::from(length));
    let bodies = if head.is_some() { vec![data, &whole] } else { vec![data] };
    for body in bodies {
        match read_oip(&Bytes::copy_from_slice(body), head.clone()) {
            // Either all of the map or bytes whose number the request gave itself.
            Ok(payload) => assert!(payload.len() <= body.len().max(4 * MAP_LEN)),
            Err(problem) => assert!(is_typed(&problem), "{problem}"),
        }
    }
}

/// The head of `POST /v1/sed`: query, content type and accept, a line each; then the body, whose
/// first bytes may tell its type.
pub fn head(data: &[u8]) {
    let mut lines = data.splitn(4, |byte| *byte == b'\n');
    let mut line = || lines.next().unwrap_or_default();
    let query = match Query::parse(&String::from_utf8_lossy(line())) {
        Ok(query) => query,
        Err(problem) => {
            assert!(is_typed(&problem), "{problem}");
            Query::default()
        }
    };
    let mut headers = HeaderMap::new();
    for name in ["content-type", "accept"] {
        if let Ok(value) = HeaderValue::from_bytes(line()) {
            headers.insert(HeaderName::from_static(name), value);
        }
    }
    for result in [
        negotiate::input(&headers, &query, line()).map(|_| ()),
        negotiate::output(&headers).map(|_| ()),
    ] {
        assert!(result.as_ref().err().is_none_or(is_typed), "{result:?}");
    }
}

#[cfg(test)]
#[path = "../../tests/fuzz/replay.rs"]
mod replay;

#[cfg(test)]
mod tests {
    use super::replay::replay;

    const CORPUS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus");

    #[test]
    fn requests_of_the_open_inference_protocol() {
        replay(CORPUS, "oip", super::oip);
    }

    #[test]
    fn heads_of_posts() {
        replay(CORPUS, "head", super::head);
    }
}
