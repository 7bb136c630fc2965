//! What is done with bodies from outside, and what must hold of it whatever the bytes are.
//!
//! Here for the fuzz target in `server/fuzz` (`tests/fuzz/run`) and the test below alone: no
//! other build has this module.

use axum::http::{HeaderMap, HeaderName, HeaderValue};

#[path = "../../tests/fuzz/refusal.rs"]
mod refusal;

use refusal::is_typed;

use crate::transport::negotiate::{self, Query};

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
    fn heads_of_posts() {
        replay(CORPUS, "head", super::head);
    }
}
