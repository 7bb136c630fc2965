//! Lists of a request, of which no more is kept than a map needs.

use std::{fmt, marker::PhantomData};

use bytes::Bytes;
use papilla_proto::{ErrorCode, MAP_LEN, Problem};
use serde::{
    Deserialize, Deserializer,
    de::{DeserializeSeed, Error, IgnoredAny, SeqAccess, Visitor},
};

/// The first member of a list, and how many there are.
pub(super) struct First<T> {
    pub(super) first: Option<T>,
    pub(super) count: usize,
}

impl<T> Default for First<T> {
    fn default() -> Self {
        Self { first: None, count: 0 }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for First<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(FirstReader(PhantomData))
    }
}

struct FirstReader<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for FirstReader<T> {
    type Value = First<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<First<T>, A::Error> {
        let first = list.next_element()?;
        let mut count = usize::from(first.is_some());
        while first.is_some() && list.next_element::<IgnoredAny>()?.is_some() {
            count += 1;
        }
        Ok(First { first, count })
    }
}

/// Axes of a shape that are kept: more than any tensor here has.
const AXES_KEPT: usize = 8;

/// The lengths of a tensor's axes.
#[derive(Default)]
pub(super) struct Shape {
    kept: [usize; AXES_KEPT],
    count: usize,
}

impl Shape {
    /// Whether it is `due`.
    pub(super) fn is<const N: usize>(&self, due: [usize; N]) -> bool {
        self.count == N && self.kept.get(..N).is_some_and(|kept| kept == due)
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kept.get(..self.count) {
            Some(all) => write!(f, "{all:?}"),
            None => write!(f, "one of {} axes", self.count),
        }
    }
}

impl<'de> Deserialize<'de> for Shape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Self::default())
    }
}

impl<'de> Visitor<'de> for Shape {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of whole numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut list: A) -> Result<Self, A::Error> {
        while let Some(length) = list.next_element()? {
            if let Some(place) = self.kept.get_mut(self.count) {
                *place = length;
            }
            self.count += 1;
        }
        Ok(self)
    }
}

/// Numbers in lists of any depth, row by row, as f32; no more are kept than a map has.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    bytes: Vec<u8>,
    count: usize,
}

impl Numbers {
    fn push(&mut self, value: f64) {
        if self.count == 0 {
            self.bytes.reserve_exact(4 * MAP_LEN);
        }
        self.count += 1;
        if self.count <= MAP_LEN {
            // What overflows becomes infinite, and is refused with its place.
            self.bytes.extend_from_slice(&(value as f32).to_le_bytes());
        }
    }

    /// # Errors
    /// They are more or fewer than a map has.
    pub(super) fn into_bytes(self) -> Result<Bytes, Problem> {
        if self.count == MAP_LEN {
            return Ok(self.bytes.into());
        }
        let message = format!("data has {} numbers, the shape {MAP_LEN}", self.count);
        Err(Problem::new(ErrorCode::WrongLength, message).at("data"))
    }
}

impl<'de> Deserialize<'de> for Numbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut numbers = Self::default();
        deserializer.deserialize_seq(Flatten(&mut numbers))?;
        Ok(numbers)
    }
}

/// Reads a number, or a list of what it reads, into the numbers.
struct Flatten<'a>(&'a mut Numbers);

impl<'de> DeserializeSeed<'de> for Flatten<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Flatten<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a list of numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(Flatten(self.0))?.is_some() {}
        Ok(())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<(), E> {
        self.0.push(value);
        Ok(())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        self.0.push(value as f64);
        Ok(())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<(), E> {
        self.0.push(value as f64);
        Ok(())
    }
}
