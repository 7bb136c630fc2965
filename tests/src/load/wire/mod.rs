//! A session over a blocking socket: a frame leaves and an answer arrives on the very thread that
//! keeps the beat or hears, in memory that is used again.
//!
//! A round trip holds what any client has to do, and no more: one pass that copies a frame under its
//! mask, and reads straight into place. Handshake and hello are `socket`'s.

use std::{
    io::{self, Read, Write},
    net::{Shutdown, TcpStream},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use papilla_proto::{FrameHeader, HEADER_LEN, MAP_LEN, SEALED_MAGIC, ServerMessage, SessionError};

use crate::socket::SocketError;

/// Kinds of frames (RFC 6455, section 5.2), whole.
const BINARY: u8 = 0x82;
const TEXT: u8 = 0x81;
const CLOSE: u8 = 0x88;
const PING: u8 = 0x89;
const PONG: u8 = 0x8a;

/// Set in the second byte of a frame under a mask.
const MASKED: u8 = 0x80;

/// Longest wait at a time; after it the hearer looks at the clock.
const LOOK: Duration = Duration::from_millis(500);

/// Room for an answer with every section there is, and the heads before it, bytes.
const ROOM: usize = 16 + HEADER_LEN + 8 * MAP_LEN;

/// The sending half.
#[derive(Debug)]
pub(super) struct Mouth {
    stream: Arc<Mutex<TcpStream>>,
    /// Held while the session moves: frames wait.
    hold: Arc<Mutex<()>>,
    random: fastrand::Rng,
    buffer: Vec<u8>,
}

/// The hearing half.
#[derive(Debug)]
pub(super) struct Hearer {
    stream: TcpStream,
    /// Shared with the mouth: pongs must not come between the bytes of a frame.
    answers: Mouth,
    buffer: Vec<u8>,
    /// Bytes of the buffer that have come.
    len: usize,
    /// Bytes at its start that belong to the last message.
    spent: usize,
}

/// What the server said.
#[derive(Debug)]
pub(super) enum Said<'a> {
    /// An answer: its header and its samples.
    Frame(FrameHeader, &'a [u8]),
    /// A refusal.
    Error(SessionError),
    /// The session is to go on over another connection.
    Reconnect,
    /// What the session remembers.
    Sealed(&'a [u8]),
}

/// Both halves of a session.
pub(super) fn halves(stream: TcpStream) -> io::Result<(Mouth, Hearer)> {
    let stream = blocking(stream)?;
    let (writer, hold) = (Arc::new(Mutex::new(stream.try_clone()?)), Arc::default());
    let mouth = || Mouth {
        stream: Arc::clone(&writer),
        hold: Arc::clone(&hold),
        random: fastrand::Rng::new(),
        buffer: Vec::with_capacity(ROOM),
    };
    let hearer = Hearer { stream, answers: mouth(), buffer: vec![0; ROOM], len: 0, spent: 0 };
    Ok((mouth(), hearer))
}

fn blocking(stream: TcpStream) -> io::Result<TcpStream> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(LOOK))?;
    Ok(stream)
}

impl Mouth {
    /// Sends a frame: header and samples.
    ///
    /// # Errors
    /// The connection is gone.
    pub(super) fn send(&mut self, header: &FrameHeader, payload: &[u8]) -> io::Result<()> {
        let hold = Arc::clone(&self.hold);
        let _free = hold.lock().unwrap_or_else(PoisonError::into_inner);
        self.write(BINARY, &[&header.encode(), payload])
    }

    /// Says goodbye.
    pub(super) fn close(&mut self) {
        // Err: it is closed already.
        let _ = self.write(CLOSE, &[&1000_u16.to_be_bytes()]);
    }

    fn write(&mut self, first: u8, parts: &[&[u8]]) -> io::Result<()> {
        let len: usize = parts.iter().map(|part| part.len()).sum();
        self.buffer.clear();
        self.buffer.push(first);
        match len {
            0..=125 => self.buffer.push(MASKED | len as u8),
            126..=0xffff => {
                self.buffer.push(MASKED | 126);
                self.buffer.extend((len as u16).to_be_bytes());
            }
            _ => {
                self.buffer.push(MASKED | 127);
                self.buffer.extend((len as u64).to_be_bytes());
            }
        }
        let mut mask = self.random.u32(..).to_ne_bytes();
        self.buffer.extend(mask);
        for part in parts {
            let start = self.buffer.len();
            self.buffer.extend_from_slice(part);
            apply(&mut self.buffer[start..], mask);
            mask.rotate_left(part.len() % 4);
        }
        let mut stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner);
        stream.write_all(&self.buffer)
    }
}

