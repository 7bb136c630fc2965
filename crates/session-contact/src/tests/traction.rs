//! Friction of gaps, and traction that changes SED.

use papilla_proto::{PressureRange, effects::OutOfRange};

use super::*;

/// A ball that is dragged, as an object and as gaps with a velocity.
#[test]
fn gaps_that_say_how_things_move_pull_as_the_object_does() {
    let plane = Plane::new();
    let ball = AnnouncedObject { friction: Some(0.5), ..ball(20.0) };
    // Gaps are found at vertices.
    let method = Some(ContactMethod::SecondOrder);
    let by_object = Hello { objects: Some(vec![ball]), method, ..objects() };
    let by_object = plane.hand(&by_object).expect("a hand");
    let hello = Hello {
        input: Some(Input::Gaps),
        input_layout: Some(SampleLayout::Vertices),
        objects: None,
        friction: Some(0.5),
        velocity: Some(true),
        shear: Some(true),
        ..objects()
    };
    let by_gaps = plane.hand(&hello).expect("a hand");
    assert_eq!(by_gaps.form().size(), Some([4 * SIDE * SIDE, 1]));
    let skin_mm = &plane.atlas.patch(Patch::Skin).positions_mm;
    let mut hand = by_gaps;
    for step in 0..20u64 {
        // 2 mm/s along x from the third frame on, 10 ms a frame.
        let x = 0.02 * step.saturating_sub(2) as f32;
        let pose = Pose { origin_mm: [x, 0.0, 0.3 - 20.0], ..Pose::default() }.encode();
        let due = touch(&by_object, 0, &pose).expect("an answer").0;
        let depths =
            skin_mm.iter().map(|p| 20.0 - ((p[0] - x).powi(2) + p[1].powi(2) + 19.7 * 19.7).sqrt());
        let speed = if step > 2 { 2.0 } else { 0.0 };
        let velocities = skin_mm.iter().flat_map(|_| [speed, 0.0, 0.0]);
        let payload: Vec<u8> = depths.chain(velocities).flat_map(f32::to_le_bytes).collect();
        let mut bytes = BytesMut::zeroed(HEADER_LEN);
        {
            let mut finger = hand.fingers()[0].lock().expect("no panic");
            finger.take(frame(&payload, 10_000 * step), None).expect("an answer");
            finger.write(&mut bytes);
        }
        let found = Touch::decode(&bytes[HEADER_LEN..]).expect("it lies there");
        let miss = (found.force_n[0] - due.force_n[0]).hypot(found.force_n[1] - due.force_n[1]);
        assert!(miss < 0.05 * 0.5 * due.force_n[2], "{step}: {found:?} {due:?}");
        if step == 19 {
            assert!(due.force_n[0] > 0.3 * 0.5 * due.force_n[2], "{due:?}");
        }
        // Another connection goes on in its place, time and all.
        let other = plane.hand(&hello).expect("a hand");
        carry(&hand, &other);
        hand = other;
    }
    let depth = skin_mm.iter().map(|_| -1.0);
    let swift = skin_mm.iter().flat_map(|_| [0.0, f32::NAN, 0.0]);
    let payload: Vec<u8> = depth.chain(swift).flat_map(f32::to_le_bytes).collect();
    let mut finger = hand.fingers()[0].lock().expect("no panic");
    let refused = finger.take(frame(&payload, 0), None).expect_err("refused");
    assert_eq!(refused.field.as_deref(), Some("velocity_mm_per_s[0]"));
}

