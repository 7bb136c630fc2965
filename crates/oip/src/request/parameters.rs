//! The parameters of a request and of its tensors: those that are known here.

use std::fmt;

use papilla_proto::{ErrorCode, Problem, error::shortened};
use serde::{
    Deserialize, Deserializer,
    de::{IgnoredAny, MapAccess, SeqAccess, Visitor},
};

/// What clients may say beside the tensors; others are passed over.
#[derive(Default, Deserialize)]
pub(super) struct Parameters {
    #[serde(default)]
    pub(super) timeout: Parameter,
    #[serde(default)]
    pub(super) binary_data_output: Parameter,
    #[serde(default)]
    pub(super) binary_data_size: Parameter,
    #[serde(default)]
    pub(super) binary_data: Parameter,
    #[serde(default)]
    pub(super) classification: Parameter,
    #[serde(default)]
    pub(super) finger: Parameter,
    #[serde(default)]
    sequence_id: Parameter,
    #[serde(default)]
    sequence_start: Parameter,
    #[serde(default)]
    sequence_end: Parameter,
    #[serde(default)]
    shared_memory_region: Parameter,
    #[serde(default)]
    shared_memory_byte_size: Parameter,
    #[serde(default)]
    shared_memory_offset: Parameter,
}

impl Parameters {
    /// The first of the parameters that make a request part of a sequence.
    pub(super) fn of_sequence(&self) -> Option<&'static str> {
        let parts = [
            ("sequence_id", &self.sequence_id),
            ("sequence_start", &self.sequence_start),
            ("sequence_end", &self.sequence_end),
        ];
        parts.into_iter().find(|(_, parameter)| parameter.is_there()).map(|(name, _)| name)
    }

    /// Whether a tensor is to be found in memory that client and server share.
    pub(super) fn has_shared_memory(&self) -> bool {
        let parts =
            [&self.shared_memory_region, &self.shared_memory_byte_size, &self.shared_memory_offset];
        parts.into_iter().any(Parameter::is_there)
    }
}

/// The value of one parameter, whatever it is.
#[derive(Default)]
pub(super) enum Parameter {
    #[default]
    Missing,
    Boolean(bool),
    WholeNumber(u64),
    /// In words.
    Other(String),
}

impl Parameter {
    /// Whether the request has it.
    pub(super) fn is_there(&self) -> bool {
        !matches!(self, Self::Missing)
    }

    /// A whole number; None if it is missing.
    pub(super) fn whole_number(&self, name: &str) -> Result<Option<u64>, Problem> {
        match self {
            Self::Missing => Ok(None),
            Self::WholeNumber(number) => Ok(Some(*number)),
            other => Err(wrong(name, format!("{other} is not a whole number"))),
        }
    }

    /// True or false; None if it is missing.
    pub(super) fn boolean(&self, name: &str) -> Result<Option<bool>, Problem> {
        match self {
            Self::Missing => Ok(None),
            Self::Boolean(value) => Ok(Some(*value)),
            other => Err(wrong(name, format!("{other} is not true or false"))),
        }
    }
}

fn wrong(name: &str, message: String) -> Problem {
    Problem::new(ErrorCode::BadQuery, message).at(name)
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str("nothing"),
            Self::Boolean(value) => value.fmt(f),
            Self::WholeNumber(number) => number.fmt(f),
            Self::Other(words) => f.write_str(words),
        }
    }
}

impl<'de> Deserialize<'de> for Parameter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Parameter;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_bool<E>(self, value: bool) -> Result<Parameter, E> {
        Ok(Parameter::Boolean(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Parameter, E> {
        Ok(Parameter::WholeNumber(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Parameter, E> {
        Ok(Parameter::Other(value.to_string()))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Parameter, E> {
        Ok(Parameter::Other(value.to_string()))
    }

    fn visit_str<E>(self, value: &str) -> Result<Parameter, E> {
        Ok(Parameter::Other(format!("\"{}\"", shortened(value))))
    }

    fn visit_unit<E>(self) -> Result<Parameter, E> {
        Ok(Parameter::Other("null".to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Parameter, A::Error> {
        while list.next_element::<IgnoredAny>()?.is_some() {}
        Ok(Parameter::Other("a list".to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Parameter, A::Error> {
        while members.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(Parameter::Other("an object".to_owned()))
    }
}
