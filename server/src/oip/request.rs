//! What an inference request asks for.

use std::fmt;

use axum::http::HeaderMap;
use bytes::Bytes;
use papilla_engine::{INPUT_NAME, OUTPUT_NAME};
use papilla_proto::{ErrorCode, MAP_LEN, Problem};
use serde::{
    Deserialize, Deserializer,
    de::{Error, SeqAccess, Visitor},
};
use serde_json::{Map, Value};

use super::{DATATYPE, SHAPE};
use crate::problem;

/// Length of the JSON before the tensors' bytes; its presence says that there are any.
const HEAD_LEN: &str = "inference-header-content-length";

/// Parameters of requests that belong together.
const SEQUENCE: [&str; 3] = ["sequence_id", "sequence_start", "sequence_end"];

#[derive(Deserialize)]
struct Request {
    id: Option<String>,
    #[serde(default)]
    parameters: Map<String, Value>,
    inputs: Vec<InputTensor>,
    #[serde(default)]
    outputs: Vec<OutputTensor>,
}

#[derive(Deserialize)]
struct InputTensor {
    name: String,
    shape: Vec<usize>,
    datatype: String,
    #[serde(default)]
    parameters: Map<String, Value>,
    data: Option<Numbers>,
}

#[derive(Deserialize)]
struct OutputTensor {
    name: String,
    #[serde(default)]
    parameters: Map<String, Value>,
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
    let request: Request = serde_json::from_slice(&head)
        .map_err(|error| Problem::new(ErrorCode::BadJson, error.to_string()))?;
    refuse_sequences(&request.parameters)?;
    let is_binary_wanted = wants_binary(&request)?;
    let [input] = <[InputTensor; 1]>::try_from(request.inputs).map_err(|inputs| {
        let message = format!("{} inputs; the model has one, {INPUT_NAME}", inputs.len());
        Problem::new(ErrorCode::WrongShape, message).at("inputs")
    })?;
    check_input(&input)?;
    let binary_len = whole_number(&input.parameters, "binary_data_size")?;
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
    let timeout_us = whole_number(&request.parameters, "timeout")?.filter(|us| *us > 0);
    Ok((Wish { id: request.id, is_binary_wanted, timeout_us }, payload))
}

/// Every request is rendered for itself.
fn refuse_sequences(parameters: &Map<String, Value>) -> Result<(), Problem> {
    match SEQUENCE.into_iter().find(|name| parameters.contains_key(*name)) {
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
        let name = problem::excerpt(name);
        let message = format!("there is no input '{name}'; the model's is {INPUT_NAME}");
        return Err(Problem::new(ErrorCode::BadQuery, message).at("inputs"));
    }
    if datatype != DATATYPE {
        let datatype = problem::excerpt(datatype);
        let message = format!("datatype {datatype} is not taken; {DATATYPE} is");
        return Err(Problem::new(ErrorCode::WrongType, message).at("datatype"));
    }
    if *shape != SHAPE {
        let message = format!("the shape is {shape:?}, {SHAPE:?} is due");
        return Err(Problem::new(ErrorCode::WrongShape, message).at("shape"));
    }
    if input.parameters.keys().any(|key| key.starts_with("shared_memory")) {
        let message = "shared memory is not served";
        return Err(Problem::new(ErrorCode::WrongType, message).at("shared_memory_region"));
    }
    Ok(())
}

/// Whether the output is to come as bytes: as it says itself, or else as the request says.
fn wants_binary(request: &Request) -> Result<bool, Problem> {
    let of_all = boolean(&request.parameters, "binary_data_output")?.unwrap_or(false);
    let output = match &request.outputs[..] {
        [] => return Ok(of_all),
        [output] => output,
        more => {
            let message = format!("{} outputs; the model has one, {OUTPUT_NAME}", more.len());
            return Err(Problem::new(ErrorCode::WrongShape, message).at("outputs"));
        }
    };
    if output.name != OUTPUT_NAME {
        let name = problem::excerpt(&output.name);
        let message = format!("there is no output '{name}'; the model's is {OUTPUT_NAME}");
        return Err(Problem::new(ErrorCode::BadQuery, message).at("outputs"));
    }
    for unserved in ["classification", "shared_memory_region"] {
        if output.parameters.contains_key(unserved) {
            let message = format!("{unserved} is not served");
            return Err(Problem::new(ErrorCode::WrongType, message).at(unserved));
        }
    }
    Ok(boolean(&output.parameters, "binary_data")?.unwrap_or(of_all))
}

fn whole_number(parameters: &Map<String, Value>, key: &str) -> Result<Option<u64>, Problem> {
    let Some(value) = parameters.get(key) else { return Ok(None) };
    value.as_u64().map(Some).ok_or_else(|| {
        let message = format!("{value} is not a whole number");
        Problem::new(ErrorCode::BadQuery, message).at(key)
    })
}

fn boolean(parameters: &Map<String, Value>, key: &str) -> Result<Option<bool>, Problem> {
    let Some(value) = parameters.get(key) else { return Ok(None) };
    value.as_bool().map(Some).ok_or_else(|| {
        Problem::new(ErrorCode::BadQuery, format!("{value} is not true or false")).at(key)
    })
}

/// Numbers in lists of any depth, row by row, as f32; no more are kept than a map has.
#[derive(Debug, Default)]
struct Numbers {
    bytes: Vec<u8>,
    count: usize,
}

impl Numbers {
    fn push(&mut self, value: f64) {
        self.count += 1;
        if self.count <= MAP_LEN {
            // What overflows becomes infinite, and is refused with its place.
            self.bytes.extend_from_slice(&(value as f32).to_le_bytes());
        }
    }

    fn into_bytes(self) -> Result<Bytes, Problem> {
        if self.count == MAP_LEN {
            return Ok(self.bytes.into());
        }
        let message = format!("data has {} numbers, the shape {MAP_LEN}", self.count);
        Err(Problem::new(ErrorCode::WrongLength, message).at("data"))
    }
}

impl<'de> Deserialize<'de> for Numbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut numbers = Self { bytes: Vec::with_capacity(MAP_LEN * 4), count: 0 };
        deserializer.deserialize_seq(Flatten(&mut numbers))?;
        Ok(numbers)
    }
}

/// Reads a number, or a list of what it reads, into the numbers.
struct Flatten<'a>(&'a mut Numbers);

impl<'de> serde::de::DeserializeSeed<'de> for Flatten<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Flatten<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a list of numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(Flatten(self.0))?.is_some() {}
        Ok(())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<(), E> {
        self.0.push(value);
        Ok(())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        self.0.push(value as f64);
        Ok(())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<(), E> {
        self.0.push(value as f64);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
