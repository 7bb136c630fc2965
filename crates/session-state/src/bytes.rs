//! State as bytes, bit by bit the same when it is read.

use super::SEALED_BYTES_MAX;

/// Zeros in a row that end a run of values: fewer cost less than the two lengths of a new run.
const GAP: usize = 3;

/// Why bytes are not the state that is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// They end too soon, or there are more than that.
    #[error("the state has another length")]
    Length,
    /// A number that cannot be there.
    #[error("the state holds {0} that cannot be")]
    Value(&'static str),
}

/// Writes state.
#[derive(Debug, Default)]
pub struct Writer(Vec<u8>);

impl Writer {
    /// Writes a whole number.
    pub fn number(&mut self, number: u64) {
        self.put(&number.to_le_bytes());
    }

    /// Writes a whole number that may be missing.
    pub fn option(&mut self, number: Option<u64>) {
        self.number(number.is_some().into());
        self.number(number.unwrap_or_default());
    }

    /// Writes values, of which zeros take no room.
    pub fn floats(&mut self, values: &[f32]) {
        let mut at = 0;
        while at < values.len() {
            let start = at + zeros(&values[at..]);
            let mut end = start;
            while end < values.len() {
                match zeros(&values[end..]) {
                    0 => end += 1,
                    gap if gap < GAP && end + gap < values.len() => end += gap,
                    _ => break,
                }
            }
            self.number(((start - at) as u64) << 32 | (end - start) as u64);
            for value in &values[start..end] {
                self.put(&value.to_le_bytes());
            }
            at = end;
        }
    }

    /// What is too much to be sealed is not kept either: the length shows it.
    fn put(&mut self, bytes: &[u8]) {
        if self.0.len() <= SEALED_BYTES_MAX {
            self.0.extend_from_slice(bytes);
        }
    }

    /// The bytes; more than [`SEALED_BYTES_MAX`] are cut off.
    #[must_use]
    pub fn finish(self) -> Vec<u8> {
        self.0
    }
}

/// Zeros at the start; minus zero is a value.
fn zeros(values: &[f32]) -> usize {
    values.iter().take_while(|value| value.to_bits() == 0).count()
}

/// Reads what a [`Writer`] wrote.
#[derive(Debug)]
pub struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// Begins at the start of `bytes`.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// The next number.
    ///
    /// # Errors
    /// The bytes end.
    pub fn number(&mut self) -> Result<u64, StateError> {
        let (number, rest) = self.0.split_first_chunk().ok_or(StateError::Length)?;
        self.0 = rest;
        Ok(u64::from_le_bytes(*number))
    }

    /// The next number that may be missing.
    ///
    /// # Errors
    /// The bytes end.
    pub fn option(&mut self) -> Result<Option<u64>, StateError> {
        let is_some = self.number()? != 0;
        let number = self.number()?;
        Ok(is_some.then_some(number))
    }

    /// The next number, which is at most `most`.
    ///
    /// # Errors
    /// The bytes end, or the number is greater; `what` names it.
    pub fn count(&mut self, most: usize, what: &'static str) -> Result<usize, StateError> {
        let number = usize::try_from(self.number()?).map_err(|_| StateError::Value(what))?;
        if number <= most { Ok(number) } else { Err(StateError::Value(what)) }
    }

    /// The next values, exactly as many as there is room for.
    ///
    /// # Errors
    /// The bytes end, or there were more values or fewer.
    pub fn floats(&mut self, values: &mut [f32]) -> Result<(), StateError> {
        let mut rest = values;
        while !rest.is_empty() {
            let run = self.number()?;
            let (gap, count) = ((run >> 32) as usize, (run & 0xffff_ffff) as usize);
            if gap + count == 0 {
                return Err(StateError::Length);
            }
            let (zeros, behind) = rest.split_at_mut_checked(gap).ok_or(StateError::Length)?;
            let (own, behind) = behind.split_at_mut_checked(count).ok_or(StateError::Length)?;
            let (bytes, left) = self.0.split_at_checked(4 * count).ok_or(StateError::Length)?;
            zeros.fill(0.0);
            for (value, bytes) in own.iter_mut().zip(bytes.as_chunks().0) {
                *value = f32::from_le_bytes(*bytes);
            }
            (rest, self.0) = (behind, left);
        }
        Ok(())
    }

    /// Whether all is read.
    ///
    /// # Errors
    /// It is not.
    pub fn end(&self) -> Result<(), StateError> {
        if self.0.is_empty() { Ok(()) } else { Err(StateError::Length) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn value() -> impl Strategy<Value = f32> {
        prop_oneof![3 => Just(0.0), 1 => Just(-0.0), 3 => any::<u32>().prop_map(f32::from_bits)]
    }

    proptest! {
        #[test]
        fn every_bit_comes_back(
            values in prop::collection::vec(value(), 0..200), number in any::<Option<u64>>(),
        ) {
            let mut writer = Writer::default();
            writer.floats(&values);
            writer.option(number);
            let bytes = writer.finish();
            let mut reader = Reader::new(&bytes);
            let mut found = vec![7.0; values.len()];
            reader.floats(&mut found).unwrap();
            prop_assert_eq!(reader.option(), Ok(number));
            prop_assert_eq!(reader.end(), Ok(()));
            prop_assert!(values.iter().zip(&found).all(|(a, b)| a.to_bits() == b.to_bits()));
            let mut short = Reader::new(&bytes[..bytes.len() - 1]);
            prop_assert!(short.floats(&mut found).and_then(|()| short.option()).is_err());
        }

        #[test]
        fn bytes_of_any_kind_are_read_or_refused(
            bytes in prop::collection::vec(any::<u8>(), 0..200), room in 0usize..100,
        ) {
            let mut reader = Reader::new(&bytes);
            let _ = reader.floats(&mut vec![0.0; room]);
            let _ = reader.count(10, "a count");
        }
    }

    #[test]
    fn more_than_can_be_sealed_is_not_kept() {
        let mut writer = Writer::default();
        writer.floats(&vec![1.0; SEALED_BYTES_MAX]);
        assert!((1..8).contains(&(writer.finish().len() - SEALED_BYTES_MAX)));
    }

    #[test]
    fn a_map_without_contact_takes_no_room() {
        let mut writer = Writer::default();
        writer.floats(&vec![0.0; 50_176]);
        assert_eq!(writer.finish().len(), 8);
    }
}
