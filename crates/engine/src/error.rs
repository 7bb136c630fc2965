//! What can be wrong with a model, or happen while it runs.

use crate::{Backend, MODEL_FORMAT};
use thiserror::Error;

/// Why a model is refused or an inference failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EngineError {
    /// The bytes are not an ONNX model, or not all of one.
    #[error("this is not a whole ONNX file ({bytes} bytes): {reason}; export or copy it again")]
    NotOnnx {
        /// Length of the file, bytes.
        bytes: usize,
        /// The decoder's message.
        reason: String,
    },
    /// A required `metadata_props` entry is not there.
    #[error("the model has no metadata '{key}'; it was not exported by the Papilla trainer")]
    MissingMetadata {
        /// Key looked for.
        key: &'static str,
    },
    /// A `metadata_props` entry cannot be read.
    #[error("the model's metadata '{key}' is '{value}', but must be {expected}")]
    BadMetadata {
        /// Key concerned.
        key: &'static str,
        /// Its text.
        value: String,
        /// What it must be.
        expected: &'static str,
    },
    /// A version of the contract that this engine does not know.
    #[error(
        "{file} has format {found}, this program reads format {MODEL_FORMAT}; export the model again, or update the program"
    )]
    UnsupportedFormat {
        /// Which file: the model or its card.
        file: &'static str,
        /// Version found.
        found: u32,
    },
    /// Inputs or outputs that are not the contract's.
    #[error("the model's {side} is {found}, but must be {expected}")]
    Interface {
        /// `input` or `output`.
        side: &'static str,
        /// What the contract asks for.
        expected: String,
        /// What the model has.
        found: String,
    },
    /// A weight that is NaN or infinite.
    #[error("weight {index} of tensor '{tensor}' is {value}; the training diverged")]
    NonFiniteWeight {
        /// Name of the tensor.
        tensor: String,
        /// Flat index in it.
        index: usize,
        /// The weight.
        value: f32,
    },
    /// A tensor whose data do not fit its shape, or lie outside the file.
    #[error("tensor '{tensor}' of the model is unusable: {reason}")]
    BrokenTensor {
        /// Name of the tensor.
        tensor: String,
        /// What is wrong with it.
        reason: String,
    },
    /// An operator that no model needs, or whose output could be large although the file is small.
    #[error(
        "node '{node}' of the model is of the kind '{kind}': {reason}; docs/reference/models.md lists what is taken"
    )]
    Operator {
        /// Name of the node.
        node: String,
        /// Its operator.
        kind: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The model asks for far more memory than any map needs.
    #[error(
        "node '{node}' of the model makes a tensor of {values} values; {limit} are left of what a model may hold"
    )]
    TooLarge {
        /// Name of the node.
        node: String,
        /// Values of its output.
        values: String,
        /// The most values that it may have.
        limit: i64,
    },
    /// The card cannot be read.
    #[error(
        "the model's card is unreadable: {reason}; write it again with `model-export evaluate`"
    )]
    BadCard {
        /// The reader's message.
        reason: String,
    },
    /// The index of the models cannot be read.
    #[error("the list of models is unreadable: {reason}; `model-export index` writes it")]
    BadIndex {
        /// The reader's message.
        reason: String,
    },
    /// The laws of errors cannot be read.
    #[error("the laws of errors are unreadable: {reason}; `model-export calibrate` writes them")]
    BadErrors {
        /// The reader's message.
        reason: String,
    },
    /// The ladder cannot be read.
    #[error("the ladder is unreadable: {reason}; measure it again with `model-export ladder`")]
    BadLadder {
        /// The reader's message.
        reason: String,
    },
    /// The card belongs to another model.
    #[error(
        "card and model disagree on {field}: card '{card}', model '{model}'; they are not of one export"
    )]
    CardMismatch {
        /// Which field.
        field: &'static str,
        /// Value in the card.
        card: String,
        /// Value of the model.
        model: String,
    },
    /// The backend is not available.
    #[error("the backend '{backend}' is not available: {reason}")]
    BackendMissing {
        /// Backend asked for.
        backend: Backend,
        /// Why it is not available.
        reason: String,
    },
    /// The backend refused the model or failed at run time.
    #[error("{backend} failed to {action}: {reason}")]
    Backend {
        /// Backend concerned.
        backend: Backend,
        /// What it was doing.
        action: &'static str,
        /// The backend's own message.
        reason: String,
    },
    /// The backend panicked; the panic was caught.
    #[error("{backend} panicked while it was to {action}: {reason}")]
    Panicked {
        /// Backend concerned.
        backend: Backend,
        /// What it was doing.
        action: &'static str,
        /// Message of the panic.
        reason: String,
    },
    /// A map of another length than 224 x 224.
    #[error("the map {map} holds {found} values where {expected} are due")]
    WrongLength {
        /// Which map.
        map: &'static str,
        /// Its length.
        found: usize,
        /// Length needed.
        expected: usize,
    },
    /// A pressure that is NaN or infinite.
    #[error("the pressure at row {row}, column {column} is {value}")]
    NonFiniteInput {
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
        /// The value.
        value: f32,
    },
    /// The network answered NaN or infinity.
    #[error("the model answered {value} J/m3 at row {row}, column {column}; the map is void")]
    NonFiniteOutput {
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
        /// The value, J/m3.
        value: f32,
    },
    /// The network answered an energy density below zero.
    #[error(
        "the model answered {value} J/m3 at row {row}, column {column}; an energy density cannot be below zero"
    )]
    NegativeOutput {
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
        /// The value, J/m3.
        value: f32,
    },
}
