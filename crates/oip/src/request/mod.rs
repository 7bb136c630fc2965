//! What an inference request asks for.
//!
//! A body that is refused costs no more memory than one that is taken: of every list the members
//! that matter are kept and the others are counted.

mod numbers;
mod parameters;

use bytes::Bytes;
use papilla_proto::{ErrorCode, INPUT_NAME, OUTPUT_NAME, Problem, error::shortened, json};
use serde::Deserialize;

use self::{
    numbers::{First, Numbers, Shape},
    parameters::Parameters,
};
use crate::{DATATYPE, HEAD_LEN, SHAPE};

/// The JSON.
#[derive(Deserialize)]
struct Head {
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

/// A map to infer, and how the client wants its answer.
#[derive(Debug, PartialEq)]
pub struct Request {
    /// Sent back as it is.
    pub id: Option<String>,
    /// Whether the answer's numbers come as bytes behind the JSON, or as numbers in it.
    pub is_binary_wanted: bool,
    /// Time the map may spend in the server, us.
    pub timeout_us: Option<u64>,
    /// f32 samples, little-endian, Pa.
    pub pressure_pa: Bytes,
}

/// The length of the JSON part of a body that goes on with bytes, from the header [`HEAD_LEN`];
/// None: all of it is JSON.
///
/// # Errors
/// The header is no number, or greater than the body.
pub fn head_len(header: Option<&[u8]>, body_len: usize) -> Result<Option<usize>, Problem> {
    let Some(value) = header else { return Ok(None) };
    let value = String::from_utf8_lossy(value);
    match value.parse().ok().filter(|length| *length <= body_len) {
        Some(length) => Ok(Some(length)),
        None => {
            let value = shortened(&value);
            let message = format!("{value:?} is not the length of a part of {body_len} bytes");
            Err(Problem::new(ErrorCode::WrongLength, message).at(HEAD_LEN))
        }
    }
}

impl Request {
    /// Reads a body whose JSON is `head_len` bytes long, or all of it.
    ///
    /// # Errors
    /// It is not what the protocol and the model's metadata ask for; the field at fault is named.
    pub fn read(body: &Bytes, head_len: Option<usize>) -> Result<Self, Problem> {
        let (head, blob) = match head_len {
            Some(length) if length > body.len() => {
                let message = format!("{length} bytes of JSON are due, {} are there", body.len());
                return Err(Problem::new(ErrorCode::WrongLength, message).at(HEAD_LEN));
            }
            Some(length) => (body.slice(..length), Some(body.slice(length..))),
            None => (body.clone(), None),
        };
        let head: Head = json::read_bounded(&head)?;
        refuse_sequences(&head.parameters)?;
        refuse_finger(&head.parameters)?;
        let is_binary_wanted = wants_binary(&head)?;
        let timeout_us = head.parameters.timeout.whole_number("timeout")?.filter(|us| *us > 0);
        let pressure_pa = samples(head.inputs, blob)?;
        Ok(Self { id: head.id, is_binary_wanted, timeout_us, pressure_pa })
    }
}

/// The samples of the one input: numbers of the JSON, or the bytes behind it.
fn samples(inputs: First<InputTensor>, blob: Option<Bytes>) -> Result<Bytes, Problem> {
    let input = match inputs {
        First { first: Some(input), count: 1 } => input,
        First { count, .. } => {
            let message = format!("{count} inputs; the model has one, {INPUT_NAME}");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("inputs"));
        }
    };
    check_input(&input)?;
    let binary_len = input.parameters.binary_data_size.whole_number("binary_data_size")?;
    match (input.data, binary_len, blob) {
        (Some(numbers), None, None) => numbers.into_bytes(),
        (Some(numbers), None, Some(blob)) if blob.is_empty() => numbers.into_bytes(),
        (None, Some(length), Some(blob)) if length == blob.len() as u64 => Ok(blob),
        (None, Some(length), blob) => {
            let found = blob.map_or(0, |blob| blob.len());
            let message = format!("binary_data_size is {length}, {found} bytes follow the JSON");
            Err(Problem::new(ErrorCode::WrongLength, message).at("binary_data_size"))
        }
        _ => {
            let message = "an input has either data or binary_data_size and bytes behind the JSON";
            Err(Problem::new(ErrorCode::WrongType, message).at("inputs"))
        }
    }
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

/// The finger is part of the address: clients ask with the same one what its models are.
fn refuse_finger(parameters: &Parameters) -> Result<(), Problem> {
    if !parameters.finger.is_there() {
        return Ok(());
    }
    let message = "a finger is named in the address, as in ?finger=thumb, not in the parameters";
    Err(Problem::new(ErrorCode::BadQuery, message).at("finger"))
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
fn wants_binary(head: &Head) -> Result<bool, Problem> {
    let of_all = head.parameters.binary_data_output.boolean("binary_data_output")?;
    let of_all = of_all.unwrap_or(false);
    let output = match &head.outputs {
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
