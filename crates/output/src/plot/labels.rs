//! Names beside dots, where they are read: within the chart, over no dot and no other name, nearer to
//! their own dot than to any other, and not on a line where there is a place beside it.

use plotters::style::text_anchor::HPos;

/// Radius of a dot, px.
pub const DOT_PX: i32 = 5;
/// Width of a letter over its height, at most.
const LETTER: f64 = 0.5;
/// Room between the middle of a dot and its name beside it, px.
const GAP_PX: i32 = 9;
/// How many places later a place on a line is tried.
const ON_LINE: usize = 8;
/// Most places that are tried for all names together.
const STEPS_MAX: usize = 50_000;

/// Left, top, right, bottom, px.
type Box4 = [i32; 4];
/// Where a straight line begins and ends, px.
pub type Line = [(i32, i32); 2];

/// Where a name stands.
#[derive(Clone, Copy)]
pub struct Place {
    /// Where it is anchored, at half its height, px.
    pub anchor: (i32, i32),
    /// By which side it is anchored there.
    pub side: HPos,
    /// What it covers at most.
    covers: Box4,
}

/// Places of the names of dots within a part of a picture (left, top, right, bottom, px), in the
/// dots' order. `text_px` is the height of the names, and `lines` are what they had better not lie on.
///
/// Of the combinations of places that are tried, the one is taken whose names stand nearest to
/// where they are looked for: beside the dot, then above and below. Where dots are so crowded that
/// no place is good for a name, the one is taken that covers least.
#[must_use]
pub fn places(
    within: Box4,
    text_px: i32,
    dots: &[((i32, i32), &str)],
    lines: &[Line],
) -> Vec<Place> {
    let all: Vec<Vec<Place>> =
        dots.iter().map(|(at, name)| candidates(*at, name, text_px)).collect();
    let cost = |place: usize, of: &Place| {
        place + ON_LINE * lines.iter().filter(|line| crosses(of.covers, **line)).count()
    };
    let good_of = |dot: usize| {
        let all = all[dot].iter().enumerate();
        let good = all.filter(|(_, place)| is_good(within, dots, dot, place));
        let mut good: Vec<_> = good.map(|(i, place)| (cost(i, place), i)).collect();
        good.sort_unstable();
        good
    };
    let good: Vec<Vec<(usize, usize)>> = (0..dots.len()).map(good_of).collect();
    let mut order: Vec<usize> = (0..dots.len()).filter(|dot| !good[*dot].is_empty()).collect();
    order.sort_by_key(|dot| good[*dot].len());
    let mut search = Search { all: &all, good: &good, order: &order, steps: 0, best: None };
    search.go_on(&mut Vec::new(), 0);
    let mut found: Vec<Option<Place>> = vec![None; dots.len()];
    if let Some((_, chosen)) = search.best {
        for (dot, place) in order.iter().zip(chosen) {
            found[*dot] = Some(all[*dot][place]);
        }
    }
    for dot in 0..dots.len() {
        if found[dot].is_none() {
            let taken: Vec<Box4> = found.iter().flatten().map(|place| place.covers).collect();
            let least = |place: &&Place| covered(within, dots, &taken, place.covers);
            found[dot] = all[dot].iter().min_by_key(least).copied();
        }
    }
    found.into_iter().flatten().collect()
}

/// Where a name may stand, the places where it is looked for first.
fn candidates((x, y): (i32, i32), name: &str, text_px: i32) -> Vec<Place> {
    let width = (LETTER * f64::from(text_px) * name.chars().count() as f64).ceil() as i32;
    let half = (text_px + 1) / 2;
    let place = |side: HPos, at: i32, dy: i32| {
        let left = match side {
            HPos::Left => at,
            HPos::Right => at - width,
            HPos::Center => at - width / 2,
        };
        let covers = [left, y + dy - half, left + width, y + dy + half];
        Place { anchor: (at, y + dy), side, covers }
    };
    let beside = [0, GAP_PX, -GAP_PX];
    let lines = [1, -1, 2, -2, 3, -3].map(|line: i32| line.signum() * half + GAP_PX * line);
    let right = beside.map(|dy| place(HPos::Left, x + GAP_PX, dy));
    let left = beside.map(|dy| place(HPos::Right, x - GAP_PX, dy));
    let on_lines = lines.into_iter().flat_map(|dy| {
        [
            place(HPos::Center, x, dy),
            place(HPos::Left, x - width / 4, dy),
            place(HPos::Right, x + width / 4, dy),
            place(HPos::Left, x - DOT_PX, dy),
            place(HPos::Right, x + DOT_PX, dy),
        ]
    });
    right.into_iter().chain(left).chain(on_lines).collect()
}

/// Whether a place lies within, covers no dot, and is nearer to its own dot than to another.
fn is_good(within: Box4, dots: &[((i32, i32), &str)], own: usize, place: &Place) -> bool {
    let covers = place.covers;
    let is_within = covers[0] >= within[0]
        && covers[1] >= within[1]
        && covers[2] <= within[2]
        && covers[3] <= within[3];
    let away = |dot: usize| away(covers, dots[dot].0);
    let nearest = (0..dots.len()).filter(|dot| dots[*dot].0 != dots[own].0).map(away).min();
    is_within
        && dots.iter().all(|(at, _)| overlap(covers, of_dot(*at)) == 0)
        && nearest.is_none_or(|other| away(own) < other)
}

/// A search for the places of all names that can have a good one.
struct Search<'a> {
    all: &'a [Vec<Place>],
    /// By dot: what its good places cost, and which they are, the cheapest first.
    good: &'a [Vec<(usize, usize)>],
    /// The dots, the one with the fewest good places first.
    order: &'a [usize],
    steps: usize,
    /// The least cost that was found, and the place of each dot of the order.
    best: Option<(usize, Vec<usize>)>,
}

