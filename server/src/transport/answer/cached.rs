//! The HTTP form of an answer from the cache: compressed, or 304, where the client takes that.

use std::hash::Hash;

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::Response,
};
use papilla_proto::Problem;

use super::answer;
use crate::{
    core::cache::{Cache, Cached, Content},
    transport::negotiate,
};

/// The answer to a request with these headers; `make` is called if nobody has asked before.
///
/// # Errors
/// Those of `make`; the next one who asks has it made anew.
pub(crate) async fn cached<K: Eq + Hash>(
    cache: &Cache<K>,
    headers: &HeaderMap,
    key: K,
    make: impl FnOnce() -> Result<Content, Problem> + Send + 'static,
) -> Result<Response, Problem> {
    Ok(respond(&*cache.get(key, make).await?, headers))
}

/// An answer the client may keep, but must ask about: 304 if it has these bytes.
fn respond(cached: &Cached, headers: &HeaderMap) -> Response {
    let gzip = cached.gzip.as_ref().filter(|_| negotiate::takes_gzip(headers));
    let tag = match gzip {
        Some(_) => format!("\"{}-gzip\"", cached.tag),
        None => format!("\"{}\"", cached.tag),
    };
    let asked = headers.get(header::IF_NONE_MATCH).and_then(|value| value.to_str().ok());
    let mut response = if asked.is_some_and(|asked| names(asked, &tag)) {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = StatusCode::NOT_MODIFIED;
        response
    } else {
        answer(cached.content.content_type, gzip.unwrap_or(&cached.content.bytes).clone())
    };
    let has_body = response.status() == StatusCode::OK;
    let headers = response.headers_mut();
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        headers.insert(header::ETAG, tag);
    }
    if gzip.is_some() && has_body {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    let vary =
        if cached.content.is_negotiated { "accept, accept-encoding" } else { "accept-encoding" };
    headers.insert(header::VARY, HeaderValue::from_static(vary));
    if let Some((name, white)) = cached.content.white
        && let Ok(white) = HeaderValue::from_str(&white.to_string())
    {
        headers.insert(name, white);
    }
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}

/// Whether `If-None-Match` names the tag, RFC 9110 13.1.2.
fn names(asked: &str, tag: &str) -> bool {
    asked
        .split(',')
        .any(|one| matches!(one.trim().trim_start_matches("W/"), t if t == tag || t == "*"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_found_in_lists() {
        for (asked, found) in [
            ("\"a\"", true),
            ("W/\"a\"", true),
            ("\"b\", \"a\"", true),
            ("*", true),
            ("a", false),
            ("\"ab\"", false),
        ] {
            assert_eq!(names(asked, "\"a\""), found, "{asked}");
        }
    }
}
