//! The effect on the plane finger: what is drawn, refused, written and carried on.

use papilla_proto::{
    HEADER_LEN, Hello, MAP_LEN,
    effects::{Place, SectionName},
    spikes::{Fired, Unit as Placed},
};

use super::{super::tests::Owned, *};
use crate::Effects;

fn hello(of: Parameters) -> Hello {
    Hello { effects: vec!["spikes".to_owned()], spikes: Some(of), ..Hello::default() }
}

fn effects(of: Parameters) -> Effects {
    Effects::of(&hello(of), Owned::plane().finger()).unwrap().unwrap()
}

fn refused(of: Parameters) -> String {
    let problem = Effects::of(&hello(of), Owned::plane().finger()).unwrap_err();
    assert_eq!(problem.field.as_deref(), Some("spikes"), "{problem}");
    problem.message
}

/// A round press whose peak goes up and down within 80 ms.
fn press(time_us: u64) -> (Vec<f32>, Vec<f32>) {
    let wave = (time_us as f32 * 1e-6 * std::f32::consts::TAU * 12.5).sin().max(0.0);
    let value = |index: usize| {
        let [x, y] = [index % MAP_SIDE_PX, index / MAP_SIDE_PX].map(|px| px as f32 - 110.0);
        wave * (1.0 - (x * x + y * y) / 900.0).max(0.0)
    };
    let map = |most: f32| (0..MAP_LEN).map(|index| most * value(index)).collect();
    (map(40_000.0), map(20_000.0))
}

fn fired(effects: &mut Effects, time_us: u64) -> Fired {
    let (pressure_pa, sed) = press(time_us);
    let mut bytes = BytesMut::zeroed(HEADER_LEN);
    effects.write(&pressure_pa, &sed, time_us, &mut bytes).unwrap();
    let section = effects.sections()[0];
    assert_eq!(section.name, SectionName::Spikes);
    let part = &bytes[section.offset as usize..][..section.bytes as usize];
    Fired::decode(part, time_us).unwrap()
}

#[test]
fn a_press_fires_units_of_every_class_at_times_of_its_frame() {
    let mut effects = effects(Parameters::default());
    let units = effects.units().unwrap().to_vec();
    // 3.24 cm2.
    let count = |class| units.iter().filter(|unit| unit.class == class).count();
    assert!(count(UnitClass::Sa1).abs_diff(227) <= 1);
    assert!(count(UnitClass::Ra).abs_diff(454) <= 1);
    assert!(count(UnitClass::Pc).abs_diff(68) <= 1);
    let mut heard = std::collections::HashSet::new();
    let mut total = 0;
    for frame in 0..160 {
        let time_us = 1000 * frame;
        let found = fired(&mut effects, time_us);
        total += found.spikes.len() as u32;
        assert_eq!(found.total, total);
        for spike in found.spikes {
            assert!(spike.time_us + 1000 > time_us && spike.time_us <= time_us);
            heard.insert(units[usize::from(spike.unit)].class);
        }
    }
    assert_eq!(heard.len(), 3, "{total} spikes of {heard:?}");
}

#[test]
fn what_gives_no_unit_is_refused() {
    let of = Parameters::default();
    let none = Parameters { sa1_per_cm2: 0.0, ra_per_cm2: 0.0, pc_per_cm2: 0.0, ..of.clone() };
    assert!(refused(none).contains("seed 1 draws no unit"));
    assert!(refused(Parameters { ra_per_cm2: -1.0, ..of.clone() }).contains("-1 ra units"));
    assert!(refused(Parameters { pc_per_cm2: 1e5, ..of.clone() }).contains("4096 at most"));
    assert!(refused(Parameters { e_ref_kpa: f32::NAN, ..of.clone() }).contains("e_ref_kpa"));
    for spikes_max in [0, SPIKES_MAX + 1] {
        assert!(refused(Parameters { spikes_max, ..of.clone() }).contains("spikes_max"));
    }
    let unit = Placed { class: UnitClass::Ra, at: Place::Px([100.5, 100.5]), model: 0 };
    let with = |units| Parameters { units: Some(units), ..of.clone() };
    assert!(refused(with(Vec::new())).contains("0 units"));
    for at in [Place::Px([5.0, 5.0]), Place::Mm([0.0, 0.0, 30.0]), Place::Px([f32::NAN, 1.0])] {
        let message = refused(with(vec![unit, Placed { at, ..unit }]));
        assert!(message.contains("unit 1") && message.contains("off the interface"), "{message}");
    }
    assert!(refused(with(vec![Placed { model: 9, ..unit }])).contains("ra units have 9"));
}

#[test]
fn units_that_are_placed_are_numbered_as_they_were_named() {
    let unit = |class, px: [f32; 2]| Placed { class, at: Place::Px(px), model: 1 };
    let units = vec![
        unit(UnitClass::Pc, [30.5, 30.5]),
        unit(UnitClass::Sa1, [110.5, 110.5]),
        unit(UnitClass::Sa1, [30.5, 30.5]),
    ];
    let mut effects = effects(Parameters { units: Some(units), ..Parameters::default() });
    let placed = effects.units().unwrap();
    assert_eq!(placed[1], PlacedUnit { class: UnitClass::Sa1, model: 1, px: [110.5, 110.5] });
    let mut counts = [0; 3];
    for frame in 0..80 {
        let found = fired(&mut effects, 1000 * frame);
        found.spikes.iter().for_each(|spike| counts[usize::from(spike.unit)] += 1);
    }
    // The last lies where nothing presses.
    assert!(counts[0] > 0 && counts[1] > 0 && counts[2] == 0, "{counts:?}");
}

#[test]
fn a_session_that_moves_goes_on_to_the_same_spikes() {
    let of = Parameters { noise: true, ..Parameters::default() };
    let mut one = effects(of.clone());
    (0..47).for_each(|frame| drop(fired(&mut one, 1000 * frame)));
    let mut state = Writer::default();
    one.save(&mut state);
    let state = state.finish();
    let mut other = effects(of);
    let mut reader = Reader::new(&state);
    other.restore(&mut reader).unwrap();
    reader.end().unwrap();
    for frame in 47..90 {
        assert_eq!(fired(&mut one, 1000 * frame), fired(&mut other, 1000 * frame));
    }
}

#[test]
fn what_an_answer_has_no_room_for_is_counted() {
    let mut effects = effects(Parameters { spikes_max: 3, ..Parameters::default() });
    let mut total = 0;
    for frame in 0..30 {
        let found = fired(&mut effects, 5000 * frame);
        assert!(found.spikes.len() <= 3);
        total = found.total;
    }
    assert!(total > 200, "{total}");
}
