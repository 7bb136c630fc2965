use proptest::prelude::*;

use super::*;
use crate::ErrorCode;

fn any_header() -> impl Strategy<Value = FrameHeader> {
    let enums = (
        prop::sample::select(vec![
            FrameKind::Pressure,
            FrameKind::Sed,
            FrameKind::Objects,
            FrameKind::Gaps,
        ]),
        prop::sample::select(SampleType::ALL.to_vec()),
        prop::sample::select(vec![
            FrameStatus::Ok,
            FrameStatus::Superseded,
            FrameStatus::Late,
            FrameStatus::Error,
            FrameStatus::Stale,
        ]),
    );
    let numbers = (any::<u32>(), any::<u16>(), any::<u16>(), any::<u64>(), any::<u32>());
    let more = any::<(u16, u16, u32, u32, u16, u8, u8)>();
    let all = (enums, numbers, -1e30f32..1e30, more);
    all.prop_map(|((kind, sample_type, status), n, scale, more)| {
        let (x, y, queue_us, infer_us, tier, flags, finger) = more;
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
            x,
            y,
            queue_us,
            infer_us,
            tier,
            flags,
            finger,
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
        x: 0x0201,
        y: 0x0403,
        queue_us: 0x0807_0605,
        infer_us: 0x0c0b_0a09,
        tier: 0x0e0d,
        flags: 15,
        finger: 16,
    };
    let mut expected = b"PPL1\x03\x02\x02\x02".to_vec();
    expected.extend(1..=20);
    expected.extend([0, 0, 0x80, 0x3f]);
    expected.extend(1..=16);
    assert_eq!((header.encode().to_vec(), HEADER_LEN), (expected.clone(), 48));
    (expected[5], expected[47]) = (4, 17);
    let header = header.of_finger(FrameKind::Objects, 17, [0x0605, 0x0807]);
    assert_eq!(header.encode().to_vec(), expected);
    // No other version is spoken.
    for found in [1, 2, 4] {
        expected[4] = found;
        assert_eq!(FrameHeader::decode(&expected), Err(FrameError::UnknownVersion { found }));
    }
    expected[4..6].copy_from_slice(&[3, 3]);
    assert_eq!(FrameHeader::decode(&expected), Err(FrameError::UnknownKind { found: 3 }));
}

#[test]
fn a_window_goes_into_the_header_and_comes_out() {
    let window = Window { x: 3, y: 5, width: 7, height: 9 };
    let whole = FrameHeader::pressure(9, 77, 0, SampleType::U16, 0.25);
    assert_eq!(whole.window(), Window::WHOLE);
    let header = whole.windowed(window);
    assert_eq!((header.window(), header.payload_len()), (window, 126));
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
    fn bytes_of_any_kind_do_not_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..80), begin in any::<bool>()) {
        // Half of them get as far as the kind.
        if begin && bytes.len() > 5 {
            bytes[..4].copy_from_slice(&MAGIC);
            bytes[4] = PROTOCOL_VERSION;
        }
        let _ = FrameHeader::peek_sequence(&bytes);
        if let Ok(header) = FrameHeader::decode(&bytes) {
            // NaN scales compare unequal; their bytes do not.
            prop_assert_eq!(&header.encode()[..], &bytes[..HEADER_LEN]);
        }
    }

    #[test]
    fn near_misses_are_named(header in any_header(), at in 0usize..8, flip in 8u8..=255) {
        let mut frame = header.encode().to_vec();
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
