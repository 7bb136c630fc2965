//! Every refusal as one typed JSON answer: `{"error": {code, message, field}}`.

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use papilla_proto::{ErrorCode, FrameError, MapError, Problem, SampleError};
use serde::Serialize;

/// A problem on its way to an HTTP client.
#[derive(Debug)]
pub(crate) struct HttpProblem(pub(crate) Problem);

/// The shape of an HTTP error body.
#[derive(Serialize)]
struct ErrorBody<'a> {
    error: &'a Problem,
}

impl<T: Into<Problem>> From<T> for HttpProblem {
    fn from(problem: T) -> Self {
        Self(problem.into())
    }
}

impl IntoResponse for HttpProblem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.0.code.http_status())
            .unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let body = serde_json::to_vec(&ErrorBody { error: &self.0 }).unwrap_or_default();
        let mut response = Response::new(Body::from(body));
        *response.status_mut() = status;
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
        label(headers, self.0.code);
        response
    }
}

/// What clients are told of a refusal beside its body.
pub(crate) fn label(headers: &mut HeaderMap, code: ErrorCode) {
    match code {
        ErrorCode::Overloaded | ErrorCode::ShuttingDown | ErrorCode::RateLimited => {
            headers.insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
        }
        ErrorCode::Unauthorized => {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        _ => {}
    }
}

/// The problem a frame header makes.
pub(crate) fn of_frame(error: FrameError) -> Problem {
    let problem = Problem::new(error.code(), error.to_string());
    match error.field() {
        Some(field) => problem.at(field),
        None => problem,
    }
}

/// The problem a payload makes.
pub(crate) fn of_samples(error: SampleError) -> Problem {
    let field = if error.code() == ErrorCode::BadScale { "scale" } else { "payload" };
    Problem::new(error.code(), error.to_string()).at(field)
}

/// The problem a map makes.
pub(crate) fn of_map(error: MapError) -> Problem {
    Problem::new(error.code(), error.to_string()).at("pressure_pa")
}

/// A fault of our own: the details go to the log, not to the client.
pub(crate) fn internal(what: &str, error: &dyn std::fmt::Display) -> Problem {
    tracing::error!(%error, "{what}");
    Problem::new(ErrorCode::Internal, format!("{what}; the server's log says more"))
}

/// The answer to work that comes while the server drains.
pub(crate) fn shutting_down() -> Problem {
    Problem::new(ErrorCode::ShuttingDown, "the server is draining; connect again in a moment")
}

/// The answer to work that missed its deadline.
pub(crate) fn late() -> Problem {
    Problem::new(ErrorCode::Late, "the deadline passed before the map was done; it was dropped")
}
