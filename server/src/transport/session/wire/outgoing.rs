//! Frames that a server sends: whole and unmasked.

use bytes::{Bytes, BytesMut};

/// The most bytes in the header of a server's frame.
pub(in crate::transport::session) const OUT_HEAD_MAX: usize = 10;

/// The header of an unfragmented, unmasked frame. It stands at the end of the array; the second
/// value is its length.
pub(in crate::transport::session) fn out_head(
    opcode: u8,
    payload_len: usize,
) -> ([u8; OUT_HEAD_MAX], usize) {
    let mut head = [0; OUT_HEAD_MAX];
    let length = (payload_len as u64).to_be_bytes();
    let (short, extra) = match payload_len {
        0..=125 => (payload_len as u8, 0),
        126..=0xffff => (126, 2),
        _ => (127, 8),
    };
    head[OUT_HEAD_MAX - extra..].copy_from_slice(&length[8 - extra..]);
    head[OUT_HEAD_MAX - extra - 1] = short;
    head[OUT_HEAD_MAX - extra - 2] = 0x80 | opcode;
    (head, 2 + extra)
}

/// A whole frame in newly allocated memory.
pub(in crate::transport::session) fn frame(opcode: u8, payload: &[u8]) -> Bytes {
    let (head, len) = out_head(opcode, payload.len());
    let mut frame = BytesMut::with_capacity(len + payload.len());
    frame.extend_from_slice(&head[OUT_HEAD_MAX - len..]);
    frame.extend_from_slice(payload);
    frame.freeze()
}
