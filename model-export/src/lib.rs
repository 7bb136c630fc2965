//! Checks, evaluates and describes exported Papilla models.
//!
//! The trainer (Python, in `trainer/`) ends at the `.onnx` file. From there on everything
//! is here: [`evaluate`] runs the serving engine on every held-out press of a dataset
//! and compares with the finite-element truth by the [`metrics`]; the outcome is the
//! model's [card](papilla_engine::card) and [pictures](picture) of its best, median and worst
//! sample. The dataset is read from its files alone: nothing here knows how it was made.

pub mod dataset;
mod error;
pub mod evaluate;
pub mod ladder;
pub mod metrics;
pub mod picture;
pub mod reference;
pub mod table;

pub use error::{ExportError, read, read_text, write};
