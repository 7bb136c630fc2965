//! What an inference request asks for.
//!
//! A body that is refused costs no more memory than one that is taken: of every list the members
//! that matter are kept and the others are counted.

mod numbers;
mod parameters;

use axum::http::HeaderMap;
use bytes::Bytes;
use papilla_engine::{INPUT_NAME, OUTPUT_NAME};
use papilla_proto::{ErrorCode, Problem, error::shortened, json};
use serde::Deserialize;

use self::{
    numbers::{First, Numbers, Shape},
    parameters::Parameters,
};
use super::{DATATYPE, SHAPE};

/// Length of the JSON before the tensors' bytes; its presence says that there are any.
const HEAD_LEN: &str = "inference-header-content-length";

#[derive(Deserialize)]
struct Request {
    id: Option<String>,
    #[serde(default)]
    parameters: Parameters,
    inputs: First<InputTensor>,
    #[serde(default)]
    outputs: First<OutputTensor>,
}

#[derive(Deserialize)]
struct InputTensor {
    name: String,
    shape: Shape,
    datatype: String,
    #[serde(default)]
    parameters: Parameters,
    data: Option<Numbers>,
}

#[derive(Deserialize)]
struct OutputTensor {
    name: String,
    #[serde(default)]
    parameters: Parameters,
}

/// How the client wants its answer.
#[derive(Debug, PartialEq)]
pub(super) struct Wish {
    /// Sent back as it is.
    pub(super) id: Option<String>,
    /// As bytes behind the JSON, or as numbers in it.
    pub(super) is_binary_wanted: bool,
    /// Time the map may spend in the server, us.
    pub(super) timeout_us: Option<u64>,
}

/// The length of the JSON part of a body that goes on with bytes; None: all of it is JSON.
///
/// # Errors
/// The header is no number, or greater than the body.
pub(super) fn head_len(headers: &HeaderMap, body_len: usize) -> Result<Option<usize>, Problem> {
    let Some(value) = headers.get(HEAD_LEN) else { return Ok(None) };
    let length = value.to_str().ok().and_then(|text| text.parse().ok());
    match length.filter(|length| *length <= body_len) {
        Some(length) => Ok(Some(length)),
        None => {
            let message = format!("{value:?} is not the length of a part of {body_len} bytes");
            Err(Problem::new(ErrorCode::WrongLength, message).at(HEAD_LEN))
        }
    }
}

/// Reads the request; the map comes back as f32 samples, little-endian.
///
/// # Errors
/// It is not what the protocol and the model's metadata ask for; the field at fault is named.
pub(super) fn read(body: &Bytes, head_len: Option<usize>) -> Result<(Wish, Bytes), Problem> {
    let (head, blob) =
        (body.slice(..head_len.unwrap_or(body.len())), head_len.map(|n| body.slice(n..)));
    let request: Request = json::read_bounded(&head)?;
    refuse_sequences(&request.parameters)?;
    let is_binary_wanted = wants_binary(&request)?;
    let input = match request.inputs {
        First { first: Some(input), count: 1 } => input,
        First { count, .. } => {
            let message = format!("{count} inputs; the model has one, {INPUT_NAME}");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("inputs"));
        }
    };
    check_input(&input)?;
    let binary_len = input.parameters.binary_data_size.whole_number("binary_data_size")?;
    let payload = match (input.data, binary_len, blob) {
        (Some(numbers), None, None) => numbers.into_bytes()?,
        (Some(numbers), None, Some(blob)) if blob.is_empty() => numbers.into_bytes()?,
        (None, Some(length), Some(blob)) if length == blob.len() as u64 => blob,
        (None, Some(length), blob) => {
            let found = blob.map_or(0, |blob| blob.len());
            let message = format!("binary_data_size is {length}, {found} bytes follow the JSON");
            return Err(Problem::new(ErrorCode::WrongLength, message).at("binary_data_size"));
        }
        _ => {
            let message = "an input has either data or binary_data_size and bytes behind the JSON";
            return Err(Problem::new(ErrorCode::WrongType, message).at("inputs"));
        }
    };
    let timeout_us = request.parameters.timeout.whole_number("timeout")?.filter(|us| *us > 0);
    Ok((Wish { id: request.id, is_binary_wanted, timeout_us }, payload))
}

/// Every request is rendered for itself.
fn refuse_sequences(parameters: &Parameters) -> Result<(), Problem> {
    match parameters.of_sequence() {
        None => Ok(()),
        Some(name) => {
            let message = "requests are rendered one by one; sequences of them are not served";
            Err(Problem::new(ErrorCode::BadQuery, message).at(name))
        }
    }
}

fn check_input(input: &InputTensor) -> Result<(), Problem> {
    let InputTensor { name, shape, datatype, .. } = input;
    if name != INPUT_NAME {
        let name = shortened(name);
        let message = format!("there is no input '{name}'; the model's is {INPUT_NAME}");
        return Err(Problem::new(ErrorCode::BadQuery, message).at("inputs"));
    }
    if datatype != DATATYPE {
        let datatype = shortened(datatype);
        let message = format!("datatype {datatype} is not taken; {DATATYPE} is");
        return Err(Problem::new(ErrorCode::WrongType, message).at("datatype"));
    }
    if !shape.is(SHAPE) {
        let message = format!("the shape is {shape}, {SHAPE:?} is due");
        return Err(Problem::new(ErrorCode::WrongShape, message).at("shape"));
    }
    if input.parameters.has_shared_memory() {
        let message = "shared memory is not served";
        return Err(Problem::new(ErrorCode::WrongType, message).at("shared_memory_region"));
    }
    Ok(())
}

/// Whether the output is to come as bytes: as it says itself, or else as the request says.
fn wants_binary(request: &Request) -> Result<bool, Problem> {
    let of_all = request.parameters.binary_data_output.boolean("binary_data_output")?;
    let of_all = of_all.unwrap_or(false);
    let output = match &request.outputs {
        First { count: 0, .. } => return Ok(of_all),
        First { first: Some(output), count: 1 } => output,
        First { count, .. } => {
            let message = format!("{count} outputs; the model has one, {OUTPUT_NAME}");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("outputs"));
        }
    };
    if output.name != OUTPUT_NAME {
        let name = shortened(&output.name);
        let message = format!("there is no output '{name}'; the model's is {OUTPUT_NAME}");
        return Err(Problem::new(ErrorCode::BadQuery, message).at("outputs"));
    }
    let of_output = &output.parameters;
    for (unserved, is_asked) in [
        ("classification", of_output.classification.is_there()),
        ("shared_memory_region", of_output.has_shared_memory()),
    ] {
        if is_asked {
            let message = format!("{unserved} is not served");
            return Err(Problem::new(ErrorCode::WrongType, message).at(unserved));
        }
    }
    Ok(of_output.binary_data.boolean("binary_data")?.unwrap_or(of_all))
}

#[cfg(test)]
mod tests;
