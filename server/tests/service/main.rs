//! The whole service, from the outside: every route, every error path, real models.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod binary;
mod broken;
mod clocks;
mod contact;
mod drain;
mod edge;
mod effects;
mod fingers;
mod first_use;
mod gate;
mod hard;
mod hostile;
mod information;
mod ladder;
mod memory;
mod messages;
mod moving;
mod network;
mod oip;
#[cfg(feature = "otlp")]
mod otlp;
mod overload;
mod page;
mod process;
#[cfg(target_os = "linux")]
mod realtime;
mod recorded;
mod reload;
mod rendering;
mod session;
mod spikes;
mod start;
mod support;
mod tls;
mod xr;
