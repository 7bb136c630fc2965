//! The Open Inference Protocol, version 2: requests read, answers written.
//!
//! <https://github.com/open-inference/open-inference-protocol>; the one extension is
//! `binary_tensor_data`. A model has one input, `pressure_pa`, and one output, `sed_j_per_m3`, both
//! FP32 `[1, 1, 224, 224]`. No I/O: a service brings the bytes and sends the answer.
//!
//! ```
//! use papilla_oip::{Answer, Request};
//! use papilla_proto::MAP_LEN;
//!
//! // A request whose numbers lie behind the JSON, and the answer to it, in the same form.
//! let json = br#"{"parameters": {"binary_data_output": true}, "inputs": [{
//!     "name": "pressure_pa", "shape": [1, 1, 224, 224], "datatype": "FP32",
//!     "parameters": {"binary_data_size": 200704}}]}"#;
//! let body = [&json[..], &[0; 4 * MAP_LEN]].concat();
//! let request = Request::read(&body.into(), Some(json.len()))?;
//! assert_eq!(request.pressure_pa.len(), 4 * MAP_LEN);
//!
//! let answer = Answer { model: "small", request, sed_j_per_m3: vec![0; 4 * MAP_LEN].into() };
//! let body = answer.encode()?;
//! assert_eq!(body.bytes.len(), body.head_len.unwrap() + 4 * MAP_LEN);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(any(test, fuzzing))]
#[doc(hidden)]
pub mod fuzz;
mod request;
mod response;

use papilla_proto::MAP_SIDE_PX;

pub use self::{
    request::{Request, head_len},
    response::{Answer, Body},
};

/// Length of the JSON before the tensors' bytes, a header; its presence says that there are any.
pub const HEAD_LEN: &str = "inference-header-content-length";
/// The only version of every model.
pub const VERSION: &str = "1";
/// Samples of both tensors.
pub const DATATYPE: &str = "FP32";
/// Axes of both tensors.
pub const SHAPE: [usize; 4] = [1, 1, MAP_SIDE_PX, MAP_SIDE_PX];
