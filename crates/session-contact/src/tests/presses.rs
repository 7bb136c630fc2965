//! What presses, where it presses next, and what goes along with a session.

use super::*;

/// What lies deep goes on pressing, says so, and is no air; elsewhere it goes on from the same side.
#[test]
fn a_deep_body_presses_on_and_is_flagged() {
    let plane = Plane::new();
    for method in [
        ContactMethod::Springs,
        ContactMethod::SmallStrain,
        ContactMethod::SecondOrder,
        ContactMethod::CoarsePixels,
        ContactMethod::Pixels,
    ] {
        let small = Hello { objects: Some(vec![ball(3.0)]), method: Some(method), ..objects() };
        let [hand, elsewhere] = [0, 1].map(|_| plane.hand(&small).expect("a hand"));
        let at = |depth_mm: f32| {
            Pose { origin_mm: [0.0, 0.0, depth_mm - 3.0], ..Pose::default() }.encode()
        };
        let mut last_n = 0.0;
        // As far as some of it lies behind this plane.
        for step in 0..12 {
            let depth_mm = 0.5 * step as f32;
            let (found, taken) = touch(&hand, 0, &at(depth_mm)).expect("a touch");
            let told = format!("{method:?}, {depth_mm} mm: {found:?} {taken:?}");
            assert!(found.force_n[2] >= 0.98 * last_n, "falls: {told}");
            if depth_mm > 2.1 {
                assert_ne!(taken.flags & flags::OUT_OF_RANGE, 0, "silent: {told}");
                assert_eq!(taken.flags & flags::NO_CONTACT, 0, "no contact: {told}");
            }
            last_n = found.force_n[2];
        }
        carry(&hand, &elsewhere);
        let deep = at(5.7);
        let [here, there] = [&hand, &elsewhere].map(|h| touch(h, 0, &deep).expect("a touch"));
        let same =
            |a: &Touch, b: &Touch| (a.force_n, a.pressure_max_pa) == (b.force_n, b.pressure_max_pa);
        assert!(same(&here.0, &there.0), "{method:?}: {here:?} {there:?}");
    }
}

#[test]
fn a_pose_becomes_a_force_and_air_becomes_none() {
    let plane = Plane::new();
    let hello =
        Hello { stiffness: Some(true), pressure: Some(SampleLayout::Vertices), ..objects() };
    let hand = plane.hand(&hello).expect("a hand");
    let (pressed, taken) = touch(&hand, 0, &pose(0.3)).expect("an answer");
    // Hertz: 4/3 E* sqrt(R) d^1.5, on vertices that are a millimetre apart.
    let due = 4.0 / 3.0 * 0.2 * 20f32.sqrt() * 0.3f32.powf(1.5);
    assert!((pressed.force_n[2] / due - 1.0).abs() < 0.1, "{pressed:?} for {due}");
    assert!(pressed.stiffness_n_per_mm > 0.0 && taken.flags == 0, "{pressed:?} {taken:?}");
    let (air, taken) = touch(&hand, 0, &pose(-5.0)).expect("an answer");
    assert_eq!((air.force_n.map(f32::to_bits), taken.flags), ([0; 3], flags::NO_CONTACT));
}

/// A ball between four vertices, none of which it touches.
#[test]
fn on_pixels_a_dot_between_vertices_presses_and_a_finger_goes_on_elsewhere() {
    let plane = Plane::new();
    let hello =
        Hello { objects: Some(vec![ball(2.0)]), pressure: Some(SampleLayout::Map), ..objects() };
    let dot = |depth_mm: f32| {
        let origin_mm = [0.5, 0.5, depth_mm - 2.0];
        Pose { origin_mm, ..Pose::default() }.encode()
    };
    let by_vertices = Hello { method: Some(ContactMethod::SecondOrder), ..hello.clone() };
    let at_vertices = plane.hand(&by_vertices).expect("a hand");
    let (missed, taken) = touch(&at_vertices, 0, &dot(0.05)).expect("an answer");
    assert_eq!((missed.force_n[2].to_bits(), taken.flags), (0, flags::NO_CONTACT));

    // Pixels are the default.
    let hand = plane.hand(&hello).expect("a hand");
    let (felt, taken) = touch(&hand, 0, &dot(0.05)).expect("an answer");
    // Hertz: 4/3 E* sqrt(R) d^1.5.
    let due = 4.0 / 3.0 * 0.2 * 2f32.sqrt() * 0.05f32.powf(1.5);
    assert!((felt.force_n[2] / due - 1.0).abs() < 0.2, "{felt:?} for {due}");
    assert!(taken.flags == 0 && felt.pressure_max_pa > 0.0, "{taken:?}");

    let other = plane.hand(&hello).expect("a hand");
    carry(&hand, &other);
    let [here, there] = [&hand, &other].map(|hand| {
        let (touch, taken) = touch(hand, 0, &dot(0.051)).expect("an answer");
        (Touch { solve_us: 0.0, ..touch }, taken)
    });
    assert_eq!(here, there);
}

