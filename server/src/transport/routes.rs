//! All routes in one list, from which the router is built, and the checks that a request passes
//! before it reaches a handler.

use std::{
    path::Path,
    sync::{Arc, LazyLock},
    time::{Duration, Instant},
};

use axum::{
    Router,
    body::Body,
    extract::{MatchedPath, Request, State},
    http::{HeaderValue, Method, StatusCode, Uri, header},
    middleware::{Next, from_fn_with_state},
    response::Response,
    routing::{MethodRouter, get, post},
};
use papilla_metrics::Shed;
use papilla_proto::{ErrorCode, Problem, error::shortened};
use tokio::time::sleep;

use super::{
    answer::{Shared, refusal::refused},
    app::App,
    gate::{Admitted, RouteAccess, TokenInQuery, cors},
    http::{admin, atlas, effects, finger, info, page, replay, sed, xr},
    oip, session,
};
use crate::telemetry;

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
        (g.clone(), "/v1/fingers", get(finger::list)),
        (g.clone(), "/v1/models", get(info::models)),
        (g.clone(), "/v1/effects", get(effects::list)),
        (g.clone(), "/v1/atlas", get(atlas::json)),
        (g.clone(), "/v1/atlas.obj", get(atlas::obj)),
        (g.clone(), "/v1/atlas.glb", get(atlas::glb)),
        (g.clone(), "/v1/atlas/mask.png", get(atlas::mask)),
        (g.clone(), "/v1/presses", get(replay::list)),
        (g.clone(), "/v1/presses/{press}", get(replay::one)),
        (g.clone(), "/v1/presses/{press}/pressure", get(replay::pressure)),
        (g.clone(), "/v1/presses/{press}/sed", get(replay::sed)),
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

/// Routes that ask for no token: they tell nothing, or are what a browser loads before it can
/// send one.
const PUBLIC: [&str; 7] =
    ["/", "/{file}", "/healthz", "/readyz", "/openapi.json", "/v2/health/live", "/v2/health/ready"];

/// What the gate has to know of a route.
fn access(route: &str) -> RouteAccess {
    let token_in_query = match route {
        "/" => TokenInQuery::Exchanged,
        "/v1/session" => TokenInQuery::Taken,
        _ => TokenInQuery::Ignored,
    };
    let is_public = PUBLIC.contains(&route) || xr::PATHS.contains(&route);
    RouteAccess { is_public, token_in_query }
}

/// The paths of all routes.
static PATHS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| routes().into_iter().map(|(_, path, _)| path).collect());

/// The route of this path, as the list has it.
fn known(path: &str) -> Option<&'static str> {
    PATHS.iter().chain(&xr::PATHS).copied().find(|known| *known == path)
}

/// The method and path of every route, as OpenAPI writes them.
pub(crate) fn list() -> Vec<(String, String)> {
    let list = routes().into_iter();
    list.map(|(method, path, _)| (method.as_str().to_ascii_lowercase(), path.to_owned())).collect()
}

/// The whole router. Pages of `origins` may read its answers; at `/xr` are the files of `xr_dir`, or
/// the scene in the binary.
pub(crate) fn router(app: Arc<App>, origins: &[String], xr_dir: Option<&Path>) -> Router {
    let mut router = Router::new();
    for (_, path, handler) in routes() {
        router = router.route(path, handler);
    }
    router = router.merge(xr::routes(xr_dir));
    let guard = from_fn_with_state(Arc::clone(&app), guard);
    let router = router
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(guard)
        .with_state(app);
    match cors(origins) {
        // Outside of the guard: a browser asks without its token whether it may send one.
        Some(cors) => router.layer(cors),
        None => router,
    }
}

async fn not_found(State(app): Shared, uri: Uri) -> Response {
    let message = format!("there is nothing at {}", shortened(uri.path()));
    refused(&app.metrics, &uri, Problem::new(ErrorCode::NotFound, message))
}

async fn method_not_allowed(State(app): Shared, method: Method, uri: Uri) -> Response {
    let (path, method) = (shortened(uri.path()), shortened(method.as_str()));
    let message = format!("{path} does not take {method}");
    refused(&app.metrics, &uri, Problem::new(ErrorCode::MethodNotAllowed, message))
}

/// Pause before a request beyond the rate is refused: refusing costs time as well, and a client that
/// sends requests without a pause would take it from its neighbours.
const REFUSAL_PAUSE: Duration = Duration::from_millis(20);

/// Every request comes through here; what is refused never reaches its handler.
async fn guard(State(app): Shared, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let (mut head, body) = request.into_parts();
    let route = head.extensions.get::<MatchedPath>();
    let route = route.and_then(|path| known(path.as_str())).unwrap_or("other");
    let span = telemetry::request_span(&head.method, route);
    let response = match app.gate.admit(&head, access(route)) {
        Ok(Admitted { principal, cookie: None }) => {
            head.extensions.insert(principal);
            telemetry::within(&span, next.run(Request::from_parts(head, body))).await
        }
        Ok(Admitted { cookie: Some(cookie), .. }) => welcome(cookie),
        Err(problem) => {
            if problem.code == ErrorCode::RateLimited {
                app.metrics.shed(Shed::Rate);
                // Requests sent ahead on the connection wait behind this one.
                sleep(REFUSAL_PAUSE).await;
            }
            refused(&app.metrics, &head.uri, problem)
        }
    };
    telemetry::answered(&span, response.status());
    app.metrics.request(route, response.status().as_u16(), start.elapsed());
    response
}

/// Sends the browser to the same address without its token, which it gets as a cookie. Relative, since
/// a proxy may serve the page below a path of its own.
fn welcome(cookie: HeaderValue) -> Response {
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::SEE_OTHER;
    let headers = response.headers_mut();
    headers.insert(header::SET_COOKIE, cookie);
    headers.insert(header::LOCATION, HeaderValue::from_static("?"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A route that is renamed must not lose what the gate knows of it.
    #[test]
    fn whatever_has_a_rule_of_its_own_is_a_route() {
        for path in PUBLIC.iter().chain(&["/v1/session"]) {
            assert!(known(path).is_some(), "{path}");
        }
        let exchanging =
            PATHS.iter().filter(|path| access(path).token_in_query != TokenInQuery::Ignored);
        assert_eq!(exchanging.count(), 2);
        assert!(!access("other").is_public);
    }
}
