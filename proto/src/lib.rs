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
//! | [`input_statistics`] | two numbers that tell a map out of distribution |
//! | [`sample`] | f32 / f16 / u16 / u8 samples and their quantisation error |
//! | [`window`] | a rectangle of the map: finding, decoding and encoding one |
//! | [`frame`] | the header in front of every binary frame |
//! | [`contact`] | poses, gaps, and what pushes back |
//! | [`effects`] | what a session can ask for beside the map |
//! | [`summary`] | a map in sixteen numbers |
//! | [`message`] | the JSON messages of a session |
//! | [`json`] | reading JSON from outside, and why it is refused |
//! | [`error`] | error codes and their HTTP status |
//!
//! ```
//! use papilla_proto::{FrameHeader, HEADER_LEN, MAP_SIDE_PX, SampleType, Window};
//!
//! // What of a map carries pressure, and a frame for it: 90 us to answer.
//! let mut pressure_pa = vec![0.0_f32; MAP_SIDE_PX * MAP_SIDE_PX];
//! pressure_pa[100 * MAP_SIDE_PX + 112] = 8e3;
//! let window = Window::around(&pressure_pa, 0.0, 2);
//! let header = FrameHeader::pressure(1, 0, 90, SampleType::F32, 1.0).windowed(window);
//! assert_eq!((HEADER_LEN, header.payload_len()), (48, 5 * 5 * 4));
//!
//! let mut payload = vec![0; header.payload_len()];
//! window.encode(header.sample_type, &pressure_pa, header.scale, &mut payload)?;
//! let frame = [&header.encode()[..], &payload].concat();
//! assert_eq!(FrameHeader::decode(&frame)?, header);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The protocol in prose, with examples: `docs/reference/protocol.md`.

pub mod contact;
pub mod effects;
pub mod error;
pub mod error_estimate;
pub mod finite;
pub mod frame;
pub mod input_statistics;
pub mod map;
pub mod message;
pub mod sample;
pub mod spikes;
pub mod summary;
pub mod window;

/// Reading JSON from outside, and why it is refused.
pub use papilla_json as json;

/// The two unwrapped patches, their rasteriser and hash.
pub use papilla_atlas as atlas;

/// Shapes that a hello announces.
pub use papilla_sdf as sdf;

pub use effects::{RuntimeEffect, unknown_effect};
pub use error::{ErrorCode, Problem};
pub use error_estimate::{ERROR_ESTIMATE_LEN, ErrorEstimate, LikelyError};
pub use frame::{FrameError, FrameHeader, FrameKind, FrameStatus, HEADER_LEN, flags};
pub use input_statistics::{InputStatistics, Look};
pub use map::{
    DOUBTED_BELOW_PA, MAP_LEN, MAP_SIDE_PX, MapError, MapSummary, PixelMask, PressureRange,
    check_pressure, keep_inside, peak,
};
pub use message::{
    ClientMessage, FingerTerms, Hello, MessageError, Ready, Reconnect, ReconnectReason, Resumption,
    SEALED_MAGIC, ServerMessage, SessionError, Warning,
};
pub use sample::{SampleError, SampleType};
pub use summary::{SUMMARY_LEN, Summary};
pub use window::Window;

/// Name of a model's input, `[1, 1, 224, 224]` float32, Pa.
pub const INPUT_NAME: &str = "pressure_pa";
/// Name of a model's output, `[1, 1, 224, 224]` float32, J/m3.
pub const OUTPUT_NAME: &str = "sed_j_per_m3";

/// Version of the session protocol, which every hello may and every binary frame has to name. No
/// other is spoken.
pub const PROTOCOL_VERSION: u8 = 3;
