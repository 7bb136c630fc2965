//! Spikes of the touch units of a fingertip: where units lie, what drives them, when they fire.
//!
//! A unit is one of seventeen integrate-and-fire neurons that were fitted to recordings from monkeys
//! (TouchSim: Saal, Delhaye, Rayhaun & Bensmaia 2017, PNAS 114, E5693). They take a stress and a
//! dynamic pressure, and get them from one of two skins:
//!
//! - [`pins`]: TouchSim's own, flat pins on a half-space;
//! - [`Fingertip`]: the finger of Papilla. SED `w` gives SA1 units their stress, `sqrt(2 E w)`. Its
//!   rate drives SA1 and RA units, [as much as](Class::drive_per_stress_rate) a pin whose stress
//!   changes at that rate. Force on the skin drives Pacinian units, wherever it changes.
//!
//! ```
//! use papilla_afferents::{Class, Neuron, pins::{self, Pin}};
//!
//! // A pin of 1 mm radius goes 1 mm into the skin within 50 ms, and stays.
//! let depth_mm: Vec<f64> = (0..1000).map(|n| (f64::from(n) / 250.0).min(1.0)).collect();
//! let pin = Pin::indenting([0.0, 0.0], 1.0, &depth_mm);
//! let inputs = pins::inputs(&[pin], Class::Sa1, [0.0, 0.0]);
//! let neuron = Neuron::new(Class::Sa1, 0).expect("it is the first of four");
//! let spikes_s = pins::spikes_s(neuron, &inputs);
//! assert!(spikes_s[0] < 0.01 && spikes_s.len() > 3);
//! ```

mod class;
mod constants;
mod filter;
mod fingertip;
mod neuron;
mod pacinian;
pub mod pins;
mod placement;
mod random;
mod state;
pub mod touchsim;

pub use class::Class;
pub use fingertip::{FRAME_MAX_US, Fingertip, Settings, Spike};
pub use neuron::{Neuron, SAMPLE_US, SAMPLES_PER_S};
pub use pacinian::Cell;
pub use placement::{Densities, PlacementError, UNITS_MAX, Unit, place};