/// Traction that the client sends, and the same that contact finds.
#[test]
fn traction_is_felt_where_the_hello_names_it() {
    let plane = Plane::new();
    let ball = AnnouncedObject { friction: Some(0.5), ..ball(20.0) };
    let rough = Hello {
        objects: Some(vec![ball]),
        // What the client sends is known at vertices alone.
        method: Some(ContactMethod::SecondOrder),
        pressure: Some(SampleLayout::Vertices),
        shear: Some(true),
        effects: vec!["shear_energy".to_owned()],
        ..objects()
    };
    let felt = |hand: &Hand, payload: &[u8], pressure_pa: &mut Vec<f32>| {
        let mut finger = hand.fingers()[0].lock().expect("no panic");
        finger.take(frame(payload, 0), Some(pressure_pa)).expect("an answer");
        let mut sed = vec![100.0; MAP_LEN];
        let range = PressureRange { trained_max_pa: 1e5, beyond: OutOfRange::Refuse };
        finger.feel_shear(pressure_pa, range, &mut sed);
        let mut bytes = BytesMut::zeroed(HEADER_LEN);
        finger.write(&mut bytes);
        (sed, bytes)
    };
    let mut pressure_pa = vec![0.0; MAP_LEN];
    let hand = plane.hand(&rough).expect("a hand");
    for x in [0.0, 0.05, 0.1] {
        let pose = Pose { origin_mm: [x, 0.0, 0.3 - 20.0], ..Pose::default() }.encode();
        felt(&hand, &pose, &mut pressure_pa);
    }
    let pose = Pose { origin_mm: [0.15, 0.0, 0.3 - 20.0], ..Pose::default() }.encode();
    let (due, bytes) = felt(&hand, &pose, &mut pressure_pa);
    assert!(due.iter().any(|sed| (sed - 100.0).abs() > 1.0));

    let section = |name| hand.sections().iter().find(|s| s.name == name).expect("a section");
    let of = |name| {
        let section = section(name);
        bytes[section.offset as usize..][..section.bytes as usize].to_vec()
    };
    let payload = [of(SectionName::Pressure), of(SectionName::Shear)].concat();
    let sent = Hello {
        input_layout: Some(SampleLayout::Vertices),
        traction: Some(true),
        effects: rough.effects,
        ..Hello::default()
    };
    let by_client = plane.hand(&sent).expect("a hand");
    assert_eq!(by_client.form().size(), Some([4 * SIDE * SIDE, 1]));
    let (found, _) = felt(&by_client, &payload, &mut pressure_pa);
    let miss = found.iter().zip(&due).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(miss < 1e-3, "{miss}");

    let plain = plane.hand(&Hello { effects: Vec::new(), ..sent.clone() }).expect("a hand");
    let (untouched, _) = felt(&plain, &payload, &mut pressure_pa);
    assert!(untouched.iter().all(|sed| sed.to_bits() == 100f32.to_bits()));
    for (hello, field) in [
        (Hello { input_layout: None, ..sent.clone() }, "traction"),
        (Hello { sample_type: SampleType::U16, ..sent }, "sample_type"),
        (Hello { traction: Some(true), ..objects() }, "traction"),
    ] {
        let refused = plane.hand(&hello).map(|_| ()).expect_err("refused");
        assert_eq!(refused.field.as_deref(), Some(field), "{refused:?}");
    }
    let mut endless = payload;
    endless[4 * SIDE * SIDE..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let mut finger = by_client.fingers()[0].lock().expect("no panic");
    let refused = finger.take(frame(&endless, 0), None).expect_err("refused");
    assert_eq!(refused.field.as_deref(), Some("traction_pa[0]"));
}

/// A hello whose SED leaves the traction out is asked whether it means that.
#[test]
fn who_has_friction_is_asked_about_shear_energy() {
    let plane = Plane::new();
    let rough = |friction: f64| {
        let ball = AnnouncedObject { friction: Some(friction), ..ball(20.0) };
        Hello { objects: Some(vec![ball]), ..objects() }
    };
    let with = |name: &str| Hello { effects: vec![name.to_owned()], ..rough(0.5) };
    for (hello, is_asked) in [
        (rough(0.5), true),
        (rough(0.0), false),
        (Hello { map: Some(false), ..rough(0.5) }, false),
        (with("summary"), true),
        (with("shear_energy"), false),
        (with("relaxation"), false),
    ] {
        let hand = plane.hand(&hello).expect("a hand");
        assert_eq!(hand.method(), Some(ContactMethod::Pixels));
        let asked: Vec<_> = hand.warnings().iter().map(|warning| &warning.member).collect();
        assert_eq!(asked == ["effects"], is_asked, "{hello:?}: {asked:?}");
        assert!(hand.warnings().iter().all(|w| w.question.contains("'shear_energy'")));
    }
}

#[test]
fn friction_and_velocity_are_of_gaps() {
    let plane = Plane::new();
    let gaps = Hello {
        input: Some(Input::Gaps),
        input_layout: Some(SampleLayout::Vertices),
        objects: None,
        friction: Some(0.5),
        velocity: Some(true),
        ..objects()
    };
    plane.hand(&gaps).expect("a hand");
    for (hello, field) in [
        (Hello { friction: Some(0.5), ..objects() }, "friction"),
        (Hello { velocity: Some(true), ..objects() }, "velocity"),
        (Hello { input_layout: None, ..gaps.clone() }, "velocity"),
        (Hello { friction: None, ..gaps.clone() }, "velocity"),
        (Hello { friction: Some(-1.0), ..gaps.clone() }, "friction"),
        (Hello { method: Some(ContactMethod::Springs), ..gaps }, "method"),
    ] {
        let refused = plane.hand(&hello).map(|_| ()).expect_err("refused");
        assert_eq!(refused.field.as_deref(), Some(field), "{refused:?}");
    }
}
