//! The 32-byte header in front of every binary frame of a session.
//!
//! All numbers are little-endian. 32 is a multiple of 16, so that a browser can
//! lay an aligned `Float32Array` over the payload.
//!
//! | at | type | field |
//! |---|---|---|
//! | 0 | u32 | magic, the bytes `PPL1` |
//! | 4 | u8 | version, 1 |
//! | 5 | u8 | kind: 1 pressure (client to server), 2 SED (server to client) |
//! | 6 | u8 | sample type: 0 f32, 1 f16, 2 u16, 3 u8 |
//! | 7 | u8 | status: 0 in requests; answers 0 ok, 1 superseded, 2 late, 3 error |
//! | 8 | u32 | sequence, the client's; the answer repeats it |
//! | 12 | u16 | width, 224 |
//! | 14 | u16 | height, 224 |
//! | 16 | u64 | client time, us, of any clock; the answer repeats it |
//! | 24 | u32 | request: deadline, us from receipt (0: the session's budget); answer: us spent in the server |
//! | 28 | f32 | scale: Pa or J/m3 per unit for u16 and u8, else 1 |
//!
//! The payload follows: width x height samples, row-major, row 0 first. Only
//! answers with status ok carry one.

use crate::{ErrorCode, MAP_SIDE_PX, PROTOCOL_VERSION, SampleType};

/// Bytes of the header.
pub const HEADER_LEN: usize = 32;

/// The first four bytes of a frame.
pub const MAGIC: [u8; 4] = *b"PPL1";

/// What the map in a frame shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum FrameKind {
    /// Pressure on the skin, Pa; client to server.
    Pressure = 1,
    /// Strain energy density at the dermis-epidermis interface, J/m3; server to client.
    Sed = 2,
}

/// How the frame fared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum FrameStatus {
    /// Done; a payload follows. Requests say this too.
    #[default]
    Ok = 0,
    /// A newer frame took this one's place before it was started.
    Superseded = 1,
    /// The deadline passed; the work was dropped.
    Late = 2,
    /// Something is wrong with the frame. Servers of this version send the
    /// JSON error with the frame's sequence instead.
    Error = 3,
}

/// The header, decoded. Units and meaning: see the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameHeader {
    /// What the map shows.
    pub kind: FrameKind,
    /// Type of each sample.
    pub sample_type: SampleType,
    /// How the frame fared; ok in requests.
    pub status: FrameStatus,
    /// The client's number of the frame.
    pub sequence: u32,
    /// Columns of the map.
    pub width: u16,
    /// Rows of the map.
    pub height: u16,
    /// The client's clock, us; opaque to the server.
    pub client_time_us: u64,
    /// Request: deadline in us from receipt, 0 for the session's budget.
    /// Answer: us from receipt to sending.
    pub time_us: u32,
    /// Pa or J/m3 per unit for u16 and u8; 1 for floats.
    pub scale: f32,
}

/// What is wrong with a frame's header.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// Fewer bytes than a header has.
    #[error("the frame has {bytes} bytes, its header alone has 32")]
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
    #[error("the frame has version {found}, this side speaks version 1")]
    UnknownVersion {
        /// The version found.
        found: u8,
    },
    /// A kind with no meaning.
    #[error("frame kind {found} is unknown; 1 is pressure, 2 is SED")]
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
    #[error("frame status {found} is unknown; 0 is ok, 1 superseded, 2 late, 3 error")]
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

impl FrameHeader {
    /// The header of a pressure frame of 224 x 224 samples. `deadline_us`
    /// counts from receipt; 0 takes the session's budget.
    #[must_use]
    pub fn pressure(
        sequence: u32,
        client_time_us: u64,
        deadline_us: u32,
        sample_type: SampleType,
        scale: f32,
    ) -> Self {
        Self {
            kind: FrameKind::Pressure,
            sample_type,
            status: FrameStatus::Ok,
            sequence,
            width: MAP_SIDE_PX as u16,
            height: MAP_SIDE_PX as u16,
            client_time_us,
            time_us: deadline_us,
            scale,
        }
    }

    /// The header that answers `self` with `status`, `total_us` after receipt.
    /// `scale` is in J/m3 per unit.
    #[must_use]
    pub fn answer(&self, status: FrameStatus, total_us: u32, scale: f32) -> Self {
        Self { kind: FrameKind::Sed, status, time_us: total_us, scale, ..*self }
    }

    /// Bytes of the payload that goes with this header.
    #[must_use]
    pub fn payload_len(&self) -> usize {
        usize::from(self.width) * usize::from(self.height) * self.sample_type.bytes()
    }

