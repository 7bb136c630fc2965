//! One set of features of third-party crates, whatever program is built: see `Cargo.toml`. There is no
//! code here.
