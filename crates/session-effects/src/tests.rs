//! The effects together: what is asked for is there, where it is said to be, and nothing else.

use papilla_proto::{
    MAP_SIDE_PX, Summary,
    atlas::{Atlas, Patch, PatchVertices, Raster},
    effects::{
        Actuator, Afferents as AfferentParameters, ContactWindow, Layout, Place, PronyTerm,
        Relaxation as RelaxationParameters,
    },
};
use proptest::prelude::*;

use super::*;

/// A plane patch, 0.1 mm a pixel, from pixel 20 to 200 both ways: x = 0.1 v, y = -0.1 u, z = -0.5.
fn plane_atlas() -> Atlas {
    let uv_px = vec![[20.0, 20.0], [200.0, 20.0], [200.0, 200.0], [20.0, 200.0]];
    let place = |&[u, v]: &[f32; 2]| [0.1 * v, -0.1 * u, -0.5];
    let patch =
        PatchVertices { positions_mm: uv_px.iter().map(place).collect(), uv_px: uv_px.clone() };
    Atlas::new(0.1, vec![[0, 2, 1], [0, 3, 2]], patch.clone(), patch).unwrap()
}

pub(super) fn plane() -> Geometry {
    let Owned { atlas, skin, interface, .. } = Owned::plane();
    Geometry::new(&atlas, &skin, &interface)
}

/// A finger of its own.
pub(super) struct Owned {
    atlas: Atlas,
    skin: Raster,
    interface: Raster,
    shared: Shared,
}

impl Owned {
    pub(super) fn plane() -> Self {
        let atlas = plane_atlas();
        let [skin, interface] = Patch::ALL.map(|patch| Raster::new(&atlas, patch));
        Self { atlas, skin, interface, shared: Shared::default() }
    }

    pub(super) fn finger(&self) -> Finger<'_> {
        let Self { atlas, skin, interface, shared } = self;
        Finger { atlas, skin, interface, shared }
    }
}

fn hello(effects: &[&str]) -> Hello {
    let effects = effects.iter().map(|&name| name.to_owned()).collect();
    Hello { version: 2, effects, ..Hello::default() }
}

