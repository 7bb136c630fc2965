//! Messages and summaries with every member there is: what is written is read back.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use papilla_proto::contact::{
    AnnouncedFinger, AnnouncedObject, ContactMethod, Input, MethodError, SampleLayout, Spread,
};
use papilla_proto::sdf::{AnnouncedShape, Mesh, Sphere};
use papilla_proto::spikes::{PlacedUnit, UnitClass};
use papilla_proto::{
    ClientMessage, FingerTerms, Hello, Ready, Resumption, RuntimeEffect, SUMMARY_LEN, SampleType,
    ServerMessage, Summary, Warning,
    effects::{
        Actuator, ActuatorInput, Afferents, ContactWindow, Drive, Layout, Moduli, OutOfRange,
        Place, PronyTerm, Relaxation, Section, SectionName, Tissue,
    },
};
use proptest::prelude::*;

fn number() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0), Just(-0.0), Just(1e-40), Just(f32::MAX), -1e6_f32..1e6]
}

fn place() -> impl Strategy<Value = Place> {
    prop_oneof![
        prop::array::uniform2(number()).prop_map(Place::Px),
        prop::array::uniform3(number()).prop_map(Place::Mm),
    ]
}

fn layout() -> impl Strategy<Value = Layout> {
    let own = || prop::option::of(number());
    let actuator = (place(), own(), own(), own())
        .prop_map(|(at, radius_mm, gain, threshold)| Actuator { at, radius_mm, gain, threshold });
    let input = prop::sample::select(vec![ActuatorInput::Sed, ActuatorInput::Sa1Rate]);
    let drive = prop::sample::select(vec![Drive::Formula, Drive::Fitted, Drive::Corrected]);
    (prop::collection::vec(actuator, 0..4), input, drive, own(), own(), number(), number())
        .prop_map(|(actuators, input, drive, radius_mm, gain, threshold, max)| Layout {
            actuators,
            input,
            drive,
            radius_mm,
            gain,
            threshold,
            max,
        })
}

fn relaxation() -> impl Strategy<Value = Relaxation> {
    let term = (any::<f64>(), any::<f64>())
        .prop_filter("JSON has no word for them", |(g, tau_s)| g.is_finite() && tau_s.is_finite());
    let term = term.prop_map(|(g, tau_s)| PronyTerm { g, tau_s });
    (
        prop::option::of(prop::collection::vec(term, 0..7)),
        prop::sample::select(vec![Tissue::Skin, Tissue::Subcutaneous]),
        prop::sample::select(vec![Moduli::Instantaneous, Moduli::LongTerm]),
    )
        .prop_map(|(prony, tissue, moduli)| Relaxation { tissue, prony, moduli })
}

fn hello() -> impl Strategy<Value = Hello> {
    let old = (
        any::<u32>(),
        prop::collection::vec(".{0,12}", 0..4),
        any::<Option<u32>>(),
        prop::option::of(".{0,20}"),
        prop::sample::select(SampleType::ALL.to_vec()),
        prop::option::of(number()),
        prop::option::of("[0-9a-f]{64}"),
    );
    let new = (
        prop::option::of(prop::sample::select(SampleType::ALL.to_vec())),
        any::<Option<bool>>(),
        prop::option::of(number()),
        prop::option::of(prop::sample::select(vec![
            OutOfRange::Refuse,
            OutOfRange::Flag,
            OutOfRange::Clamp,
        ])),
        any::<Option<u32>>(),
        prop::option::of(any::<u16>().prop_map(|margin_px| ContactWindow { margin_px })),
        prop::option::of(prop::collection::vec(place(), 0..5)),
        prop::option::of(layout()),
        prop::option::of(prop::array::uniform4(number())),
        prop::option::of(relaxation()),
    );
    (old, new, contact()).prop_map(|(old, new, contact)| Hello {
        version: old.0,
        effects: old.1,
        budget_us: old.2,
        tier: old.3,
        sample_type: old.4,
        pressure_scale_pa: old.5,
        atlas_hash: old.6,
        answer_sample_type: new.0,
        map: new.1,
        contact_pa: new.2,
        out_of_range: new.3,
        stale_after_us: new.4,
        contact_window: new.5,
        points: new.6,
        actuators: new.7,
        afferents: new.8.map(|[e_ref_kpa, theta_kpa, k_s_hz_per_kpa, k_d_hz_s_per_kpa]| {
            Afferents {
                e_ref_kpa,
                theta_kpa,
                k_s_hz_per_kpa,
                k_d_hz_s_per_kpa,
                map: theta_kpa > 1.0,
            }
        }),
        relaxation: new.9,
        ..contact
    })
}

