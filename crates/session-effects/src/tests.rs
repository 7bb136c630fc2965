//! The effects together: what is asked for is there, where it is said to be, and nothing else.

use papilla_proto::{
    MAP_SIDE_PX, Summary,
    atlas::{Atlas, Patch, PatchVertices, Raster},
    effects::{
        Actuator, Afferents as AfferentParameters, ContactWindow, Layout, Place, PronyTerm,
        Relaxation as RelaxationParameters,
    },
    spikes::Spikes as SpikeParameters,
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
    Hello { effects, ..Hello::default() }
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
    let mut bytes = BytesMut::zeroed(HEADER_LEN);
    let written = effects.write(&map, &map, 0, &mut bytes).unwrap();
    assert_eq!(written.window, Window { x: 99, y: 99, width: 4, height: 3 });
    assert_eq!(bytes.len(), 144 + 48);
    let summary = Summary::decode(&bytes[48..]).unwrap();
    assert!((summary.sed_max_j_per_m3 - 9.0).abs() < 1e-6);
    assert_eq!(floats(&bytes[112..120]), [7.0, 9.0]);
    assert_eq!(floats(&bytes[128..140]), [7.0; 3]);
    let window = [0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(floats(&bytes[144..]), window);
}

/// Sums of finite numbers may not be finite; nothing of such an answer is sent.
#[test]
fn no_answer_holds_a_number_that_is_none() {
    let pressure = vec![1.0; MAP_LEN];
    for (names, sed, section) in [
        (&[][..], f32::NAN, None),
        (&["summary"], f32::NAN, None),
        (&["summary"], f32::INFINITY, None),
        (&["summary"], 5e36, Some(SectionName::Summary)),
        (&["afferents"], f32::NAN, None),
    ] {
        for sample_type in SampleType::ALL {
            let answer_sample_type = Some(sample_type);
            let wish = Hello { map: Some(true), answer_sample_type, ..hello(names) };
            let wish = Hello { answer_layout: Some(SampleLayout::Vertices), ..wish };
            let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
            let mut bytes = BytesMut::zeroed(HEADER_LEN);
            let error = effects.write(&pressure, &vec![sed; MAP_LEN], 0, &mut bytes).unwrap_err();
            match (error, section) {
                (WriteError::Samples(SampleError::NotFinite { index: 0, .. }), None) => {}
                (WriteError::NotFinite { section: found, .. }, Some(due)) => assert_eq!(found, due),
                (error, _) => panic!("{names:?} {sed} {sample_type:?}: {error}"),
            }
            // The next frame is none the worse.
            let mut bytes = BytesMut::zeroed(HEADER_LEN);
            effects.write(&pressure, &vec![5.0; MAP_LEN], 11_111, &mut bytes).unwrap();
        }
    }
}

#[test]
fn no_map_is_no_map() {
    let wish = Hello { map: Some(false), ..hello(&["summary"]) };
    let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
    assert_eq!((effects.sections.len(), effects.size_hint()), (1, 112));
    let map = vec![1.0; MAP_LEN];
    let mut bytes = BytesMut::zeroed(HEADER_LEN);
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
        let mut bytes = BytesMut::zeroed(HEADER_LEN);
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

/// Values at sections, by name.
fn section(effects: &Effects, bytes: &[u8], name: SectionName) -> Vec<f32> {
    let section = effects.sections.iter().find(|section| section.name == name).unwrap();
    floats(&bytes[section.offset as usize..][..section.bytes as usize])
}

/// Map and points stay SED; rates come beside them, with a scale of their own.
#[test]
fn afferents_add_rates_and_change_no_sed() {
    let wish = Hello {
        points: Some(vec![Place::Px([100.5, 100.5])]),
        actuators: Some(Layout { input: ActuatorInput::Sa1Rate, ..display() }),
        answer_sample_type: Some(SampleType::U16),
        contact_window: Some(ContactWindow { margin_px: 1 }),
        ..hello(&["afferents", "points", "actuators", "summary", "contact_window"])
    };
    let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
    // 20 kPa at 80 kPa: 12 Hz.
    let map = vec![2500.0; MAP_LEN];
    let mut bytes = BytesMut::zeroed(HEADER_LEN);
    let written = effects.write(&map, &map, 0, &mut bytes).unwrap();
    assert_eq!(section(&effects, &bytes, SectionName::Points), [2500.0]);
    let rates = section(&effects, &bytes, SectionName::PointRates);
    let values = [rates, section(&effects, &bytes, SectionName::Actuators)].concat();
    assert!(values.len() == 4 && values.iter().all(|hz| (hz - 12.0).abs() < 1e-3), "{values:?}");
    let [rates, map] = [SectionName::Rates, SectionName::Map].map(|name| {
        let section = effects.sections.iter().find(|section| section.name == name).unwrap();
        &bytes[section.offset as usize..][..section.bytes as usize]
    });
    let scale = f32::from_le_bytes(rates[..4].try_into().unwrap());
    let mut found = vec![0.0; MAP_LEN];
    SampleType::U16.decode(&rates[RATES_HEAD_LEN..], scale, &mut found).unwrap();
    assert!(found.iter().all(|hz| (hz - 12.0).abs() < 1e-3), "{scale}");
    SampleType::U16.decode(map, written.scale, &mut found).unwrap();
    assert!(found.iter().all(|sed| (sed - 2500.0).abs() < 0.1));
    let summary = Summary::decode(&bytes[48..]).unwrap();
    assert!((summary.sa1_rate_hz / (324.0 * 0.7 * 12.0) - 1.0).abs() < 1e-3);
    assert!((summary.sed_max_j_per_m3 - 2500.0).abs() < 1e-3, "the summary is of SED");
}

/// Who wants no map of rates says so, and who wants no map gets neither.
#[test]
fn rates_may_be_had_without_their_map() {
    let names = |wish: Hello| {
        let effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
        effects.sections.iter().map(|section| section.name).collect::<Vec<_>>()
    };
    let summary = || hello(&["afferents", "summary"]);
    let without = AfferentParameters { map: false, ..Default::default() };
    let of_summary = Hello { afferents: Some(without), ..summary() };
    assert_eq!(names(of_summary), [SectionName::Summary, SectionName::Map]);
    assert_eq!(names(Hello { map: Some(false), ..summary() }), [SectionName::Summary]);
    let all = [SectionName::Summary, SectionName::Rates, SectionName::Map];
    assert_eq!(names(summary()), all);
    let by_vertices = Hello { answer_layout: Some(SampleLayout::Vertices), ..summary() };
    let all = [SectionName::Summary, SectionName::Rates, SectionName::Vertices];
    assert_eq!(names(by_vertices), all);
}

/// A press that goes in and is held, frame by frame every 11.1 ms, by a clock that is rounded down.
fn press_by_a_clock(effects: &mut Effects, tick_us: f64) -> (f64, u32, u32) {
    let (mut hz_s, mut coarse, mut fired) = (0.0, 0, 0);
    for frame in 0..180_u32 {
        let true_us = 5e6 + 11_111.0 * f64::from(frame);
        let stamp_us = ((true_us / tick_us).floor() * tick_us) as u64;
        // Air, then in and out twice a second.
        let phase = (f64::from(frame) - 30.0).max(0.0) * 11_111e-6 * std::f64::consts::TAU * 2.0;
        let depth = (0.5 * (1.0 - phase.cos())) as f32;
        let mut pressure_pa = vec![0.0; MAP_LEN];
        let mut sed = vec![0.0; MAP_LEN];
        for row in 95..125 {
            pressure_pa[row * MAP_SIDE_PX + 95..][..30].fill(2e4 * depth);
            sed[row * MAP_SIDE_PX + 95..][..30].fill(2e4 * depth * depth);
        }
        let time_us = effects.time_us(stamp_us);
        coarse += u32::from(effects.clock_flags() != 0);
        effects.before(&mut pressure_pa, time_us);
        let mut bytes = BytesMut::zeroed(HEADER_LEN);
        effects.write(&pressure_pa, &sed, time_us, &mut bytes).unwrap();
        hz_s += f64::from(section(effects, &bytes, SectionName::PointRates)[0]) * 11_111e-6;
        let spikes = effects.sections.iter().find(|s| s.name == SectionName::Spikes).unwrap();
        fired = u32::from_le_bytes(bytes[spikes.offset as usize..][..4].try_into().unwrap());
    }
    (hz_s, fired, coarse)
}

/// Browsers' clocks tick by 1 to 100 ms: rates and counts of spikes stay within a tenth, or the
/// answer says that its clock is too coarse.
#[test]
fn a_coarse_clock_changes_rates_and_spikes_by_a_tenth_at_most_or_is_told() {
    let wish = Hello {
        map: Some(false),
        points: Some(vec![Place::Px([110.5, 110.5])]),
        spikes: Some(SpikeParameters { spikes_max: 4096, ..Default::default() }),
        ..hello(&["afferents", "points", "spikes", "relaxation"])
    };
    let run = |tick_us: f64| {
        let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
        press_by_a_clock(&mut effects, tick_us)
    };
    let (hz_s, fired, coarse) = run(1.0);
    assert!(hz_s > 10.0 && fired > 300 && coarse == 0, "{hz_s} {fired} {coarse}");
    for tick_us in [1000.0, 4000.0, 16_666.7] {
        let (found_hz_s, found, coarse) = run(tick_us);
        assert!((found_hz_s / hz_s - 1.0).abs() < 0.1, "{tick_us}: {found_hz_s}, not {hz_s}");
        let share = f64::from(found) / f64::from(fired);
        assert!((share - 1.0).abs() < 0.1, "{tick_us}: {found} spikes, not {fired}");
        assert_eq!(coarse, 0, "{tick_us}");
    }
    let (_, _, coarse) = run(100_000.0);
    assert!(coarse > 160, "{coarse}");
}

/// Tracking that is lost under a held press: nothing is shown meanwhile, and nothing bursts when it
/// comes back, be it at once elsewhere.
#[test]
fn lost_tracking_is_silent_and_forgets_nothing() {
    let wish = Hello {
        map: Some(false),
        points: Some(vec![Place::Px([110.5, 110.5])]),
        spikes: Some(SpikeParameters { spikes_max: 4096, ..Default::default() }),
        ..hello(&["afferents", "points", "spikes", "relaxation", "summary"])
    };
    let mut effects = Effects::of(&wish, Owned::plane().finger()).unwrap().unwrap();
    let mut peak_pa = 0.0;
    let mut frame = |effects: &mut Effects, ms: u64, tracked_pa: Option<f32>| {
        let mut pressure_pa = vec![0.0; MAP_LEN];
        let mut sed = vec![0.0; MAP_LEN];
        let time_us = 1000 * ms;
        if let Some(pa) = tracked_pa {
            for row in 80..140 {
                pressure_pa[row * MAP_SIDE_PX + 80..][..60].fill(pa);
                sed[row * MAP_SIDE_PX + 80..][..60].fill(1e-4 * pa * pa);
            }
            let time_us = effects.time_us(time_us);
            peak_pa = effects.before(&mut pressure_pa, time_us).unwrap();
        } else {
            effects.lose();
        }
        let mut bytes = BytesMut::zeroed(HEADER_LEN);
        effects.write(&pressure_pa, &sed, time_us, &mut bytes).unwrap();
        let hz = section(effects, &bytes, SectionName::PointRates)[0];
        let at = effects.sections.iter().find(|s| s.name == SectionName::Spikes).unwrap().offset;
        let here = u32::from_le_bytes(bytes[at as usize + 4..][..4].try_into().unwrap());
        let summary = Summary::decode(&bytes[HEADER_LEN..]).unwrap();
        (hz, here, summary.force_n, peak_pa)
    };
    for ms in (0..1000).step_by(10) {
        frame(&mut effects, ms, Some(1e4));
    }
    let (steady_hz, _, force_n, crept_pa) = frame(&mut effects, 1000, Some(1e4));
    for ms in (1010..1500).step_by(10) {
        let (hz, spikes, force_n, _) = frame(&mut effects, ms, None);
        assert_eq!((hz.to_bits(), spikes, force_n.to_bits()), (0, 0, 0), "at {ms} ms");
    }
    let (hz, spikes, found_n, found_pa) = frame(&mut effects, 1500, Some(1e4));
    assert!((hz - steady_hz).abs() < 0.05 * steady_hz && spikes == 0, "{hz} Hz, {spikes} spikes");
    assert!((found_n - force_n).abs() < 1e-3 * force_n);
    assert!((found_pa - crept_pa).abs() < 1e-3 * crept_pa, "{found_pa}, not {crept_pa}");
    let (_, held, ..) = frame(&mut effects, 1510, Some(1e4));
    frame(&mut effects, 1520, None);
    // Three times as much: unfelt, since nobody saw it come.
    let (_, spikes, ..) = frame(&mut effects, 1530, Some(3e4));
    assert_eq!(spikes, 0, "{held} while it was held");
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
                e_ref_kpa, theta_kpa, k_s_hz_per_kpa, k_d_hz_s_per_kpa, map: true,
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
            let mut bytes = BytesMut::zeroed(HEADER_LEN);
            effects.write(&map, &sed, time_us, &mut bytes).unwrap();
            let found = floats(&bytes[HEADER_LEN..]);
            prop_assert!(found.iter().all(|v| v.is_finite()), "{:?}", &found[..24]);
        }
    }
}
