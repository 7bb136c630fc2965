//! Neurons of touch units: TouchSim's own values under pins, and pins against SED.

use super::{CaseError, Check, Context};
use papilla_afferents::{
    Class, Fingertip, Neuron, SAMPLES_PER_S, Settings, Unit,
    pins::{Pin, inputs, spikes_s},
    touchsim::{FIRST_TOLERANCE_MS, Motion, PUBLISHED, SPIKES_TOLERANCE},
};

const TOUCHSIM: &str = "TouchSim's tests (Saal, Delhaye, Rayhaun & Bensmaia 2017)";
const PINS: &str = "the same neuron under the pin itself";

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for value in PUBLISHED {
        let found_s = value.found_s();
        let motion = match value.motion {
            Motion::Ramp { depth_mm } => format!("ramp of {depth_mm} mm"),
            Motion::Sine { frequency_hz, amplitude_mm } => {
                format!("{frequency_hz} Hz, {amplitude_mm} mm")
            }
        };
        let name = format!(
            "{}, {motion}, pin of {} mm, {} mm off",
            value.class, value.radius_mm, value.distance_mm
        );
        let count = found_s.len() as f64;
        let quantity = format!("{name}: spikes");
        rows.push(Check::absolute(quantity, count, value.spikes, SPIKES_TOLERANCE, TOUCHSIM));
        let first_ms = found_s.first().map_or(f64::NAN, |first_s| 1e3 * first_s);
        let quantity = format!("{name}: first spike, ms");
        let tolerance_ms = FIRST_TOLERANCE_MS;
        rows.push(Check::absolute(quantity, first_ms, value.first_ms, tolerance_ms, TOUCHSIM));
    }
    for class in [Class::Sa1, Class::Ra] {
        for model in 0..Neuron::models(class) {
            rows.push(from_sed(class, model)?);
        }
    }
    Ok(rows)
}

/// A pin's stress at the depth of SA1 receptors as SED, 1000 frames a second.
fn from_sed(class: Class, model: usize) -> Result<Check, CaseError> {
    let trace_mm = Motion::Ramp { depth_mm: 1.0 }.trace_mm();
    let pin = [Pin::indenting([0.0; 2], 1.0, &trace_mm)];
    let neuron = Neuron::new(class, model).ok_or("no such neuron")?;
    let due = spikes_s(neuron, &inputs(&pin, class, [0.0; 2])).len();
    let settings = Settings { e_ref_kpa: 80.0, noise: None };
    let unit = Unit { class, model: u8::try_from(model)?, pixel: 0 };
    let mut finger = Fingertip::new(vec![unit], &[], |_| [0.0; 3], settings, 1000);
    let stress_mpa = inputs(&pin, Class::Sa1, [0.0; 2]).stress_mpa;
    for (ms, stress_mpa) in stress_mpa.iter().step_by(SAMPLES_PER_S as usize / 1000).enumerate() {
        // sigma^2 / 2 E, MPa as J/m3.
        let sed = (1e9 * stress_mpa * stress_mpa / (2.0 * 80.0)) as f32;
        finger.step(1000 * ms as u64, &[sed], &[]);
    }
    let quantity = format!("{class} {model}, ramp of 1 mm as SED, 1 kHz: spikes");
    Ok(Check::absolute(quantity, f64::from(finger.fired()), due as f64, SPIKES_TOLERANCE, PINS))
}
