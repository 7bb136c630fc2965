use papilla_contact::{Arrays, Header, InterfaceSkin, Layer};
use papilla_proto::{
    FrameHeader, FrameKind, SampleType,
    atlas::{Patch, PatchVertices},
    contact::{
        AnnouncedFinger, AnnouncedObject, ContactErrors, ContactMethod, MethodError, MethodErrors,
        POSE_LEN, Pose, ROW, Spread, Touch,
    },
    flags,
    sdf::{AnnouncedShape, Mesh, Sphere},
};

use papilla_session_state::{Reader, Writer};

use super::*;

mod traction;

const SIDE: usize = 19;

/// A plane finger, 0.1 mm a pixel, skin looking down, on a half-space.
struct Plane {
    atlas: Atlas,
    raster: Arc<Raster>,
    model: Arc<ContactModel>,
    pixels: Arc<PixelSkin>,
    interface: Arc<InterfaceSkin>,
}

impl Plane {
    fn new() -> Self {
        let at = |i: usize| [i % SIDE, i / SIDE].map(|k| 10.0 * k as f32 + 20.0);
        let uv_px: Vec<[f32; 2]> = (0..SIDE * SIDE).map(at).collect();
        let mut triangles = Vec::new();
        for y in 0..SIDE - 1 {
            for x in 0..SIDE - 1 {
                let (a, s) = ((y * SIDE + x) as u32, SIDE as u32);
                triangles.extend([[a, a + s, a + 1], [a + 1, a + s, a + s + 1]]);
            }
        }
        let positions_mm: Vec<[f32; 3]> =
            uv_px.iter().map(|[u, v]| [0.1 * (v - 110.0), -0.1 * (u - 110.0), 0.0]).collect();
        let patch = PatchVertices { positions_mm: positions_mm.clone(), uv_px };
        let atlas = Atlas::new(0.1, triangles.clone(), patch.clone(), patch).expect("an atlas");
        let header = Header {
            vertices: SIDE * SIDE,
            triangles: triangles.len(),
            share_max: 1.0,
            layers: [0.2, 98.8]
                .map(|thickness_mm| Layer { young_mpa: 0.15, poisson: 0.49, thickness_mm })
                .to_vec(),
            atlas_hash: atlas.hash().to_owned(),
            ..Header::current()
        };
        let arrays = Arrays::half_space(
            positions_mm.into_flattened(),
            (0..SIDE * SIDE).flat_map(|_| [0.0, 0.0, -1.0]).collect(),
            vec![1.0; SIDE * SIDE],
            triangles.into_flattened(),
            0.2,
        );
        let model = Arc::new(ContactModel::new(header, arrays).expect("a model"));
        let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
        let pixels = PixelSkin::new(&model, &atlas, Arc::clone(&raster)).expect("layers");
        let interface = InterfaceSkin::new(&model, &atlas, Arc::clone(&raster)).expect("layers");
        Self { atlas, raster, model, pixels: Arc::new(pixels), interface: Arc::new(interface) }
    }

    fn hand(&self, hello: &Hello) -> Result<Hand, Problem> {
        let Self { atlas, raster, model, pixels, interface } = self;
        let (model, pixels, interface) = (Some(model), Some(pixels), Some(interface));
        Hand::of(
            hello,
            Skin { atlas, raster, model, pixels, interface, errors: None, model_sha256: None },
        )
    }
}

fn ball(radius_mm: f64) -> AnnouncedObject {
    let shape = AnnouncedShape::Sphere(Sphere { radius_mm });
    AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction: None }
}

fn objects() -> Hello {
    Hello { input: Some(Input::Objects), objects: Some(vec![ball(20.0)]), ..Hello::default() }
}

fn pose(depth_mm: f32) -> [u8; POSE_LEN] {
    Pose { origin_mm: [0.0, 0.0, depth_mm - 20.0], ..Pose::default() }.encode()
}

/// Gives what a hand's first finger remembers to another's.
fn carry(from: &Hand, to: &Hand) {
    let mut state = Writer::default();
    from.fingers()[0].lock().expect("no panic").save(&mut state);
    let state = state.finish();
    let mut reader = Reader::new(&state);
    to.fingers()[0].lock().expect("no panic").restore(&mut reader).expect("its state");
    reader.end().expect("nothing more");
}

fn frame(payload: &[u8], time_us: u64) -> Frame<'_> {
    Frame { payload, sample_type: SampleType::F32, scale: 1.0, time_us }
}

fn touch(hand: &Hand, finger: usize, payload: &[u8]) -> Result<(Touch, Taken), Problem> {
    let mut finger = hand.fingers()[finger].lock().expect("no panic");
    let mut map_pa = vec![0.0; MAP_LEN];
    let taken = finger.take(frame(payload, 0), Some(&mut map_pa))?;
    let mut bytes = BytesMut::zeroed(HEADER_LEN);
    finger.write(&mut bytes);
    assert_eq!(bytes.len(), HEADER_LEN + hand.sections_len());
    let peak = map_pa.iter().copied().fold(0.0, f32::max);
    assert!(peak <= 1.0001 * taken.peak_pa, "{peak} {taken:?}");
    Ok((Touch::decode(&bytes[HEADER_LEN..]).expect("it lies there"), taken))
}

