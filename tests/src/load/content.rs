//! What the frames hold: FE simulations.

use papilla_dataset::Split;
use std::path::Path;

use papilla_model_export::dataset::Dataset;
use papilla_proto::{MAP_LEN, SampleType, atlas::Atlas};
use serde::{Deserialize, de::DeserializeOwned};

use super::LoadError;
use crate::http::Request;

/// Pressure maps of FE simulations.
#[derive(Clone, Debug)]
pub struct Content {
    /// Where they are from, for people.
    pub source: String,
    /// The atlas they are drawn with.
    pub atlas_hash: String,
    /// 224 x 224 samples each, row-major, Pa.
    pub maps_pa: Vec<Vec<f32>>,
}

#[derive(Deserialize)]
struct StateList {
    #[serde(rename = "presses")]
    states: Vec<StateEntry>,
}

#[derive(Deserialize)]
struct StateEntry {
    id: usize,
}

impl Content {
    /// The first `count` samples of a split of the dataset in `folder`.
    ///
    /// # Errors
    /// [`LoadError::Dataset`] if the dataset is damaged.
    pub fn from_dataset(folder: &Path, split: Split, count: usize) -> Result<Self, LoadError> {
        let dataset = Dataset::open(folder)?;
        let mut maps_pa = Vec::new();
        for indentation in dataset.indentations(split)? {
            let shard = dataset.shard(indentation)?;
            for state in 0..shard.depth_mm.len().min(count - maps_pa.len()) {
                let mut map_pa = vec![0.0; MAP_LEN];
                dataset.draw_pressure(indentation, &shard, state, &mut map_pa)?;
                maps_pa.push(map_pa);
            }
        }
        let source = format!("split {split} of {}", folder.display());
        Ok(Self { source, atlas_hash: dataset.atlas().hash().to_owned(), maps_pa })
    }

    /// The first `count` states that the service at `server` ships.
    ///
    /// # Errors
    /// [`LoadError`]: the service does not answer, or ships none.
    pub async fn from_server(server: &str, count: usize) -> Result<Self, LoadError> {
        let atlas: Atlas = get(server, "/v1/atlas").await?;
        let list: StateList = get(server, "/v1/presses").await?;
        let mut maps_pa = Vec::new();
        for entry in list.states.iter().take(count) {
            maps_pa.push(get_map(server, &format!("/v1/presses/{}/pressure", entry.id)).await?);
        }
        let source = format!("the presses of {server}");
        if maps_pa.is_empty() {
            return Err(LoadError::NoMaps(source));
        }
        Ok(Self { source, atlas_hash: atlas.hash().to_owned(), maps_pa })
    }
}

async fn get_map(server: &str, path: &str) -> Result<Vec<f32>, LoadError> {
    let body = get_bytes(server, path).await?;
    if body.len() != 4 * MAP_LEN {
        let reason = format!("{} bytes, a map has {}", body.len(), 4 * MAP_LEN);
        return Err(LoadError::Service { path: path.to_owned(), reason });
    }
    Ok(body.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect())
}

pub(super) async fn get<T: DeserializeOwned>(server: &str, path: &str) -> Result<T, LoadError> {
    let bad = |error: serde_json::Error| LoadError::Service {
        path: path.to_owned(),
        reason: error.to_string(),
    };
    serde_json::from_slice(&get_bytes(server, path).await?).map_err(bad)
}

async fn get_bytes(server: &str, path: &str) -> Result<Vec<u8>, LoadError> {
    let answer = Request::get(path).send(server).await?;
    if answer.status != 200 {
        let reason = format!("status {}: {}", answer.status, answer.text());
        return Err(LoadError::Service { path: path.to_owned(), reason });
    }
    Ok(answer.body)
}

/// The maps as they go over the wire.
#[derive(Clone, Debug)]
pub(super) struct Encoded {
    pub(super) sample_type: SampleType,
    /// Pa per unit for u16 and u8, else 1.
    pub(super) scale: f32,
    pub(super) payloads: Vec<Vec<u8>>,
}

impl Encoded {
    /// Encodes all maps with one scale, the finest that clips none.
    pub(super) fn new(content: &Content, sample_type: SampleType) -> Result<Self, LoadError> {
        let peak_pa = content.maps_pa.iter().flatten().copied().fold(0.0, f32::max);
        let scale = if sample_type.is_scaled() && peak_pa > 0.0 {
            peak_pa / sample_type.unit_max()
        } else {
            1.0
        };
        if sample_type == SampleType::F16 && peak_pa > sample_type.value_max(scale) {
            return Err(LoadError::BeyondF16(peak_pa));
        }
        let encode = |map: &Vec<f32>| {
            let mut payload = vec![0; map.len() * sample_type.bytes()];
            sample_type.encode(map, scale, &mut payload).map(|()| payload)
        };
        let payloads = content.maps_pa.iter().map(encode).collect::<Result<_, _>>()?;
        Ok(Self { sample_type, scale, payloads })
    }

    /// Which payload `frame` of `session` holds. Frames of all `fingers` follow one another, so that
    /// each finger gets one payload after another; sessions and fingers start at different ones.
    pub(super) fn index(&self, session: usize, frame: u32, fingers: u32) -> usize {
        let (instant, finger) = (frame / fingers, frame % fingers);
        (session * 7 + finger as usize * 5 + instant as usize) % self.payloads.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_scale_serves_all_maps() {
        let maps_pa = vec![vec![0.0, 510.0], vec![1.0, 2.0]];
        let content = Content { source: String::new(), atlas_hash: String::new(), maps_pa };
        let encoded = Encoded::new(&content, SampleType::U8).unwrap();
        assert_eq!(encoded.scale.to_bits(), 2.0_f32.to_bits());
        assert_eq!(encoded.payloads, [vec![0, 255], vec![1, 1]]);
        let sent: Vec<_> = (0..3).map(|frame| encoded.index(1, frame, 1)).collect();
        assert_eq!(sent, [1, 0, 1]);
        let of_two: Vec<_> = (0..6).map(|frame| encoded.index(0, frame, 2)).collect();
        assert_eq!(of_two, [0, 1, 1, 0, 0, 1], "each of two fingers gets one map after another");
        let above = Content { maps_pa: vec![vec![7e4]], ..content };
        assert!(matches!(Encoded::new(&above, SampleType::F16), Err(LoadError::BeyondF16(_))));
        assert!(Encoded::new(&above, SampleType::F32).is_ok());
    }
}
