//! One press: a body, an indenter on its way, and what is recorded.

mod balanced;
pub mod body;
pub mod drive;
pub mod fields;
mod fit;
pub mod laws;
pub mod record;
pub mod section;
pub mod setup;
mod skin;
mod touch;

#[cfg(test)]
mod tests;
