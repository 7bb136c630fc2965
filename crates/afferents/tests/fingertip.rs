//! A whole finger: what drives it is what drives pins, and when frames come changes nothing.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use papilla_afferents::{
    Cell, Class, Densities, FRAME_MAX_US, Fingertip, Neuron, SAMPLES_PER_S, Settings, Spike, Unit,
    pins::{Pin, inputs, spikes_s},
    place,
};

const SIDE: u32 = 40;

/// 16 mm x 16 mm of plane interface, pixels of 0.4 mm.
fn place_mm(pixel: u32) -> [f32; 3] {
    let [x, y] = [pixel % SIDE, pixel / SIDE].map(|n| 0.4 * (n as f32 + 0.5) - 8.0);
    [x, y, 0.0]
}

fn cells() -> Vec<Cell> {
    (0..SIDE * SIDE).map(|pixel| Cell { at_mm: place_mm(pixel), area_mm2: 0.16 }).collect()
}

const QUIET: Settings = Settings { e_ref_kpa: 80.0, noise: None };

fn finger(settings: Settings) -> Fingertip {
    let pixels: Vec<_> = (0..SIDE * SIDE).map(|pixel| (pixel, 0.16)).collect();
    let units = place(&pixels, Densities::default(), 11).unwrap();
    Fingertip::new(units, &cells(), place_mm, settings, 10_000)
}

/// SED of a stress of `kpa`, at 80 kPa.
fn sed(kpa: f64) -> f32 {
    (kpa * kpa / 0.16) as f32
}

/// A stroke: SED and force of every pixel at a time, stress linear in time within each 20 ms.
fn stroke(time_us: u64) -> (Vec<f32>, Vec<f32>) {
    let knots = [0.0, 8.0, 40.0, 40.0, 64.0, 16.0, 0.0, 0.0];
    let (knot, rest_us) = ((time_us / 20_000) as usize, time_us % 20_000);
    let at = |knot: usize| knots.get(knot).copied().unwrap_or(0.0);
    let share = rest_us as f64 / 20_000.0;
    let kpa = at(knot) + share * (at(knot + 1) - at(knot));
    let over = |pixel: u32| {
        let [x, y, _] = place_mm(pixel);
        f64::from((1.0 - (x * x + y * y) / 25.0).max(0.0))
    };
    let maps = (0..SIDE * SIDE).map(|pixel| {
        let kpa = kpa * over(pixel);
        (sed(kpa), (1e-3 * kpa * 0.16) as f32)
    });
    maps.unzip()
}

fn spikes(finger: &mut Fingertip, times_us: impl IntoIterator<Item = u64>) -> Vec<Spike> {
    let mut all = Vec::new();
    for time_us in times_us {
        let (sed_j_per_m3, force_n) = stroke(time_us);
        finger.step(time_us, &sed_j_per_m3, &force_n);
        all.extend_from_slice(finger.spikes());
    }
    assert_eq!(all.len(), finger.fired() as usize);
    all
}

fn of_class(finger: &Fingertip, spikes: &[Spike], class: Class) -> usize {
    let is = |spike: &&Spike| finger.units()[usize::from(spike.unit)].class == class;
    spikes.iter().filter(is).count()
}

#[test]
fn spikes_do_not_depend_on_when_frames_come() {
    for noise in [None, Some(3)] {
        let settings = Settings { noise, ..QUIET };
        let of = |times_us: Vec<u64>| spikes(&mut finger(settings), times_us);
        let each_ms = of((0..=160).map(|n| 1000 * n).collect());
        for class in Class::ALL {
            assert!(of_class(&finger(settings), &each_ms, class) > 20, "{class}");
        }
        assert!(each_ms.windows(2).all(|pair| pair[0].time_us <= pair[1].time_us));
        // 200 Hz; and unevenly, with all bends of the stroke among the frames.
        let each_5_ms = of((0..=32).map(|n| 5000 * n).collect());
        let uneven = of((0..=160)
            .flat_map(|n| [1000 * n, 1000 * n + 137 * (n % 7 + 1)])
            .filter(|time_us| *time_us <= 160_000)
            .collect());
        assert_eq!(each_ms, of((0..=160).map(|n| 1000 * n).collect()));
        assert_eq!(each_ms, each_5_ms);
        assert_eq!(each_ms, uneven);
    }
}

#[test]
fn sed_of_a_pin_fires_units_as_the_pin_does() {
    let samples = SAMPLES_PER_S as usize;
    let ramp_mm: Vec<_> = (0..samples).map(|n| (n as f64 / 250.0).min(1.0)).collect();
    let pin = [Pin::indenting([0.0; 2], 1.0, &ramp_mm)];
    let stress_mpa = inputs(&pin, Class::Sa1, [0.0; 2]).stress_mpa;
    for class in [Class::Sa1, Class::Ra] {
        for model in 0..Neuron::models(class) {
            let due = spikes_s(Neuron::new(class, model).unwrap(), &inputs(&pin, class, [0.0; 2]));
            let unit = Unit { class, model: model as u8, pixel: 0 };
            let mut finger = Fingertip::new(vec![unit], &[], place_mm, QUIET, 100);
            let mut found = Vec::new();
            for frame in 0..1000 {
                finger.step(1000 * frame as u64, &[sed(1e3 * stress_mpa[5 * frame])], &[]);
                found.extend(finger.spikes().iter().map(|spike| 1e-6 * spike.time_us as f64));
            }
            assert!(found.len().abs_diff(due.len()) <= 1, "{class} {model}: {found:?}, {due:?}");
            for (found, due) in found.iter().zip(&due).take(3) {
                assert!((found - due).abs() < 1e-3, "{class} {model}: {found}, not {due}");
            }
        }
    }
}

