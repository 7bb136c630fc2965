//! What a session remembers, as sealed bytes that its client carries to another service.
//!
//! [`Writer`] and [`Reader`] turn state into bytes and back, bit by bit. [`Keys`] seals them, so that
//! a client can neither read nor forge them, for one minute and for the same [terms](SealedFor) alone. A
//! sealed state may be used more than once: it is the client's own. A [`Clock`] is what a session
//! remembers of its client's, and a [`Pace`] tells whether the client counts in another unit.
//!
//! ```
//! use papilla_proto::Resumption;
//! use papilla_session_state::{Keys, Reader, SealedFor, Writer};
//! use std::time::SystemTime;
//!
//! let mut writer = Writer::default();
//! writer.floats(&[0.0, 0.0, 1.5]);
//!
//! // Both services have the same key in a file.
//! let key = "0f".repeat(32);
//! let (one, other) = (Keys::read(&key)?, Keys::read(&key)?);
//! let (terms, now) = (SealedFor::of("nano", &[b"atlas", b"effects"]), SystemTime::now());
//! let sealed = one.seal(&terms, &writer.finish(), now)?;
//! let state = other.open(&terms, &sealed, now).expect("the terms are the same");
//! let mut floats = [0.0; 3];
//! Reader::new(&state).floats(&mut floats)?;
//! assert_eq!(floats, [0.0, 0.0, 1.5]);
//!
//! let elsewhere = Keys::fresh()?;
//! assert_eq!(elsewhere.open(&terms, &sealed, now), Err(Resumption::Unreadable));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bytes;
mod clock;
mod keys;
mod pace;

pub use bytes::{Reader, StateError, Writer};
pub use clock::Clock;
pub use keys::{KeyError, Keys, SEALED_BYTES_MAX, SealError, SealedFor, is_sealed, tier_of};
pub use pace::Pace;
