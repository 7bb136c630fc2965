//! Places for names beside dots.

use super::FONT_PX;

/// Finds places for names beside dots where they cover neither dots nor each other.
pub(super) struct Labels {
    /// Left, top, right, bottom of what names must stay within.
    frame: [i32; 4],
    /// The same of what they must not cover.
    taken: Vec<[i32; 4]>,
}

impl Labels {
    pub(super) fn new(dots: &[(i32, i32)], frame: [i32; 4]) -> Self {
        let taken = dots.iter().map(|(x, y)| [x - 6, y - 6, x + 6, y + 6]).collect();
        Self { frame, taken }
    }

    /// Top left corner of the name of the dot at `(x, y)`.
    pub(super) fn place(&mut self, (x, y): (i32, i32), name: &str) -> (i32, i32) {
        // The fonts are the viewer's: a generous guess of the width.
        let width = (name.chars().count() as i32 * FONT_PX * 10) / 20;
        let height = FONT_PX + 1;
        let beside = |dx: i32, dy: i32| [x + dx, y + dy, x + dx + width, y + dy + height];
        let mut candidates = Vec::new();
        for lift in [0, 9, -9] {
            candidates.push(beside(9, lift - height / 2));
        }
        for lift in [15, -15] {
            candidates.push(beside(-width / 2, lift - height / 2));
        }
        for lift in [0, 9, -9] {
            candidates.push(beside(-9 - width, lift - height / 2));
        }
        for lift in [24, -24, 34, -34] {
            candidates.push(beside(-width / 2, lift - height / 2));
            candidates.push(beside(8, lift - height / 2));
        }
        let apart =
            |a: &[i32; 4], b: &[i32; 4]| a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1];
        let inside = |c: &[i32; 4]| c[0] >= self.frame[0] && c[2] <= self.frame[2];
        let free = |c: &&[i32; 4]| inside(c) && self.taken.iter().all(|t| apart(c, t));
        let free = candidates.iter().find(free);
        let found = *free.unwrap_or(&candidates[0]);
        self.taken.push(found);
        (found[0], found[1])
    }
}

#[cfg(test)]
mod tests {
    use super::Labels;

    #[test]
    fn names_keep_clear_of_dots_and_each_other() {
        let dots = [(100, 100), (112, 102), (104, 95)];
        let mut labels = Labels::new(&dots, [0, 0, 400, 400]);
        for dot in dots {
            labels.place(dot, "some-name");
        }
        for (i, a) in labels.taken.iter().enumerate().skip(dots.len()) {
            for b in &labels.taken[..i] {
                assert!(a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1], "{a:?} {b:?}");
            }
        }
    }
}
