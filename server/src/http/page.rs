//! The page and its parts, from the binary.

use std::sync::LazyLock;

use axum::{
    extract::State,
    http::{HeaderMap, Uri, header},
};
use bytes::Bytes;
use papilla_proto::{ErrorCode, Problem};

use super::{Answer, Shared, refuse, tagged};
use crate::{
    app::App,
    assets::{PAGE, sha256_hex},
    problem::excerpt,
};

struct PageFile {
    name: &'static str,
    content_type: &'static str,
    etag: String,
    bytes: &'static [u8],
}

static FILES: LazyLock<Vec<PageFile>> = LazyLock::new(|| {
    let files = PAGE.iter().map(|&(name, bytes)| PageFile {
        name,
        content_type: content_type(name),
        etag: sha256_hex(bytes),
        bytes,
    });
    files.collect()
});

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
        _ => "application/octet-stream",
    }
}

pub(super) async fn index(State(app): Shared, headers: HeaderMap) -> Answer {
    serve(&app, "index.html", &headers)
}

pub(super) async fn file(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    serve(&app, uri.path().trim_start_matches('/'), &headers)
}

fn serve(app: &App, name: &str, headers: &HeaderMap) -> Answer {
    match FILES.iter().find(|file| file.name == name) {
        Some(file) => {
            let asked = headers.get(header::IF_NONE_MATCH);
            Ok(tagged(file.content_type, &file.etag, asked, Bytes::from_static(file.bytes)))
        }
        None => {
            let message = format!("there is nothing at /{}", excerpt(name));
            refuse(app, Problem::new(ErrorCode::NotFound, message))
        }
    }
}
