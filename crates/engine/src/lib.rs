//! Runs Papilla models, which are ONNX files with a card, behind a small trait.
//!
//! A model maps the pressure on the skin (Pa) to the strain energy density at the
//! dermis-epidermis interface (J/m3), both 224 x 224 maps, row-major, row 0 at the tip
//! of the finger. Before the first map is inferred, [`load`] checks whatever can be wrong with
//! a file: that it is whole, that its input and output are the contract's,
//! that its weights are finite, that it belongs to its card, and that it answers a
//! trial map with finite, non-negative values.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))?;
//! let onnx = std::fs::read("models/nano.onnx")?;
//! let model = papilla_engine::load(&onnx, None)?;
//! let mut session = model.session()?; // one per inference thread
//! let pressure_pa = vec![0.0; papilla_engine::MAP_LEN];
//! let mut sed_j_per_m3 = vec![0.0; papilla_engine::MAP_LEN];
//! session.infer(&pressure_pa, &mut sed_j_per_m3)?;
//! # Ok(())
//! # }
//! ```
//!
//! The engine (backend) is tract, which is pure Rust and embedded. The cargo feature `ort` adds ONNX
//! Runtime, which is faster on large networks; its shared library is opened at run time from
//! `ORT_DYLIB_PATH`. A [`Choice`] takes the faster of the two for each model.

pub mod agreement;
mod backend;
pub mod card;
mod choice;
mod convolution;
mod error;
pub mod error_law;
mod guard;
mod info;
pub mod ladder;
mod map_net;
mod moves;
mod onnx;
mod operators;
#[cfg(feature = "ort")]
mod ort_backend;
mod products;
mod profile;
mod rewrite;
mod sparse;
mod tract_backend;
mod widen;

use std::sync::Arc;

pub use backend::Backend;
pub use card::Card;
pub use choice::Choice;
pub use error::EngineError;
pub use info::ModelInfo;
pub use ladder::Ladder;
pub use papilla_proto::{INPUT_NAME, MAP_LEN, MAP_SIDE_PX, OUTPUT_NAME};
pub use profile::{Operator, profile};
use tract_onnx::pb::ModelProto;

/// Version of the metadata contract that this engine reads (`papilla.format`).
pub const MODEL_FORMAT: u32 = 1;

/// A loaded model. Shared between threads; each thread makes its own [`Session`].
pub trait Model: Send + Sync {
    /// What the model is: name, atlas, effects, scales, backend.
    fn info(&self) -> &ModelInfo;

    /// The backend that runs it.
    fn backend(&self) -> Backend;

    /// Makes the pre-allocated state of one inference thread.
    ///
    /// # Errors
    /// [`EngineError::Backend`] if the backend cannot set its state up.
    fn session(&self) -> Result<Box<dyn Session>, EngineError>;
}

/// The state of one inference thread.
pub trait Session: Send {
    /// Infers one map.
    ///
    /// `pressure_pa` and `sed_j_per_m3` hold 224 x 224 values, row-major. Nothing is allocated,
    /// except by the backend itself. After an error the session can be used again, and the contents
    /// of `sed_j_per_m3` are unspecified.
    ///
    /// # Errors
    /// - [`EngineError::WrongLength`]: a map of another length.
    /// - [`EngineError::NonFiniteInput`]: a pressure that is NaN or infinite.
    /// - [`EngineError::NonFiniteOutput`], [`EngineError::NegativeOutput`]: the network answered a
    ///   value that cannot be an energy density; the map must not be used.
    /// - [`EngineError::Backend`], [`EngineError::Panicked`]: the backend failed.
    fn infer(&mut self, pressure_pa: &[f32], sed_j_per_m3: &mut [f32]) -> Result<(), EngineError>;
}

/// Loads a model with the default backend; see [`load_with`].
///
/// # Errors
/// As [`load_with`].
pub fn load(onnx: &[u8], card: Option<&Card>) -> Result<Arc<dyn Model>, EngineError> {
    load_with(Backend::default(), onnx, card)
}

/// Loads a model: checks the file against the contract and against its card, if there is
/// one, optimises it and infers one trial map.
///
/// Without a card a changed bit inside a weight cannot be noticed, since the file has no checksum
/// of its own. With a card its SHA-256 is compared.
///
/// # Errors
/// An [`EngineError`] that says which rule of the contract the file breaks. Whatever the
/// bytes are, this does not panic.
pub fn load_with(
    backend: Backend,
    onnx: &[u8],
    card: Option<&Card>,
) -> Result<Arc<dyn Model>, EngineError> {
    match backend {
        Backend::Tract => aside(|| {
            let (proto, info) = checked(onnx, card)?;
            let found = map_net::find(&proto);
            let plain = Arc::new(tract_backend::TractModel::load(&proto, info)?);
            tried(plain.as_ref())?;
            map_net::prefer(plain, found)
        })?
        .map(map_net::Preferred::into_model),
        #[cfg(feature = "ort")]
        Backend::Ort => {
            let (_, info) = checked(onnx, card)?;
            let model = ort_backend::OrtModel::load(onnx, info)?;
            tried(&model)?;
            Ok(Arc::new(model))
        }
        #[cfg(not(feature = "ort"))]
        Backend::Ort => {
            checked(onnx, card)?;
            Err(choice::not_built(backend))
        }
    }
}

