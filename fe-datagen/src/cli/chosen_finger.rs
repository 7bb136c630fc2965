//! The option `--finger` of commands.

use papilla_fingertip::scene::Finger;
use std::path::Path;

/// The finger that an option names; the default one if it names none.
///
/// # Errors
/// It is not there, or makes no sense.
pub(super) fn named(name: Option<&Path>) -> anyhow::Result<Finger> {
    match name {
        Some(name) => Ok(Finger::find(name, Path::new(""))?),
        None => Ok(Finger::usual()),
    }
}
