//! Every refusal as one typed JSON answer: `{"error": {code, message, field}}`.

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use papilla_proto::{ErrorCode, FrameError, MapError, Problem, SampleError, error::shortened};
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

/// Most characters of a message.
const MESSAGE_MAX: usize = 1000;

/// The problem with a message and a field of bounded length: what parsers say of input repeats it.
pub(crate) fn bounded(mut problem: Problem) -> Problem {
    let words: Vec<_> = problem.message.split(' ').map(shortened).collect();
    problem.message = words.join(" ");
    if let Some((end, _)) = problem.message.char_indices().nth(MESSAGE_MAX) {
        problem.message.truncate(end);
        problem.message.push('…');
    }
    problem.field = problem.field.map(|field| shortened(&field));
    problem
}

impl IntoResponse for HttpProblem {
    fn into_response(self) -> Response {
        let problem = bounded(self.0);
        let status = StatusCode::from_u16(problem.code.http_status())
            .unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let body = serde_json::to_vec(&ErrorBody { error: &problem }).unwrap_or_default();
        let mut response = Response::new(Body::from(body));
        *response.status_mut() = status;
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
        label(headers, problem.code, problem.field.as_deref());
        response
    }
}

/// The field of a body that is compressed.
pub(crate) const CODING: &str = "content-encoding";

/// What clients are told of a refusal beside its body.
pub(crate) fn label(headers: &mut HeaderMap, code: ErrorCode, field: Option<&str>) {
    match code {
        ErrorCode::WrongType if field == Some(CODING) => {
            // RFC 9110 12.5.3: what would be taken.
            headers.insert(header::ACCEPT_ENCODING, HeaderValue::from_static("identity"));
        }
        ErrorCode::Overloaded | ErrorCode::ShuttingDown | ErrorCode::RateLimited => {
            headers.insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
        }
        ErrorCode::Unauthorized => {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        ErrorCode::UpgradeRequired => {
            // RFC 9110 15.5.22 and RFC 6455 4.4: to what, and in which version.
            headers.insert(header::CONNECTION, HeaderValue::from_static("upgrade"));
            headers.insert(header::UPGRADE, HeaderValue::from_static("websocket"));
            headers.insert(header::SEC_WEBSOCKET_VERSION, HeaderValue::from_static("13"));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_repeated_is_cut() {
        let problem = |message: &str| Problem::new(ErrorCode::BadJson, message);
        let whole = problem(
            "a message of some words, each short, that goes on for longer than an \
                             excerpt may, stays as it is",
        );
        assert_eq!(bounded(whole.clone()), whole);
        let long =
            bounded(problem(&format!("no '{}' here", "x".repeat(5000))).at("y".repeat(5000)));
        assert_eq!(long.message, format!("no '{}… here", "x".repeat(99)));
        assert_eq!(long.field.unwrap().chars().count(), 101);
        assert_eq!(bounded(problem(&"a ".repeat(5000))).message.chars().count(), 1001);
    }
}
