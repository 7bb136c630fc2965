//! Checks, evaluates and describes exported Papilla models.
//!
//! The trainer (Python, in `trainer/`) writes an `.onnx` file. Everything after that is here.
//! [`evaluate`] runs the engine of the service on every held-out simulation of a dataset, and compares
//! its answers with the finite-element truth by the [`metrics`]. The result is the model's
//! [card](papilla_engine::card), with [pictures](picture) of its best, median and worst sample. The
//! dataset is read from its files alone; nothing here depends on how it was made.
//!
//! ```
//! use papilla_model_export::metrics::{Ground, SampleMetrics};
//!
//! // A plane interface, 0.1 mm a pixel; SED of one pixel is a tenth too low.
//! let place = |i| [0.1 * (i / 224) as f32, 0.1 * (i % 224) as f32, 0.0];
//! let position_mm: Vec<_> = (0..224 * 224).map(place).collect();
//! let [mask, nail_base] = [true, false].map(|of| vec![of; position_mm.len()]);
//! let ground = Ground { mask, nail_base, position_mm };
//! let mut truth = vec![0.0; ground.mask.len()];
//! truth[112 * 224..][..4].fill(100.0);
//! let mut predicted = truth.clone();
//! predicted[112 * 224] = 90.0;
//! let metrics = SampleMetrics::measure(&predicted, &truth, &ground).expect("truth is above 0");
//! assert!((metrics.relative_l2 - 0.05).abs() < 1e-12);
//! assert!((metrics.total_energy_error - 0.025).abs() < 1e-12);
//! ```

pub mod calibrate;
pub mod contact;
pub mod dataset;
mod error;
pub mod evaluate;
pub mod friction;
pub mod ladder;
pub mod metrics;
pub mod picture;
pub mod reference;
pub mod shear;
pub mod split;
pub mod table;

pub use error::{ExportError, read, read_atlas, read_text, write};