/// Puts bytes under a mask, a word at a time.
fn apply(bytes: &mut [u8], mask: [u8; 4]) {
    let key = u32::from_ne_bytes(mask);
    let (words, rest) = bytes.as_chunks_mut();
    for word in words {
        *word = (u32::from_ne_bytes(*word) ^ key).to_ne_bytes();
    }
    rest.iter_mut().zip(mask).for_each(|(byte, mask)| *byte ^= mask);
}

impl Hearer {
    /// The next answer or refusal, and when it had come; none: `until` has passed.
    ///
    /// # Errors
    /// The connection is gone, or the server leaves the protocol.
    pub(super) fn receive(
        &mut self,
        until: Instant,
    ) -> Result<Option<(Instant, Said<'_>)>, SocketError> {
        loop {
            self.buffer.copy_within(self.spent..self.len, 0);
            (self.len, self.spent) = (self.len - self.spent, 0);
            let Some((start, end)) = self.message(until)? else { return Ok(None) };
            self.spent = end;
            let now = Instant::now();
            let protocol = |what: String| Err(SocketError::Text(what));
            match self.buffer[0] {
                BINARY if self.buffer[start..end].starts_with(&SEALED_MAGIC) => {
                    return Ok(Some((now, Said::Sealed(&self.buffer[start..end]))));
                }
                BINARY => {
                    let frame = &self.buffer[start..end];
                    let header = FrameHeader::decode(frame)?;
                    let said = Said::Frame(header, &frame[HEADER_LEN..]);
                    return Ok(Some((now, said)));
                }
                TEXT => match serde_json::from_slice(&self.buffer[start..end]) {
                    Ok(ServerMessage::Error(error)) => return Ok(Some((now, Said::Error(error)))),
                    Ok(ServerMessage::Reconnect(_)) => return Ok(Some((now, Said::Reconnect))),
                    Ok(_) => return protocol("a second ready".to_owned()),
                    Err(error) => return protocol(error.to_string()),
                },
                PING => {
                    let payload = &self.buffer[start..end];
                    // Err: what is read next says so too.
                    let _ = self.answers.write(PONG, &[payload]);
                }
                PONG => {}
                CLOSE => return Err(SocketError::Closed),
                other => return protocol(format!("a frame that begins with {other:#x}")),
            }
        }
    }

    /// Where the payload of the next message lies in the buffer, once all of it is there.
    fn message(&mut self, until: Instant) -> Result<Option<(usize, usize)>, SocketError> {
        loop {
            if let Some((start, end)) = bounds(&self.buffer[..self.len]) {
                if end <= self.len {
                    return Ok(Some((start, end)));
                }
                if end > self.buffer.len() {
                    return Err(SocketError::Text(format!("a message of {end} bytes")));
                }
            }
            match self.stream.read(&mut self.buffer[self.len..]) {
                Ok(0) => return Err(SocketError::Closed),
                Ok(read) => self.len += read,
                Err(error) if is_pause(&error) => {
                    if Instant::now() >= until {
                        return Ok(None);
                    }
                }
                Err(_) => return Err(SocketError::Closed),
            }
        }
    }

    /// What keeps frames from being sent while it is locked.
    pub(super) fn hold(&self) -> Arc<Mutex<()>> {
        Arc::clone(&self.answers.hold)
    }

    /// Asks for what the session remembers.
    ///
    /// # Errors
    /// The connection is gone.
    pub(super) fn seal(&mut self) -> io::Result<()> {
        self.answers.write(TEXT, &[br#"{"type":"seal"}"#])
    }

    /// Goes on over another connection, and closes this one.
    ///
    /// # Errors
    /// The system refuses a copy of it.
    pub(super) fn move_to(&mut self, stream: TcpStream) -> io::Result<()> {
        let stream = blocking(stream)?;
        self.answers.close();
        let mut writer = self.answers.stream.lock().unwrap_or_else(PoisonError::into_inner);
        *writer = stream.try_clone()?;
        self.stream = stream;
        (self.len, self.spent) = (0, 0);
        Ok(())
    }

    /// Ends the connection, whoever may be writing to it.
    pub(super) fn end(&self) {
        // Err: it is over already.
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

fn is_pause(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}

/// Where the payload of the first frame begins and ends; none: its head is not there yet.
fn bounds(bytes: &[u8]) -> Option<(usize, usize)> {
    let &[_, second, ref rest @ ..] = bytes else { return None };
    let extra = match second {
        126 => 2,
        127 => 8,
        _ => 0,
    };
    let len = match extra {
        0 => usize::from(second),
        _ => rest.get(..extra)?.iter().fold(0, |len: usize, &b| (len << 8) | usize::from(b)),
    };
    Some((2 + extra, (2 + extra).saturating_add(len)))
}

#[cfg(test)]
mod tests;
