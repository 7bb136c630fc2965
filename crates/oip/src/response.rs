//! The answer to an inference request.

use bytes::{BufMut, Bytes, BytesMut};
use papilla_proto::OUTPUT_NAME;
use serde::Serialize;

use crate::{DATATYPE, Request, SHAPE, VERSION};

#[derive(Serialize)]
struct Head<'a> {
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

/// A SED map on its way out, in the form that its request asks for.
#[derive(Debug)]
pub struct Answer<'a> {
    /// Name of the model that made it.
    pub model: &'a str,
    /// What it answers.
    pub request: Request,
    /// f32 samples, little-endian, J/m3.
    pub sed_j_per_m3: Bytes,
}

/// The body of an answer.
#[derive(Debug)]
pub struct Body {
    /// Length of the JSON, for the header [`HEAD_LEN`](crate::HEAD_LEN); None: all of it is JSON.
    pub head_len: Option<usize>,
    /// JSON, and behind it, if the request asks for that, the samples.
    pub bytes: Bytes,
}

impl Answer<'_> {
    /// Writes the body. In digits that is fifty thousand numbers: some milliseconds.
    ///
    /// # Errors
    /// The serialiser fails (out of memory apart, it does not).
    pub fn encode(&self) -> Result<Body, serde_json::Error> {
        if !self.request.is_binary_wanted {
            let (samples, _) = self.sed_j_per_m3.as_chunks::<4>();
            let data = samples.iter().map(|sample| f32::from_le_bytes(*sample)).collect();
            let bytes = self.head(Some(data), None)?.into();
            return Ok(Body { head_len: None, bytes });
        }
        let parameters = Parameters { binary_data_size: self.sed_j_per_m3.len() };
        let head = self.head(None, Some(parameters))?;
        let mut bytes = BytesMut::with_capacity(head.len() + self.sed_j_per_m3.len());
        bytes.put_slice(&head);
        bytes.put_slice(&self.sed_j_per_m3);
        Ok(Body { head_len: Some(head.len()), bytes: bytes.freeze() })
    }

    fn head(
        &self,
        data: Option<Vec<f32>>,
        parameters: Option<Parameters>,
    ) -> Result<Vec<u8>, serde_json::Error> {
        let output =
            Output { name: OUTPUT_NAME, datatype: DATATYPE, shape: SHAPE, parameters, data };
        serde_json::to_vec(&Head {
            model_name: self.model,
            model_version: VERSION,
            id: self.request.id.as_deref(),
            outputs: [output],
        })
    }
}

#[cfg(test)]
mod tests {
    use papilla_proto::MAP_LEN;
    use serde_json::Value;

    use super::*;

    #[test]
    fn both_forms_carry_the_same_numbers() {
        let map: Vec<f32> = (0..MAP_LEN).map(|i| i as f32 * 0.37).collect();
        let samples: Bytes = map.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>().into();
        let answer = |is_binary_wanted| {
            let id = Some("seven".to_owned());
            let request =
                Request { id, is_binary_wanted, timeout_us: None, pressure_pa: Bytes::new() };
            Answer { model: "small", request, sed_j_per_m3: samples.clone() }.encode().unwrap()
        };
        let json = answer(false);
        assert_eq!(json.head_len, None);
        let value: Value = serde_json::from_slice(&json.bytes).unwrap();
        assert_eq!((&value["model_name"], &value["id"]), (&"small".into(), &"seven".into()));
        let data: Vec<f32> = serde_json::from_value(value["outputs"][0]["data"].clone()).unwrap();
        assert_eq!(data, map);

        let binary = answer(true);
        let (head, blob) = binary.bytes.split_at(binary.head_len.unwrap());
        assert_eq!(blob, samples);
        let value: Value = serde_json::from_slice(head).unwrap();
        let output = &value["outputs"][0];
        assert_eq!(output["parameters"]["binary_data_size"], 4 * MAP_LEN);
        assert!(output.get("data").is_none());
    }
}
