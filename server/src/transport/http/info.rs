//! What the service says about itself: health, metrics, tiers, models.

use std::sync::{Arc, atomic::Ordering};

use axum::{
    extract::State,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::Response,
};
use papilla_metrics::Metrics;
use papilla_proto::{Problem, contact::ContactMethod};
use papilla_session_contact::ContactAssets;
use serde::Serialize;
use serde_json::{Value, json};
use tokio::{sync::Semaphore, task::spawn_blocking};

use crate::{
    core::{
        cache::Content,
        catalogue::{Catalogue, Document},
        fingers::Loaded,
    },
    problem, progress,
    transport::{
        answer::{Answer, Shared, answer, cached, json_answer, refusal::label, refuse},
        http::finger::Asked,
    },
};

/// Alive: the process answers.
pub(crate) async fn healthz() -> Response {
    json_answer(&json!({"status": "ok"}))
}

/// Ready: every thread has its models, every tier is measured, and the server does not drain.
pub(crate) async fn readyz(State(app): Shared) -> Answer {
    if app.is_draining() {
        return refuse(&app, problem::shutting_down());
    }
    Ok(match app.progress.left() {
        Some(left) => starting(&app.metrics, &left),
        None => json_answer(&json!({"status": "ready"})),
    })
}

/// What `/readyz` answers while the start goes on: a refusal that says what is left.
pub(crate) fn starting(metrics: &Metrics, left: &progress::State) -> Response {
    #[derive(Serialize)]
    struct Starting<'a> {
        error: &'a Problem,
        status: &'static str,
        #[serde(flatten)]
        left: &'a progress::State,
    }
    let problem = left.problem();
    metrics.error(problem.code);
    let mut response = json_answer(&Starting { error: &problem, status: "starting", left });
    *response.status_mut() = StatusCode::SERVICE_UNAVAILABLE;
    let headers = response.headers_mut();
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    label(headers, problem.code, None);
    response
}

/// One text at a time, and not on a thread that moves bytes: it takes milliseconds, and looks into
/// the system's files.
pub(crate) async fn metrics(State(app): Shared) -> Answer {
    static TURN: Semaphore = Semaphore::const_new(1);
    let failed = |error: &dyn std::fmt::Display| -> Problem {
        problem::internal("the metrics cannot be encoded", error)
    };
    let _turn = TURN.acquire().await.map_err(|error| failed(&error))?;
    let metrics = Arc::clone(&app.metrics);
    let text = spawn_blocking(move || metrics.encode()).await.map_err(|error| failed(&error))?;
    let text = text.map_err(|error| failed(&error))?;
    Ok(answer("application/openmetrics-text; version=1.0.0; charset=utf-8", text))
}

pub(crate) async fn tiers(Asked(Loaded { catalogue, contact }): Asked) -> Answer {
    let tiers: Vec<Value> = catalogue.offered().map(|(index, _)| tier(&catalogue, index)).collect();
    // The ladder is long and never changes: its JSON is put in as it is.
    let text = format!(
        r#"{{"default":{},"default_for_pressure":{},"judged_on":{},"ladder":{},"methods":{},"overhead_us":{},"tiers":{}}}"#,
        json!(catalogue.tiers[catalogue.default].name),
        json!(catalogue.tiers[catalogue.default_for_pressure].name),
        json!(catalogue.judged_on),
        catalogue.ladder_json,
        json!(contact.as_deref().map(methods)),
        catalogue.overhead.us(),
        json!(tiers),
    );
    Ok(answer("application/json", text))
}

/// What each method of contact takes and errs.
fn methods(contact: &ContactAssets) -> Vec<Value> {
    let method = |&(method, us): &(ContactMethod, u64)| {
        let errors = contact.errors.as_ref().map_or(&[][..], |errors| errors.all_of(method));
        json!({"name": method, "contact_us": us, "errors": errors})
    };
    contact.frame_us().iter().map(method).collect()
}

fn tier(catalogue: &Catalogue, index: usize) -> Value {
    let tier = &catalogue.tiers[index];
    json!({
        "name": tier.name,
        "kind": tier.kind,
        "backend": tier.backend_label(),
        "on_demand": tier.on_demand,
        "loaded": tier.is_loaded(),
        "default": index == catalogue.default,
        "default_for_pressure": index == catalogue.default_for_pressure,
        "learnt": tier.learnt,
        "effects": tier.effects,
        "atlas_hash": tier.atlas_hash,
        "pressure_max_pa": tier.pressure_max_pa,
        "pattern_max": tier.input_statistics_max,
        "sed_max_j_per_m3": tier.sed_max_j_per_m3,
        "relative_l2_median": tier.relative_l2_median,
        "relative_l2_median_from_poses": tier.relative_l2_median_from_poses,
        "trained_on": tier.trained_on.as_ref().map(|lender| &lender.name),
        "named_only": tier.named_only,
        "predicted_latency_us": catalogue.predicted_latency_us(index),
        "calibrated_us": tier.latency.calibrated_us(),
        "sessions": tier.sessions.load(Ordering::Relaxed),
    })
}

pub(crate) async fn models(
    State(app): Shared,
    Asked(Loaded { catalogue, .. }): Asked,
    headers: HeaderMap,
) -> Answer {
    let of = Arc::clone(&catalogue);
    let make = move || {
        let cards: Vec<&Value> = of.offered().map(|(_, tier)| &tier.card).collect();
        Ok(Content::new("application/json", json!({"models": cards}).to_string()))
    };
    let models = cached(&catalogue.cache, &headers, Document::Models, make).await;
    models.or_else(|problem| refuse(&app, problem))
}
