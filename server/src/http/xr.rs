//! `/xr`: the files of a folder, for a page that is built elsewhere (`clients/web`, `npm run build`).
//!
//! Not in the list of routes: without a folder there is nothing there.

use std::{path::Path, sync::Arc};

use axum::{
    Router,
    extract::{Request, State},
    http::{HeaderValue, StatusCode, Uri, header, uri::PathAndQuery},
    response::{IntoResponse, Redirect, Response},
    routing::get,
};
use papilla_proto::{ErrorCode, Problem};
use tower::ServiceExt;
use tower_http::services::ServeDir;

use super::{Shared, refuse};
use crate::app::App;

/// What a folder adds to the routes; none of it asks for a token, as the page does not.
pub(crate) const PATHS: [&str; 3] = ["/xr", "/xr/", "/xr/{*path}"];

/// The routes that serve `folder`. `ServeDir` refuses paths that lead out of it (`..`, roots, drive names).
pub(super) fn routes(folder: &Path) -> Router<Arc<App>> {
    let files = ServeDir::new(folder);
    let serve = get(move |state: Shared, request: Request| file(files, state, request));
    let [bare, index, below] = PATHS;
    Router::new()
        // Without the slash the page's relative addresses would miss the folder.
        .route(bare, get(|| async { Redirect::permanent("/xr/") }))
        .route(index, serve.clone())
        .route(below, serve)
}

async fn file(files: ServeDir, State(app): Shared, mut request: Request) -> Response {
    let asked = request.uri().path().to_owned();
    let below = asked.strip_prefix("/xr").and_then(|path| path.parse::<PathAndQuery>().ok());
    let Some(below) = below else { return missing(&app, &asked) };
    *request.uri_mut() = Uri::from(below);
    // Its error type has no values: a file that cannot be read is an answer too.
    let Ok(found) = files.oneshot(request).await;
    if found.status() == StatusCode::NOT_FOUND {
        return missing(&app, &asked);
    }
    let mut response = found.into_response();
    let headers = response.headers_mut();
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}

fn missing(app: &App, path: &str) -> Response {
    let problem = Problem::new(ErrorCode::NotFound, format!("there is nothing at {path}"));
    refuse(app, problem).into_response()
}
