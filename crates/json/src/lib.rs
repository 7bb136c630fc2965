//! JSON from outside: read within bounds, and refused in serde's words with member and place.
//!
//! ```
//! #[derive(Debug, serde::Deserialize)]
//! struct Contact {
//!     force_n: f32,
//! }
//!
//! let contact: Contact = papilla_json::read_bounded(br#"{"force_n": 0.5}"#)?;
//! assert_eq!(contact.force_n, 0.5);
//! let error = papilla_json::read_bounded::<Contact>(br#"{"force_n": "much"}"#).unwrap_err();
//! assert_eq!(error.member.as_deref(), Some("force_n"));
//! # Ok::<_, papilla_json::JsonError>(())
//! ```

mod meant;
mod text;

use std::fmt;

use serde::de::DeserializeOwned;
use serde_path_to_error::Track;

pub use meant::{meant, nearest};
pub use text::{TextError, plain, read_text, text};

/// Longest name or text that [`read_bounded`] takes, bytes as they stand in the JSON.
pub const TEXT_BYTES_MAX: usize = 1024;

/// Why a text is not the JSON that is due.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct JsonError {
    /// The member it is about, as `actuators.actuators[3].at`; none: the text as a whole, or a
    /// member that the reason names.
    pub member: Option<String>,
    /// What is wrong.
    pub reason: String,
    /// Line and column, both from 1; none where only the whole is at fault.
    pub place: Option<(usize, usize)>,
}

impl fmt::Display for JsonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(member) = &self.member {
            write!(f, "{member}: ")?;
        }
        f.write_str(&self.reason)?;
        match self.place {
            Some((line, column)) => write!(f, " (line {line}, column {column})"),
            None => Ok(()),
        }
    }
}

impl From<TextError> for JsonError {
    fn from(error: TextError) -> Self {
        Self { member: None, reason: error.to_string(), place: None }
    }
}

impl From<serde_json::Error> for JsonError {
    fn from(error: serde_json::Error) -> Self {
        let (line, column) = (error.line(), error.column());
        let text = error.to_string();
        let place = format!(" at line {line} column {column}");
        let reason = own_words(text.strip_suffix(&place).unwrap_or(&text));
        Self { member: None, reason, place: (line > 0).then_some((line, column)) }
    }
}

/// Reads all of `json`, a byte order mark before it aside.
///
/// # Errors
/// It is not JSON, or not of the shape of `T`.
pub fn read<T: DeserializeOwned>(json: &[u8]) -> Result<T, JsonError> {
    read_with(json, |deserializer| T::deserialize(deserializer))
}

/// As [`read`], of somebody who is not trusted: no name or text is longer than [`TEXT_BYTES_MAX`].
/// Looked at before anything is reserved.
///
/// # Errors
/// As [`read`], and a text that is too long.
pub fn read_bounded<T: DeserializeOwned>(json: &[u8]) -> Result<T, JsonError> {
    let json = plain(json)?;
    check_texts(json)?;
    read(json)
}

/// The deserializer that [`read_with`] hands on: that of `serde_json`, watched for the member.
pub type Watched<'a, 'b, 'de> = serde_path_to_error::Deserializer<
    'a,
    'b,
    &'a mut serde_json::Deserializer<serde_json::de::SliceRead<'de>>,
>;

/// Reads all of `json` by `work`.
pub fn read_with<'de, T>(
    json: &'de [u8],
    work: impl for<'a, 'b> FnOnce(Watched<'a, 'b, 'de>) -> Result<T, serde_json::Error>,
) -> Result<T, JsonError> {
    let mut deserializer = serde_json::Deserializer::from_slice(plain(json)?);
    let mut track = Track::new();
    let result = work(serde_path_to_error::Deserializer::new(&mut deserializer, &mut track));
    let value = result.map_err(|error| {
        let path = track.path().to_string();
        // A single point stands for the whole.
        let member = (path != ".").then(|| shortened(&path));
        JsonError { member, ..JsonError::from(error) }
    })?;
    deserializer.end()?;
    Ok(value)
}

/// Whether no name or text is too long. Whatever is no JSON is left to the reader.
///
/// # Errors
/// The place of the first that is.
pub(crate) fn check_texts(json: &[u8]) -> Result<(), JsonError> {
    let mut rest = json;
    while let Some(start) = rest.iter().position(|&byte| byte == b'"') {
        let text = &rest[start + 1..];
        let length = text_len(text);
        if length > TEXT_BYTES_MAX {
            let before = &json[..json.len() - text.len()];
            let line_start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
            let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
            return Err(JsonError {
                member: None,
                reason: format!("a name or text is longer than {TEXT_BYTES_MAX} bytes"),
                place: Some((line, before.len() - line_start)),
            });
        }
        rest = text.get(length + 1..).unwrap_or_default();
    }
    Ok(())
}

/// Bytes before the quote that ends a text, or all of them.
fn text_len(text: &[u8]) -> usize {
    let mut at = 0;
    while let Some(&byte) = text.get(at) {
        match byte {
            b'"' => return at,
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
    text.len()
}

/// serde's own words. Of a long message what was sent is cut, which may be of any length, and not what
/// is expected, which is ours.
fn own_words(text: &str) -> String {
    match text.rsplit_once(EXPECTED) {
        Some((sent, expected)) => format!("{}{EXPECTED}{expected}", shortened(sent)),
        None => shortened(text),
    }
}

/// Between what serde found and what it expected; without it a long message is only cut elsewhere.
const EXPECTED: &str = ", expected ";
/// Longest piece of the input that an error repeats, characters.
const ECHO_MAX: usize = 100;

/// At most 100 characters of what came from outside and may be of any length.
#[must_use]
pub fn shortened(text: &str) -> String {
    match text.char_indices().nth(ECHO_MAX) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests;