/// The members of contact.
fn contact() -> impl Strategy<Value = Hello> {
    let layout =
        || prop::option::of(prop::sample::select(vec![SampleLayout::Map, SampleLayout::Vertices]));
    let shape = prop_oneof![
        (0.1..9.0f64).prop_map(|radius_mm| AnnouncedShape::Sphere(Sphere { radius_mm })),
        prop::collection::vec(prop::array::uniform3(-9.0..9.0f64), 0..4).prop_map(|vertices_mm| {
            AnnouncedShape::Mesh(Mesh { vertices_mm, triangles: vec![[0, 1, 2]] })
        }),
    ];
    let object = (shape, prop::option::of(0.1..9.0f64), prop::option::of(0.0..2.0f64)).prop_map(
        |(shape, stiffness_mpa_per_mm, friction)| AnnouncedObject {
            shape,
            stiffness_mpa_per_mm,
            friction,
        },
    );
    let finger = (prop::option::of("[a-z]{1,8}"), 0.5..2.0f64, 0.5..2.0f64)
        .prop_map(|(name, width, stiffness)| AnnouncedFinger { name, width, stiffness });
    let inputs = vec![Input::Pressure, Input::Gaps, Input::Objects];
    let methods = vec![
        ContactMethod::Springs,
        ContactMethod::SmallStrain,
        ContactMethod::SecondOrder,
        ContactMethod::Pixels,
        ContactMethod::CoarsePixels,
    ];
    (
        prop::option::of(prop::sample::select(inputs)),
        (layout(), layout(), layout()),
        prop::option::of(prop::collection::vec(object, 0..3)),
        prop::option::of(prop::collection::vec(finger, 0..3)),
        prop::option::of(prop::sample::select(methods)),
        any::<(Option<bool>, Option<bool>, Option<bool>)>(),
    )
        .prop_map(|(input, layouts, objects, fingers, method, asked)| Hello {
            input,
            input_layout: layouts.0,
            answer_layout: layouts.1,
            pressure: layouts.2,
            objects,
            fingers,
            method,
            force_target: asked.0,
            error_estimate: asked.1,
            stiffness: asked.1,
            shear: asked.2,
            displacement: asked.2.map(|on| !on),
            ..Hello::default()
        })
}

proptest! {
    #[test]
    fn hellos_with_every_member_come_back(hello in hello()) {
        let message = ClientMessage::Hello(hello);
        let text = serde_json::to_string(&message).unwrap();
        prop_assert_eq!(serde_json::from_str::<ClientMessage>(&text).unwrap(), message);
    }

    #[test]
    fn readies_come_back(
        names in prop::collection::vec(".{0,12}", 3),
        numbers in any::<(u64, u64, Option<u32>, Option<bool>, Option<u16>)>(),
        tier_number in any::<u16>(),
        scales in (number(), number()),
        effects in prop::sample::subsequence(RuntimeEffect::ALL.to_vec(), 0..=8),
        offset in any::<u32>(),
    ) {
        let section = Section { name: SectionName::Points, offset, bytes: 8 };
        let message = ServerMessage::Ready(Box::new(Ready {
            version: 3,
            session: numbers.0,
            tier: names[0].clone(),
            effects: vec![names[1].clone()],
            atlas_hash: names[2].clone(),
            predicted_latency_us: numbers.1,
            budget_us: numbers.2,
            meets_budget: numbers.3,
            width: 224,
            height: 224,
            sample_type: SampleType::U8,
            pressure_max_pa: scales.0,
            sed_scale_j_per_m3: scales.1,
            tier_number,
            tier_names: numbers.3.map(|_| names.clone()),
            answer_sample_type: SampleType::F16,
            session_effects: effects,
            sections: vec![section],
            units: numbers.4.map(|model| {
                let model = model as u8;
                vec![PlacedUnit { class: UnitClass::Ra, model, px: [scales.0, 0.5] }]
            }),
            state: numbers.2.map(|_| Resumption::OtherTerms),
            vertices: offset,
            fingers: tier_number.into(),
            finger_terms: numbers.3.map(|_| {
                vec![FingerTerms {
                    name: names[0].clone(),
                    tier: names[1].clone(),
                    tier_number,
                    trained_on: numbers.2.map(|_| names[2].clone()),
                    atlas_hash: names[2].clone(),
                    vertices: offset,
                    pressure_max_pa: scales.0,
                    sed_scale_j_per_m3: scales.1,
                    predicted_latency_us: numbers.1,
                    method: numbers.2.map(|_| ContactMethod::Springs),
                    expected_error: None,
                    units: numbers.4.map(|_| Vec::new()),
                }]
            }),
            contact_us: Some(numbers.1),
            method: numbers.3.map(|_| ContactMethod::Pixels),
            expected_error: numbers.2.map(|states| {
                let spread = Spread { median: scales.0.into(), p95: scales.1.into() };
                MethodError {
                    set: names[0].clone(),
                    states,
                    pressure_relative_l2: spread,
                    force_relative: spread,
                    sed_relative_l2: numbers.4.map(|_| spread),
                }
            }),
            warnings: names[..numbers.4.map_or(0, |_| 2)]
                .iter()
                .map(|name| Warning {
                    member: name.clone(),
                    value: numbers.2.map(f64::from),
                    question: names[0].clone(),
                })
                .collect(),
        }));
        let text = serde_json::to_string(&message).unwrap();
        prop_assert_eq!(serde_json::from_str::<ServerMessage>(&text).unwrap(), message);
    }

    #[test]
    fn summaries_come_back_bit_for_bit(bytes in prop::collection::vec(any::<u8>(), 0..100)) {
        match Summary::decode(&bytes) {
            Some(summary) => prop_assert_eq!(&summary.encode()[..], &bytes[..SUMMARY_LEN]),
            None => prop_assert!(bytes.len() < SUMMARY_LEN),
        }
    }
}
