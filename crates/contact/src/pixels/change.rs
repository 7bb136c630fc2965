//! By how much a round changes forces.

/// Sums over the vertices' forces of a round.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    by_n: f32,
    size_n: f32,
}

impl Change {
    /// Counts a force that was `from` and is `to`; returns the difference.
    pub(super) fn count(&mut self, from: f32, to: f32) -> f32 {
        let by = to - from;
        self.by_n += by.abs();
        self.size_n += to.abs();
        by
    }

    /// Whether skin that was pressed was pushed out of all reach.
    pub(super) fn is_out_of_reach(self) -> bool {
        self.size_n == 0.0 && self.by_n > 0.0
    }

    /// The change over the sum of forces; 1 where skin was pushed out of all reach. NaN stays NaN: it
    /// must not pass for nothing.
    pub(super) fn part(self) -> f32 {
        match self.size_n {
            0.0 if self.by_n == 0.0 => 0.0,
            0.0 => 1.0,
            size_n => self.by_n / size_n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_is_none_of_nothing_and_all_of_what_is_out_of_reach() {
        let of = |forces: &[[f32; 2]]| {
            let mut change = Change::default();
            forces.iter().for_each(|[from, to]| _ = change.count(*from, *to));
            change
        };
        assert_eq!((of(&[]).part(), of(&[[0.0; 2]]).is_out_of_reach()), (0.0, false));
        assert_eq!((of(&[[2.0, 0.0]]).part(), of(&[[2.0, 0.0]]).is_out_of_reach()), (1.0, true));
        let turned = of(&[[-1.0, 1.0], [1.0, 3.0]]);
        assert_eq!((turned.part(), turned.is_out_of_reach()), (1.0, false));
        assert!(of(&[[f32::NAN, 1.0]]).part().is_nan());
    }
}
