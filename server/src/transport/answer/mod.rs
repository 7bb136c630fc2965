//! What all protocols over HTTP share: reading bodies, writing answers and refusals, computing
//! posted maps.

pub(crate) mod body;
mod cached;
pub(crate) mod refusal;
pub(crate) mod render;

use std::sync::Arc;

use axum::{
    body::Body,
    extract::State,
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use papilla_proto::Problem;
use serde::Serialize;

pub(crate) use self::{cached::cached, refusal::HttpProblem};
use super::app::App;
use crate::problem;

pub(crate) type Shared = State<Arc<App>>;
pub(crate) type Answer = Result<Response, HttpProblem>;

/// Counts a refusal and makes it the answer.
pub(crate) fn refuse<T>(app: &App, problem: Problem) -> Result<T, HttpProblem> {
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
        Err(error) => {
            HttpProblem(problem::internal("the answer cannot be encoded", &error)).into_response()
        }
    }
}
