//! `/xr`: the WebXR scene that is in the binary, or the files of a folder in its place.
//!
//! Not in the list of routes: which files there are depends on the folder.

use std::{io::ErrorKind, path::Path, sync::Arc};

use axum::{
    Router,
    extract::{Request, State},
    http::{HeaderValue, StatusCode, Uri, header, uri::PathAndQuery},
    response::{IntoResponse, Redirect, Response},
    routing::get,
};
use papilla_proto::{ErrorCode, Problem, error::shortened};
use tower_http::services::ServeDir;

use crate::{
    problem,
    transport::{
        answer::{Shared, refuse},
        app::App,
        http::page,
    },
};

/// What this adds to the routes; none of it asks for a token, as the page does not.
pub(crate) const PATHS: [&str; 3] = ["/xr", "/xr/", "/xr/{*path}"];

/// The routes that serve `folder`, or the scene in the binary. `ServeDir` refuses paths that lead out
/// of a folder (`..`, roots, drive names).
pub(crate) fn routes(folder: Option<&Path>) -> Router<Arc<App>> {
    let serve = match folder {
        Some(folder) => {
            let files = ServeDir::new(folder);
            get(move |state: Shared, request: Request| file(files, state, request))
        }
        None => get(page::scene),
    };
    let [bare, index, below] = PATHS;
    Router::new()
        // Without the slash the page's relative addresses would miss the folder. The redirect is
        // relative itself: a proxy may serve all this below a path of its own.
        .route(bare, get(|| async { Redirect::permanent("xr/") }))
        .route(index, serve.clone())
        .route(below, serve)
}

async fn file(mut files: ServeDir, State(app): Shared, mut request: Request) -> Response {
    let asked = request.uri().clone();
    let Some(below) = below(&asked) else { return missing(&app, asked.path()) };
    *request.uri_mut() = Uri::from(below);
    let found = match files.try_call(request).await {
        Ok(found) => found,
        // No file can have this name.
        Err(error)
            if matches!(error.kind(), ErrorKind::InvalidFilename | ErrorKind::InvalidInput) =>
        {
            return missing(&app, asked.path());
        }
        Err(error) => return broken(&app, &error),
    };
    let mut response = match found.status() {
        StatusCode::NOT_FOUND => return missing(&app, asked.path()),
        status if status.is_server_error() => return broken(&app, &status),
        _ => found.into_response(),
    };
    let headers = response.headers_mut();
    // A folder without its slash: `ServeDir` names the way as it sees it, and the browser may see
    // another, so only its last part is sent.
    let location = headers.get(header::LOCATION).and_then(|location| location.to_str().ok());
    if let Some(location) = location.and_then(|way| last_part(way).parse().ok()) {
        headers.insert(header::LOCATION, location);
    }
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}

/// The way from a folder without its slash to the same with it, `sub/?query` of `/a/sub/?query`.
fn last_part(way: &str) -> String {
    let (path, query) = way.split_at(way.find('?').unwrap_or(way.len()));
    let name = path.trim_end_matches('/').rsplit('/').next().unwrap_or_default();
    // Before a colon a browser would read a scheme.
    format!("./{name}/{query}")
}

/// What `ServeDir` is asked for, the page of a folder by its name; none for a path with an empty part, which is no file's and whose
/// redirect would name another host.
fn below(asked: &Uri) -> Option<PathAndQuery> {
    let path = asked.path().strip_prefix("/xr")?;
    if path.contains("//") {
        return None;
    }
    // `ServeDir` would answer `a.js/` with the file.
    let index = if path.ends_with('/') { "index.html" } else { "" };
    let query = asked.query().map(|query| format!("?{query}")).unwrap_or_default();
    format!("{path}{index}{query}").parse().ok()
}

fn broken(app: &App, error: &dyn std::fmt::Display) -> Response {
    refuse::<Response>(app, problem::internal("the file cannot be read", error)).into_response()
}

fn missing(app: &App, path: &str) -> Response {
    let problem =
        Problem::new(ErrorCode::NotFound, format!("there is nothing at {}", shortened(path)));
    refuse::<Response>(app, problem).into_response()
}
