//! TouchSim's own test values: `tests/test_timing.py` of github.com/hsaal/touchsim, to one spike
//! and 0.25 ms.

use papilla_afferents::{
    Class, Neuron, SAMPLES_PER_S,
    pins::{Pin, inputs, spikes_s},
};

/// One second of its sampling.
const SAMPLES: usize = SAMPLES_PER_S as usize;

/// Fades a trace in and out within 50 ms.
fn faded(mut trace: Vec<f64>) -> Vec<f64> {
    let fade = SAMPLES / 20;
    for n in 0..fade {
        let share = n as f64 / (fade - 1) as f64;
        trace[n] *= share;
        trace[SAMPLES - 1 - n] *= share;
    }
    trace
}

fn ramp_mm() -> Vec<f64> {
    faded(vec![1.0; SAMPLES])
}

fn sine_mm(hz: f64, amplitude_mm: f64) -> Vec<f64> {
    let angle = |n: usize| std::f64::consts::TAU * hz * n as f64 / (SAMPLES - 1) as f64;
    faded((0..SAMPLES).map(|n| amplitude_mm * angle(n).sin()).collect())
}

#[test]
fn every_value_is_met_to_one_spike_and_a_quarter_of_a_millisecond() {
    let at = |x_mm: f64| [x_mm, 0.0];
    let mut missed = Vec::new();
    for (name, class, trace_mm, radius_mm, place_mm, spikes, first_ms) in [
        ("ramp 1 mm", Class::Sa1, ramp_mm(), 1.0, at(0.0), 22, 6.2),
        ("10 Hz 0.5 mm", Class::Sa1, sine_mm(10.0, 0.5), 0.5, at(0.0), 43, 13.0),
        ("ramp 1 mm", Class::Ra, ramp_mm(), 1.0, at(0.0), 7, 9.2),
        ("25 Hz 0.5 mm", Class::Ra, sine_mm(25.0, 0.5), 0.5, at(0.0), 119, 12.6),
        ("ramp 1 mm", Class::Pc, ramp_mm(), 1.0, at(0.0), 3, 0.4),
        ("250 Hz 5 um", Class::Pc, sine_mm(250.0, 0.005), 0.5, at(0.0), 247, 4.2),
        ("250 Hz 10 um, 25 mm off", Class::Pc, sine_mm(250.0, 0.01), 0.5, at(25.0), 40, 23.8),
        ("250 Hz 10 um, 50 mm off", Class::Pc, sine_mm(250.0, 0.01), 0.5, at(50.0), 29, 43.0),
    ] {
        let pin = Pin::indenting([0.0; 2], radius_mm, &trace_mm);
        let found = spikes_s(Neuron::new(class, 0).unwrap(), &inputs(&[pin], class, place_mm));
        let found_ms = found.first().map_or(f64::NAN, |first_s| 1e3 * first_s);
        println!(
            "{class} {name}: {} spikes ({spikes}), first {found_ms:.1} ms ({first_ms})",
            found.len()
        );
        // Times are multiples of 0.2 ms; that of TouchSim's table is rounded.
        if found.len().abs_diff(spikes) > 1 || (found_ms - first_ms).abs() > 0.25 {
            missed.push(format!("{class} {name}: {} spikes, first at {found_ms} ms", found.len()));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}
