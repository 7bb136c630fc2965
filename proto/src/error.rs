//! Error codes of the wire contract and the HTTP status each one has.

use std::fmt;

use papilla_json::JsonError;
pub use papilla_json::shortened;
use serde::{Deserialize, Serialize};

/// What went wrong, as one stable word a program can match on.
///
/// On the wire a code is the `snake_case` name of the variant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ErrorCode {
    /// The payload has another number of bytes or samples than the map needs.
    WrongLength,
    /// A content type, sample type, frame kind or pixel type that is not taken here.
    WrongType,
    /// The map is not 224 x 224.
    WrongShape,
    /// A sample is NaN or infinite.
    NotFinite,
    /// A sample is below zero: pressure pushes, it never pulls.
    NegativePressure,
    /// A sample is above the greatest pressure the model was trained on.
    OutOfRange,
    /// A scale is missing, zero, negative or not finite.
    BadScale,
    /// The message or body is larger than the server reads.
    TooLarge,
    /// A binary frame is shorter than its 32-byte header.
    TruncatedHeader,
    /// A binary frame does not start with `PPL1`.
    BadMagic,
    /// A protocol or frame version this server does not speak.
    UnknownVersion,
    /// Text arrived where a binary frame was due.
    UnexpectedText,
    /// A binary frame arrived where the JSON hello was due.
    UnexpectedBinary,
    /// The text is not the JSON that was due.
    BadJson,
    /// The body is not a readable `.npy` file.
    BadNpy,
    /// The body is not a readable PNG file.
    BadPng,
    /// A query parameter is unknown, missing or malformed.
    BadQuery,
    /// No tier has this name.
    UnknownTier,
    /// No such effect, or the tier does not render it.
    UnknownEffect,
    /// A parameter of an effect is missing or unusable.
    BadEffect,
    /// A shape, pose, gap, finger or net force that cannot be.
    BadContact,
    /// The client's atlas is not the one the tier was trained on.
    AtlasMismatch,
    /// No answer type in `Accept` is offered.
    NotAcceptable,
    /// No such resource.
    NotFound,
    /// The resource does not take this HTTP method.
    MethodNotAllowed,
    /// The resource speaks WebSocket; plain HTTP arrived.
    UpgradeRequired,
    /// A bearer token is asked for, and none or an unknown one came.
    Unauthorized,
    /// The client is known, but this is not for it: the origin of a page, or an administrator's
    /// resource.
    Forbidden,
    /// The client sends more requests a second than it may.
    RateLimited,
    /// The new models cannot be served; those that run were left as they are.
    BadModel,
    /// The client was too slow to send what was due.
    Timeout,
    /// The deadline passed; the work was dropped.
    Late,
    /// A newer frame of the same session took the place of this one.
    Superseded,
    /// Every place in the queue, or every session, is taken. Try again later.
    Overloaded,
    /// The server is draining and takes no new work.
    ShuttingDown,
    /// A fault of the server's own.
    Internal,
}

impl ErrorCode {
    /// All codes, in the order of the documentation.
    pub const ALL: [Self; 36] = [
        Self::WrongLength,
        Self::WrongType,
        Self::WrongShape,
        Self::NotFinite,
        Self::NegativePressure,
        Self::OutOfRange,
        Self::BadScale,
        Self::TooLarge,
        Self::TruncatedHeader,
        Self::BadMagic,
        Self::UnknownVersion,
        Self::UnexpectedText,
        Self::UnexpectedBinary,
        Self::BadJson,
        Self::BadNpy,
        Self::BadPng,
        Self::BadQuery,
        Self::UnknownTier,
        Self::UnknownEffect,
        Self::BadEffect,
        Self::BadContact,
        Self::AtlasMismatch,
        Self::NotAcceptable,
        Self::NotFound,
        Self::MethodNotAllowed,
        Self::UpgradeRequired,
        Self::Unauthorized,
        Self::Forbidden,
        Self::RateLimited,
        Self::BadModel,
        Self::Timeout,
        Self::Late,
        Self::Superseded,
        Self::Overloaded,
        Self::ShuttingDown,
        Self::Internal,
    ];

