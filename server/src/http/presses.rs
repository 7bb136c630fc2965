//! The replay: FE presses to hold the networks against.

use axum::{
    extract::State,
    http::{HeaderMap, HeaderValue, Uri},
    response::Response,
};
use bytes::BytesMut;
use papilla_proto::{ErrorCode, MAP_LEN, Problem, atlas::Raster};
use serde_json::{Value, json};

use super::{Answer, Shared, answer, json_answer, refuse};
use crate::{
    codec::{self, Map, Output, Quantity},
    models::Catalogue,
    negotiate, problem,
    replay::Press,
};

pub(super) async fn list(State(app): Shared) -> Response {
    let catalogue = app.catalogue();
    let presses: Vec<Value> = catalogue
        .replay
        .presses
        .iter()
        .enumerate()
        .map(|(id, press)| {
            json!({"id": id, "name": press.name, "pose": press.pose, "depth_mm": press.depth_mm})
        })
        .collect();
    json_answer(&json!({"atlas_hash": catalogue.atlas.hash(), "presses": presses}))
}

/// The press whose number is the third part of the path, `/v1/presses/{press}`.
///
/// Taken from the raw path: axum's own extractor would refuse broken percent-encoding in
/// words that are not our JSON.
fn find<'a>(catalogue: &'a Catalogue, uri: &Uri) -> Result<&'a Press, Problem> {
    let presses = &catalogue.replay.presses;
    let press = uri.path().split('/').nth(3).unwrap_or_default();
    let found = press.parse().ok().and_then(|id: usize| presses.get(id));
    found.ok_or_else(|| {
        let press = problem::excerpt(press);
        let message = format!("no press '{press}'; there are {}, counted from 0", presses.len());
        Problem::new(ErrorCode::NotFound, message)
    })
}

/// Vertex values, as the atlas orders them.
pub(super) async fn one(State(app): Shared, uri: Uri) -> Answer {
    match find(&app.catalogue(), &uri) {
        Ok(press) => Ok(json_answer(press)),
        Err(problem) => refuse(&app, problem),
    }
}

/// The pressure as a map, ready to be posted.
pub(super) async fn pressure(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    let catalogue = app.catalogue();
    let map = find(&catalogue, &uri).and_then(|press| {
        rasterised(&catalogue.skin, &press.pressure_pa, Quantity::Pressure, &headers)
    });
    map.or_else(|problem| refuse(&app, problem))
}

/// The FE solver's SED as a map.
pub(super) async fn sed(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    let catalogue = app.catalogue();
    let map = find(&catalogue, &uri).and_then(|press| {
        rasterised(&catalogue.interface, &press.sed_j_per_m3, Quantity::Sed, &headers)
    });
    map.or_else(|problem| refuse(&app, problem))
}

fn rasterised(
    raster: &Raster,
    vertex_values: &[f32],
    quantity: Quantity,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let output = negotiate::output(headers)?;
    let mut values = vec![0.0; MAP_LEN];
    raster
        .rasterise(vertex_values, &mut values)
        .map_err(|error| problem::internal("the press does not fit the atlas", &error))?;
    let mut bytes = BytesMut::with_capacity(output.size_hint());
    // No common scale: each picture uses the whole range of gray.
    let map = Map { quantity, values: &values, value_max: f32::MIN_POSITIVE, source: "fe" };
    let scale = codec::encode(output, map, &mut bytes)?;
    let mut response = answer(output.content_type(), bytes.freeze());
    if let (Output::Png, Ok(white)) = (output, HeaderValue::from_str(&scale.to_string())) {
        let name = match quantity {
            Quantity::Pressure => "x-pressure-max-pa",
            Quantity::Sed => "x-sed-max-j-per-m3",
        };
        response.headers_mut().insert(name, white);
    }
    Ok(response)
}
