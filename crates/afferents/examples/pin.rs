//! When three kinds of touch units fire under a pin that goes 1 mm into the skin and stays.
//!
//! ```sh
//! cargo run -p papilla-afferents --example pin
//! ```

use papilla_afferents::{
    Class, Neuron, SAMPLES_PER_S,
    pins::{self, Pin},
};

fn main() {
    // One second, of which the first 50 ms are the way in.
    let samples = SAMPLES_PER_S as i32;
    let ramp = f64::from(samples) / 20.0;
    let depth_mm: Vec<f64> = (0..samples).map(|n| (f64::from(n) / ramp).min(1.0)).collect();
    let pin = [Pin::indenting([0.0, 0.0], 1.0, &depth_mm)];
    for class in [Class::Sa1, Class::Ra, Class::Pc] {
        let inputs = pins::inputs(&pin, class, [0.0, 0.0]);
        for model in 0..Neuron::models(class) {
            let Some(neuron) = Neuron::new(class, model) else { continue };
            let spikes_s = pins::spikes_s(neuron, &inputs);
            match spikes_s.first() {
                Some(first_s) => println!(
                    "{class} {model}: {:3} spikes, the first after {:.1} ms",
                    spikes_s.len(),
                    1e3 * first_s
                ),
                None => println!("{class} {model}: silent"),
            }
        }
    }
}