use bytes::BytesMut;

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

fn rough(friction: f64) -> Hello {
    Hello {
        objects: Some(vec![AnnouncedObject { friction: Some(friction), ..ball(20.0) }]),
        shear: Some(true),
        ..objects()
    }
}

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

/// A hello that names no method gets the most accurate one that can serve it, and is told where that
/// is not the most accurate one there is, with what it errs.
#[test]
fn without_a_name_the_most_accurate_method_serves() {
    let plane = Plane::new();
    let spread = |median| Spread { median, p95: 2.0 * median };
    let errors = |name, median| MethodErrors {
        name,
        errors: vec![MethodError {
            set: "held-out".to_owned(),
            states: 40,
            pressure_relative_l2: spread(median),
            force_relative: spread(0.02),
            sed_relative_l2: Some(spread(2.0 * median)),
        }],
    };
    let errors = ContactErrors {
        contact_sha256: String::new(),
        network: None,
        methods: vec![errors(ContactMethod::SecondOrder, 0.3), errors(ContactMethod::Pixels, 0.08)],
    };
    let Plane { atlas, raster, model, pixels, interface } = &plane;
    let (model, interface) = (Some(model), Some(interface));
    let with = |hello: &Hello, has_layers: bool, errors| {
        let pixels = has_layers.then_some(pixels);
        let skin = Skin { atlas, raster, model, pixels, interface, errors, model_sha256: None };
        let hand = Hand::of(hello, skin).expect("a hand");
        let told = hand.warnings().iter().map(|warning| {
            assert_eq!(warning.member, "method");
            warning.question.clone()
        });
        (hand.method(), told.collect::<Vec<String>>())
    };
    for hello in [objects(), Hello { shear: Some(true), ..objects() }, rough(0.0)] {
        assert_eq!(with(&hello, true, None), (Some(ContactMethod::Pixels), Vec::new()));
    }
    let gaps = Hello { input: Some(Input::Gaps), objects: None, ..objects() };
    let slippery = Hello { shear: None, ..rough(0.0) };
    for (hello, has_layers, why) in [(&gaps, true, "gaps"), (&slippery, false, "layers")] {
        let (method, warnings) = with(hello, has_layers, Some(&errors));
        assert_eq!((method, warnings.len()), (Some(ContactMethod::SecondOrder), 1), "{why}");
        for said in [why, "second_order", "60 % of SED, 30 % of pressure", "16 % of SED"] {
            assert!(warnings[0].contains(said), "{said}: {}", warnings[0]);
        }
        let (_, unmeasured) = with(hello, has_layers, None);
        assert!(unmeasured[0].contains("nobody measured"), "{unmeasured:?}");
        // Who names a method knows what it is.
        let named = Hello { method: Some(ContactMethod::SecondOrder), ..hello.clone() };
        assert_eq!(with(&named, has_layers, None), (Some(ContactMethod::SecondOrder), Vec::new()));
    }
    let sent = Hello::default();
    assert_eq!(with(&sent, true, None), (None, Vec::new()));
}

#[test]
fn bad_hellos_are_refused_by_member() {
    let plane = Plane::new();
    let open = Mesh { vertices_mm: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 2]; 4] };
    let open = AnnouncedObject { shape: AnnouncedShape::Mesh(open), ..ball(1.0) };
    let soft = AnnouncedObject { stiffness_mpa_per_mm: Some(-1.0), ..ball(1.0) };
    let thin = AnnouncedFinger { width: 0.0, ..AnnouncedFinger::default() };
    let with = |objects_: Vec<AnnouncedObject>| Hello { objects: Some(objects_), ..objects() };
    let cases = [
        (Hello { objects: None, ..objects() }, "objects"),
        (with(Vec::new()), "objects"),
        (with(vec![ball(1.0); 17]), "objects"),
        (with(vec![ball(1.0), ball(0.0)]), "objects[1].shape"),
        (with(vec![open]), "objects[0].shape"),
        (with(vec![soft]), "objects[0].stiffness_mpa_per_mm"),
        (rough(-0.1), "objects[0].friction"),
        (rough(f64::NAN), "objects[0].friction"),
        (rough(11.0), "objects[0].friction"),
        (Hello { method: Some(ContactMethod::Springs), ..rough(0.5) }, "method"),
        (Hello { input: None, objects: None, ..rough(0.5) }, "shear"),
        (
            Hello { displacement: Some(true), input: None, objects: None, ..objects() },
            "displacement",
        ),
        (
            Hello { displacement: Some(true), method: Some(ContactMethod::Springs), ..objects() },
            "method",
        ),
        (Hello { fingers: Some(Vec::new()), ..objects() }, "fingers"),
        (Hello { fingers: Some(vec![AnnouncedFinger::default(); 11]), ..objects() }, "fingers"),
        (Hello { fingers: Some(vec![thin]), ..objects() }, "fingers[0].width"),
        (Hello { sample_type: SampleType::U8, ..objects() }, "sample_type"),
        (Hello { input_layout: Some(SampleLayout::Map), ..objects() }, "input_layout"),
        (Hello { input: None, ..objects() }, "objects"),
        (
            Hello {
                input: Some(Input::Gaps),
                objects: None,
                method: Some(ContactMethod::Pixels),
                ..objects()
            },
            "method",
        ),
        (Hello { input: None, objects: None, stiffness: Some(true), ..objects() }, "stiffness"),
    ];
    for (hello, field) in cases {
        let problem = plane.hand(&hello).map(|_| ()).expect_err(field);
        assert_eq!((problem.code, problem.field.as_deref()), (ErrorCode::BadContact, Some(field)));
    }
}

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

