//! The header in front of every binary frame of a session: 32 bytes, and 16 more in version 2.
//!
//! All numbers are little-endian. 32 and 48 are multiples of 16, so that a browser can
//! lay an aligned `Float32Array` over the payload.
//!
//! | at | type | field |
//! |---|---|---|
//! | 0 | u32 | magic, the bytes `PPL1` |
//! | 4 | u8 | version, 1 to 3: the hello's |
//! | 5 | u8 | kind: 1 pressure, 4 poses of objects, 5 gaps (client to server); 2 SED (server to client) |
//! | 6 | u8 | sample type: 0 f32, 1 f16, 2 u16, 3 u8 |
//! | 7 | u8 | status: 0 in requests; answers 0 ok, 1 superseded, 2 late, 3 error, 4 stale |
//! | 8 | u32 | sequence, the client's; the answer repeats it |
//! | 12 | u16 | width of the window that is sent, pixels; 224 for a whole map |
//! | 14 | u16 | height, likewise |
//! | 16 | u64 | client time, us, of any clock; the answer repeats it |
//! | 24 | u32 | request: deadline, us from receipt (0: the session's budget); answer: us spent in the server |
//! | 28 | f32 | scale: Pa or J/m3 per unit for u16 and u8, else 1 |
//!
//! Versions 2 and 3 go on ([`Extension`]):
//!
//! | at | type | field |
//! |---|---|---|
//! | 32 | u16 | column of the window's first pixel |
//! | 34 | u16 | row of the window's first pixel |
//! | 36 | u32 | answer: us the frame waited for a thread |
//! | 40 | u32 | answer: us in the network, 0 if it was not asked |
//! | 44 | u16 | answer: number of the tier, as `ready` gave it |
//! | 46 | u8 | flags, see [`flags`]; in a request [`flags::NOT_TRACKED`] alone has a meaning |
//! | 47 | u8 | version 3: number of the finger, both ways; version 2: 0, to be ignored |
//!
//! The payload follows. A request's: width x height samples, row-major, first row first. An
//! answer's: the sections that `ready` listed; only answers with status ok carry one.

mod error;
mod extension;

use std::ops::Deref;

pub use error::FrameError;
pub use extension::{Extension, flags};

use crate::{SampleType, Window};

/// Bytes of the header of version 1, and of the first part of that of version 2.
pub const HEADER_LEN: usize = 32;

/// Bytes of the header of version 2.
pub const HEADER_LEN_V2: usize = 48;

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
    /// Poses of objects; client to server, version 3.
    Objects = 4,
    /// Depth of the undeformed skin in things, mm; client to server, version 3.
    Gaps = 5,
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
    /// The frame was old when it came: not newer than one taken before, or held up on its way
    /// for longer than the hello allows. It was not rendered. Version 2.
    Stale = 4,
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
    /// Columns of the window that is sent; 224 for a whole map.
    pub width: u16,
    /// Rows of the window that is sent.
    pub height: u16,
    /// The client's clock, us; repeated. Relaxation, afferents and `stale_after_us` read it.
    pub client_time_us: u64,
    /// Request: deadline in us from receipt, 0 for the session's budget.
    /// Answer: us from receipt to sending.
    pub time_us: u32,
    /// Pa or J/m3 per unit for u16 and u8; 1 for floats.
    pub scale: f32,
    /// What version 2 adds; none in version 1.
    pub extension: Option<Extension>,
}

/// The bytes of a header: 32, or 48 in version 2.
#[derive(Debug, Clone, Copy)]
pub struct HeaderBytes {
    bytes: [u8; HEADER_LEN_V2],
    len: usize,
}

impl Deref for HeaderBytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.len]
    }
}

