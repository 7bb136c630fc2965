//! Answers that do not change. Each is made once, on a thread that does not move bytes.
//!
//! The cache is bounded by what can be asked for: a few forms of each state of the replay, of the
//! atlas and of the page, each plain and compressed.

use std::{
    collections::HashMap,
    hash::Hash,
    io::{self, Write},
    sync::{Arc, Mutex, PoisonError},
};

use bytes::Bytes;
use flate2::{Compression, write::GzEncoder};
use papilla_proto::Problem;
use tokio::{
    sync::{OnceCell, Semaphore},
    task::spawn_blocking,
};

use crate::{core::digest::sha256_hex, problem};

/// An answer before it is compressed and hashed.
#[derive(Debug)]
pub(crate) struct Content {
    pub(crate) content_type: &'static str,
    pub(crate) bytes: Bytes,
    /// For a map drawn as a picture: the name of the header that states the value of white, and
    /// that value.
    pub(crate) white: Option<(&'static str, f32)>,
    /// Whether the client's `Accept` has chosen this form among others.
    pub(crate) is_negotiated: bool,
}

impl Content {
    pub(crate) fn new(content_type: &'static str, bytes: impl Into<Bytes>) -> Self {
        Self { content_type, bytes: bytes.into(), white: None, is_negotiated: false }
    }
}

/// An answer as it lies in the cache.
#[derive(Debug)]
pub(crate) struct Cached {
    pub(crate) content: Content,
    /// The bytes compressed by gzip; None if that is no shorter.
    pub(crate) gzip: Option<Bytes>,
    /// SHA-256 of the uncompressed bytes, in hexadecimal digits.
    pub(crate) tag: String,
}

/// The answers that were asked for so far, by key.
pub(crate) struct Cache<K> {
    cells: Mutex<HashMap<K, Arc<OnceCell<Arc<Cached>>>>>,
    /// One answer is made at a time, to leave the processors to frames.
    turn: Semaphore,
}

impl<K> Default for Cache<K> {
    fn default() -> Self {
        Self { cells: Mutex::default(), turn: Semaphore::new(1) }
    }
}

impl<K: Eq + Hash> Cache<K> {
    /// The answer for this key. `make` is called if it is not cached yet.
    ///
    /// # Errors
    /// Those of `make`. An error is not cached: the next request calls its `make`.
    pub(crate) async fn get(
        &self,
        key: K,
        make: impl FnOnce() -> Result<Content, Problem> + Send + 'static,
    ) -> Result<Arc<Cached>, Problem> {
        let cell = Arc::clone(
            self.cells.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default(),
        );
        let made = cell.get_or_try_init(|| async {
            let failed = |error: &dyn std::fmt::Display| {
                problem::internal("the answer cannot be made", error)
            };
            let _turn = self.turn.acquire().await.map_err(|error| failed(&error))?;
            let making =
                spawn_blocking(move || Cached::of(make()?).map_err(|error| failed(&error)));
            making.await.map_err(|error| failed(&error))?.map(Arc::new)
        });
        made.await.map(Arc::clone)
    }
}

impl Cached {
    fn of(content: Content) -> io::Result<Self> {
        let tag = sha256_hex(&content.bytes);
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&content.bytes)?;
        let gzip = encoder.finish()?;
        let gzip = (gzip.len() < content.bytes.len()).then(|| Bytes::from(gzip));
        Ok(Self { content, gzip, tag })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use papilla_proto::ErrorCode;

    use super::*;

    #[tokio::test(flavor = "multi_thread")]
    async fn an_answer_is_made_once_for_all_who_ask() {
        static MADE: AtomicUsize = AtomicUsize::new(0);
        let cache = Arc::new(Cache::default());
        let askers = (0..32).map(|_| {
            let cache = Arc::clone(&cache);
            tokio::spawn(async move {
                let make = || {
                    MADE.fetch_add(1, Ordering::Relaxed);
                    Ok(Content::new("text/plain", "x".repeat(1000)))
                };
                let answer = cache.get(0, make).await;
                assert_eq!(answer.unwrap().content.bytes.len(), 1000);
            })
        });
        for asker in askers.collect::<Vec<_>>() {
            asker.await.unwrap();
        }
        assert_eq!(MADE.load(Ordering::Relaxed), 1);
    }

    #[tokio::test]
    async fn a_failure_is_not_cached() {
        let cache = Cache::default();
        let failed = || Err(Problem::new(ErrorCode::Internal, "not now"));
        assert!(cache.get(0, failed).await.is_err());
        let made = || Ok(Content::new("text/plain", "now"));
        assert!(cache.get(0, made).await.is_ok());
    }
}
