//! Part of a campaign, for one of many processes.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::num::NonZero;
use std::ops::Range;
use std::str::FromStr;

/// Slice `index` of `count`. A serial run is slice 1 of 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Slice {
    /// 1 to `count`.
    index: usize,
    count: NonZero<usize>,
}

/// Text that names no slice.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum SliceError {
    /// It is not `I/N`.
    #[error("'{0}' is no slice: give I/N with 1 <= I <= N, such as 3/100")]
    Form(String),
    /// Slurm's variables cannot be taken for one.
    #[error(
        "{0}: a job array is taken for slices where its ids have no gaps; give --slice I/N yourself"
    )]
    Slurm(String),
}

impl Slice {
    /// All of it.
    pub const WHOLE: Self = Self { index: 1, count: NonZero::<usize>::MIN };

    /// Slice `index` (from 1) of `count`.
    ///
    /// # Errors
    /// [`SliceError::Form`] where there is no such slice.
    pub fn new(index: usize, count: usize) -> Result<Self, SliceError> {
        match NonZero::new(count) {
            Some(n) if (1..=count).contains(&index) => Ok(Self { index, count: n }),
            _ => Err(SliceError::Form(format!("{index}/{count}"))),
        }
    }

    /// The slice of a task of a Slurm job array, by the variables of its environment; `None`
    /// outside an array.
    ///
    /// # Errors
    /// [`SliceError::Slurm`] where they make no sense or the array has gaps, as one that was
    /// submitted again for some ids: its tasks would take other slices than at first.
    pub fn of_slurm(variable: impl Fn(&str) -> Option<String>) -> Result<Option<Self>, SliceError> {
        let Some(id) = variable("SLURM_ARRAY_TASK_ID") else { return Ok(None) };
        let number = |name: &str, text: String| -> Result<usize, SliceError> {
            text.trim().parse().map_err(|_| SliceError::Slurm(format!("{name} is '{text}'")))
        };
        let given = |name: &str, otherwise: Option<usize>| match (variable(name), otherwise) {
            (Some(text), _) => number(name, text),
            (None, Some(value)) => Ok(value),
            (None, None) => Err(SliceError::Slurm(format!("{name} is not set"))),
        };
        let id = number("SLURM_ARRAY_TASK_ID", id)?;
        let count = given("SLURM_ARRAY_TASK_COUNT", None)?;
        let least = given("SLURM_ARRAY_TASK_MIN", Some(1))?;
        let step = given("SLURM_ARRAY_TASK_STEP", Some(1))?.max(1);
        let most = given("SLURM_ARRAY_TASK_MAX", Some(least + step * count.saturating_sub(1)))?;
        let places = most.checked_sub(least).map(|span| span / step + 1);
        let place = id.checked_sub(least).map(|past| past / step + 1);
        match (places == Some(count), place) {
            (true, Some(place)) if place <= count => Self::new(place, count).map(Some),
            _ => Err(SliceError::Slurm(format!(
                "task {id} of an array of {count} ids from {least} to {most}"
            ))),
        }
    }

    /// Number of the slice, from 1.
    pub fn index(self) -> usize {
        self.index
    }

    /// Slices in all.
    pub fn count(self) -> usize {
        self.count.get()
    }

    /// Is it all of it?
    pub fn is_whole(self) -> bool {
        self.count.get() == 1
    }

    /// Which of `all` things are its own. Neighbours, since every stretch of a campaign has its
    /// share of each indenter.
    pub fn range(self, all: usize) -> Range<usize> {
        let from = |index: usize| (index as u128 * all as u128 / self.count.get() as u128) as usize;
        from(self.index - 1)..from(self.index)
    }
}

impl Slice {
    /// Whether the `k`-th of things that grow dearer is its own: every `count`-th is.
    pub fn takes(self, k: usize) -> bool {
        k % self.count.get() == self.index - 1
    }
}

impl fmt::Display for Slice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Slice {
    type Err = SliceError;

    fn from_str(text: &str) -> Result<Self, SliceError> {
        let form = || SliceError::Form(text.into());
        let (index, count) = text.split_once('/').ok_or_else(form)?;
        let number = |part: &str| part.parse::<usize>().map_err(|_| form());
        Self::new(number(index)?, number(count)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn slices_have_everything_once() {
        for (all, count) in [(0, 3), (7, 3), (100, 7), (3, 9), (1 << 20, 34_953)] {
            let own = |i| Slice::new(i, count).unwrap().range(all);
            let joined: Vec<usize> = (1..=count).flat_map(own).collect();
            assert!(joined == (0..all).collect::<Vec<_>>(), "{all} in {count}");
            let sizes = (1..=count).map(|i| own(i).len());
            assert!(sizes.clone().max().unwrap() - sizes.min().unwrap() <= 1);
        }
        assert_eq!(Slice::WHOLE.range(5), 0..5);
    }

    #[test]
    fn what_is_no_slice_is_refused() {
        assert_eq!("3/100".parse::<Slice>().unwrap().to_string(), "3/100");
        for text in ["", "3", "0/4", "5/4", "1/0", "-1/4", "a/b", "1/2/3", "1 / 2"] {
            assert_eq!(text.parse::<Slice>(), Err(SliceError::Form(text.into())), "{text}");
        }
    }

    fn of_slurm(
        id: &str,
        count: &str,
        least: &str,
        most: &str,
        step: &str,
    ) -> Result<Option<Slice>, SliceError> {
        let names = ["ID", "COUNT", "MIN", "MAX", "STEP"].map(|n| format!("SLURM_ARRAY_TASK_{n}"));
        let set = names.into_iter().zip([id, count, least, most, step]);
        let set: HashMap<_, _> = set.filter(|(_, v)| !v.is_empty()).collect();
        Slice::of_slurm(|name| set.get(name).map(ToString::to_string))
    }

    #[test]
    fn an_array_of_slurm_is_slices_if_it_has_no_gaps() {
        assert_eq!(of_slurm("", "", "", "", ""), Ok(None));
        assert_eq!(of_slurm("0", "4", "0", "3", "1"), Ok(Some(Slice::new(1, 4).unwrap())));
        assert_eq!(of_slurm("7", "3", "3", "7", "2"), Ok(Some(Slice::new(3, 3).unwrap())));
        assert_eq!(of_slurm("2", "4", "", "", ""), Ok(Some(Slice::new(2, 4).unwrap())));
        for (id, count, least, most, step) in [
            ("7", "2", "3", "7", "1"),
            ("2", "", "1", "4", "1"),
            ("x", "4", "1", "4", "1"),
            ("5", "4", "1", "4", "1"),
            ("0", "4", "1", "4", "1"),
        ] {
            let found = of_slurm(id, count, least, most, step);
            assert!(matches!(found, Err(SliceError::Slurm(_))), "{id} of {count}: {found:?}");
        }
    }
}
