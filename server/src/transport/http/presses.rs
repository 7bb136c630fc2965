//! The replay: FE presses to hold the networks against.

use std::sync::Arc;

use axum::{
    extract::State,
    http::{HeaderMap, Uri},
};
use bytes::BytesMut;
use papilla_proto::{ErrorCode, MAP_LEN, Problem, error::shortened};
use serde_json::{Value, json};

use super::{
    Answer, Shared,
    kept::{Fresh, What},
    refuse,
};
use crate::{
    codec::{self, Map, Output, Quantity},
    core::catalogue::Catalogue,
    problem,
    transport::negotiate,
};

pub(super) async fn list(State(app): Shared, headers: HeaderMap) -> Answer {
    let catalogue = app.catalogue();
    let of = Arc::clone(&catalogue);
    let make = move || {
        let presses = of.replay.presses.iter().enumerate().map(|(id, press)| {
            json!({"id": id, "name": press.name, "pose": press.pose, "depth_mm": press.depth_mm})
        });
        let presses: Vec<Value> = presses.collect();
        let text = json!({"atlas_hash": of.atlas.hash(), "presses": presses}).to_string();
        Ok(Fresh::new("application/json", text))
    };
    let made = catalogue.kept.answer(&headers, What::Presses, make).await;
    made.or_else(|problem| refuse(&app, problem))
}

/// The number of the press in the path, `/v1/presses/{press}`.
///
/// Taken from the raw path: axum's own extractor would refuse broken percent-encoding in
/// words that are not our JSON.
fn find(catalogue: &Catalogue, uri: &Uri) -> Result<usize, Problem> {
    let presses = &catalogue.replay.presses;
    let press = uri.path().split('/').nth(3).unwrap_or_default();
    let found = press.parse().ok().filter(|id: &usize| *id < presses.len());
    found.ok_or_else(|| {
        let press = shortened(press);
        let message = format!("no press '{press}'; there are {}, counted from 0", presses.len());
        Problem::new(ErrorCode::NotFound, message)
    })
}

/// Vertex values, as the atlas orders them.
pub(super) async fn one(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    let catalogue = app.catalogue();
    let press = match find(&catalogue, &uri) {
        Ok(press) => press,
        Err(problem) => return refuse(&app, problem),
    };
    let of = Arc::clone(&catalogue);
    let make = move || match serde_json::to_vec(&of.replay.presses[press]) {
        Ok(bytes) => Ok(Fresh::new("application/json", bytes)),
        Err(error) => Err(problem::internal("the press cannot be encoded", &error)),
    };
    let made = catalogue.kept.answer(&headers, What::Press(press), make).await;
    made.or_else(|problem| refuse(&app, problem))
}

/// The pressure as a map, ready to be posted.
pub(super) async fn pressure(state: Shared, uri: Uri, headers: HeaderMap) -> Answer {
    map(state, &uri, &headers, Quantity::Pressure).await
}

/// The FE solver's SED as a map.
pub(super) async fn sed(state: Shared, uri: Uri, headers: HeaderMap) -> Answer {
    map(state, &uri, &headers, Quantity::Sed).await
}

async fn map(State(app): Shared, uri: &Uri, headers: &HeaderMap, quantity: Quantity) -> Answer {
    let catalogue = app.catalogue();
    let asked = find(&catalogue, uri).and_then(|press| Ok((press, negotiate::output(headers)?)));
    let (press, output) = match asked {
        Ok(asked) => asked,
        Err(problem) => return refuse(&app, problem),
    };
    let of = Arc::clone(&catalogue);
    let make = move || rasterised(&of, press, quantity, output);
    let what = What::PressMap(press, quantity, output);
    let made = catalogue.kept.answer(headers, what, make).await;
    made.or_else(|problem| refuse(&app, problem))
}

fn rasterised(
    catalogue: &Catalogue,
    press: usize,
    quantity: Quantity,
    output: Output,
) -> Result<Fresh, Problem> {
    let press = &catalogue.replay.presses[press];
    let (raster, vertex_values, white) = match quantity {
        Quantity::Pressure => (&catalogue.skin, &press.pressure_pa, "x-pressure-max-pa"),
        Quantity::Sed => (&catalogue.interface, &press.sed_j_per_m3, "x-sed-max-j-per-m3"),
    };
    let mut values = vec![0.0; MAP_LEN];
    raster
        .rasterise(vertex_values, &mut values)
        .map_err(|error| problem::internal("the press does not fit the atlas", &error))?;
    let mut bytes = BytesMut::with_capacity(output.size_hint());
    // No common scale: each picture uses the whole range of gray.
    let map = Map { quantity, values: &values, value_max: f32::MIN_POSITIVE, source: "fe" };
    let scale = codec::encode(output, map, &mut bytes)?;
    let white = (output == Output::Png).then_some((white, scale));
    Ok(Fresh { white, ..Fresh::new(output.content_type(), bytes) })
}
