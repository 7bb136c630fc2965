//! Spikes of touch units: TouchSim's values, pins against SED, the time of a frame.

use papilla_afferents::{
    Cell, Class, Densities, Fingertip, Neuron, PlacementError, SAMPLES_PER_S, Settings, Unit,
    pins::{Pin, inputs, spikes_s},
    place,
    touchsim::{FIRST_TOLERANCE_MS, Motion, PUBLISHED, Published, SPIKES_TOLERANCE},
};
use papilla_processor::today_here;
use std::fmt::Write as _;
use std::time::Instant;

const HEAD: &str = "\
# Spikes of touch units

**Question.** TouchSim is a published model of the nerve fibres of touch, in which a pin drives the fibres (Saal, Delhaye,
Rayhaun & Bensmaia 2017). The session effect [`spikes`](../../docs/reference/protocol-effects.md#spikes) has the same
model neurons. Do they fire as those of TouchSim? Do they fire the same if strain energy density (SED) drives them in
place of a pin? And what does a frame cost? The [glossary](../../docs/glossary.md) explains terms.

**What it means.** Under the same pin the neurons fire as those of TouchSim. Driven by SED, each neuron fires as often,
and 0.2 ms later. This holds for the effect alone. Whether SED on a finger makes fibres fire as people's do is another
question: the stress at which they begin to fire was not fitted to people.

**Method.** The first table repeats TouchSim's own tests (`tests/test_timing.py` of github.com/hsaal/touchsim): the first
neuron of each class under a pin that moves for a second. TouchSim's tests allow a difference of one spike, and of 0.25
ms in the time of the first spike; *ok* means that this holds here too. SA1 are slowly adapting, RA rapidly adapting and
PC Pacinian fibres. *Neuron* and *unit* both stand for one simulated fibre. The command writes this page:

```sh
cargo run --release -p papilla-studies -- spikes
```

## Against TouchSim

| class | movement of the pin | radius, mm | distance of the neuron, mm | spikes here | spikes in TouchSim | first spike here, ms | first spike in TouchSim, ms | within the tolerance? |
|---|---|---|---|---|---|---|---|---|
";

const SED: &str = "
## Pins against strain energy density

A pin of 1 mm radius makes a ramp of 1 mm. The stress that it causes 0.3 mm deep is converted to SED, and given to the
effect in 1000 frames. So this tests the effect alone, without the mechanics of Papilla's finger. The truth is the same
neuron under the pin in TouchSim. PC units take force and not SED.

| neuron | spikes under the pin | spikes of SED | first under the pin, ms | first of SED, ms |
|---|---|---|---|---|
";

const AFTER: &str = "
The effect takes the stress `sqrt(2 e_ref SED)` from SED, with the modulus `e_ref_kpa`. At its default of 80 kPa, SA1
units do not fire below a stress of some 8 kPa, which is an SED of 400 J/m3. The modulus was not fitted to people. Under
a plate with 0.9 N, SED is 340 J/m3 at most (by the network `large` of 23 November 2026), and only a few of the 470 SA1
units of the default finger fire.
";

const COST: &str = "
## Time of a frame

A plane of 6.7 cm2 carries units of all three classes at the densities of a fingertip. SED and force go up and down seven
times a second, on a disc of 77 mm2 or everywhere. Times are medians of 400 frames. They cover the steps of the neurons,
the reading of SED at their places, and the waves along the skin that drive PC units. A frame at 90 Hz covers 11 times
as many steps as one at 1000 Hz. *Noise* is the option of random fluctuations, with which no neuron may be left out.

| SED on | noise | frames a second | units | spikes a second | time of a frame, us |
|---|---|---|---|---|---|
";

const SIDE: u32 = 224;
const PIXEL_MM: f32 = 0.1156;

/// The page.
///
/// # Errors
/// [`PlacementError`] of the units.
pub fn markdown() -> Result<String, PlacementError> {
    let mut text = HEAD.to_owned();
    for value in PUBLISHED {
        touchsim(&mut text, &value);
    }
    text.push_str(SED);
    for class in [Class::Sa1, Class::Ra] {
        (0..Neuron::models(class)).for_each(|model| from_sed(&mut text, class, model));
    }
    text.push_str(AFTER);
    text.push_str(COST);
    for (what, radius_mm) in [("77 mm2", 4.95), ("all", f32::INFINITY)] {
        for (noise, name) in [(None, "no"), (Some(1), "yes")] {
            for period_us in [1000, 11_111] {
                cost(&mut text, what, radius_mm, (noise, name), period_us)?;
            }
        }
    }
    // Writing to a String cannot fail.
    let _ = writeln!(text, "\nMeasured {}, beside other programs.", today_here());
    Ok(text)
}

/// A row of what TouchSim's tests hold.
fn touchsim(text: &mut String, value: &Published) {
    let found_s = value.found_s();
    let (count, first_ms) = (found_s.len() as f64, found_s.first().map_or(f64::NAN, |s| 1e3 * s));
    let is_met = (count - value.spikes).abs() <= SPIKES_TOLERANCE
        && (first_ms - value.first_ms).abs() <= FIRST_TOLERANCE_MS;
    let pin = match value.motion {
        Motion::Ramp { depth_mm } => format!("ramp of {depth_mm} mm"),
        Motion::Sine { frequency_hz, amplitude_mm } => {
            format!("{frequency_hz} Hz, {amplitude_mm} mm")
        }
    };
    let _ = writeln!(
        text,
        "| {} | {pin} | {} | {} | {count} | {} | {first_ms:.1} | {:.1} | {} |",
        value.class,
        value.radius_mm,
        value.distance_mm,
        value.spikes,
        value.first_ms,
        if is_met { "ok" } else { "MISSED" }
    );
}

/// A pin's stress at the depth of SA1 receptors as SED, 1000 frames a second.
fn from_sed(text: &mut String, class: Class, model: usize) {
    let trace_mm = Motion::Ramp { depth_mm: 1.0 }.trace_mm();
    let pin = [Pin::indenting([0.0; 2], 1.0, &trace_mm)];
    let due_s = Neuron::new(class, model)
        .map_or_else(Vec::new, |neuron| spikes_s(neuron, &inputs(&pin, class, [0.0; 2])));
    let settings = Settings { e_ref_kpa: 80.0, noise: None };
    let unit = Unit { class, model: model as u8, pixel: 0 };
    let mut finger = Fingertip::new(vec![unit], &[], |_| [0.0; 3], settings, 1000);
    let stress_mpa = inputs(&pin, Class::Sa1, [0.0; 2]).stress_mpa;
    let mut first_us = None;
    for (ms, stress_mpa) in stress_mpa.iter().step_by(SAMPLES_PER_S as usize / 1000).enumerate() {
        // sigma^2 / 2 E, MPa as J/m3.
        let sed = (1e9 * stress_mpa * stress_mpa / (2.0 * 80.0)) as f32;
        finger.step(1000 * ms as u64, &[sed], &[]);
        first_us = first_us.or(finger.spikes().first().map(|spike| spike.time_us));
    }
    let ms = |time_s: Option<f64>| time_s.map_or("–".to_owned(), |s| format!("{:.1}", 1e3 * s));
    let _ = writeln!(
        text,
        "| {class} {model} | {} | {} | {} | {} |",
        due_s.len(),
        finger.fired(),
        ms(due_s.first().copied()),
        ms(first_us.map(|us| 1e-6 * us as f64))
    );
}

fn cost(
    text: &mut String,
    what: &str,
    radius_mm: f32,
    (noise, name): (Option<u32>, &str),
    period_us: u64,
) -> Result<(), PlacementError> {
    const FRAMES: u64 = 400;
    let at_mm = |pixel: u32| {
        let [x, y] = [pixel % SIDE, pixel / SIDE].map(|n| PIXEL_MM * (n as f32 - 111.5));
        [x, y, 0.0]
    };
    let within = |at_mm: [f32; 3]| {
        let [x, y, _] = at_mm;
        (1.0 - (x * x + y * y) / (radius_mm * radius_mm)).max(0.0)
    };
    let pixels: Vec<_> = (0..SIDE * SIDE).map(|pixel| (pixel, PIXEL_MM * PIXEL_MM)).collect();
    // Middles of squares of 16 pixels.
    let cell = |n: u32| Cell {
        at_mm: at_mm(16 * (n / 14) * SIDE + 8 * SIDE + 16 * (n % 14) + 8),
        area_mm2: (16.0 * PIXEL_MM).powi(2),
    };
    let cells: Vec<_> = (0..196).map(cell).collect();
    let units = place(&pixels, Densities::default(), 1)?;
    let count = units.len();
    let settings = Settings { e_ref_kpa: 80.0, noise };
    let mut finger = Fingertip::new(units, &cells, at_mm, settings, 1024);
    let mut times_us = Vec::new();
    for frame in 0..FRAMES {
        let time_us = frame * period_us;
        let wave = (1e-6 * time_us as f32 * std::f32::consts::TAU * 7.0).sin().abs();
        // 2 kJ/m3 are 18 kPa.
        let sed: Vec<f32> =
            pixels.iter().map(|&(pixel, _)| 2000.0 * wave * wave * within(at_mm(pixel))).collect();
        let force_n: Vec<f32> = cells.iter().map(|cell| 0.05 * wave * within(cell.at_mm)).collect();
        let start = Instant::now();
        finger.step(time_us, &sed, &force_n);
        times_us.push(1e6 * start.elapsed().as_secs_f64());
    }
    times_us.sort_by(f64::total_cmp);
    let seconds = 1e-6 * (FRAMES * period_us) as f64;
    let _ = writeln!(
        text,
        "| {what} | {name} | {} | {count} | {:.0} | {:.0} |",
        1_000_000 / period_us,
        f64::from(finger.fired()) / seconds,
        times_us[times_us.len() / 2]
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_touchsim_is_met() {
        let mut text = String::new();
        for value in PUBLISHED {
            touchsim(&mut text, &value);
        }
        assert_eq!(text.matches(" ok |").count(), PUBLISHED.len(), "{text}");
    }
}
