//! What each effect costs on this machine.

use std::time::{Duration, Instant};

use bytes::BytesMut;
use papilla_proto::{
    HEADER_LEN, Hello, MAP_LEN, MAP_SIDE_PX, RuntimeEffect,
    atlas::Raster,
    effects::{Actuator, ActuatorInput, Drive, Layout, Place},
};

use super::{Cost, Effects, Finger};

/// Runs of which the fastest counts.
const RUNS: u64 = 12;

/// Points and actuators that the measurement takes.
const PLACES: usize = 64;

/// Times every effect on a contact, 224 x 224 values in Pa, against the bare map; keeps the costs
/// in what the sessions on this finger share ([`Shared::costs`](super::Shared::costs)).
pub fn measure(finger: Finger<'_>, contact_pa: &[f32]) {
    let bare = Hello { effects: vec!["contact_window".to_owned()], ..Hello::default() };
    // An effect that cannot be set up here has no cost to tell of.
    let of = |hello: &Hello| Effects::of(hello, finger).ok().flatten();
    let Some(base_us) = of(&bare).map(|effects| us(effects, contact_pa)) else { return };
    let mut costs = Vec::new();
    for effect in RuntimeEffect::ALL {
        let hello = hello(effect, finger.interface);
        let Some(us) = of(&hello).map(|effects| us(effects, contact_pa)) else { continue };
        // Less than the timer tells apart is nothing, not a gain.
        let us = if effect == RuntimeEffect::ContactWindow { us } else { (us - base_us).max(0.0) };
        costs.push(Cost { effect, us: (10.0 * us).round() / 10.0 });
    }
    let _ = finger.shared.costs.set(costs);
}

/// A hello for one effect (and for the window, which the base has too).
fn hello(effect: RuntimeEffect, interface: &Raster) -> Hello {
    let indices = interface.indices();
    let place = |i: usize| {
        let index = indices[i * indices.len() / PLACES] as usize;
        Place::Px([index % MAP_SIDE_PX, index / MAP_SIDE_PX].map(|px| px as f32 + 0.5))
    };
    let places = || (0..PLACES).filter(|_| !indices.is_empty()).map(place);
    let mut hello = Hello {
        effects: vec!["contact_window".to_owned(), effect.as_str().to_owned()],
        ..Hello::default()
    };
    match effect {
        RuntimeEffect::Points => hello.points = Some(places().collect()),
        RuntimeEffect::Actuators => {
            let actuator = |at| Actuator { at, radius_mm: None, gain: None, threshold: None };
            hello.actuators = Some(Layout {
                actuators: places().map(actuator).collect(),
                input: ActuatorInput::Sed,
                drive: Drive::Formula,
                radius_mm: Some(1.0),
                gain: Some(1.0),
                threshold: 0.0,
                max: 1.0,
            });
        }
        _ => {}
    }
    hello
}

/// Time of one frame's effects, us: the least of several.
fn us(mut effects: Effects, contact_pa: &[f32]) -> f64 {
    let mut pressure_pa = vec![0.0; MAP_LEN];
    let mut bytes = BytesMut::with_capacity(effects.size_hint());
    let mut least = Duration::MAX;
    // A contact that moves: at rest, units that spike cost next to nothing.
    let lighter_pa: Vec<f32> = contact_pa.iter().map(|pa| 0.9 * pa).collect();
    for run in 0..RUNS {
        let map = if run % 2 == 0 { contact_pa } else { &lighter_pa };
        pressure_pa.copy_from_slice(map);
        bytes.clear();
        bytes.resize(HEADER_LEN, 0);
        let start = Instant::now();
        let time_us = run * 11_111;
        effects.before(&mut pressure_pa, time_us);
        // The pressure stands in for its SED: the times do not depend on the values.
        let written = effects.write(&pressure_pa, map, time_us, &mut bytes).is_ok();
        // The first frame begins, which is less than to go on.
        if written && run > 0 {
            least = least.min(start.elapsed());
        }
    }
    least.as_nanos() as f64 / 1e3
}
