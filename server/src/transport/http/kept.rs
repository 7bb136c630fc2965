//! Answers that do not change: made once, away from the threads that move bytes, and kept.
//!
//! What is kept is bounded by what there is: a few forms of each press, of the atlas and of the page,
//! each as it is and compressed.

use std::{
    collections::HashMap,
    io::{self, Write},
    sync::{Arc, Mutex, PoisonError},
};

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::Response,
};
use bytes::Bytes;
use flate2::{Compression, write::GzEncoder};
use papilla_proto::{Problem, atlas::Patch};
use tokio::{
    sync::{OnceCell, Semaphore},
    task::spawn_blocking,
};

use super::answer;
use crate::{
    codec::{Output, Quantity},
    core::catalogue::assets::sha256_hex,
    problem,
    transport::negotiate,
};

/// Which answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum What {
    /// A file of the page, by its place.
    Page(usize),
    OpenApi,
    Models,
    Atlas,
    AtlasObj,
    AtlasGlb,
    Mask(Patch),
    Presses,
    /// Vertex values of a press, by its number.
    Press(usize),
    /// A press as a map.
    PressMap(usize, Quantity, Output),
}

/// An answer as it is made.
pub(super) struct Fresh {
    pub(super) content_type: &'static str,
    pub(super) bytes: Bytes,
    /// Greatest value of a map that is a picture, and the header that says it.
    pub(super) white: Option<(&'static str, f32)>,
}

impl Fresh {
    pub(super) fn new(content_type: &'static str, bytes: impl Into<Bytes>) -> Self {
        Self { content_type, bytes: bytes.into(), white: None }
    }
}

/// An answer as it is kept.
struct Made {
    fresh: Fresh,
    /// Compressed, if that is shorter.
    packed: Option<Bytes>,
    tag: String,
}

/// All that was asked for so far.
pub(crate) struct Kept {
    cells: Mutex<HashMap<What, Arc<OnceCell<Arc<Made>>>>>,
    /// One at a time: the processors are there for maps.
    turn: Semaphore,
}

impl Default for Kept {
    fn default() -> Self {
        Self { cells: Mutex::default(), turn: Semaphore::new(1) }
    }
}

impl Kept {
    /// The answer to a request with these headers; `make` is called if nobody has asked before.
    ///
    /// # Errors
    /// Those of `make`; the next one who asks has it made anew.
    pub(super) async fn answer(
        &self,
        headers: &HeaderMap,
        what: What,
        make: impl FnOnce() -> Result<Fresh, Problem> + Send + 'static,
    ) -> Result<Response, Problem> {
        let cell = Arc::clone(
            self.cells.lock().unwrap_or_else(PoisonError::into_inner).entry(what).or_default(),
        );
        let made = cell.get_or_try_init(|| async {
            let failed = |error: &dyn std::fmt::Display| {
                problem::internal("the answer cannot be made", error)
            };
            let _turn = self.turn.acquire().await.map_err(|error| failed(&error))?;
            let making = spawn_blocking(move || Made::of(make()?).map_err(|error| failed(&error)));
            making.await.map_err(|error| failed(&error))?.map(Arc::new)
        });
        Ok(made.await?.respond(headers, what))
    }
}

impl Made {
    fn of(fresh: Fresh) -> io::Result<Self> {
        let tag = sha256_hex(&fresh.bytes);
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&fresh.bytes)?;
        let packed = encoder.finish()?;
        let packed = (packed.len() < fresh.bytes.len()).then(|| Bytes::from(packed));
        Ok(Self { fresh, packed, tag })
    }

    /// An answer the client may keep, but must ask about: 304 if it has these bytes.
    fn respond(&self, headers: &HeaderMap, what: What) -> Response {
        let packed = self.packed.as_ref().filter(|_| negotiate::takes_gzip(headers));
        let tag = match packed {
            Some(_) => format!("\"{}-gzip\"", self.tag),
            None => format!("\"{}\"", self.tag),
        };
        let asked = headers.get(header::IF_NONE_MATCH).and_then(|value| value.to_str().ok());
        let mut response = if asked.is_some_and(|asked| names(asked, &tag)) {
            let mut response = Response::new(Body::empty());
            *response.status_mut() = StatusCode::NOT_MODIFIED;
            response
        } else {
            answer(self.fresh.content_type, packed.unwrap_or(&self.fresh.bytes).clone())
        };
        let has_body = response.status() == StatusCode::OK;
        let headers = response.headers_mut();
        if let Ok(tag) = HeaderValue::from_str(&tag) {
            headers.insert(header::ETAG, tag);
        }
        if packed.is_some() && has_body {
            headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
        }
        let has_forms = matches!(what, What::PressMap(..));
        let vary = if has_forms { "accept, accept-encoding" } else { "accept-encoding" };
        headers.insert(header::VARY, HeaderValue::from_static(vary));
        if let Some((name, white)) = self.fresh.white
            && let Ok(white) = HeaderValue::from_str(&white.to_string())
        {
            headers.insert(name, white);
        }
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
        headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
        response
    }
}

/// Whether `If-None-Match` names the tag, RFC 9110 13.1.2.
fn names(asked: &str, tag: &str) -> bool {
    asked
        .split(',')
        .any(|one| matches!(one.trim().trim_start_matches("W/"), t if t == tag || t == "*"))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use papilla_proto::ErrorCode;

    use super::*;

    #[tokio::test(flavor = "multi_thread")]
    async fn an_answer_is_made_once_for_all_who_ask() {
        static MADE: AtomicUsize = AtomicUsize::new(0);
        let kept = Arc::new(Kept::default());
        let askers = (0..32).map(|_| {
            let kept = Arc::clone(&kept);
            tokio::spawn(async move {
                let make = || {
                    MADE.fetch_add(1, Ordering::Relaxed);
                    Ok(Fresh::new("text/plain", "x".repeat(1000)))
                };
                let answer = kept.answer(&HeaderMap::new(), What::Atlas, make).await;
                assert_eq!(answer.unwrap().status(), StatusCode::OK);
            })
        });
        for asker in askers.collect::<Vec<_>>() {
            asker.await.unwrap();
        }
        assert_eq!(MADE.load(Ordering::Relaxed), 1);
    }

    #[tokio::test]
    async fn a_failure_is_not_kept() {
        let kept = Kept::default();
        let none = HeaderMap::new();
        let failed = || Err(Problem::new(ErrorCode::Internal, "not now"));
        assert!(kept.answer(&none, What::Atlas, failed).await.is_err());
        let made = || Ok(Fresh::new("text/plain", "now"));
        assert!(kept.answer(&none, What::Atlas, made).await.is_ok());
    }

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
