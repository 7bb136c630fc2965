//! Answers that do not change: made once, away from the threads that move bytes, and kept.
//!
//! What is kept is bounded by what there is: a few forms of each state of the replay, of the atlas
//! and of the page, each as it is and compressed.

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

/// An answer as it is made.
#[derive(Debug)]
pub(crate) struct Fresh {
    pub(crate) content_type: &'static str,
    pub(crate) bytes: Bytes,
    /// Greatest value of a map that is a picture, and the header that says it.
    pub(crate) white: Option<(&'static str, f32)>,
    /// Whether the client's `Accept` has chosen this form among others.
    pub(crate) is_negotiated: bool,
}

impl Fresh {
    pub(crate) fn new(content_type: &'static str, bytes: impl Into<Bytes>) -> Self {
        Self { content_type, bytes: bytes.into(), white: None, is_negotiated: false }
    }
}

/// An answer as it is kept.
#[derive(Debug)]
pub(crate) struct Made {
    pub(crate) fresh: Fresh,
    /// Compressed, if that is shorter.
    pub(crate) packed: Option<Bytes>,
    /// SHA-256 of the bytes, in hexadecimal digits.
    pub(crate) tag: String,
}

/// All that was asked for so far, by its key.
pub(crate) struct Kept<K> {
    cells: Mutex<HashMap<K, Arc<OnceCell<Arc<Made>>>>>,
    /// One at a time: the processors are there for maps.
    turn: Semaphore,
}

impl<K> Default for Kept<K> {
    fn default() -> Self {
        Self { cells: Mutex::default(), turn: Semaphore::new(1) }
    }
}

impl<K: Eq + Hash> Kept<K> {
    /// The answer of this key; `make` is called if nobody has asked before.
    ///
    /// # Errors
    /// Those of `make`; the next one who asks has it made anew.
    pub(crate) async fn get(
        &self,
        key: K,
        make: impl FnOnce() -> Result<Fresh, Problem> + Send + 'static,
    ) -> Result<Arc<Made>, Problem> {
        let cell = Arc::clone(
            self.cells.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default(),
        );
        let made = cell.get_or_try_init(|| async {
            let failed = |error: &dyn std::fmt::Display| {
                problem::internal("the answer cannot be made", error)
            };
            let _turn = self.turn.acquire().await.map_err(|error| failed(&error))?;
            let making = spawn_blocking(move || Made::of(make()?).map_err(|error| failed(&error)));
            making.await.map_err(|error| failed(&error))?.map(Arc::new)
        });
        made.await.map(Arc::clone)
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
                let answer = kept.get(0, make).await;
                assert_eq!(answer.unwrap().fresh.bytes.len(), 1000);
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
        let failed = || Err(Problem::new(ErrorCode::Internal, "not now"));
        assert!(kept.get(0, failed).await.is_err());
        let made = || Ok(Fresh::new("text/plain", "now"));
        assert!(kept.get(0, made).await.is_ok());
    }
}
