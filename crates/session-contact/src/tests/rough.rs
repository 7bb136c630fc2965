//! Bodies that rub: how far the skin moves, what pulls at it, what is remembered of it.

use super::*;

fn aside(by_mm: f32) -> [u8; POSE_LEN] {
    Pose { origin_mm: [0.0, by_mm, 0.3 - 20.0], ..Pose::default() }.encode()
}

/// The last section has how far each vertex moved: most under the ball, and nothing without it.
#[test]
fn a_hello_can_ask_how_far_skin_moves() {
    let plane = Plane::new();
    let hello =
        Hello { displacement: Some(true), pressure: Some(SampleLayout::Vertices), ..objects() };
    let hand = plane.hand(&hello).expect("a hand");
    let vertices = SIDE * SIDE;
    let Section { name, offset, bytes } = *hand.sections().last().expect("sections");
    assert_eq!((name, bytes), (SectionName::Displacement, 12 * vertices as u32));
    let moved = |depth_mm: f32| {
        let mut finger = hand.fingers()[0].lock().expect("no panic");
        finger.take(frame(&pose(depth_mm), 0), None).expect("an answer");
        let mut written = BytesMut::new();
        finger.write(&mut written);
        assert_eq!(written.len(), finger.sections_len());
        let floats = written[offset as usize - HEADER_LEN..][..bytes as usize].as_chunks::<4>().0;
        floats.iter().map(|b| f32::from_le_bytes(*b)).collect::<Vec<_>>()
    };
    let pressed = moved(0.3);
    let most = pressed.as_chunks::<3>().0.iter().map(|u| u[2]).fold(0.0, f32::max);
    assert!((0.2..0.4).contains(&most), "{most} mm under a ball 0.3 mm deep");
    assert!(moved(-5.0).iter().all(|u| *u == 0.0));
}

/// The touch has the pull, the section behind it the traction at each vertex; and it goes on where
/// the session goes.
#[test]
fn a_rough_ball_pulls_and_goes_on_elsewhere() {
    let plane = Plane::new();
    let hand = plane.hand(&rough(0.5)).expect("a hand");
    let vertices = SIDE * SIDE;
    let shear = Section {
        name: SectionName::Shear,
        offset: (HEADER_LEN + TOUCH_LEN) as u32,
        bytes: 12 * vertices as u32,
    };
    assert_eq!(hand.sections()[1], shear);
    let (pressed, _) = touch(&hand, 0, &aside(0.0)).expect("an answer");
    assert!(pressed.force_n[1].abs() < 1e-3 * pressed.force_n[2], "{pressed:?}");
    let other = plane.hand(&rough(0.5)).expect("a hand");
    carry(&hand, &other);
    let mut answers = [&hand, &other].map(|hand| {
        let mut finger = hand.fingers()[0].lock().expect("no panic");
        finger.take(frame(&aside(0.4), 0), None).expect("an answer");
        let mut bytes = BytesMut::zeroed(HEADER_LEN);
        finger.write(&mut bytes);
        bytes
    });
    // The time of the solve differs.
    answers.iter_mut().for_each(|bytes| bytes[HEADER_LEN + 60..][..4].fill(0));
    assert_eq!(answers[0], answers[1]);
    let pulled = Touch::decode(&answers[0][HEADER_LEN..]).expect("it lies there");
    let share = pulled.force_n[1] / pulled.force_n[2];
    assert!((0.49..0.51).contains(&share), "{pulled:?}");
    let section = &answers[0][shear.offset as usize..][..shear.bytes as usize];
    let sum: f32 = section
        .as_chunks::<12>()
        .0
        .iter()
        .map(|v| f32::from_le_bytes([v[4], v[5], v[6], v[7]]))
        .sum();
    // Each vertex stands for a square millimetre.
    assert!((1e-6 * sum / pulled.force_n[1] - 1.0).abs() < 0.02, "{sum} Pa, {pulled:?}");
}

/// A session that names no friction remembers in the bytes that it always did.
#[test]
fn what_has_no_friction_remembers_none() {
    let plane = Plane::new();
    let len = |hello: &Hello| {
        let hand = plane.hand(hello).expect("a hand");
        touch(&hand, 0, &aside(0.0)).expect("an answer");
        let mut state = Writer::default();
        hand.fingers()[0].lock().expect("no panic").save(&mut state);
        state.finish().len()
    };
    let by_vertices = Hello { method: Some(ContactMethod::SecondOrder), ..objects() };
    let slippery = Hello { objects: rough(0.0).objects, ..by_vertices.clone() };
    assert_eq!(len(&slippery), len(&by_vertices));
    assert!(len(&rough(0.5)) > len(&by_vertices));
}
