//! The HTTP surface: one list of routes, from which the router is built.

mod atlas;
mod body;
mod effects;
mod info;
mod page;
mod presses;
mod sed;

use std::sync::Arc;

use axum::{
    Router,
    body::Body,
    extract::State,
    http::{HeaderValue, Method, Uri, header},
    response::{IntoResponse, Response},
    routing::{MethodRouter, get, post},
};
use bytes::Bytes;
use papilla_proto::{ErrorCode, Problem};
use serde::Serialize;

use crate::{app::App, problem::HttpProblem, session};

type Shared = State<Arc<App>>;
type Answer = Result<Response, HttpProblem>;

/// Every route: method, path, handler. The OpenAPI document lists the same, and a test
/// holds the two against each other.
fn routes() -> Vec<(Method, &'static str, MethodRouter<Arc<App>>)> {
    let g = Method::GET;
    vec![
        (g.clone(), "/", get(page::index)),
        (g.clone(), "/{file}", get(page::file)),
        (g.clone(), "/healthz", get(info::healthz)),
        (g.clone(), "/readyz", get(info::readyz)),
        (g.clone(), "/metrics", get(info::metrics)),
        (g.clone(), "/openapi.json", get(info::openapi)),
        (g.clone(), "/v1/tiers", get(info::tiers)),
        (g.clone(), "/v1/models", get(info::models)),
        (g.clone(), "/v1/effects", get(effects::list)),
        (g.clone(), "/v1/atlas", get(atlas::json)),
        (g.clone(), "/v1/atlas.obj", get(atlas::obj)),
        (g.clone(), "/v1/atlas/mask.png", get(atlas::mask)),
        (g.clone(), "/v1/presses", get(presses::list)),
        (g.clone(), "/v1/presses/{press}", get(presses::one)),
        (g.clone(), "/v1/presses/{press}/pressure", get(presses::pressure)),
        (g.clone(), "/v1/presses/{press}/sed", get(presses::sed)),
        (Method::POST, "/v1/sed", post(sed::post)),
        (g, "/v1/session", get(session::open)),
    ]
}

/// The method and path of every route, as OpenAPI writes them.
pub(crate) fn route_list() -> Vec<(String, String)> {
    let list = routes().into_iter();
    list.map(|(method, path, _)| (method.as_str().to_ascii_lowercase(), path.to_owned())).collect()
}

/// The whole router.
pub(crate) fn router(app: Arc<App>) -> Router {
    let mut router = Router::new();
    for (_, path, handler) in routes() {
        router = router.route(path, handler);
    }
    router.fallback(not_found).method_not_allowed_fallback(method_not_allowed).with_state(app)
}

async fn not_found(State(app): Shared, uri: Uri) -> Answer {
    refuse(&app, Problem::new(ErrorCode::NotFound, format!("there is nothing at {}", uri.path())))
}

async fn method_not_allowed(State(app): Shared, method: Method, uri: Uri) -> Answer {
    let message = format!("{} does not take {method}", uri.path());
    refuse(&app, Problem::new(ErrorCode::MethodNotAllowed, message))
}

/// Counts a refusal and makes it the answer.
fn refuse(app: &App, problem: Problem) -> Answer {
    app.metrics.error(problem.code);
    Err(HttpProblem(problem))
}

/// An answer of `content_type`.
fn answer(content_type: &'static str, body: impl Into<Body>) -> Response {
    let mut response = Response::new(body.into());
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
    response
}

/// An answer of JSON.
fn json_answer(value: &impl Serialize) -> Response {
    match serde_json::to_vec(value) {
        Ok(bytes) => answer("application/json", bytes),
        Err(error) => HttpProblem(crate::problem::internal("the answer cannot be encoded", &error))
            .into_response(),
    }
}

/// An answer the client may keep, but must ask about: 304 if `etag` is the one it has.
fn tagged(
    content_type: &'static str,
    etag: &str,
    asked: Option<&HeaderValue>,
    body: Bytes,
) -> Response {
    let quoted = format!("\"{etag}\"");
    let known = asked.and_then(|v| v.to_str().ok()).is_some_and(|asked| {
        asked
            .split(',')
            .any(|tag| matches!(tag.trim().trim_start_matches("W/"), t if t == quoted || t == "*"))
    });
    let mut response = if known {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = axum::http::StatusCode::NOT_MODIFIED;
        response
    } else {
        answer(content_type, body)
    };
    let headers = response.headers_mut();
    if let Ok(etag) = HeaderValue::from_str(&quoted) {
        headers.insert(header::ETAG, etag);
    }
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}
