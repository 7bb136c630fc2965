//! What moves bytes: connections, HTTP, WebSocket sessions and the Open Inference Protocol.
//!
//! `net` -> `front` -> `routes` (set once the models are there) -> `gate` -> `http`, `session`, `oip`.

mod answer;
pub(crate) mod app;
mod bucket;
pub(crate) mod front;
pub(crate) mod gate;
mod http;
pub(crate) mod negotiate;
pub(crate) mod net;
pub(crate) mod oip;
pub(crate) mod routes;
mod session;
mod stream;
pub(crate) mod tls;