#[test]
fn force_anywhere_reaches_pacinian_units_and_no_others() {
    let mut finger = finger(QUIET);
    let force = |n: u64| {
        let wave = (std::f32::consts::TAU * 0.2 * n as f32).sin();
        // 0.1 N in one corner.
        (0..SIDE * SIDE).map(|pixel| if pixel == 41 { 0.1 * wave } else { 0.0 }).collect()
    };
    let still = vec![0.0; (SIDE * SIDE) as usize];
    let mut all = Vec::new();
    for n in 0..100 {
        let force_n: Vec<f32> = force(n);
        finger.step(1000 * n, &still, &force_n);
        all.extend_from_slice(finger.spikes());
    }
    assert!(of_class(&finger, &all, Class::Pc) > 100);
    assert_eq!(of_class(&finger, &all, Class::Pc), all.len());
}

#[test]
fn what_is_saved_goes_on_to_the_same_spikes() {
    let settings = Settings { noise: Some(9), ..QUIET };
    for until_ms in [0, 33, 61, 150] {
        let (mut one, mut other) = (finger(settings), finger(settings));
        spikes(&mut one, (0..until_ms).map(|ms| 1000 * ms));
        let mut numbers = Vec::new();
        one.save(&mut |number| numbers.push(number));
        let mut rest = numbers.iter().copied();
        other.restore(&mut || rest.next().ok_or("short")).unwrap();
        assert_eq!(rest.next(), None);
        let mut short = numbers[..numbers.len() - 1].iter().copied();
        assert!(finger(settings).restore(&mut || short.next().ok_or("short")).is_err());
        let go_on = |finger: &mut Fingertip| {
            let mut all = Vec::new();
            for ms in until_ms..until_ms + 60 {
                let (sed_j_per_m3, force_n) = stroke(1000 * ms);
                finger.step(1000 * ms, &sed_j_per_m3, &force_n);
                all.extend_from_slice(finger.spikes());
            }
            (all, finger.fired())
        };
        assert_eq!(go_on(&mut one), go_on(&mut other));
    }
}

#[test]
fn clocks_that_jump_are_bounded_and_a_full_frame_still_counts() {
    let mut finger = finger(QUIET);
    spikes(&mut finger, (0..60).map(|ms| 1000 * ms));
    let (sed_j_per_m3, force_n) = stroke(60_000);
    // Whatever passes, a frame stands for 50 ms at most.
    finger.step(u64::MAX, &sed_j_per_m3, &force_n);
    let first_us = u64::MAX - FRAME_MAX_US;
    assert!(!finger.spikes().is_empty());
    assert!(finger.spikes().iter().all(|spike| spike.time_us > first_us));
    // Back: anew, and nothing fires in no time.
    finger.step(5, &sed_j_per_m3, &force_n);
    assert!(finger.spikes().is_empty());

    let pixels: Vec<_> = (0..SIDE * SIDE).map(|pixel| (pixel, 0.16)).collect();
    let units = place(&pixels, Densities::default(), 11).unwrap();
    let mut narrow = Fingertip::new(units, &cells(), place_mm, QUIET, 4);
    for ms in 0..60 {
        let (sed_j_per_m3, force_n) = stroke(1000 * ms);
        narrow.step(1000 * ms, &sed_j_per_m3, &force_n);
        assert!(narrow.spikes().len() <= 4);
    }
    assert!(narrow.fired() > 240);
}

/// Frames of one tick of a coarse clock: motion within the tick is felt over it, neither lost nor at
/// once.
#[test]
fn frames_of_one_time_are_part_of_the_way_to_the_next() {
    let alone = spikes(&mut finger(QUIET), (0..=32).map(|n| 5000 * n));
    let mut doubled = finger(QUIET);
    let mut all = Vec::new();
    for n in 0..=32 {
        for seen_us in [5000 * n, 5000 * n + 2500] {
            let (sed_j_per_m3, force_n) = stroke(seen_us);
            doubled.step(5000 * n, &sed_j_per_m3, &force_n);
            all.extend_from_slice(doubled.spikes());
        }
    }
    assert_eq!(alone, all);
}

/// Tracking that is lost under a held press, and comes back to it: no unit fires for either.
#[test]
fn a_pause_is_silent_and_so_is_its_end() {
    let mut one = finger(QUIET);
    let (sed_j_per_m3, force_n) = stroke(50_000);
    let held = |finger: &mut Fingertip, times_ms: std::ops::Range<u64>| {
        times_ms
            .map(|ms| {
                finger.step(1000 * ms, &sed_j_per_m3, &force_n);
                finger.spikes().len()
            })
            .collect::<Vec<_>>()
    };
    held(&mut one, 0..400);
    let before: usize = held(&mut one, 400..500).iter().sum();
    one.pause();
    assert!(one.spikes().is_empty());
    let mut numbers = Vec::new();
    one.save(&mut |number| numbers.push(number));
    let mut rest = numbers.iter().copied();
    let mut other = finger(QUIET);
    other.restore(&mut || rest.next().ok_or("short")).unwrap();
    let after = held(&mut one, 900..1000);
    assert_eq!(after, held(&mut other, 900..1000));
    assert_eq!(after[0], 0, "the frame that comes back");
    let after: usize = after.iter().sum();
    assert!(after.abs_diff(before) <= before / 5 + 2, "{before} spikes before, {after} after");
}