    /// The header's bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; HEADER_LEN] {
        let mut b = [0; HEADER_LEN];
        b[0..4].copy_from_slice(&MAGIC);
        b[4] = PROTOCOL_VERSION;
        b[5] = self.kind as u8;
        b[6] = self.sample_type.to_wire();
        b[7] = self.status as u8;
        b[8..12].copy_from_slice(&self.sequence.to_le_bytes());
        b[12..14].copy_from_slice(&self.width.to_le_bytes());
        b[14..16].copy_from_slice(&self.height.to_le_bytes());
        b[16..24].copy_from_slice(&self.client_time_us.to_le_bytes());
        b[24..28].copy_from_slice(&self.time_us.to_le_bytes());
        b[28..32].copy_from_slice(&self.scale.to_le_bytes());
        b
    }

    /// Reads the header at the start of `frame`; what follows is the payload.
    ///
    /// Width, height and scale are any numbers here: the receiver checks them
    /// against what it takes.
    ///
    /// # Errors
    /// Too short, another magic or version, or a kind, sample type or status
    /// with no meaning.
    pub fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let Some(b) = frame.first_chunk::<HEADER_LEN>() else {
            return Err(FrameError::TruncatedHeader { bytes: frame.len() });
        };
        let found = [b[0], b[1], b[2], b[3]];
        if found != MAGIC {
            return Err(FrameError::BadMagic { found });
        }
        if b[4] != PROTOCOL_VERSION {
            return Err(FrameError::UnknownVersion { found: b[4] });
        }
        let kind = match b[5] {
            1 => FrameKind::Pressure,
            2 => FrameKind::Sed,
            found => return Err(FrameError::UnknownKind { found }),
        };
        let sample_type =
            SampleType::from_wire(b[6]).ok_or(FrameError::UnknownSampleType { found: b[6] })?;
        let status = match b[7] {
            0 => FrameStatus::Ok,
            1 => FrameStatus::Superseded,
            2 => FrameStatus::Late,
            3 => FrameStatus::Error,
            found => return Err(FrameError::UnknownStatus { found }),
        };
        Ok(Self {
            kind,
            sample_type,
            status,
            sequence: u32::from_le_bytes([b[8], b[9], b[10], b[11]]),
            width: u16::from_le_bytes([b[12], b[13]]),
            height: u16::from_le_bytes([b[14], b[15]]),
            client_time_us: u64::from_le_bytes([
                b[16], b[17], b[18], b[19], b[20], b[21], b[22], b[23],
            ]),
            time_us: u32::from_le_bytes([b[24], b[25], b[26], b[27]]),
            scale: f32::from_le_bytes([b[28], b[29], b[30], b[31]]),
        })
    }

    /// The sequence of a frame whose header may be damaged elsewhere, so that
    /// an error can still name it. None if the frame is cut short before it or
    /// does not start with the magic.
    #[must_use]
    pub fn peek_sequence(frame: &[u8]) -> Option<u32> {
        let b = frame.first_chunk::<12>()?;
        (b[0..4] == MAGIC).then(|| u32::from_le_bytes([b[8], b[9], b[10], b[11]]))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_header() -> impl Strategy<Value = FrameHeader> {
        let enums = (
            prop::sample::select(vec![FrameKind::Pressure, FrameKind::Sed]),
            prop::sample::select(SampleType::ALL.to_vec()),
            prop::sample::select(vec![
                FrameStatus::Ok,
                FrameStatus::Superseded,
                FrameStatus::Late,
                FrameStatus::Error,
            ]),
        );
        let numbers = (any::<u32>(), any::<u16>(), any::<u16>(), any::<u64>(), any::<u32>());
        (enums, numbers, -1e30f32..1e30).prop_map(|((kind, sample_type, status), n, scale)| {
            FrameHeader {
                kind,
                sample_type,
                status,
                sequence: n.0,
                width: n.1,
                height: n.2,
                client_time_us: n.3,
                time_us: n.4,
                scale,
            }
        })
    }

    #[test]
    fn the_layout_is_the_documented_one() {
        let header = FrameHeader {
            kind: FrameKind::Sed,
            sample_type: SampleType::U16,
            status: FrameStatus::Late,
            sequence: 0x0403_0201,
            width: 0x0605,
            height: 0x0807,
            client_time_us: 0x100f_0e0d_0c0b_0a09,
            time_us: 0x1413_1211,
            scale: 1.0,
        };
        let mut expected = b"PPL1\x01\x02\x02\x02".to_vec();
        expected.extend(1..=20);
        expected.extend([0, 0, 0x80, 0x3f]);
        assert_eq!(header.encode().to_vec(), expected);
    }

    #[test]
    fn an_answer_repeats_what_the_client_needs() {
        let request = FrameHeader::pressure(9, 77, 11_000, SampleType::U8, 0.25);
        assert_eq!(request.payload_len(), 50_176);
        let answer = request.answer(FrameStatus::Superseded, 42, 3.0);
        assert_eq!((answer.kind, answer.status), (FrameKind::Sed, FrameStatus::Superseded));
        assert_eq!((answer.sequence, answer.client_time_us, answer.time_us), (9, 77, 42));
        assert_eq!((answer.width, answer.height), (224, 224));
    }

    proptest! {
        #[test]
        fn headers_come_back(header in any_header(), tail in prop::collection::vec(any::<u8>(), 0..9)) {
            let mut frame = header.encode().to_vec();
            frame.extend(tail);
            prop_assert_eq!(FrameHeader::decode(&frame), Ok(header));
            prop_assert_eq!(FrameHeader::peek_sequence(&frame), Some(header.sequence));
        }

        #[test]
        fn bytes_of_any_kind_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
            let _ = FrameHeader::peek_sequence(&bytes);
            if let Ok(header) = FrameHeader::decode(&bytes) {
                // NaN scales compare unequal; their bytes do not.
                prop_assert_eq!(&header.encode()[..], &bytes[..HEADER_LEN]);
            }
        }

        #[test]
        fn near_misses_are_named(header in any_header(), at in 0usize..8, flip in 4u8..=255) {
            let mut frame = header.encode();
            frame[at] ^= flip;
            let due = match at {
                0..=3 => ErrorCode::BadMagic,
                4 => ErrorCode::UnknownVersion,
                _ => ErrorCode::WrongType,
            };
            prop_assert_eq!(FrameHeader::decode(&frame).unwrap_err().code(), due);
        }

        #[test]
        fn short_frames_are_truncated(header in any_header(), len in 0..HEADER_LEN) {
            let error = FrameHeader::decode(&header.encode()[..len]).unwrap_err();
            prop_assert_eq!(error, FrameError::TruncatedHeader { bytes: len });
        }
    }
}
