//! WebSocket framing of a server (RFC 6455, section 5) over memory that a session keeps.
//!
//! Bytes are read straight into a buffer of the session, freed of their mask while the rest of the
//! frame is still on its way, and handed on without a copy. Nothing here waits or reads by itself.

mod outgoing;

use std::{mem, ops::Range};

use bytes::{Buf, Bytes, BytesMut};

pub(super) use self::outgoing::{OUT_HEAD_MAX, frame, out_head};
use crate::core::buffers::{Frames, HEADROOM, Store};

const _: () = assert!(HEAD_MAX <= HEADROOM && OUT_HEAD_MAX <= HEADROOM);

/// Largest message that is read, bytes: five times a float32 map. Within this limit a frame that is
/// too long is read and refused, and the session goes on; beyond it the connection is closed.
pub(super) const MESSAGE_MAX: usize = 1 << 20;

/// Longest payload of a control frame, bytes.
const CONTROL_MAX: usize = 125;

/// By how much the buffer grows at a time, bytes, if a frame does not fit. It grows only as bytes
/// arrive, so a length that is merely announced costs no memory.
const STEP: usize = 64 * 1024;

/// The most bytes in the header of a client's frame.
pub(super) const HEAD_MAX: usize = 14;

/// Kinds of frames.
pub(super) mod opcode {
    pub(in crate::transport::session) const CONTINUATION: u8 = 0;
    pub(in crate::transport::session) const TEXT: u8 = 1;
    pub(in crate::transport::session) const BINARY: u8 = 2;
    pub(in crate::transport::session) const CLOSE: u8 = 8;
    pub(in crate::transport::session) const PING: u8 = 9;
    pub(in crate::transport::session) const PONG: u8 = 10;
}

/// A whole message of a client.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Message {
    /// A text, which has not been checked to be UTF-8 yet.
    Text(Bytes),
    Binary(Bytes),
    Ping(Bytes),
    Pong,
    /// The code, if one was given.
    Close(Option<u16>),
}

/// Why the bytes of a client cannot be understood. The connection has to be closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// They break the WebSocket protocol in this way.
    Protocol(&'static str),
    /// A message beyond [`MESSAGE_MAX`].
    TooLarge,
}

/// The header of a client's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Head {
    is_last: bool,
    opcode: u8,
    mask: [u8; 4],
    /// Length of the header itself, bytes.
    len: usize,
    payload_len: usize,
}

impl Head {
    /// Reads a header. None: more bytes are needed.
    fn parse(bytes: &[u8]) -> Result<Option<Self>, Fault> {
        let &[first, second, ref rest @ ..] = bytes else { return Ok(None) };
        let (is_last, opcode, short) =
            (first & 0x80 != 0, first & 0x0f, usize::from(second & 0x7f));
        if first & 0x70 != 0 {
            return Err(Fault::Protocol("a reserved bit is set"));
        }
        if !matches!(opcode, 0..=2 | 8..=10) {
            return Err(Fault::Protocol("a frame of a reserved kind"));
        }
        if second & 0x80 == 0 {
            return Err(Fault::Protocol("a client's frame without a mask"));
        }
        if opcode >= opcode::CLOSE && !(is_last && short <= CONTROL_MAX) {
            return Err(Fault::Protocol("a control frame in pieces, or of more than 125 bytes"));
        }
        let extra = match short {
            126 => 2,
            127 => 8,
            _ => 0,
        };
        let Some((length, rest)) = rest.split_at_checked(extra) else { return Ok(None) };
        let payload_len = match extra {
            0 => short as u64,
            _ => length.iter().fold(0, |sum, &byte| sum << 8 | u64::from(byte)),
        };
        if payload_len > MESSAGE_MAX as u64 {
            return Err(Fault::TooLarge);
        }
        let Some(&mask) = rest.first_chunk() else { return Ok(None) };
        let payload_len = payload_len as usize;
        Ok(Some(Self { is_last, opcode, mask, len: 2 + extra + mask.len(), payload_len }))
    }
}

/// What a complete frame of a client is.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Received {
    Message(Message),
    /// A fragment of a message that is not complete yet.
    Piece,
}

/// The bytes that have come and are not a message yet.
#[derive(Debug, Default)]
pub(super) struct Inbound {
    spare: Frames,
    /// Size of this session's largest frame, bytes.
    room: usize,
    buffer: BytesMut,
    /// Number of bytes at the front of the buffer that are dealt with.
    taken: usize,
    /// The header of the frame that is on its way, and how many bytes of its payload are unmasked.
    head: Option<Head>,
    unmasked: usize,
    /// The fragments of a message so far, and its opcode.
    pieces: BytesMut,
    in_pieces: Option<u8>,
}

impl Inbound {
    /// Begins with bytes that the HTTP server has read already.
    pub(super) fn new(read: &[u8]) -> Self {
        Self { buffer: BytesMut::from(read), ..Self::default() }
    }

    /// Takes memory for frames of `frame_len` bytes of so many fingers, once for the whole session.
    pub(super) fn expect(&mut self, frame_len: usize, fingers: usize, store: &Store) {
        self.room = HEAD_MAX + frame_len;
        self.spare = store.frames(self.room, fingers);
        let read = mem::take(&mut self.buffer);
        self.renew(&read[self.taken..]);
    }

    /// Takes memory for frames of another number of fingers.
    pub(super) fn expect_fingers(&mut self, fingers: usize, store: &Store) {
        store.enlarge_frames(&mut self.spare, self.room, fingers);
    }

    /// Changes to a free buffer that begins with `read`.
    fn renew(&mut self, read: &[u8]) {
        self.buffer = self.spare.lend(self.room.max(read.len()));
        self.buffer.extend_from_slice(read);
        self.taken = 0;
    }