/// Infers one trial map.
fn tried(model: &dyn Model) -> Result<(), EngineError> {
    let pressure_pa = trial_map(model.info().pressure_max_pa);
    model.session()?.infer(&pressure_pa, &mut vec![0.0; MAP_LEN])
}

/// Does work on a thread of its own, whose memory goes back to the system when it ends. Reading and
/// optimising a network takes many times the memory that is kept. If the thread that keeps the
/// network did it, the few allocations that stay would keep otherwise free pages from being
/// returned.
fn aside<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, EngineError> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("load".to_owned());
        let working = thread.spawn_scoped(scope, work).map_err(|error| EngineError::Backend {
            backend: Backend::Tract,
            action: "start a thread",
            reason: error.to_string(),
        })?;
        Ok(working.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

/// Loads the graph as it stands in the file, run by tract one operator after another. Benchmarks
/// compare faster evaluations with it.
///
/// # Errors
/// As [`load_with`].
pub fn load_as_it_stands(onnx: &[u8]) -> Result<Arc<dyn Model>, EngineError> {
    let (proto, info) = checked(onnx, None)?;
    Ok(Arc::new(tract_backend::TractModel::load(&proto, info)?))
}

/// Decodes a file and checks it against the contract and its card. Constants stored in 16 bits are
/// widened in the result.
fn checked(onnx: &[u8], card: Option<&Card>) -> Result<(ModelProto, ModelInfo), EngineError> {
    let mut proto = onnx::decode(onnx)?;
    let info = ModelInfo::read(&proto, onnx)?;
    if let Some(card) = card {
        card.require_model(&info)?;
    }
    onnx::check(&proto)?;
    widen::widen(&mut proto);
    Ok((proto, info))
}

/// The map of one smooth contact, whose peak is half of the greatest pressure of the training, Pa.
fn trial_map(pressure_max_pa: f32) -> Vec<f32> {
    let centre = MAP_SIDE_PX as f32 / 2.0;
    (0..MAP_LEN)
        .map(|i| {
            let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
            let r2 = ((row - centre).powi(2) + (column - centre).powi(2)) / (40.0 * 40.0);
            0.5 * pressure_max_pa * (1.0 - r2).max(0.0)
        })
        .collect()
}

/// Refuses maps of another length than 224 x 224, and input that is not finite.
fn check_maps(pressure_pa: &[f32], sed_j_per_m3: &[f32]) -> Result<(), EngineError> {
    for (map, found) in [(INPUT_NAME, pressure_pa.len()), (OUTPUT_NAME, sed_j_per_m3.len())] {
        if found != MAP_LEN {
            return Err(EngineError::WrongLength { map, found, expected: MAP_LEN });
        }
    }
    // This has to be checked here, since a ReLU may turn NaN into zero, and the answer would not
    // show it.
    if all(pressure_pa, f32::is_finite) {
        return Ok(());
    }
    match pressure_pa.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => {
            let (row, column) = (index / MAP_SIDE_PX, index % MAP_SIDE_PX);
            Err(EngineError::NonFiniteInput { row, column, value: pressure_pa[index] })
        }
    }
}

/// Whether all values are good. It checks sixteen values at a time without a branch between them,
/// which the compiler can vectorise; a search that stops early it cannot.
fn all(values: &[f32], good: impl Fn(f32) -> bool) -> bool {
    let (chunks, rest) = values.as_chunks::<16>();
    let whole = |values: &[f32]| values.iter().fold(true, |all, &value| all & good(value));
    chunks.iter().all(|chunk| whole(chunk)) && whole(rest)
}

/// Refuses an answer with a value that is NaN, infinite or negative.
fn check_output(sed_j_per_m3: &[f32]) -> Result<(), EngineError> {
    // A range check, since NaN fails it too.
    let good = |v: f32| (0.0..=f32::MAX).contains(&v);
    if all(sed_j_per_m3, good) {
        return Ok(());
    }
    let Some(index) = sed_j_per_m3.iter().position(|v| !good(*v)) else {
        return Ok(());
    };
    let (row, column) = (index / MAP_SIDE_PX, index % MAP_SIDE_PX);
    let value = sed_j_per_m3[index];
    Err(if value.is_finite() {
        EngineError::NegativeOutput { row, column, value }
    } else {
        EngineError::NonFiniteOutput { row, column, value }
    })
}
