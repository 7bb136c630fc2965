//! Wire contract of Papilla: frames, messages, maps, atlas.
//!
//! Everything a client and the server must agree on, and nothing else: no I/O,
//! no async, no engine. All decoders take bytes from outside; none panics,
//! whatever the bytes.
//!
//! | module | holds |
//! |---|---|
//! | [`atlas`] | the two unwrapped patches, their rasteriser and hash |
//! | [`map`] | the 224 x 224 map: length, checks |
//! | [`sample`] | f32 / f16 / u16 / u8 samples and their quantisation error |
//! | [`frame`] | the 32-byte header in front of every binary frame |
//! | [`message`] | the JSON messages of a session |
//! | [`error`] | error codes and their HTTP status |
//!
//! The protocol in prose, with examples: `docs/protocol.md`.

pub mod atlas;
pub mod error;
pub mod frame;
pub mod map;
pub mod message;
pub mod sample;

pub use error::{ErrorCode, Problem};
pub use frame::{FrameError, FrameHeader, FrameKind, FrameStatus, HEADER_LEN};
pub use map::{MAP_LEN, MAP_SIDE_PX, MapError, MapSummary, check_pressure};
pub use message::{ClientMessage, Hello, Ready, ServerMessage, SessionError};
pub use sample::{SampleError, SampleType};

/// Version of the session protocol and of the binary frame.
pub const PROTOCOL_VERSION: u8 = 1;
