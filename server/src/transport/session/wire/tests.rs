//! Compares the framing with that of tungstenite: what it writes is read the same, in portions of
//! any size.

use tokio_tungstenite::tungstenite::protocol::frame::{
    Frame, FrameHeader,
    coding::{Control, Data, OpCode},
};

use super::*;

/// A client's frame as tungstenite writes it.
fn written(opcode: OpCode, is_last: bool, mask: [u8; 4], payload: &[u8]) -> Vec<u8> {
    let header =
        FrameHeader { is_final: is_last, opcode, mask: Some(mask), ..FrameHeader::default() };
    let frame = Frame::from_payload(header, payload.to_vec().into());
    let mut bytes = Vec::new();
    frame.format(&mut bytes).unwrap();
    bytes
}

/// What is read from bytes that arrive in portions.
fn heard(inbound: &mut Inbound, bytes: &[u8], portion: usize) -> Result<Vec<Message>, Fault> {
    let mut messages = Vec::new();
    for part in bytes.chunks(portion) {
        inbound.room();
        inbound.buffer.extend_from_slice(part);
        while let Some(received) = inbound.next()? {
            if let Received::Message(message) = received {
                messages.push(message);
            }
        }
    }
    Ok(messages)
}

fn noise(random: &mut fastrand::Rng, len: usize) -> Vec<u8> {
    (0..len).map(|_| random.u8(..)).collect()
}

#[test]
fn what_the_library_writes_is_read_in_any_portions() {
    let mut random = fastrand::Rng::with_seed(7);
    for portion in [1, 2, 3, 7, 64, 1000, 65_536, usize::MAX] {
        let mut inbound = Inbound::new(&[]);
        let (mut bytes, mut due) = (Vec::new(), Vec::new());
        for len in [0, 1, 4, 5, 125, 126, 127, 999, 65_535, 65_536, 65_537] {
            let mask = [(); 4].map(|()| random.u8(..));
            let payload = noise(&mut random, len);
            bytes.extend(written(OpCode::Data(Data::Binary), true, mask, &payload));
            due.push(Message::Binary(payload.into()));
            // A text in three pieces, with a ping and a pong in between.
            let text = vec![b'a'; len];
            let (one, rest) = text.split_at(len / 3);
            let (two, three) = rest.split_at(len / 3);
            bytes.extend(written(OpCode::Data(Data::Text), false, mask, one));
            bytes.extend(written(OpCode::Control(Control::Ping), true, mask, b"here?"));
            bytes.extend(written(OpCode::Data(Data::Continue), false, mask, two));
            bytes.extend(written(OpCode::Control(Control::Pong), true, mask, b""));
            bytes.extend(written(OpCode::Data(Data::Continue), true, mask, three));
            due.extend([Message::Ping(Bytes::from("here?")), Message::Pong]);
            due.push(Message::Text(text.into()));
        }
        let (early, late) = bytes.split_at(bytes.len() / 2);
        let mut found = heard(&mut inbound, early, portion).unwrap();
        inbound.expect(1000, 1, &Store::new(1));
        found.extend(heard(&mut inbound, late, portion).unwrap());
        assert!(found == due, "in portions of {portion}");
        assert!(!inbound.is_amid());
    }
}

#[test]
fn frames_of_a_session_use_the_same_memory_again() {
    let mut inbound = Inbound::new(&[]);
    inbound.expect(1000, 1, &Store::new(1));
    let mut places = std::collections::HashSet::new();
    for n in 0..50_u8 {
        let frame = written(OpCode::Data(Data::Binary), true, [n; 4], &[n; 1000]);
        for message in heard(&mut inbound, &frame, 300).unwrap() {
            let Message::Binary(payload) = message else { panic!("{message:?}") };
            assert!(payload.iter().all(|&byte| byte == n));
            places.insert(payload.as_ptr());
        }
    }
    assert!(places.len() <= 4, "{} places", places.len());
}

#[test]
fn noise_ends_in_a_fault_or_in_silence_and_takes_little_memory() {
    let mut random = fastrand::Rng::with_seed(3);
    for _ in 0..20_000 {
        let mut inbound = Inbound::new(&[]);
        let len = random.usize(..200);
        let mut bytes = noise(&mut random, len);
        if let [first, second, ..] = bytes.as_mut_slice() {
            // Half of them get flag bits that a client's header may have.
            if random.bool() {
                (*first, *second) = (*first & 0x8f, *second | 0x80);
            }
        }
        let portion = random.usize(1..40);
        let _ = heard(&mut inbound, &bytes, portion);
        assert!(inbound.buffer.capacity() <= 2 * STEP);
    }
}

#[test]
fn close_codes_are_those_that_may_be_sent() {
    for (payload, due) in [
        (&[][..], Ok(None)),
        (&[3, 232], Ok(Some(1000))),
        (&[3, 232, b'b', b'y', b'e'], Ok(Some(1000))),
        (&[15, 160], Ok(Some(4000))),
    ] {
        assert_eq!(close_code(payload), due);
    }
    // One byte, codes that are for programs alone, a reason that is not UTF-8.
    for payload in
        [&[3][..], &[3, 237], &[3, 238], &[3, 247], &[0, 1], &[255, 255], &[3, 232, 0xff]]
    {
        assert!(close_code(payload).is_err(), "{payload:?}");
    }
}

#[test]
fn heads_are_those_of_the_library() {
    for len in [0, 1, 125, 126, 65_535, 65_536, 200_752] {
        let header = FrameHeader { opcode: OpCode::Data(Data::Binary), ..FrameHeader::default() };
        let payload = vec![9; len];
        let mut due = Vec::new();
        Frame::from_payload(header, payload.clone().into()).format(&mut due).unwrap();
        assert!(frame(opcode::BINARY, &payload) == due, "{len}");
    }
}
