use papilla_proto::{
    Summary,
    contact::Touch,
    spikes::{Fired, PlacedUnit, Spike, UnitClass},
};
use serde_json::Value;

use super::*;
use crate::Status;

fn number(said: &Value) -> f64 {
    match said.as_str() {
        Some("nan") => f64::NAN,
        Some(_) => f64::INFINITY,
        None => said.as_f64().unwrap(),
    }
}

fn device_of(said: &Value) -> Result<Device, DeviceError> {
    let read = || {
        if let Some(told) = said.get("force") {
            return force(number(&told["full_n"]), told["threshold_n"].as_f64().unwrap_or(0.0));
        }
        let Some(told) = said.get("spike_rate") else {
            return actuators(number(&said["actuators"]["full"]));
        };
        let unit = |class: &Value| PlacedUnit {
            class: serde_json::from_value(class.clone()).unwrap(),
            model: 0,
            px: [112.0, 112.0],
        };
        let units: Vec<_> = told["units"].as_array().unwrap().iter().map(unit).collect();
        spike_rate(&units, number(&told["full_hz"]), &[UnitClass::Ra, UnitClass::Pc])
    };
    let fingers = said["fingers"].as_u64().unwrap_or(1);
    let usual = Options::default();
    let of = |name: &str, usual| said.get(name).map_or(usual, number);
    let options = Options {
        max_hz: of("max_hz", usual.max_hz),
        hold_s: of("hold_s", usual.hold_s),
        fade_s: of("fade_s", usual.fade_s),
    };
    Device::new((0..fingers).map(|_| read()).collect::<Result<_, _>>()?, options)
}

fn answer_of(said: &Value) -> Answer {
    let status = match said["status"].as_str() {
        None => Status::Ok,
        Some("superseded") => Status::Superseded { by_client: false },
        Some("late") => Status::Late,
        Some("stale") => Status::Stale,
        Some(_) => Status::Lost,
    };
    let mut answer = Answer::without_map(1, 0, status);
    answer.finger = said["finger"].as_u64().unwrap_or(0) as u8;
    answer.no_contact = said["no_contact"] == true;
    answer.not_tracked = said["not_tracked"] == true;
    answer.touch = said.get("force_n").map(|force_n| Touch {
        force_n: [0, 1, 2].map(|k| number(&force_n[k]) as f32),
        ..Touch::default()
    });
    let summary =
        |force_n: &Value| Summary { force_n: number(force_n) as f32, ..Summary::default() };
    answer.summary = said.get("summary_force_n").map(summary);
    let listed = said["actuators"].as_array().into_iter().flatten();
    answer.actuators = listed.map(|value| number(value) as f32).collect();
    answer.client_time_us = said["client_time_us"].as_u64().unwrap_or(0);
    answer.fired = said["spikes"].as_array().map(|units| {
        let spike = |unit: &Value| Spike { unit: unit.as_u64().unwrap() as u16, time_us: 0 };
        Fired { total: 0, spikes: units.iter().map(spike).collect() }
    });
    answer
}

#[track_caller]
fn compare(found: Option<Command>, due: &Value, tolerance: f64, case: &str) {
    let Some(found) = found else {
        return assert!(due.is_null(), "{case}: no command, and {due} is due");
    };
    assert!(!due.is_null(), "{case}: {found:?}");
    let near =
        |value: f64, due: f64| assert!((value - due).abs() <= tolerance, "{case}: {found:?}");
    for (finger, levels) in due["levels"].as_array().unwrap().iter().enumerate() {
        for (k, level) in levels.as_array().unwrap().iter().enumerate() {
            near(found.levels[finger].get(k).map_or(0.0, |&l| f64::from(l)), number(level));
        }
    }
    near(f64::from(found.amplitude()), number(&due["amplitude"]));
    near(found.duration_s, number(&due["duration_s"]));
}

fn run(case: &Value, tolerance: f64) {
    let name = case["name"].as_str().unwrap();
    if case["refused"] == true {
        let refused = device_of(&case["device"]).err();
        let is_due =
            matches!(refused, Some(DeviceError::Setting { .. } | DeviceError::NoUnits { .. }));
        assert!(is_due, "{name}: {refused:?}");
        return;
    }
    let mut device = device_of(&case["device"]).unwrap();
    let begun = Instant::now();
    for step in case["steps"].as_array().unwrap() {
        let now = begun + Duration::from_secs_f64(number(&step["at_s"]));
        if let Some(due) = step.get("poll") {
            compare(device.poll(now), due, tolerance, name);
        } else if let Some(due) = step.get("stop") {
            compare(Some(device.stop()), due, tolerance, name);
        } else {
            let fed = device.feed(&answer_of(&step["feed"]), now);
            match fed {
                Ok(()) => {
                    assert!(step.get("refused").or(step.get("not_carried")).is_none(), "{name}");
                }
                Err(DeviceError::Finger { .. }) => assert_eq!(step["refused"], true, "{name}"),
                Err(DeviceError::Answer(PapillaError::NotCarried { .. })) => {
                    assert_eq!(step["not_carried"], true, "{name}");
                }
                Err(other) => panic!("{name}: {other}"),
            }
        }
    }
}

/// The script of devices, as every client runs it.
#[test]
fn the_script_of_devices() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../conformance/devices.json");
    let script: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let tolerance = number(&script["tolerance"]);
    let cases = script["cases"].as_array().unwrap();
    assert_eq!(cases.iter().map(|case| run(case, tolerance)).count(), 21);
}