fn display() -> Layout {
    let at = Place::Px([100.5, 100.5]);
    Layout {
        actuators: vec![Actuator { at, radius_mm: None, gain: None, threshold: None }; 3],
        input: ActuatorInput::Sed,
        drive: Drive::Formula,
        radius_mm: Some(0.0),
        gain: Some(1.0),
        threshold: 0.0,
        max: 1e9,
    }
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn areas_are_those_of_the_finger() {
    let geometry = plane();
    let inside = geometry.skin_mm2.iter().filter(|a| **a > 0.0);
    assert!(inside.clone().all(|a| (a - 0.01).abs() < 1e-6));
    assert_eq!(inside.count(), 180 * 180);
    assert!((geometry.interface_sum_mm2 - 324.0).abs() < 1e-3);
}

#[test]
fn a_bare_map_has_no_effects_and_costs_nothing() {
    let plane = Owned::plane();
    assert!(Effects::of(&hello(&["layers"]), plane.finger()).unwrap().is_none());
    let hello = Hello { map: Some(true), ..hello(&[]) };
    assert!(Effects::of(&hello, plane.finger()).unwrap().is_none());
    assert!(plane.shared.geometry.get().is_none(), "nobody asked for areas");
}

#[test]
fn sections_lie_where_they_are_said_to_be() {
    let plane = Owned::plane();
    let wish = Hello {
        points: Some(vec![Place::Px([100.5, 100.5]), Place::Px([101.5, 100.5])]),
        actuators: Some(display()),
        contact_window: Some(ContactWindow { margin_px: 1 }),
        ..hello(&["contact_window", "summary", "points", "actuators"])
    };
    let mut effects = Effects::of(&wish, plane.finger()).unwrap().unwrap();
    let found: Vec<_> = effects.sections.iter().map(|s| (s.name, s.offset, s.bytes)).collect();
    let due = [
        (SectionName::Summary, 48, 64),
        (SectionName::Points, 112, 8),
        (SectionName::Actuators, 128, 12),
        (SectionName::Map, 144, 200_704),
    ];
    assert_eq!(found, due);
    assert_eq!(effects.size_hint(), 144 + 200_704);
    let mut map = vec![0.0; MAP_LEN];
    map[100 * MAP_SIDE_PX + 100] = 7.0;
    map[100 * MAP_SIDE_PX + 101] = 9.0;
    let mut bytes = BytesMut::zeroed(HEADER_LEN_V2);
    let written = effects.write(&map, &map, 0, &mut bytes).unwrap();
    assert_eq!(written.window, Window { x: 99, y: 99, width: 4, height: 3 });
    assert_eq!((written.kind, bytes.len()), (FrameKind::Sed, 144 + 48));
    let summary = Summary::decode(&bytes[48..]).unwrap();
    assert!((summary.sed_max_j_per_m3 - 9.0).abs() < 1e-6);
    assert_eq!(floats(&bytes[112..120]), [7.0, 9.0]);
    assert_eq!(floats(&bytes[128..140]), [7.0; 3]);
    let window = [0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(floats(&bytes[144..]), window);
}

#[test]
fn no_map_is_no_map() {
    let wish = Hello { map: Some(false), ..hello(&["summary"]) };
    let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
    assert_eq!((effects.sections.len(), effects.size_hint()), (1, 112));
    let map = vec![1.0; MAP_LEN];
    let mut bytes = BytesMut::zeroed(HEADER_LEN_V2);
    let written = effects.write(&map, &map, 0, &mut bytes).unwrap();
    assert_eq!((written.window, bytes.len()), (Window::EMPTY, 112));
}

#[test]
fn relaxation_changes_what_the_network_is_asked_and_not_what_is_touched() {
    let wish = hello(&["relaxation", "summary", "contact_window"]);
    let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
    let press = |effects: &mut Effects, pa: f32, time_us| {
        let mut map = vec![0.0; MAP_LEN];
        map[100 * MAP_SIDE_PX + 100] = pa;
        let peak_pa = effects.before(&mut map, time_us).unwrap();
        let mut bytes = BytesMut::zeroed(HEADER_LEN_V2);
        let window = effects.write(&map, &map, time_us, &mut bytes).unwrap().window;
        (peak_pa, Summary::decode(&bytes[48..]).unwrap().pressure_max_pa, window.pixel_count())
    };
    let (at_once, sent, _) = press(&mut effects, 1000.0, 0);
    assert!((at_once - 1000.0).abs() < 0.1 && (sent - 1000.0).abs() < 1e-3);
    let (later, sent, pixels) = press(&mut effects, 1000.0, 600_000_000);
    assert!((later - 1000.0 / 0.7).abs() < 1.0 && (sent - 1000.0).abs() < 1e-3, "{later}");
    assert_eq!(pixels, 49 * 49);
    let (left, sent, pixels) = press(&mut effects, 0.0, 600_000_001);
    assert!(left > 400.0 && sent <= 0.0 && pixels == 0, "{left} {sent} {pixels}");
}

#[test]
fn afferents_show_rates_in_map_points_and_if_asked_actuators() {
    let wish = Hello {
        points: Some(vec![Place::Px([100.5, 100.5])]),
        actuators: Some(Layout { input: ActuatorInput::Sa1Rate, ..display() }),
        answer_sample_type: Some(SampleType::U16),
        ..hello(&["afferents", "points", "actuators", "summary"])
    };
    let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
    // 20 kPa at 80 kPa: 12 Hz.
    let map = vec![2500.0; MAP_LEN];
    let mut bytes = BytesMut::zeroed(HEADER_LEN_V2);
    let written = effects.write(&map, &map, 0, &mut bytes).unwrap();
    assert_eq!(written.kind, FrameKind::Sa1Rate);
    let values = [floats(&bytes[112..116]), floats(&bytes[128..140])].concat();
    assert!(values.iter().all(|hz| (hz - 12.0).abs() < 1e-3), "{values:?}");
    let mut rates = vec![0.0; MAP_LEN];
    SampleType::U16.decode(&bytes[144..], written.scale, &mut rates).unwrap();
    assert!(rates.iter().all(|hz| (hz - 12.0).abs() < 1e-3));
    let summary = Summary::decode(&bytes[48..]).unwrap();
    assert!((summary.sa1_rate_hz / (324.0 * 0.7 * 12.0) - 1.0).abs() < 1e-3);
    assert!((summary.sed_max_j_per_m3 - 2500.0).abs() < 1e-3, "the summary is of SED");
}

#[test]
fn wishes_that_contradict_themselves_are_refused() {
    let plane = Owned::plane();
    let none = || hello(&[]);
    for (wish, field) in [
        (hello(&["points"]), "points"),
        (hello(&["actuators"]), "actuators"),
        (Hello { contact_window: Some(ContactWindow::default()), ..none() }, "contact_window"),
        (Hello { afferents: Some(AfferentParameters::default()), ..none() }, "afferents"),
        (Hello { relaxation: Some(RelaxationParameters::default()), ..none() }, "relaxation"),
        (Hello { map: Some(false), ..hello(&["contact_window"]) }, "contact_window"),
        (Hello { contact_pa: Some(-1.0), ..hello(&["summary"]) }, "contact_pa"),
        (Hello { contact_pa: Some(f32::NAN), ..hello(&["summary"]) }, "contact_pa"),
        (
            Hello {
                actuators: Some(Layout { input: ActuatorInput::Sa1Rate, ..display() }),
                ..hello(&["actuators"])
            },
            "actuators",
        ),
    ] {
        let problem = Effects::of(&wish, plane.finger()).unwrap_err();
        assert_eq!(problem.code, ErrorCode::BadEffect, "{problem}");
        assert_eq!(problem.field.as_deref(), Some(field), "{problem}");
    }
}

#[test]
fn every_effect_has_a_cost() {
    let plane = Owned::plane();
    assert!(plane.shared.costs().is_none());
    measure(plane.finger(), &vec![1.0; MAP_LEN]);
    let costs = plane.shared.costs().unwrap();
    let names: Vec<_> = costs.iter().map(|cost| cost.effect).collect();
    // What traction costs is the session's finger's to tell.
    let here = RuntimeEffect::ALL.into_iter().filter(|e| *e != RuntimeEffect::ShearEnergy);
    assert_eq!(names, here.collect::<Vec<_>>());
    assert!(costs.iter().all(|cost| cost.us.is_finite()), "{costs:?}");
    let window = costs.iter().find(|c| c.effect == RuntimeEffect::ContactWindow).unwrap();
    assert_eq!(plane.shared.cost_us(&[window.effect]), window.us.ceil() as u64);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever a hello asks for and whatever its clock does: refused, or all that is written is
    /// numbers, and creep stays between its limits.
    #[test]
    fn no_parameter_and_no_clock_makes_an_answer_that_is_no_number(
        prony in prop::collection::vec((1e-3_f64..0.6, -7.0_f64..7.0), 1..4),
        rates in prop::collection::vec(-3.0_f32..40.0, 4),
        gain in prop_oneof![0.0_f32..10.0, Just(f32::MAX)],
        times_us in prop::collection::vec(any::<u64>(), 6),
        pressure_pa in prop_oneof![Just(0.0_f32), 1e-40_f32..1e-30, 1.0_f32..5e5],
    ) {
        let terms = prony.iter().map(|&(g, power)| PronyTerm { g, tau_s: 10f64.powf(power) });
        let prony = Some(terms.collect());
        let [e_ref_kpa, theta_kpa, k_s_hz_per_kpa, k_d_hz_s_per_kpa] =
            [0, 1, 2, 3].map(|i| 10f32.powf(rates[i]));
        let wish = Hello {
            relaxation: Some(RelaxationParameters { prony, ..Default::default() }),
            afferents: Some(AfferentParameters {
                e_ref_kpa, theta_kpa, k_s_hz_per_kpa, k_d_hz_s_per_kpa,
            }),
            points: Some(vec![Place::Px([100.5, 100.5])]),
            actuators: Some(Layout { gain: Some(gain), ..display() }),
            ..hello(&["relaxation", "afferents", "points", "actuators", "summary"])
        };
        let Ok(Some(mut effects)) = Effects::of(&wish, Owned::plane().finger()) else { return Ok(()) };
        for time_us in times_us {
            let mut map = vec![pressure_pa; MAP_LEN];
            let peak_pa = effects.before(&mut map, time_us).unwrap();
            prop_assert!((0.0..=100.1 * pressure_pa + 0.1).contains(&peak_pa), "{peak_pa}");
            prop_assert!(map.iter().all(|p| p.is_finite() && *p >= 0.0));
            let sed: Vec<f32> = map.iter().map(|p| p * p).collect();
            let mut bytes = BytesMut::zeroed(HEADER_LEN_V2);
            effects.write(&map, &sed, time_us, &mut bytes).unwrap();
            let found = floats(&bytes[HEADER_LEN_V2..]);
            prop_assert!(found.iter().all(|v| v.is_finite()), "{:?}", &found[..24]);
        }
    }
}