impl Search<'_> {
    /// Tries the places of the next dot, behind those that were chosen at a cost.
    fn go_on(&mut self, chosen: &mut Vec<usize>, cost: usize) {
        let Some(&dot) = self.order.get(chosen.len()) else {
            self.best = Some((cost, chosen.clone()));
            return;
        };
        for &(costs, place) in &self.good[dot] {
            let costs = cost + costs;
            let is_dearer = self.best.as_ref().is_some_and(|(least, _)| costs >= *least);
            self.steps += 1;
            if is_dearer || self.steps > STEPS_MAX {
                return;
            }
            let own = self.all[dot][place].covers;
            let mut before = self.order.iter().zip(&*chosen);
            if before.all(|(dot, place)| overlap(own, self.all[*dot][*place].covers) == 0) {
                chosen.push(place);
                self.go_on(chosen, costs);
                chosen.pop();
            }
        }
    }
}

/// What a name would cover of dots and names that are placed, px2; what lies outside counts most.
fn covered(within: Box4, dots: &[((i32, i32), &str)], taken: &[Box4], own: Box4) -> i64 {
    let [left, top, right, bottom] = within;
    let outside = (left - own[0]).max(0)
        + (own[2] - right).max(0)
        + (top - own[1]).max(0)
        + (own[3] - bottom).max(0);
    let dots = dots.iter().map(|(at, _)| of_dot(*at));
    let covered: i32 = dots.chain(taken.iter().copied()).map(|other| overlap(own, other)).sum();
    i64::from(outside) * 1000 + i64::from(covered)
}

fn of_dot((x, y): (i32, i32)) -> Box4 {
    [x - DOT_PX, y - DOT_PX, x + DOT_PX, y + DOT_PX]
}

/// Square of the distance between a box and a point, px2.
fn away(from: Box4, (x, y): (i32, i32)) -> i32 {
    let along = |at: i32, i: usize| (from[i] - at).max(at - from[i + 2]).max(0);
    along(x, 0).pow(2) + along(y, 1).pow(2)
}

/// Whether a line goes through a box (Liang & Barsky 1984).
fn crosses(of: Box4, [from, to]: Line) -> bool {
    let (mut enters, mut leaves) = (0.0, 1.0);
    for (from, to, low, high) in [(from.0, to.0, of[0], of[2]), (from.1, to.1, of[1], of[3])] {
        if from == to {
            if !(low..=high).contains(&from) {
                return false;
            }
            continue;
        }
        let [low, high] = [low, high].map(|end| f64::from(end - from) / f64::from(to - from));
        enters = f64::max(enters, low.min(high));
        leaves = f64::min(leaves, low.max(high));
    }
    enters <= leaves
}

/// Area that two boxes share, px2.
fn overlap(a: Box4, b: Box4) -> i32 {
    let along = |i: usize| (a[i + 2].min(b[i + 2]) - a[i].max(b[i])).max(0);
    along(0) * along(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dots like those of the networks of the ladder, two of which have two names each beside them.
    const DOTS: [((i32, i32), &str); 5] = [
        ((112, 342), "nano-maps"),
        ((114, 323), "nano"),
        ((140, 352), "small-maps"),
        ((140, 337), "small"),
        ((211, 335), "large"),
    ];

    #[test]
    fn each_name_stands_by_its_own_dot_and_over_nothing() {
        let found = places([64, 30, 748, 540], 13, &DOTS, &[]);
        for (i, place) in found.iter().enumerate() {
            let aways = DOTS.map(|(at, _)| away(place.covers, at));
            assert_eq!(aways.iter().min(), Some(&aways[i]), "{}: {aways:?}", DOTS[i].1);
            for (at, name) in DOTS {
                assert_eq!(overlap(place.covers, of_dot(at)), 0, "{} over {name}", DOTS[i].1);
            }
            for other in &found[..i] {
                assert_eq!(
                    overlap(place.covers, other.covers),
                    0,
                    "{} over another name",
                    DOTS[i].1
                );
            }
        }
    }

    #[test]
    fn where_there_is_room_a_name_stands_right_of_its_dot() {
        let alone =
            places([0, 0, 400, 400], 13, &[((100, 100), "name"), ((100, 200), "name")], &[]);
        assert_eq!(alone.iter().map(|of| of.anchor).collect::<Vec<_>>(), [(109, 100), (109, 200)]);
    }

    /// A line through the dot, level, upright or askew: the name stands beside it.
    #[test]
    fn a_name_does_not_stand_on_a_line() {
        let dot = [((100, 100), "name")];
        for line in [[(0, 100), (400, 100)], [(130, 0), (130, 400)], [(60, 40), (180, 170)]] {
            let [plain] = places([0, 0, 400, 400], 13, &dot, &[])[..] else { unreachable!() };
            assert!(crosses(plain.covers, line), "{line:?}");
            let [place] = places([0, 0, 400, 400], 13, &dot, &[line])[..] else { unreachable!() };
            assert!(!crosses(place.covers, line), "{line:?}");
        }
        assert!(!crosses([0, 0, 10, 10], [(20, 0), (0, 30)]));
    }

    /// In a crowd without room, and where two dots are one, every name still has a place within.
    #[test]
    fn a_crowd_has_places_too() {
        let crowd: Vec<_> = (0..40).map(|i| ((100 + i % 6, 100 + i / 6), "some-name")).collect();
        let found = places([0, 0, 200, 200], 13, &crowd, &[]);
        assert_eq!(found.len(), 40);
        for place in found {
            let [left, top, right, bottom] = place.covers;
            assert!(
                left >= 0 && top >= 0 && right <= 200 && bottom <= 200,
                "{left} {top} {right} {bottom}"
            );
        }
    }
}
