//! What moves bytes: connections, HTTP, WebSocket sessions and the Open Inference Protocol.

pub(crate) mod app;
mod bucket;
pub(crate) mod front;
pub(crate) mod gate;
pub(crate) mod http;
pub(crate) mod negotiate;
pub(crate) mod net;
pub(crate) mod oip;
mod session;
pub(crate) mod tls;
