//! Writes every refusal as one typed JSON answer, in the form of the protocol to which the path
//! belongs.

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, StatusCode, Uri, header},
    response::{IntoResponse, Response},
};
use papilla_metrics::Metrics;
use papilla_proto::{ErrorCode, Problem};
use serde::Serialize;
use serde_json::json;

use super::json_answer;
use crate::problem::bounded;

/// A problem on its way to an HTTP client: `{"error": {code, message, field}}`.
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

/// A problem on its way to a client of the Open Inference Protocol: `{"error": "message"}`.
#[derive(Debug)]
pub(crate) struct OipProblem(pub(crate) Problem);

impl IntoResponse for OipProblem {
    fn into_response(self) -> Response {
        let Problem { code, message, field } = bounded(self.0);
        let place = field.as_ref().map(|field| format!(" ({field})")).unwrap_or_default();
        let mut response = json_answer(&json!({"error": format!("{message}{place}")}));
        *response.status_mut() =
            StatusCode::from_u16(code.http_status()).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let headers = response.headers_mut();
        headers.insert("x-papilla-code", HeaderValue::from_static(code.as_str()));
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
        label(headers, code, field.as_deref());
        response
    }
}

/// Whether the path belongs to the Open Inference Protocol, whose errors look otherwise.
fn is_oip(path: &str) -> bool {
    path == "/v2" || path.starts_with("/v2/")
}

/// Counts a refusal that no handler made, in the shape of the protocol of its path.
pub(crate) fn refused(metrics: &Metrics, uri: &Uri, problem: Problem) -> Response {
    metrics.error(problem.code);
    if is_oip(uri.path()) {
        OipProblem(problem).into_response()
    } else {
        HttpProblem(problem).into_response()
    }
}
