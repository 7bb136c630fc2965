//! A session that moves to another connection: the request, and what became of its state.

use serde::{Deserialize, Serialize};

/// What a sealed state begins with, as opposed to a frame.
pub const SEALED_MAGIC: [u8; 3] = *b"PPS";

/// Asks a client that announced it ([`Hello::reconnect`](super::Hello::reconnect)) to open another connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reconnect {
    /// Why.
    pub reason: ReconnectReason,
    /// Time for which this connection still answers, ms; none: for as long as the client stays.
    pub within_ms: Option<u64>,
}

/// Why a client is asked to open another connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReconnectReason {
    /// The session is old, and other machines may have less to do.
    Age,
    /// The server drains.
    Drain,
}

/// What became of the state that a hello brought ([`Hello::resume`](super::Hello::resume)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Resumption {
    /// The session goes on with it.
    Resumed,
    /// There was none; the session starts anew, as in all cases below.
    Nothing,
    /// It was more than is carried.
    TooLarge,
    /// No service with this one's key has sealed it.
    Unreadable,
    /// It is too old.
    Expired,
    /// It is of another tier, atlas, software version, or of other effects or objects.
    OtherTerms,
}
