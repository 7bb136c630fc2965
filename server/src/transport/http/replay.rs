//! `/v1/presses`: the states of the replay, to compare networks with FE.

use std::sync::Arc;

use axum::{
    extract::State as AppState,
    http::{HeaderMap, Uri},
};
use bytes::BytesMut;
use papilla_codec::{Map, Output, Quantity, encode};
use papilla_proto::{
    ErrorCode, MAP_LEN, Problem,
    atlas::{AtlasError, Raster, VertexSampler},
    contact::DEFAULT_FINGER,
    error::shortened,
};
use serde_json::{Value, json};

use crate::{
    core::{
        cache::Content,
        catalogue::{Catalogue, Document, replay::State},
        fingers::Loaded,
    },
    problem,
    transport::{
        answer::{Answer, Shared, cached, refuse},
        http::finger::Asked,
        negotiate,
    },
};

pub(crate) async fn list(
    AppState(app): Shared,
    Asked(Loaded { catalogue, .. }): Asked,
    headers: HeaderMap,
) -> Answer {
    let of = Arc::clone(&catalogue);
    let make = move || {
        let states = of.replay.states.iter().enumerate().map(|(id, state)| {
            json!({"id": id, "name": state.name, "pose": state.pose, "depth_mm": state.depth_mm})
        });
        let states: Vec<Value> = states.collect();
        let text = json!({"atlas_hash": of.atlas.hash(), "presses": states}).to_string();
        Ok(Content::new("application/json", text))
    };
    let made = cached(&catalogue.cache, &headers, Document::States, make).await;
    made.or_else(|problem| refuse(&app, problem))
}

/// The state whose number stands in the path, `/v1/presses/{press}`.
///
/// Taken from the raw path: axum's own extractor would refuse broken percent-encoding in
/// words that are not our JSON.
fn find(catalogue: &Catalogue, uri: &Uri) -> Result<usize, Problem> {
    let states = &catalogue.replay.states;
    let asked = uri.path().split('/').nth(3).unwrap_or_default();
    let found = asked.parse().ok().filter(|id: &usize| *id < states.len());
    found.ok_or_else(|| {
        let message = if states.is_empty() {
            let (of, folder) = match &*catalogue.name {
                DEFAULT_FINGER => ("this service".to_owned(), "models"),
                name => (format!("finger '{name}'"), "this finger"),
            };
            format!(
                "{of} has no press to replay: `fe-datagen dataset replay DATASET --out FOLDER` \
                 makes the replay.json of the folder of {folder}"
            )
        } else {
            let asked = shortened(asked);
            format!("no press '{asked}'; there are {}, counted from 0", states.len())
        };
        Problem::new(ErrorCode::NotFound, message)
    })
}

/// Values read from the maps at the atlas' vertices, in its order.
pub(crate) async fn one(
    AppState(app): Shared,
    Asked(Loaded { catalogue, .. }): Asked,
    uri: Uri,
    headers: HeaderMap,
) -> Answer {
    let state = match find(&catalogue, &uri) {
        Ok(state) => state,
        Err(problem) => return refuse(&app, problem),
    };
    let of = Arc::clone(&catalogue);
    let make = move || {
        let at_vertices = |quantity| {
            let (raster, map) = drawn(&of, state, quantity)?;
            let sampler = VertexSampler::new(&of.atlas, raster);
            let mut values = vec![0.0; sampler.vertex_count()];
            sampler.sample(&map, &mut values).map_err(|error| unfit(&error))?;
            Ok::<_, Problem>(values)
        };
        let (pressure_pa, sed_j_per_m3) =
            (at_vertices(Quantity::Pressure)?, at_vertices(Quantity::Sed)?);
        let State { name, pose, depth_mm, .. } = &of.replay.states[state];
        let text = json!({"name": name, "pose": pose, "depth_mm": depth_mm,
            "pressure_pa": pressure_pa, "sed_j_per_m3": sed_j_per_m3});
        Ok(Content::new("application/json", text.to_string()))
    };
    let made = cached(&catalogue.cache, &headers, Document::State(state), make).await;
    made.or_else(|problem| refuse(&app, problem))
}

/// The pressure as a map, ready to be posted.
pub(crate) async fn pressure(app: Shared, asked: Asked, uri: Uri, headers: HeaderMap) -> Answer {
    map(app, asked, &uri, &headers, Quantity::Pressure).await
}

/// The FE solver's SED as a map.
pub(crate) async fn sed(app: Shared, asked: Asked, uri: Uri, headers: HeaderMap) -> Answer {
    map(app, asked, &uri, &headers, Quantity::Sed).await
}

async fn map(
    AppState(app): Shared,
    Asked(Loaded { catalogue, .. }): Asked,
    uri: &Uri,
    headers: &HeaderMap,
    quantity: Quantity,
) -> Answer {
    let asked = find(&catalogue, uri).and_then(|state| Ok((state, negotiate::output(headers)?)));
    let (state, output) = match asked {
        Ok(asked) => asked,
        Err(problem) => return refuse(&app, problem),
    };
    let of = Arc::clone(&catalogue);
    let make = move || encoded(&of, state, quantity, output);
    let document = Document::StateMap(state, quantity, output);
    let made = cached(&catalogue.cache, headers, document, make).await;
    made.or_else(|problem| refuse(&app, problem))
}

fn drawn(
    catalogue: &Catalogue,
    state: usize,
    quantity: Quantity,
) -> Result<(&Raster, Vec<f32>), Problem> {
    let state = &catalogue.replay.states[state];
    let (raster, values) = match quantity {
        Quantity::Pressure => (&*catalogue.skin, &state.pressure_pa),
        Quantity::Sed => (&catalogue.interface, &state.sed_j_per_m3),
    };
    let mut map = vec![0.0; MAP_LEN];
    raster.scatter(values, &mut map).map_err(|error| unfit(&error))?;
    Ok((raster, map))
}

fn unfit(error: &AtlasError) -> Problem {
    problem::internal("the press does not fit the atlas", error)
}

fn encoded(
    catalogue: &Catalogue,
    state: usize,
    quantity: Quantity,
    output: Output,
) -> Result<Content, Problem> {
    let (_, values) = drawn(catalogue, state, quantity)?;
    let white = match quantity {
        Quantity::Pressure => "x-pressure-max-pa",
        Quantity::Sed => "x-sed-max-j-per-m3",
    };
    let mut bytes = BytesMut::with_capacity(output.size_hint());
    let map = Map { quantity, values: &values, source: "fe" };
    let scale = encode(output, map, &mut bytes)
        .map_err(|error| problem::internal("the map cannot be encoded", &error))?;
    let white = (output == Output::Png).then_some((white, scale));
    Ok(Content { white, is_negotiated: true, ..Content::new(output.content_type(), bytes) })
}
