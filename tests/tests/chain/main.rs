//! The whole chain for real: a scene is solved by finite elements, unwrapped, rasterised,
//! rendered by a model in the engine, served, and read by clients that share no code with
//! the server. What arrives must be the library's own answer.
//!
//! | module | holds |
//! |---|---|
//! | `shipped` | the models, atlas and dataset of the repository, and this indentation solved again |
//! | `scene` | a coarse indentation and a small network: the chain without any shipped file |
//! | `service` | a running service beside the library's own model |
//! | `client` | what every client must find, over HTTP and in a session |
//! | `load` | the load generator against the service |
//! | `persons` | fingers of other widths and stiffness, in sessions and in finite elements |
//! | `poses` | random objects under the shipped finger, on pixels |
//! | `moving` | sessions that go on elsewhere, of the Rust client and the load generator |

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod client;
mod load;
mod moving;
mod persons;
mod poses;
mod scene;
mod service;
mod shipped;

/// Asserts that two maps are equal to `tolerance` of the greatest value.
#[track_caller]
fn assert_close(what: &str, found: &[f32], due: &[f32], tolerance: f32) {
    assert_eq!(found.len(), due.len(), "{what}");
    let allowed = tolerance * due.iter().copied().fold(0.0, f32::max);
    for (i, (f, d)) in found.iter().zip(due).enumerate() {
        assert!((f - d).abs() <= allowed, "{what}: {f} at {i}, not {d}; {allowed} is allowed");
    }
}
