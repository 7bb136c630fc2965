//! The C interface: pointers become references, panics and errors become numbers.
//!
//! Every function here is `unsafe` for the same reason: a C program vouches for its pointers, and
//! what it has to vouch for stands in `papilla_c.h`. What can be checked is checked: pointers are
//! not null and aligned, texts are UTF-8, lengths are those that are due.

// A border to C is made of pointers; nothing else of the workspace has `unsafe` for it.
#![allow(unsafe_code)]

mod handle;
mod model;
mod session;
mod types;

use std::ffi::{CStr, c_char};

use crate::Status;

/// Version of the interface: raised when a struct or a function changes.
const ABI: u32 = 2;

/// The interface's version: `PAPILLA_ABI` of the header that a program was compiled with is to be
/// the same.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn papilla_abi() -> u32 {
    ABI
}

/// The library's version, as `0.2.0`.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn papilla_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// The word of a status, as `wrong_length`; `internal` for a number that is none.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn papilla_status_name(status: i32) -> *const c_char {
    let status = Status::ALL.into_iter().find(|known| *known as i32 == status);
    let name: &'static CStr = status.unwrap_or(Status::Internal).name();
    name.as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = include_str!("../../include/papilla_c.h");

    #[test]
    fn the_header_has_every_status_with_its_number() {
        let mut seen = 0;
        for line in HEADER.lines().map(str::trim) {
            let Some((name, rest)) =
                line.strip_prefix("PAPILLA_").and_then(|l| l.split_once(" = "))
            else {
                continue;
            };
            let number: i32 = rest.split([',', ' ']).next().unwrap().parse().unwrap();
            let status = Status::ALL.into_iter().find(|s| *s as i32 == number).unwrap();
            assert_eq!(status.name().to_str().unwrap(), name.to_lowercase());
            seen += 1;
        }
        assert_eq!(seen, Status::ALL.len());
        assert!(HEADER.contains(&format!("#define PAPILLA_ABI {ABI}\n")));
    }

    #[test]
    fn the_header_has_every_flag() {
        use papilla_proto::flags;
        let flag = |(bit, name): (u8, &str)| {
            format!("#define PAPILLA_FLAG_{} {bit}u ", name.to_uppercase())
        };
        for line in flags::NAMED.into_iter().map(flag) {
            assert!(HEADER.contains(&line), "{line}");
        }
    }

    /// Every function of the header is one of the library, and the other way round.
    #[test]
    fn the_header_declares_what_the_library_has() {
        let sources =
            [include_str!("mod.rs"), include_str!("model.rs"), include_str!("session.rs")];
        let names = |text: &str, end: &str| {
            let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || "_(".contains(c)));
            let names = words.filter_map(|word| word.split_once(end).map(|(name, _)| name));
            let mut names: Vec<String> =
                names.filter(|n| n.starts_with("papilla_")).map(str::to_owned).collect();
            names.sort();
            names.dedup();
            names
        };
        let exported: String = sources
            .iter()
            .flat_map(|source| source.split("#[unsafe(no_mangle)]\n").skip(1))
            .filter_map(|rest| rest.split_once("extern \"C\" fn ").map(|(_, rest)| rest))
            .map(|rest| format!("{}( ", rest.split('(').next().unwrap()))
            .collect();
        assert_eq!(names(HEADER, "("), names(&exported, "("));
    }
}