    /// Gives the buffers back to the store.
    pub(super) fn end(&mut self, store: &Store) {
        self.buffer = BytesMut::new();
        store.keep_frames(&mut self.spare);
    }

    /// The buffer to read into. There is always room in it.
    pub(super) fn room(&mut self) -> &mut BytesMut {
        if self.taken == self.buffer.len() {
            self.buffer.clear();
            self.taken = 0;
        }
        if self.buffer.capacity() == self.buffer.len() {
            if self.taken > 0 {
                // What is moved is less than a frame, and it happens once for each full buffer.
                self.buffer.copy_within(self.taken.., 0);
                self.buffer.truncate(self.buffer.len() - self.taken);
                self.taken = 0;
            } else {
                self.buffer.reserve(STEP);
            }
        }
        &mut self.buffer
    }

    /// Whether a message has begun that is not complete.
    pub(super) fn is_amid(&self) -> bool {
        self.taken < self.buffer.len() || self.in_pieces.is_some()
    }

    /// The next frame; None: not all of it has come. The time that it takes depends on that frame
    /// alone, however many lie behind it.
    pub(super) fn next(&mut self) -> Result<Option<Received>, Fault> {
        let head = match self.head {
            Some(head) => head,
            None => match Head::parse(&self.buffer[self.taken..])? {
                Some(head) => *self.head.insert(self.check(head)?),
                None => return Ok(None),
            },
        };
        let start = self.taken + head.len;
        let end = self.buffer.len().min(start + head.payload_len);
        let done = self.unmasked;
        unmask(&mut self.buffer[start + done..end], head.mask, done);
        self.unmasked = end - start;
        if self.unmasked < head.payload_len {
            return Ok(None);
        }
        (self.head, self.unmasked) = (None, 0);
        let payload = start..end;
        let message = self.complete(head, payload)?;
        Ok(Some(message.map_or(Received::Piece, Received::Message)))
    }

    /// Checks that a frame with this header may come now.
    fn check(&self, head: Head) -> Result<Head, Fault> {
        match (head.opcode, self.in_pieces) {
            (opcode::CONTINUATION, None) => Err(Fault::Protocol("a continuation of nothing")),
            (opcode::TEXT | opcode::BINARY, Some(_)) => {
                Err(Fault::Protocol("a message within a message"))
            }
            (opcode::CONTINUATION, _) if self.pieces.len() + head.payload_len > MESSAGE_MAX => {
                Err(Fault::TooLarge)
            }
            _ => Ok(head),
        }
    }

    /// Handles a complete frame. None: it is a fragment of a message.
    fn complete(&mut self, head: Head, payload: Range<usize>) -> Result<Option<Message>, Fault> {
        if head.is_last && matches!(head.opcode, opcode::TEXT | opcode::BINARY) {
            return Ok(Some(message(head.opcode, self.hand_over(payload))));
        }
        self.taken = payload.end;
        let payload = &self.buffer[payload];
        Ok(match head.opcode {
            opcode::CLOSE => Some(Message::Close(close_code(payload)?)),
            opcode::PING => Some(Message::Ping(Bytes::copy_from_slice(payload))),
            opcode::PONG => Some(Message::Pong),
            kind => {
                self.pieces.extend_from_slice(payload);
                let kind = *self.in_pieces.get_or_insert(kind);
                head.is_last.then(|| {
                    self.in_pieces = None;
                    message(kind, mem::take(&mut self.pieces).freeze())
                })
            }
        })
    }

    /// Splits the payload from the bytes behind it, and copies whichever is shorter. So a buffer
    /// full of short frames is read in one pass.
    fn hand_over(&mut self, payload: Range<usize>) -> Bytes {
        if self.buffer.len() - payload.end > payload.len() {
            let mut own = self.spare.lend(self.room.max(payload.len()));
            own.extend_from_slice(&self.buffer[payload.clone()]);
            self.taken = payload.end;
            return own.freeze();
        }
        let mut frame = mem::take(&mut self.buffer);
        self.renew(&frame[payload.end..]);
        frame.truncate(payload.end);
        frame.advance(payload.start);
        frame.freeze()
    }
}

fn message(kind: u8, payload: Bytes) -> Message {
    if kind == opcode::TEXT { Message::Text(payload) } else { Message::Binary(payload) }
}

/// The code of a close frame; None if it has none. A code that must not be sent is a fault (section
/// 7.4).
fn close_code(payload: &[u8]) -> Result<Option<u16>, Fault> {
    let Some((code, reason)) = payload.split_first_chunk() else {
        return if payload.is_empty() {
            Ok(None)
        } else {
            Err(Fault::Protocol("half a close code"))
        };
    };
    match u16::from_be_bytes(*code) {
        code @ (1000..=1003 | 1007..=1014 | 3000..=4999) if str::from_utf8(reason).is_ok() => {
            Ok(Some(code))
        }
        _ => Err(Fault::Protocol("a close code or reason that must not be sent")),
    }
}

/// Removes the mask from bytes that begin `offset` bytes into the payload.
fn unmask(bytes: &mut [u8], mut mask: [u8; 4], offset: usize) {
    mask.rotate_left(offset % 4);
    let key = u32::from_ne_bytes(mask);
    let (words, rest) = bytes.as_chunks_mut();
    for word in words {
        *word = (u32::from_ne_bytes(*word) ^ key).to_ne_bytes();
    }
    rest.iter_mut().zip(mask).for_each(|(byte, mask)| *byte ^= mask);
}

#[cfg(test)]
mod tests;
