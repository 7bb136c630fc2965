//! What moves bytes: connections, HTTP, WebSocket sessions and the Open Inference Protocol.
//!
//! A request goes from `net` through `front`, which holds it until the models are loaded, to
//! `routes`. There `gate` decides whether it may come in, and `http`, `session` or `oip` answers.

mod answer;
pub(crate) mod app;
mod first_use;
pub(crate) mod front;
pub(crate) mod gate;
mod http;
pub(crate) mod moves;
pub(crate) mod negotiate;
pub(crate) mod net;
pub(crate) mod oip;
mod posters;
mod room;
pub(crate) mod routes;
mod session;
mod stream;
pub(crate) mod tls;
