//! Text from outside: without the byte order mark that some editors and shells put before it, and
//! refused by its name where it is UTF-16.

use std::{io, path::Path};

/// The byte order mark of UTF-8.
const BOM: &[u8] = b"\xef\xbb\xbf";

/// Why bytes are not the text that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TextError {
    /// Two bytes a letter.
    #[error(
        "it is UTF-16; write it as UTF-8 (PowerShell: `-Encoding utf8`; editors: 'save with encoding')"
    )]
    Utf16,
    /// Another encoding, or no text.
    #[error("it is not UTF-8 from line {line} on; write it as UTF-8")]
    NotUtf8 {
        /// The line, from 1.
        line: usize,
    },
}

/// The bytes behind a byte order mark, if there is one.
///
/// # Errors
/// [`TextError::Utf16`]. Whether they are UTF-8 is not looked at.
pub fn plain(bytes: &[u8]) -> Result<&[u8], TextError> {
    if let Some(rest) = bytes.strip_prefix(BOM) {
        return Ok(rest);
    }
    let has_mark = bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff");
    // Without a mark: the first letter of JSON, of TOML and of a mesh is ASCII.
    let is_wide = matches!(bytes, [0, 1..=u8::MAX, ..] | [1..=u8::MAX, 0, ..]);
    if has_mark || is_wide { Err(TextError::Utf16) } else { Ok(bytes) }
}

/// The text behind a byte order mark, if there is one.
///
/// # Errors
/// [`TextError`].
pub fn text(bytes: &[u8]) -> Result<&str, TextError> {
    let bytes = plain(bytes)?;
    std::str::from_utf8(bytes).map_err(|error| {
        let before = bytes.get(..error.valid_up_to()).unwrap_or_default();
        TextError::NotUtf8 { line: 1 + before.iter().filter(|byte| **byte == b'\n').count() }
    })
}

/// The text of a file, as [`text`].
///
/// # Errors
/// As [`std::fs::read_to_string`], with [`TextError`] as the reason where the file is no text.
pub fn read_text(path: &Path) -> io::Result<String> {
    let bytes = std::fs::read(path)?;
    match text(&bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => Err(io::Error::new(io::ErrorKind::InvalidData, error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide(text: &str, unit: fn(u16) -> [u8; 2]) -> Vec<u8> {
        text.encode_utf16().flat_map(unit).collect()
    }

    #[test]
    fn a_mark_is_passed_over_and_wide_text_is_named() {
        for plain_text in ["{\"a\": 1}", "", "[a]\n", "\u{e9}t\u{e9}"] {
            let marked = [BOM, plain_text.as_bytes()].concat();
            assert_eq!(text(&marked), Ok(plain_text));
            assert_eq!(text(plain_text.as_bytes()), Ok(plain_text));
        }
        for unit in [u16::to_le_bytes, u16::to_be_bytes] {
            for wide_text in ["\u{feff}{}", "{\"a\": 1}", "\u{feff}", "$MeshFormat"] {
                assert_eq!(text(&wide(wide_text, unit)), Err(TextError::Utf16), "{wide_text:?}");
            }
        }
        assert_eq!(text(b"a\nb\n\xe9"), Err(TextError::NotUtf8 { line: 3 }));
    }

    #[test]
    fn a_file_that_is_no_text_says_so() {
        let folder = std::env::temp_dir().join(format!("papilla-json-{}", std::process::id()));
        std::fs::write(&folder, [0xff, 0xfe, b'{', 0]).unwrap();
        let error = read_text(&folder).unwrap_err();
        std::fs::remove_file(&folder).unwrap();
        assert!(error.to_string().contains("UTF-16"), "{error}");
        assert_eq!(read_text(&folder).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
