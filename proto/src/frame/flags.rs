//! Bits of [`FrameHeader::flags`](super::FrameHeader::flags).

/// Some pressure was above what the tier was trained on: the map is an extrapolation.
pub const OUT_OF_RANGE: u8 = 1;
/// Nothing touches the finger: the map is zero and no network was asked.
pub const NO_CONTACT: u8 = 2;
/// Rougher or heavier than any map the tier was trained on ([`crate::input_statistics`]).
pub const UNFAMILIAR: u8 = 4;
/// The contact solve did not settle: its answer is rough.
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
