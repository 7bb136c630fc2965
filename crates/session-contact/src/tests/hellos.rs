//! Which method a hello gets, and what of it is asked about or refused.

use super::*;

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
