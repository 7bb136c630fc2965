//! Names beside dots, where they are read: within the chart and beside each other.

use plotters::style::text_anchor::HPos;

/// Height of the text, px.
pub(super) const TEXT_PX: i32 = 14;
/// Radius of a dot, px.
pub(super) const DOT_PX: i32 = 5;
/// Width of a letter over its height, at most.
const LETTER: f64 = 0.6;
/// Room between a dot and its name, px.
const GAP_PX: i32 = 8;

/// Left, top, right, bottom, px.
type Box4 = [i32; 4];

/// What is taken already.
pub(super) struct Labels {
    within: Box4,
    taken: Vec<Box4>,
}

impl Labels {
    /// None yet, in this part of the picture.
    pub(super) fn new(within: Box4) -> Self {
        Self { within, taken: Vec::new() }
    }

    /// Takes a dot's place.
    pub(super) fn dot(&mut self, (x, y): (i32, i32)) {
        self.taken.push([x - DOT_PX, y - DOT_PX, x + DOT_PX, y + DOT_PX]);
    }

    /// Where a name is anchored at half its height, from its dot at `(x, y)`, and by which side:
    /// the place beside the dot, or on other lines, that covers least and stays within.
    pub(super) fn place(&mut self, name: &str, (x, y): (i32, i32)) -> ((i32, i32), HPos) {
        let width = (LETTER * f64::from(TEXT_PX) * name.chars().count() as f64).ceil() as i32;
        let beside = |line: i32| {
            let dy = line * TEXT_PX;
            [((GAP_PX, dy), HPos::Left), ((-GAP_PX, dy), HPos::Right), ((0, dy), HPos::Center)]
        };
        let own = |((dx, dy), side): &((i32, i32), HPos)| {
            let left = match side {
                HPos::Left => x + dx,
                HPos::Right => x + dx - width,
                HPos::Center => x + dx - width / 2,
            };
            [left, y + dy - TEXT_PX / 2, left + width, y + dy + TEXT_PX / 2]
        };
        let cost = |place: &((i32, i32), HPos)| {
            let own = own(place);
            let [left, top, right, bottom] = self.within;
            let outside = (left - own[0]).max(0)
                + (own[2] - right).max(0)
                + (top - own[1]).max(0)
                + (own[3] - bottom).max(0);
            let covered: i32 = self.taken.iter().map(|other| overlap(own, *other)).sum();
            i64::from(outside) * 1000 + i64::from(covered)
        };
        let places = [0, -1, 1, -2, 2, -3, 3].into_iter().flat_map(beside);
        let found = places.min_by_key(cost).unwrap_or(((GAP_PX, 0), HPos::Left));
        let taken = own(&found);
        self.taken.push(taken);
        found
    }
}

/// Area that two boxes share, px2.
fn overlap(a: Box4, b: Box4) -> i32 {
    let along = |i: usize| (a[i + 2].min(b[i + 2]) - a[i].max(b[i])).max(0);
    along(0) * along(1)
}
