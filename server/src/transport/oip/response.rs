//! The answer to an inference request.

use axum::{http::HeaderValue, response::Response};
use bytes::{BufMut, Bytes, BytesMut};
use papilla_engine::OUTPUT_NAME;
use papilla_proto::Problem;
use serde::Serialize;

use super::{DATATYPE, SHAPE, VERSION, request::Wish};
use crate::{problem, transport::answer::answer};

#[derive(Serialize)]
struct Body<'a> {
    model_name: &'a str,
    model_version: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<&'a str>,
    outputs: [Output; 1],
}

#[derive(Serialize)]
struct Output {
    name: &'static str,
    datatype: &'static str,
    shape: [usize; 4],
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<Parameters>,
    #[serde(skip_serializing_if = "Option::is_none")]
    data: Option<Vec<f32>>,
}

#[derive(Serialize)]
struct Parameters {
    binary_data_size: usize,
}

/// A SED map on its way out.
pub(super) struct Tensor {
    pub(super) model: String,
    pub(super) wish: Wish,
    /// f32 samples, little-endian, J/m3.
    pub(super) sed: Bytes,
}

impl Tensor {
    /// The numbers in the JSON.
    pub(super) fn json(&self) -> Result<Response, Problem> {
        let (samples, _) = self.sed.as_chunks::<4>();
        let data = samples.iter().map(|sample| f32::from_le_bytes(*sample)).collect();
        Ok(answer("application/json", self.head(Some(data), None)?))
    }

    /// The numbers as bytes behind the JSON.
    pub(super) fn binary(&self) -> Result<Response, Problem> {
        let parameters = Parameters { binary_data_size: self.sed.len() };
        let head = self.head(None, Some(parameters))?;
        let mut body = BytesMut::with_capacity(head.len() + self.sed.len());
        body.put_slice(&head);
        body.put_slice(&self.sed);
        let mut response = answer("application/octet-stream", body.freeze());
        let headers = response.headers_mut();
        headers.insert("inference-header-content-length", HeaderValue::from(head.len()));
        Ok(response)
    }

    fn head(
        &self,
        data: Option<Vec<f32>>,
        parameters: Option<Parameters>,
    ) -> Result<Vec<u8>, Problem> {
        let output =
            Output { name: OUTPUT_NAME, datatype: DATATYPE, shape: SHAPE, parameters, data };
        let body = Body {
            model_name: &self.model,
            model_version: VERSION,
            id: self.wish.id.as_deref(),
            outputs: [output],
        };
        serde_json::to_vec(&body)
            .map_err(|error| problem::internal("the answer cannot be encoded", &error))
    }
}
