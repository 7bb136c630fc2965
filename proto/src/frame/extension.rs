//! What version 2 adds to a frame's header.

use super::HEADER_LEN_V2;

/// Bits of [`Extension::flags`].
pub mod flags {
    /// Some pressure was above what the tier was trained on: the map is an extrapolation.
    pub const OUT_OF_RANGE: u8 = 1;
    /// Nothing touches the finger: the map is zero and no network was asked.
    pub const NO_CONTACT: u8 = 2;
    /// Rougher or heavier than any map the tier was trained on ([`crate::input_statistics`]).
    pub const UNFAMILIAR: u8 = 4;
    /// The contact solve did not settle: its answer is rough. Version 3.
    pub const UNSETTLED: u8 = 8;
    /// The contact reaches the edge of the atlas: what lies beyond is missing from the map.
    pub const CUT_OFF: u8 = 16;
    /// Request: nobody knows where things are; the frame has no payload. Answer: to such a frame,
    /// which is zero.
    pub const NOT_TRACKED: u8 = 32;
    /// The client's clock ticks so coarsely, or stands, that what depends on time may be far off.
    pub const COARSE_CLOCK: u8 = 64;
    /// All of them by name.
    pub const NAMED: [(u8, &str); 7] = [
        (OUT_OF_RANGE, "out_of_range"),
        (NO_CONTACT, "no_contact"),
        (UNFAMILIAR, "unfamiliar"),
        (UNSETTLED, "unsettled"),
        (CUT_OFF, "cut_off"),
        (NOT_TRACKED, "not_tracked"),
        (COARSE_CLOCK, "coarse_clock"),
    ];
}

/// What versions 2 and 3 add to a header.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Extension {
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
    /// Number of the finger in version 3; none in version 2.
    pub finger: Option<u8>,
}

impl Extension {
    pub(super) fn decode(b: &[u8; HEADER_LEN_V2]) -> Self {
        Self {
            x: u16::from_le_bytes([b[32], b[33]]),
            y: u16::from_le_bytes([b[34], b[35]]),
            queue_us: u32::from_le_bytes([b[36], b[37], b[38], b[39]]),
            infer_us: u32::from_le_bytes([b[40], b[41], b[42], b[43]]),
            tier: u16::from_le_bytes([b[44], b[45]]),
            flags: b[46],
            finger: (b[4] == 3).then_some(b[47]),
        }
    }
}
