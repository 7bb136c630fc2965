//! Papilla inside a program: what `include/papilla_c.h` declares, for engines that open no socket.
//!
//! [`Model`] is a folder of models read once, [`Session`] the memory of one hand: frames in,
//! answers out, on the caller's thread. Both are safe Rust; `border` makes C of them and is the one
//! place with `unsafe`.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))?;
//! use papilla_c::{Model, Session};
//!
//! let model = Model::load("models".as_ref(), Some("nano"), None)?.into();
//! let mut session = Session::open(&model, r#"{"type": "hello"}"#)?;
//! let mut pressure_pa = vec![0.0; 224 * 224];
//! (95..115).for_each(|row| pressure_pa[row * 224 + 105..][..25].fill(8e3));
//! session.send_map(0, &pressure_pa, 0)?;
//! assert!(session.answer().map.iter().any(|sed| *sed > 0.0));
//! # Ok(())
//! # }
//! ```

mod answer;
mod border;
mod hello;
mod session;
mod status;

/// The library's own heap. The network runtime (tract 0.23.9) has no place for results from outside:
/// each of its operators allocates what it returns. The published U-Nets and the half-space run in it.
/// From here these blocks come in constant time (two-level segregated fit: Masmano et al., ECRTS 2004),
/// out of memory that stays, so that a warm frame asks neither malloc nor the system.
#[cfg(unix)]
#[global_allocator]
static HEAP: rlsf::GlobalTlsf = rlsf::GlobalTlsf::new();

pub use answer::Answer;
pub use papilla_inside::{LoadError, Model, Problem};
pub use session::Session;
pub use status::Status;