#[test]
fn a_net_force_is_met_by_poses_and_by_gaps() {
    let plane = Plane::new();
    let hello = Hello { force_target: Some(true), ..objects() };
    let row = Pose { origin_mm: [0.0, 0.0, 1.0], quaternion: [0.05, 0.0, 0.0, 0.0] }.encode();
    let payload = [pose(-1.0), row].concat();
    let (on_pixels, _) = touch(&plane.hand(&hello).expect("a hand"), 0, &payload).expect("met");
    assert!((on_pixels.force_n[2] / 0.05 - 1.0).abs() < 0.01, "{on_pixels:?}");
    let hello = Hello { method: Some(ContactMethod::SecondOrder), ..hello };
    let (found, _) = touch(&plane.hand(&hello).expect("a hand"), 0, &payload).expect("met");
    assert!((found.force_n[2] / 0.05 - 1.0).abs() < 3e-3 && found.travel_mm > 1.0, "{found:?}");
    let hello = Hello {
        input: Some(Input::Gaps),
        input_layout: Some(SampleLayout::Vertices),
        objects: None,
        ..hello
    };
    let hand = plane.hand(&hello).expect("a hand");
    let gap = |p: &[f32; 3]| 20.0 - (p[0] * p[0] + p[1] * p[1] + 21.0 * 21.0).sqrt();
    let depth = plane.atlas.patch(Patch::Skin).positions_mm.iter().map(gap);
    let mut payload: Vec<u8> = depth.flat_map(f32::to_le_bytes).collect();
    payload.extend(row);
    let (by_gaps, _) = touch(&hand, 0, &payload).expect("met");
    assert!((by_gaps.force_n[2] / 0.05 - 1.0).abs() < 3e-3, "{by_gaps:?}");
    assert!((by_gaps.travel_mm - found.travel_mm).abs() < 0.02, "{by_gaps:?} {found:?}");
}

#[test]
fn a_map_of_gaps_presses_as_vertices_do() {
    let plane = Plane::new();
    let hello = Hello { input: Some(Input::Gaps), objects: None, ..objects() };
    let hand = plane.hand(&hello).expect("a hand");
    let depth = |i: usize| {
        let [u, v] = [i % 224, i / 224].map(|k| 0.1 * (k as f32 + 0.5 - 110.0));
        20.0 - (u * u + v * v + 19.7 * 19.7).sqrt()
    };
    let payload: Vec<u8> = (0..MAP_LEN).flat_map(|i| depth(i).to_le_bytes()).collect();
    let (found, _) = touch(&hand, 0, &payload).expect("an answer");
    let due = touch(&plane.hand(&objects()).expect("a hand"), 0, &pose(0.3)).expect("an answer").0;
    assert!((found.force_n[2] / due.force_n[2] - 1.0).abs() < 0.05, "{found:?} {due:?}");
}

/// Fingers know nothing of each other, and a finger twice as stiff answers twice the force.
#[test]
fn each_finger_has_its_own_state_and_factors() {
    let plane = Plane::new();
    let fingers =
        [1.0, 2.0].map(|stiffness| AnnouncedFinger { stiffness, ..AnnouncedFinger::default() });
    let hello = Hello { fingers: Some(fingers.to_vec()), ..objects() };
    let hand = plane.hand(&hello).expect("a hand");
    let (first, one) = touch(&hand, 0, &pose(0.2)).expect("an answer");
    let (other, two) = touch(&hand, 1, &pose(0.2)).expect("an answer");
    assert!((other.force_n[2] / first.force_n[2] - 2.0).abs() < 1e-3, "{first:?} {other:?}");
    // What the network is asked about is the same.
    assert!((one.peak_pa / two.peak_pa - 1.0).abs() < 1e-3, "{one:?} {two:?}");
}

/// Tracking that is lost tells of no touch, is shorter than any frame, and leaves what the next frame
/// starts from.
#[test]
fn a_finger_that_is_lost_is_told_as_air_and_goes_on() {
    let plane = Plane::new();
    let hello = Hello { pressure: Some(SampleLayout::Vertices), ..objects() };
    let hand = plane.hand(&hello).expect("a hand");
    let (before, _) = touch(&hand, 0, &pose(0.3)).expect("an answer");
    let header = FrameHeader::pressure(1, 0, 0, SampleType::F32, 1.0);
    let lost = header.of_finger(FrameKind::Pressure, 0, [0, 0]).not_tracked();
    assert_eq!((hand.form().check(&lost), hand.form().payload_len(&lost)), (Ok(0), 0));
    let tall = header.of_finger(FrameKind::Objects, 0, [ROW as u16, 1]).not_tracked();
    assert_eq!(
        hand.form().check(&FrameHeader { height: 1, ..tall }).expect_err("refused").code,
        ErrorCode::WrongShape
    );
    let mut bytes = BytesMut::zeroed(HEADER_LEN);
    {
        let mut finger = hand.fingers()[0].lock().expect("no panic");
        finger.lose();
        finger.write(&mut bytes);
    }
    assert_eq!(bytes.len(), HEADER_LEN + hand.sections_len());
    assert!(bytes.iter().all(|byte| *byte == 0));
    let (after, taken) = touch(&hand, 0, &pose(0.3)).expect("an answer");
    assert!((after.force_n[2] / before.force_n[2] - 1.0).abs() < 0.01, "{before:?} {after:?}");
    assert!(taken.flags == 0 && taken.iterations.is_some_and(|n| n < 10), "{taken:?}");
}
