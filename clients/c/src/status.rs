//! What a call returns: one number a reason, the same in every version.

use papilla_inside::LoadError;
use papilla_proto::ErrorCode;

/// A status of the C interface. Numbers do not change; new ones are added at the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
#[allow(missing_docs)] // `papilla_c.h` says each in words, and a test holds the two together.
pub enum Status {
    Ok = 0,
    BadPointer = 1,
    NotOpen = 2,
    NoFile = 3,
    BadModel = 4,
    BadJson = 5,
    UnknownVersion = 6,
    UnknownTier = 7,
    UnknownEffect = 8,
    BadEffect = 9,
    BadContact = 10,
    AtlasMismatch = 11,
    WrongType = 12,
    WrongLength = 13,
    NotFinite = 14,
    NegativePressure = 15,
    OutOfRange = 16,
    Internal = 17,
}

impl Status {
    /// All of them, by number.
    pub const ALL: [Self; 18] = [
        Self::Ok,
        Self::BadPointer,
        Self::NotOpen,
        Self::NoFile,
        Self::BadModel,
        Self::BadJson,
        Self::UnknownVersion,
        Self::UnknownTier,
        Self::UnknownEffect,
        Self::BadEffect,
        Self::BadContact,
        Self::AtlasMismatch,
        Self::WrongType,
        Self::WrongLength,
        Self::NotFinite,
        Self::NegativePressure,
        Self::OutOfRange,
        Self::Internal,
    ];

    /// Its word: that of the protocol where the service knows the same error.
    #[must_use]
    pub const fn name(self) -> &'static std::ffi::CStr {
        match self {
            Self::Ok => c"ok",
            Self::BadPointer => c"bad_pointer",
            Self::NotOpen => c"not_open",
            Self::NoFile => c"no_file",
            Self::BadModel => c"bad_model",
            Self::BadJson => c"bad_json",
            Self::UnknownVersion => c"unknown_version",
            Self::UnknownTier => c"unknown_tier",
            Self::UnknownEffect => c"unknown_effect",
            Self::BadEffect => c"bad_effect",
            Self::BadContact => c"bad_contact",
            Self::AtlasMismatch => c"atlas_mismatch",
            Self::WrongType => c"wrong_type",
            Self::WrongLength => c"wrong_length",
            Self::NotFinite => c"not_finite",
            Self::NegativePressure => c"negative_pressure",
            Self::OutOfRange => c"out_of_range",
            Self::Internal => c"internal",
        }
    }
}

impl From<ErrorCode> for Status {
    fn from(code: ErrorCode) -> Self {
        match code {
            ErrorCode::BadModel => Self::BadModel,
            ErrorCode::BadJson => Self::BadJson,
            ErrorCode::UnknownVersion => Self::UnknownVersion,
            ErrorCode::UnknownTier => Self::UnknownTier,
            ErrorCode::UnknownEffect => Self::UnknownEffect,
            ErrorCode::BadEffect => Self::BadEffect,
            ErrorCode::BadContact => Self::BadContact,
            ErrorCode::AtlasMismatch => Self::AtlasMismatch,
            ErrorCode::WrongType => Self::WrongType,
            ErrorCode::WrongLength => Self::WrongLength,
            ErrorCode::NotFinite => Self::NotFinite,
            ErrorCode::NegativePressure => Self::NegativePressure,
            ErrorCode::OutOfRange => Self::OutOfRange,
            // Of the wire alone: nothing here makes them.
            _ => Self::Internal,
        }
    }
}

impl From<&LoadError> for Status {
    fn from(error: &LoadError) -> Self {
        match error {
            LoadError::File { .. } => Self::NoFile,
            LoadError::Unknown { .. } => Self::UnknownTier,
            _ => Self::BadModel,
        }
    }
}
