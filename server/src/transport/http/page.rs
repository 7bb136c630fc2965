//! The page and its parts, from the binary.

use std::sync::LazyLock;

use axum::{
    extract::State,
    http::{HeaderMap, Uri},
};
use papilla_proto::{ErrorCode, Problem, error::shortened};

use crate::{
    core::cache::{Cache, Content},
    transport::{
        answer::{Answer, Shared, cached, refuse},
        app::App,
    },
};

/// The files of the page, as they were when the binary was built.
const PAGE: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/page.rs"));

/// The WebXR scene: what `npm run build` in `clients/web` makes, as it was committed.
const SCENE: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/scene.rs"));

/// The description of the HTTP surface, written by hand.
const OPENAPI: &str = include_str!("../../../openapi.json");

/// Keys of the cache.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Part {
    /// A file of the page, by its place.
    File(usize),
    /// A file of the scene, likewise.
    Scene(usize),
    OpenApi,
}

/// Answers that last as long as the binary.
static CACHE: LazyLock<Cache<Part>> = LazyLock::new(Cache::default);

fn content_type(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "mjs" | "js" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "webp" => "image/webp",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "txt" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

pub(crate) async fn index(State(app): Shared, headers: HeaderMap) -> Answer {
    serve(&app, PAGE, Part::File, "index.html", &headers).await
}

pub(crate) async fn file(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    serve(&app, PAGE, Part::File, uri.path().trim_start_matches('/'), &headers).await
}

/// Files of the page that the scene has in its folder as well.
const OF_BOTH: [&str; 2] = ["three.js", "three.js.LEGAL.txt"];

/// A file of the scene, `/xr/` for its page.
pub(crate) async fn scene(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    let name = uri.path().trim_start_matches("/xr/");
    if OF_BOTH.contains(&name) {
        return serve(&app, PAGE, Part::File, name, &headers).await;
    }
    let name = if name.is_empty() { "index.html" } else { name };
    serve(&app, SCENE, Part::Scene, name, &headers).await
}

/// The description of the HTTP surface.
pub(crate) async fn openapi(State(app): Shared, headers: HeaderMap) -> Answer {
    let make = || Ok(Content::new("application/json", OPENAPI));
    cached(&CACHE, &headers, Part::OpenApi, make).await.or_else(|problem| refuse(&app, problem))
}

async fn serve(
    app: &App,
    files: &'static [(&'static str, &'static [u8])],
    part: fn(usize) -> Part,
    name: &str,
    headers: &HeaderMap,
) -> Answer {
    let Some(place) = files.iter().position(|(file, _)| *file == name) else {
        let message = format!("there is no file {}", shortened(name));
        return refuse(app, Problem::new(ErrorCode::NotFound, message));
    };
    let (name, bytes) = files[place];
    let make = move || Ok(Content::new(content_type(name), bytes));
    cached(&CACHE, headers, part(place), make).await.or_else(|problem| refuse(app, problem))
}
