//! The HTTP surface: one list of routes, from which the router is built.

mod admin;
mod atlas;
pub(crate) mod body;
mod effects;
pub(crate) mod info;
pub(crate) mod kept;
mod page;
mod presses;
pub(crate) mod sed;
pub(crate) mod xr;

use std::{
    path::Path,
    sync::{Arc, LazyLock},
};

use axum::{
    Router,
    body::Body,
    extract::State,
    http::{HeaderValue, Method, Uri, header},
    middleware::from_fn_with_state,
    response::{IntoResponse, Response},
    routing::{MethodRouter, get, post},
};
use papilla_proto::{ErrorCode, Problem, error::shortened};
use serde::Serialize;

use crate::{
    core::metrics::Metrics,
    problem::HttpProblem,
    transport::{
        app::App,
        gate,
        oip::{self, OipProblem},
        session,
    },
};

pub(crate) type Shared = State<Arc<App>>;
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
        (g.clone(), "/openapi.json", get(page::openapi)),
        (g.clone(), "/v1/tiers", get(info::tiers)),
        (g.clone(), "/v1/models", get(info::models)),
        (g.clone(), "/v1/effects", get(effects::list)),
        (g.clone(), "/v1/atlas", get(atlas::json)),
        (g.clone(), "/v1/atlas.obj", get(atlas::obj)),
        (g.clone(), "/v1/atlas.glb", get(atlas::glb)),
        (g.clone(), "/v1/atlas/mask.png", get(atlas::mask)),
        (g.clone(), "/v1/presses", get(presses::list)),
        (g.clone(), "/v1/presses/{press}", get(presses::one)),
        (g.clone(), "/v1/presses/{press}/pressure", get(presses::pressure)),
        (g.clone(), "/v1/presses/{press}/sed", get(presses::sed)),
        (Method::POST, "/v1/sed", post(sed::post)),
        (Method::POST, "/v1/admin/reload", post(admin::reload)),
        (g.clone(), "/v1/session", get(session::open)),
        (g.clone(), "/v2", get(oip::server)),
        (g.clone(), "/v2/health/live", get(oip::live)),
        (g.clone(), "/v2/health/ready", get(oip::ready)),
        (g.clone(), "/v2/models/{model}", get(oip::model)),
        (g.clone(), "/v2/models/{model}/ready", get(oip::model_ready)),
        (Method::POST, "/v2/models/{model}/infer", post(oip::infer)),
        (g.clone(), "/v2/models/{model}/versions/{version}", get(oip::model)),
        (g, "/v2/models/{model}/versions/{version}/ready", get(oip::model_ready)),
        (Method::POST, "/v2/models/{model}/versions/{version}/infer", post(oip::infer)),
    ]
}

/// The paths of all routes.
static PATHS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| routes().into_iter().map(|(_, path, _)| path).collect());

/// The route of this path, as the list has it.
pub(crate) fn known_route(path: &str) -> Option<&'static str> {
    PATHS.iter().chain(&xr::PATHS).copied().find(|known| *known == path)
}

/// Whether the path belongs to the Open Inference Protocol, whose errors look otherwise.
fn is_oip(path: &str) -> bool {
    path == "/v2" || path.starts_with("/v2/")
}

/// The method and path of every route, as OpenAPI writes them.
pub(crate) fn route_list() -> Vec<(String, String)> {
    let list = routes().into_iter();
    list.map(|(method, path, _)| (method.as_str().to_ascii_lowercase(), path.to_owned())).collect()
}

/// The whole router. Pages of `origins` may read its answers; the files of `xr_dir` are at `/xr`.
pub(crate) fn router(app: Arc<App>, origins: &[String], xr_dir: Option<&Path>) -> Router {
    let mut router = Router::new();
    for (_, path, handler) in routes() {
        router = router.route(path, handler);
    }
    if let Some(folder) = xr_dir {
        router = router.merge(xr::routes(folder));
    }
    let guard = from_fn_with_state(Arc::clone(&app), gate::guard);
    let router = router
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(guard)
        .with_state(app);
    match gate::cors(origins) {
        // Outside of the guard: a browser asks without its token whether it may send one.
        Some(cors) => router.layer(cors),
        None => router,
    }
}

async fn not_found(State(app): Shared, uri: Uri) -> Response {
    let message = format!("there is nothing at {}", shortened(uri.path()));
    refusal(&app, &uri, Problem::new(ErrorCode::NotFound, message))
}

async fn method_not_allowed(State(app): Shared, method: Method, uri: Uri) -> Response {
    let (path, method) = (shortened(uri.path()), shortened(method.as_str()));
    let message = format!("{path} does not take {method}");
    refusal(&app, &uri, Problem::new(ErrorCode::MethodNotAllowed, message))
}

/// Counts a refusal that no handler made, in the words of the protocol of its path.
pub(crate) fn refusal(app: &App, uri: &Uri, problem: Problem) -> Response {
    refused(&app.metrics, uri, problem)
}

/// The same, before there is anything to serve.
pub(crate) fn refused(metrics: &Metrics, uri: &Uri, problem: Problem) -> Response {
    metrics.error(problem.code);
    if is_oip(uri.path()) {
        OipProblem(problem).into_response()
    } else {
        HttpProblem(problem).into_response()
    }
}

/// Counts a refusal and makes it the answer.
fn refuse(app: &App, problem: Problem) -> Answer {
    app.metrics.error(problem.code);
    Err(HttpProblem(problem))
}

/// An answer of `content_type`.
pub(crate) fn answer(content_type: &'static str, body: impl Into<Body>) -> Response {
    let mut response = Response::new(body.into());
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
    response
}

/// An answer of JSON.
pub(crate) fn json_answer(value: &impl Serialize) -> Response {
    match serde_json::to_vec(value) {
        Ok(bytes) => answer("application/json", bytes),
        Err(error) => HttpProblem(crate::problem::internal("the answer cannot be encoded", &error))
            .into_response(),
    }
}
