//! The header in front of every binary frame of a session: 48 bytes.
//!
//! All numbers are little-endian. 48 is a multiple of 16, so that a browser can lay an aligned
//! `Float32Array` over the payload.
//!
//! | at | type | field |
//! |---|---|---|
//! | 0 | u32 | magic, the bytes `PPL1` |
//! | 4 | u8 | version of the protocol, 3 ([`PROTOCOL_VERSION`]) |
//! | 5 | u8 | kind: 1 pressure, 4 poses of objects, 5 gaps (client to server); 2 SED (server to client) |
//! | 6 | u8 | sample type: 0 f32, 1 f16, 2 u16, 3 u8 |
//! | 7 | u8 | status: 0 in requests; answers 0 ok, 1 superseded, 2 late, 3 error, 4 stale |
//! | 8 | u32 | sequence, the client's; the answer repeats it |
//! | 12 | u16 | width of the window that is sent, pixels; 224 for a whole map |
//! | 14 | u16 | height, likewise |
//! | 16 | u64 | client time, us, of any clock; the answer repeats it |
//! | 24 | u32 | request: deadline, us from receipt (0: the session's budget); answer: us spent in the server |
//! | 28 | f32 | scale: Pa or J/m3 per unit for u16 and u8, else 1 |
//! | 32 | u16 | column of the window's first pixel |
//! | 34 | u16 | row of the window's first pixel |
//! | 36 | u32 | answer: us the frame waited for a thread |
//! | 40 | u32 | answer: us in the network, 0 if it was not asked |
//! | 44 | u16 | answer: number of the tier, as `ready` gave it |
//! | 46 | u8 | flags, see [`flags`]; in a request [`flags::NOT_TRACKED`] alone has a meaning |
//! | 47 | u8 | number of the finger, both ways |
//!
//! The payload follows. A request's: width x height samples, row-major, first row first. An
//! answer's: the sections that `ready` listed; only answers with status ok carry one.

mod error;
pub mod flags;

pub use error::FrameError;

use crate::{PROTOCOL_VERSION, SampleType, Window};

/// Bytes of the header.
pub const HEADER_LEN: usize = 48;

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
    /// Poses of objects; client to server.
    Objects = 4,
    /// Depth of the undeformed skin in things, mm; client to server.
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
    /// Something is wrong with the frame. Servers send the JSON error with the frame's
    /// sequence instead.
    Error = 3,
    /// The frame was old when it came: not newer than one taken before, or held up on its way
    /// for longer than the hello allows. It was not rendered.
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
    /// Column of the window's first pixel.
    pub x: u16,
    /// Row of the window's first pixel.
    pub y: u16,
    /// Answer: us the frame waited for a thread.
    pub queue_us: u32,
    /// Answer: us in the network; 0 if it was not asked.
    pub infer_us: u32,
    /// Answer: number of the tier, as `ready` gave it.
    pub tier: u16,
    /// Bits of [`flags`]; in a request [`flags::NOT_TRACKED`] alone has a meaning.
    pub flags: u8,
    /// Number of the finger.
    pub finger: u8,
}

impl FrameHeader {
    /// The header of a pressure frame of 224 x 224 samples for the first finger. `deadline_us`
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
            x: 0,
            y: 0,
            queue_us: 0,
            infer_us: 0,
            tier: 0,
            flags: 0,
            finger: 0,
        }
    }

    /// The same header for the pixels of `window` alone.
    #[must_use]
    pub fn windowed(self, Window { x, y, width, height }: Window) -> Self {
        Self { x, y, width, height, ..self }
    }

    /// The same header of this kind and finger, for `width` x `height` samples.
    #[must_use]
    pub fn of_finger(self, kind: FrameKind, finger: u8, [width, height]: [u16; 2]) -> Self {
        Self { kind, finger, width, height, ..self }
    }

    /// The same header of a frame without a payload: nobody knows where things are.
    #[must_use]
    pub fn not_tracked(self) -> Self {
        Self { flags: flags::NOT_TRACKED, ..self.windowed(Window::EMPTY) }
    }

    /// Whether a request says where things are, or what presses.
    #[must_use]
    pub fn is_tracked(&self) -> bool {
        self.flags & flags::NOT_TRACKED == 0
    }

    /// The pixels that the payload holds.
    #[must_use]
    pub fn window(&self) -> Window {
        Window { x: self.x, y: self.y, width: self.width, height: self.height }
    }

    /// The header that answers `self` with `status`, `total_us` after receipt.
    /// `scale` is in J/m3 per unit.
    #[must_use]
    pub fn answer(&self, status: FrameStatus, total_us: u32, scale: f32) -> Self {
        Self { kind: FrameKind::Sed, status, time_us: total_us, scale, ..*self }
    }

    /// Bytes of the samples that go with this header.
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
        b[32..34].copy_from_slice(&self.x.to_le_bytes());
        b[34..36].copy_from_slice(&self.y.to_le_bytes());
        b[36..40].copy_from_slice(&self.queue_us.to_le_bytes());
        b[40..44].copy_from_slice(&self.infer_us.to_le_bytes());
        b[44..46].copy_from_slice(&self.tier.to_le_bytes());
        (b[46], b[47]) = (self.flags, self.finger);
        b
    }

    /// Reads the header at the start of `frame`; what follows its [`HEADER_LEN`] bytes is the
    /// payload.
    ///
    /// Width, height, place and scale are any numbers here: the receiver checks them
    /// against what it takes.
    ///
    /// # Errors
    /// Too short, another magic or version, or a kind, sample type or status
    /// with no meaning.
    pub fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let truncated = FrameError::TruncatedHeader { bytes: frame.len() };
        let b = frame.first_chunk::<HEADER_LEN>().ok_or(truncated)?;
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
            4 => FrameKind::Objects,
            5 => FrameKind::Gaps,
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
            x: u16::from_le_bytes([b[32], b[33]]),
            y: u16::from_le_bytes([b[34], b[35]]),
            queue_us: u32::from_le_bytes([b[36], b[37], b[38], b[39]]),
            infer_us: u32::from_le_bytes([b[40], b[41], b[42], b[43]]),
            tier: u16::from_le_bytes([b[44], b[45]]),
            flags: b[46],
            finger: b[47],
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