    /// The code's word on the wire.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::WrongLength => "wrong_length",
            Self::WrongType => "wrong_type",
            Self::WrongShape => "wrong_shape",
            Self::NotFinite => "not_finite",
            Self::NegativePressure => "negative_pressure",
            Self::OutOfRange => "out_of_range",
            Self::BadScale => "bad_scale",
            Self::TooLarge => "too_large",
            Self::TruncatedHeader => "truncated_header",
            Self::BadMagic => "bad_magic",
            Self::UnknownVersion => "unknown_version",
            Self::UnexpectedText => "unexpected_text",
            Self::UnexpectedBinary => "unexpected_binary",
            Self::BadJson => "bad_json",
            Self::BadNpy => "bad_npy",
            Self::BadPng => "bad_png",
            Self::BadQuery => "bad_query",
            Self::UnknownTier => "unknown_tier",
            Self::UnknownEffect => "unknown_effect",
            Self::BadEffect => "bad_effect",
            Self::BadContact => "bad_contact",
            Self::AtlasMismatch => "atlas_mismatch",
            Self::NotAcceptable => "not_acceptable",
            Self::NotFound => "not_found",
            Self::MethodNotAllowed => "method_not_allowed",
            Self::UpgradeRequired => "upgrade_required",
            Self::Unauthorized => "unauthorized",
            Self::Forbidden => "forbidden",
            Self::RateLimited => "rate_limited",
            Self::BadModel => "bad_model",
            Self::Timeout => "timeout",
            Self::Late => "late",
            Self::Superseded => "superseded",
            Self::Overloaded => "overloaded",
            Self::ShuttingDown => "shutting_down",
            Self::Internal => "internal",
        }
    }

    /// The HTTP status an answer with this code has.
    #[must_use]
    pub const fn http_status(self) -> u16 {
        match self {
            Self::WrongLength
            | Self::WrongShape
            | Self::BadScale
            | Self::TruncatedHeader
            | Self::BadMagic
            | Self::UnknownVersion
            | Self::UnexpectedText
            | Self::UnexpectedBinary
            | Self::BadJson
            | Self::BadNpy
            | Self::BadPng
            | Self::BadQuery => 400,
            Self::Unauthorized => 401,
            Self::Forbidden => 403,
            Self::UnknownTier | Self::NotFound => 404,
            Self::MethodNotAllowed => 405,
            Self::NotAcceptable => 406,
            Self::Timeout => 408,
            Self::UpgradeRequired => 426,
            Self::TooLarge => 413,
            Self::WrongType => 415,
            Self::NotFinite
            | Self::NegativePressure
            | Self::OutOfRange
            | Self::UnknownEffect
            | Self::BadEffect
            | Self::BadContact
            | Self::AtlasMismatch
            | Self::BadModel => 422,
            Self::RateLimited => 429,
            Self::Internal => 500,
            Self::Superseded | Self::Overloaded | Self::ShuttingDown => 503,
            Self::Late => 504,
        }
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// One error as a client sees it: a code to match on, words to read, and the
/// field at fault where there is one.
///
/// The HTTP body is `{"error": Problem}`; a session sends a
/// [`SessionError`](crate::SessionError), which holds the same three.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{code}: {message}")]
pub struct Problem {
    /// The code.
    pub code: ErrorCode,
    /// What went wrong, where, and what to do about it.
    pub message: String,
    /// Name of the header, parameter or member at fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
}

impl Problem {
    /// A problem with no single field at fault.
    #[must_use]
    pub fn new(code: ErrorCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), field: None }
    }

    /// The same problem, laid at the door of `field`.
    #[must_use]
    pub fn at(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }
}

impl From<JsonError> for Problem {
    fn from(error: JsonError) -> Self {
        let problem = Self::new(ErrorCode::BadJson, error.to_string());
        match error.member {
            Some(member) => problem.at(member),
            None => problem,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_reads_back_from_its_own_word() {
        for code in ErrorCode::ALL {
            let json = serde_json::to_string(&code).unwrap();
            assert_eq!(json, format!("\"{}\"", code.as_str()));
            assert_eq!(serde_json::from_str::<ErrorCode>(&json).unwrap(), code);
            assert!((400..600).contains(&code.http_status()), "{code}");
        }
    }

    #[test]
    fn codes_are_all_listed_once() {
        let mut words: Vec<_> = ErrorCode::ALL.iter().map(|c| c.as_str()).collect();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), ErrorCode::ALL.len());
    }

    #[test]
    fn a_problem_without_a_field_leaves_it_out() {
        let json = serde_json::to_string(&Problem::new(ErrorCode::Late, "too late")).unwrap();
        assert_eq!(json, r#"{"code":"late","message":"too late"}"#);
        let at = Problem::new(ErrorCode::BadQuery, "no").at("tier");
        assert_eq!(
            serde_json::to_value(&at).unwrap(),
            serde_json::json!({"code": "bad_query", "message": "no", "field": "tier"})
        );
    }
}
