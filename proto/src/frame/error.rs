//! What can be wrong with a frame's header.

use super::HEADER_LEN;
use crate::{ErrorCode, PROTOCOL_VERSION};

/// What is wrong with a frame's header.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// Fewer bytes than a header has.
    #[error("the frame has {bytes} bytes, its header alone has {HEADER_LEN}")]
    TruncatedHeader {
        /// Bytes found.
        bytes: usize,
    },
    /// Another magic.
    #[error("the frame starts with the bytes {found:02x?}, not with 'PPL1'")]
    BadMagic {
        /// The four bytes found.
        found: [u8; 4],
    },
    /// Another version.
    #[error("the frame has version {found}; version {PROTOCOL_VERSION} is spoken")]
    UnknownVersion {
        /// The version found.
        found: u8,
    },
    /// A kind with no meaning.
    #[error("frame kind {found} is unknown; 1 is pressure, 2 SED, 4 poses, 5 gaps")]
    UnknownKind {
        /// The kind found.
        found: u8,
    },
    /// A sample type with no meaning.
    #[error("sample type {found} is unknown; 0 is f32, 1 f16, 2 u16, 3 u8")]
    UnknownSampleType {
        /// The sample type found.
        found: u8,
    },
    /// A status with no meaning.
    #[error("frame status {found} is unknown; 0 is ok, 1 superseded, 2 late, 3 error, 4 stale")]
    UnknownStatus {
        /// The status found.
        found: u8,
    },
}

impl FrameError {
    /// The wire code of this error.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::TruncatedHeader { .. } => ErrorCode::TruncatedHeader,
            Self::BadMagic { .. } => ErrorCode::BadMagic,
            Self::UnknownVersion { .. } => ErrorCode::UnknownVersion,
            Self::UnknownKind { .. }
            | Self::UnknownSampleType { .. }
            | Self::UnknownStatus { .. } => ErrorCode::WrongType,
        }
    }

    /// The header field at fault.
    #[must_use]
    pub const fn field(&self) -> Option<&'static str> {
        match self {
            Self::TruncatedHeader { .. } => None,
            Self::BadMagic { .. } => Some("magic"),
            Self::UnknownVersion { .. } => Some("version"),
            Self::UnknownKind { .. } => Some("kind"),
            Self::UnknownSampleType { .. } => Some("sample_type"),
            Self::UnknownStatus { .. } => Some("status"),
        }
    }
}
