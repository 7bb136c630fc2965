//! What the service says of itself.

use std::sync::atomic::Ordering;

use axum::{extract::State, response::Response};
use papilla_proto::Problem;
use serde_json::{Value, json};

use super::{Answer, Shared, answer, json_answer, refuse};
use crate::{models::Catalogue, problem};

/// The description of the HTTP surface, written by hand.
pub(crate) const OPENAPI: &str = include_str!("../../openapi.json");

/// Alive: the process answers.
pub(super) async fn healthz() -> Response {
    json_answer(&json!({"status": "ok"}))
}

/// Ready: every thread has its models, and the server does not drain.
pub(super) async fn readyz(State(app): Shared) -> Answer {
    if app.is_draining() {
        return refuse(&app, problem::shutting_down());
    }
    Ok(json_answer(&json!({"status": "ready"})))
}

pub(super) async fn metrics(State(app): Shared) -> Answer {
    let text = app
        .metrics
        .encode()
        .map_err(|e| -> Problem { problem::internal("the metrics cannot be encoded", &e) })?;
    Ok(answer("application/openmetrics-text; version=1.0.0; charset=utf-8", text))
}

pub(super) async fn openapi() -> Response {
    answer("application/json", OPENAPI)
}

pub(super) async fn tiers(State(app): Shared) -> Response {
    let catalogue = app.catalogue();
    let tiers: Vec<Value> = catalogue.offered().map(|(index, _)| tier(&catalogue, index)).collect();
    json_answer(&json!({
        "default": catalogue.tiers[catalogue.default].name,
        "judged_on": catalogue.judged_on,
        "overhead_us": catalogue.overhead.us(),
        "tiers": tiers,
        "ladder": catalogue.ladder,
    }))
}

fn tier(catalogue: &Catalogue, index: usize) -> Value {
    let tier = &catalogue.tiers[index];
    json!({
        "name": tier.name,
        "kind": tier.kind,
        "default": index == catalogue.default,
        "effects": tier.effects,
        "atlas_hash": tier.atlas_hash,
        "pressure_max_pa": tier.pressure_max_pa,
        "pattern_max": tier.pattern_max,
        "sed_max_j_per_m3": tier.sed_max_j_per_m3,
        "relative_l2_median": tier.relative_l2_median,
        "predicted_latency_us": catalogue.predicted_latency_us(index),
        "calibrated_us": tier.speed.calibrated_us(),
        "sessions": tier.sessions.load(Ordering::Relaxed),
    })
}

pub(super) async fn models(State(app): Shared) -> Response {
    let catalogue = app.catalogue();
    let cards: Vec<&Value> = catalogue.offered().map(|(_, tier)| &tier.card).collect();
    json_answer(&json!({"models": cards}))
}