#[test]
fn lengths_in_metres_are_asked_about() {
    let plane = Plane::new();
    let asked = |shape: &str| {
        let shape: AnnouncedShape =
            papilla_proto::json::read_bounded(shape.as_bytes()).expect("a shape");
        let object = AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction: None };
        let hello = Hello { objects: Some(vec![object]), ..objects() };
        let hand = plane.hand(&hello).expect("a hand");
        let of_shape = hand.warnings().iter().find(|w| w.member.starts_with("objects"));
        of_shape.map(|w| (w.member.clone(), w.value.expect("a size"), w.question.clone()))
    };
    let tetrahedron = |size: f64| {
        format!(
            r#"{{"shape":"mesh","vertices_mm":[[0,0,0],[{size},0,0],[0,{size},0],[0,0,{size}]],
                "triangles":[[0,2,1],[0,1,3],[0,3,2],[1,2,3]]}}"#
        )
    };
    let map = |pixel: f64, height: f64| {
        format!(
            r#"{{"shape":"heightmap","columns":2,"pixel_mm":[{pixel},{pixel}],
                "heights_mm":[0,{height},0,0]}}"#
        )
    };
    let ball = |radius: f64| format!(r#"{{"shape":"sphere","radius_mm":{radius}}}"#);
    let union =
        |radius: f64| format!(r#"{{"shape":"union","parts":[{{"part":{}}}]}}"#, ball(radius));
    for (shape, member, value) in [
        (ball(0.01), "objects[0].shape.radius_mm", 0.02),
        (tetrahedron(0.02), "objects[0].shape.vertices_mm", 0.02),
        (map(1e-4, 1e-5), "objects[0].shape.pixel_mm", 2e-4),
        (map(1.0, 1e-4), "objects[0].shape.heights_mm", 1e-4),
        (union(0.01), "objects[0].shape.parts", 0.02),
    ] {
        let (found, size, question) = asked(&shape).expect("a question");
        assert_eq!(found, member);
        assert!((size - value).abs() < 1e-12, "{size} of {member}");
        assert!(question.contains("was m meant?"), "{question}");
    }
    for shape in [ball(0.3), tetrahedron(5.0), map(1.0, 0.05), map(1.0, 0.0), union(3.0)] {
        assert_eq!(asked(&shape), None, "{shape}");
    }
}

#[test]
fn shapes_that_are_slow_together_are_refused_with_the_figure() {
    let plane = Plane::new();
    let dots = r#"{"part":{"shape":"dots","count":[40,40],"plate_mm":[99,99]}}"#;
    let parts = |count: usize| vec![dots; count].join(",");
    let objects = |objects: usize, count: usize| {
        let text = format!(r#"{{"shape":"union","parts":[{}]}}"#, parts(count));
        let shape: AnnouncedShape =
            papilla_proto::json::read_bounded(text.as_bytes()).expect("a shape");
        let object = AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction: None };
        plane.hand(&Hello { objects: Some(vec![object; objects]), ..self::objects() })
    };
    let problem = objects(16, 64).map(|_| ()).expect_err("some tenths of a second a frame");
    assert_eq!(problem.code, ErrorCode::BadContact);
    assert_eq!(problem.field.as_deref(), Some("objects[15].shape"));
    assert!(problem.message.contains("512 at most"), "{}", problem.message);
    assert!(objects(16, 3).is_ok());
}

#[test]
fn a_hello_that_nobody_waits_for_is_not_worked_out() {
    let plane = Plane::new();
    let Plane { atlas, raster, model, pixels, interface } = &plane;
    let (model, pixels, interface) = (Some(model), Some(pixels), Some(interface));
    let skin = Skin { atlas, raster, model, pixels, interface, errors: None, model_sha256: None };
    let shape = AnnouncedShape::Mesh(Mesh {
        vertices_mm: vec![[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    });
    let object = AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction: None };
    let hello = Hello { objects: Some(vec![object]), ..objects() };
    assert!(Hand::of_until(&hello, skin, &|| true).is_ok());
    let problem = Hand::of_until(&hello, skin, &|| false).map(|_| ()).expect_err("stopped");
    assert!(problem.message.contains("nobody waits"), "{}", problem.message);
}