impl FrameHeader {
    /// The header of a pressure frame of 224 x 224 samples, version 1. `deadline_us`
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
            width: Window::WHOLE.width,
            height: Window::WHOLE.height,
            client_time_us,
            time_us: deadline_us,
            scale,
            extension: None,
        }
    }

    /// The same header in version 2, for the pixels of `window` alone.
    #[must_use]
    pub fn windowed(self, window: Window) -> Self {
        let extension =
            Extension { x: window.x, y: window.y, ..self.extension.unwrap_or_default() };
        Self { width: window.width, height: window.height, extension: Some(extension), ..self }
    }

    /// The same header in version 3, of this kind and finger, for `width` x `height` samples.
    #[must_use]
    pub fn of_finger(self, kind: FrameKind, finger: u8, [width, height]: [u16; 2]) -> Self {
        let extension = Extension { finger: Some(finger), ..self.extension.unwrap_or_default() };
        Self { kind, width, height, extension: Some(extension), ..self }
    }

    /// The same header of a frame without a payload: nobody knows where things are.
    #[must_use]
    pub fn not_tracked(self) -> Self {
        let extension = self.extension.unwrap_or_default();
        let extension = Extension { x: 0, y: 0, flags: flags::NOT_TRACKED, ..extension };
        Self { width: 0, height: 0, extension: Some(extension), ..self }
    }

    /// Whether a request says where things are, or what presses.
    #[must_use]
    pub fn is_tracked(&self) -> bool {
        self.extension.is_none_or(|extension| extension.flags & flags::NOT_TRACKED == 0)
    }

    /// Version of the frame.
    #[must_use]
    pub fn version(&self) -> u8 {
        self.extension.map_or(1, |extension| if extension.finger.is_some() { 3 } else { 2 })
    }

    /// The pixels that the payload holds.
    #[must_use]
    pub fn window(&self) -> Window {
        let Extension { x, y, .. } = self.extension.unwrap_or_default();
        Window { x, y, width: self.width, height: self.height }
    }

    /// The header that answers `self` with `status`, `total_us` after receipt.
    /// `scale` is in J/m3 per unit. An extension is kept as it is.
    #[must_use]
    pub fn answer(&self, status: FrameStatus, total_us: u32, scale: f32) -> Self {
        Self { kind: FrameKind::Sed, status, time_us: total_us, scale, ..*self }
    }

    /// Bytes of this header: 32, or 48 in version 2.
    #[must_use]
    pub fn header_len(&self) -> usize {
        if self.extension.is_some() { HEADER_LEN_V2 } else { HEADER_LEN }
    }

    /// Bytes of the samples that go with this header.
    #[must_use]
    pub fn payload_len(&self) -> usize {
        usize::from(self.width) * usize::from(self.height) * self.sample_type.bytes()
    }

    /// The header's bytes.
    #[must_use]
    pub fn encode(&self) -> HeaderBytes {
        let mut b = [0; HEADER_LEN_V2];
        b[0..4].copy_from_slice(&MAGIC);
        b[4] = 1;
        b[5] = self.kind as u8;
        b[6] = self.sample_type.to_wire();
        b[7] = self.status as u8;
        b[8..12].copy_from_slice(&self.sequence.to_le_bytes());
        b[12..14].copy_from_slice(&self.width.to_le_bytes());
        b[14..16].copy_from_slice(&self.height.to_le_bytes());
        b[16..24].copy_from_slice(&self.client_time_us.to_le_bytes());
        b[24..28].copy_from_slice(&self.time_us.to_le_bytes());
        b[28..32].copy_from_slice(&self.scale.to_le_bytes());
        if let Some(extension) = &self.extension {
            b[4] = 2;
            b[32..34].copy_from_slice(&extension.x.to_le_bytes());
            b[34..36].copy_from_slice(&extension.y.to_le_bytes());
            b[36..40].copy_from_slice(&extension.queue_us.to_le_bytes());
            b[40..44].copy_from_slice(&extension.infer_us.to_le_bytes());
            b[44..46].copy_from_slice(&extension.tier.to_le_bytes());
            b[46] = extension.flags;
            if let Some(finger) = extension.finger {
                (b[4], b[47]) = (3, finger);
            }
        }
        HeaderBytes { bytes: b, len: self.header_len() }
    }

    /// Reads the header at the start of `frame`; what follows its
    /// [`header_len`](Self::header_len) is the payload.
    ///
    /// Width, height, place and scale are any numbers here: the receiver checks them
    /// against what it takes.
    ///
    /// # Errors
    /// Too short, another magic or version, or a kind, sample type or status
    /// with no meaning.
    pub fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let truncated = |due| FrameError::TruncatedHeader { bytes: frame.len(), due };
        let b = frame.first_chunk::<HEADER_LEN>().ok_or(truncated(HEADER_LEN))?;
        let found = [b[0], b[1], b[2], b[3]];
        if found != MAGIC {
            return Err(FrameError::BadMagic { found });
        }
        let extension = match b[4] {
            1 => None,
            2 | 3 => Some(Extension::decode(
                frame.first_chunk::<HEADER_LEN_V2>().ok_or(truncated(HEADER_LEN_V2))?,
            )),
            found => return Err(FrameError::UnknownVersion { found }),
        };
        let kind = match b[5] {
            1 => FrameKind::Pressure,
            2 => FrameKind::Sed,
            4 if b[4] >= 3 => FrameKind::Objects,
            5 if b[4] >= 3 => FrameKind::Gaps,
            found => return Err(FrameError::UnknownKind { found }),
        };
        let sample_type =
            SampleType::from_wire(b[6]).ok_or(FrameError::UnknownSampleType { found: b[6] })?;
        let status = match b[7] {
            0 => FrameStatus::Ok,
            1 => FrameStatus::Superseded,
            2 => FrameStatus::Late,
            3 => FrameStatus::Error,
            4 => FrameStatus::Stale,
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
            extension,
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
mod tests;
