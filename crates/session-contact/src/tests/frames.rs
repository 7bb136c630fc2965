//! Frames that are refused, and what the finger makes of any bytes.

use super::*;

#[test]
fn bad_frames_are_refused_by_member_and_the_finger_lives_on() {
    let plane = Plane::new();
    let hello = Hello { force_target: Some(true), ..objects() };
    let hand = plane.hand(&hello).expect("a hand");
    let none = [0; POSE_LEN];
    let turned = Pose { quaternion: [0.0, 0.0, 0.5, 1.0], ..Pose::default() }.encode();
    let nan = Pose { origin_mm: [f32::NAN, 0.0, 0.0], ..Pose::default() }.encode();
    let lost = Pose { origin_mm: [0.0, 1e9, 0.0], ..Pose::default() }.encode();
    let net = |v: [f32; 3], n: f32| Pose { origin_mm: v, quaternion: [n, 0.0, 0.0, 0.0] }.encode();
    let cases = [
        ([none, none], "objects[0].quaternion"),
        ([turned, none], "objects[0].quaternion"),
        ([nan, none], "objects[0].origin_mm"),
        ([lost, none], "objects[0].origin_mm"),
        ([pose(0.1), net([0.0, 0.0, 2.0], 1.0)], "direction"),
        ([pose(0.1), net([0.0, 0.0, 1.0], f32::NAN)], "force_n"),
        ([pose(0.1), net([0.0, 0.0, 1.0], -1.0)], "force_n"),
        ([pose(0.1), net([0.0, 0.0, -1.0], 1.0)], "force_n"),
    ];
    for (payload, field) in cases {
        let problem = touch(&hand, 0, &payload.concat()).expect_err(field);
        assert_eq!(problem.field.as_deref(), Some(field), "{problem}");
        let (found, _) = touch(&hand, 0, &[pose(0.2), none].concat()).expect("it lives on");
        assert!(found.force_n[2] > 0.0);
    }
}

#[test]
fn frames_of_another_form_are_refused_by_field() {
    let plane = Plane::new();
    let hand = plane.hand(&Hello { force_target: Some(true), ..objects() }).expect("a hand");
    let header = FrameHeader::pressure(1, 0, 0, SampleType::F32, 1.0);
    let of = |kind, finger, size| hand.form().check(&header.of_finger(kind, finger, size));
    assert_eq!(of(FrameKind::Objects, 0, [ROW as u16, 2]), Ok(0));
    let field = |found: Result<usize, Problem>| found.expect_err("refused").field.expect("named");
    assert_eq!(field(of(FrameKind::Objects, 1, [ROW as u16, 2])), "finger");
    assert_eq!(field(of(FrameKind::Gaps, 0, [ROW as u16, 2])), "kind");
    assert_eq!(field(of(FrameKind::Objects, 0, [ROW as u16, 1])), "width");
}

/// Whatever bytes come, of the right length or not: an answer or a refusal, and the finger lives on.
#[test]
fn any_bytes_are_answered_or_refused() {
    let plane = Plane::new();
    let mut random = fastrand::Rng::with_seed(3);
    let gaps = Hello {
        input: Some(Input::Gaps),
        input_layout: Some(SampleLayout::Vertices),
        objects: None,
        force_target: Some(true),
        ..objects()
    };
    for hello in [Hello { force_target: Some(true), ..objects() }, gaps] {
        let hand = plane.hand(&hello).expect("a hand");
        let due = hand.form().payload_len_max(4);
        let mut finger = hand.fingers()[0].lock().expect("no panic");
        for _ in 0..300 {
            let len = if random.u8(..8) == 0 { random.usize(..2 * due) } else { due };
            let mut bytes: Vec<u8> = (0..len).map(|_| random.u8(..)).collect();
            if random.bool() {
                // Numbers that may be meant.
                let small = |_: &[u8; 4]| (2.0 * random.f32() - 1.0).to_le_bytes();
                bytes = bytes.as_chunks::<4>().0.iter().flat_map(small).collect();
            }
            let taken = finger.take(frame(&bytes, 0), None);
            assert!(taken.is_err() || taken.is_ok_and(|taken| taken.peak_pa.is_finite()));
        }
    }
}
