//! The forces that vertices and pixels hand to each other, from round to round and from frame to
//! frame.

use super::JUMP;

/// Farthest that a round goes beyond, or stays behind, what it found.
const SHARE_MAX: f32 = 0.7;
/// Rounds from which on they take only a part of what is left of the residual: flanks of narrow things
/// push skin aside, which gives way up to ten times as far as pixels expect.
const LATE: usize = 4;
/// That part at first. A round whose residual is no less than [`FALLS`] of the one before takes
/// [`LESS`] of it, any other one [`MORE`].
const TAKEN: f32 = 0.45;
const FALLS: f32 = 0.9;
const LESS: f32 = 0.7;
const MORE: f32 = 1.1;
/// Least such part.
const TAKEN_MIN: f32 = 0.1;
/// How far the first one stays behind: over long distances skin gives way as far as over short
/// ones, so that a round overshoots by a half to all of its change.
const FIRST: f32 = 0.4;

type Vectors = [Vec<f32>; 3];

/// Forces that vertices and pixels hand to each other, N.
///
/// A round answers forces `f` with `F(f)`. The next one starts from the secant's estimate of where
/// `F(f) = f` (Anderson's method of depth one, J. ACM 12, 1965), late ones from less far, the less the
/// more they go to and fro.
#[derive(Debug)]
pub(super) struct Turns {
    /// What vertices find by themselves, in this frame and in the last one.
    without: Vectors,
    last: Vectors,
    /// `F(f)` and `F(f) - f`; `f` and `F(f)` of the round before.
    found: Vectors,
    residual: Vectors,
    from: Vectors,
    before: Vectors,
    rounds: usize,
    /// Part of the residual that late rounds take, and the last round's change over the forces.
    taken: f32,
    change: f32,
    warm: bool,
}

impl Turns {
    pub(super) fn new(vertices: usize) -> Self {
        let zeros = || std::array::from_fn(|_| vec![0.0; vertices]);
        let [without, last, found, residual, from, before] = std::array::from_fn(|_| zeros());
        Self {
            without,
            last,
            found,
            residual,
            from,
            before,
            rounds: 0,
            taken: TAKEN,
            change: 0.0,
            warm: false,
        }
    }

    /// To be filled with the forces that vertices find by themselves.
    pub(super) fn without_pixels(&mut self) -> &mut Vectors {
        std::mem::swap(&mut self.without, &mut self.last);
        &mut self.without
    }

    /// To be filled with a round's forces.
    pub(super) fn found(&mut self) -> &mut Vectors {
        &mut self.found
    }

    /// The last round's forces.
    pub(super) fn answered(&self) -> &Vectors {
        &self.found
    }

    /// Whether the next frame starts from this one.
    pub(super) fn is_warm(&self) -> bool {
        self.warm
    }

    /// Forces that vertices found by themselves in the last frame.
    pub(super) fn found_without_pixels(&self) -> &Vectors {
        &self.without
    }

    /// The same of the frame before it.
    pub(super) fn last(&self) -> &Vectors {
        &self.last
    }

    /// The same, empty and to be filled; the next frame starts from it.
    pub(super) fn recall(&mut self) -> &mut Vectors {
        self.warm = true;
        self.without.iter_mut().for_each(|f| f.fill(0.0));
        &mut self.without
    }

    /// The next frame starts from nothing.
    pub(super) fn forget(&mut self) {
        self.warm = false;
    }

    /// Sets the forces that a frame starts from: those of the last frame, moved on as the vertices
    /// move by themselves; after a jump, theirs. Returns whether the last frame is a start.
    pub(super) fn begin(&mut self, force_n: &mut Vectors) -> bool {
        let (mut change, mut size) = (0.0, 0.0);
        for (now, last) in self.without.iter().flatten().zip(self.last.iter().flatten()) {
            change += (now - last).abs();
            size += now.abs();
        }
        let warm = self.warm && change <= JUMP * size;
        let now = self.without.iter().flatten().zip(self.last.iter().flatten());
        for (force, (now, last)) in force_n.iter_mut().flatten().zip(now) {
            *force = if warm { *force + now - last } else { *now };
        }
        (self.rounds, self.warm) = (0, true);
        warm
    }

    /// Moves `force_n` on; returns the change over the sum of forces.
    pub(super) fn take(&mut self, force_n: &mut Vectors) -> f32 {
        let (mut change, mut size, mut was) = (0.0f32, 0.0f32, 0.0f32);
        let (mut along, mut square) = (0.0f32, 0.0f32);
        let forces = force_n.iter().flatten().zip(self.found.iter().flatten());
        for ((force, found), residual) in forces.zip(self.residual.iter_mut().flatten()) {
            let now = found - force;
            let by = now - *residual;
            change += now.abs();
            size += found.abs();
            was += force.abs();
            along += now * by;
            square += by * by;
            *residual = now;
        }
        if size == 0.0 && was > 0.0 {
            // Skin was pushed out of all reach: half as far, and from there anew.
            force_n.iter_mut().flatten().for_each(|force| *force *= 0.5);
            self.rounds = 0;
            return 1.0;
        }
        let share = if square > 0.0 { along / square } else { 0.0 };
        // NaN must not pass for nothing.
        let change = if size == 0.0 { 0.0 } else { change / size };
        let late = self.late_part(change);
        let (share, taken) = match self.rounds {
            0 => (0.0, 1.0 - FIRST),
            rounds => (share.clamp(-SHARE_MAX, SHARE_MAX), if rounds < LATE { 1.0 } else { late }),
        };
        let both = self.from.iter_mut().flatten().zip(self.before.iter_mut().flatten());
        let found = self.found.iter().flatten();
        for ((force, found), (from, before)) in force_n.iter_mut().flatten().zip(found).zip(both) {
            if self.rounds == 0 {
                // What ran away in another frame is of no account here.
                (*from, *before) = (*force, *found);
            }
            let start = *force + share * (*from - *force);
            let end = found + share * (*before - found);
            (*from, *before) = (*force, *found);
            *force = start + taken * (end - start);
        }
        self.rounds += 1;
        change
    }

    /// Part of the residual that a late round takes whose change is so large, over the forces.
    fn late_part(&mut self, change: f32) -> f32 {
        self.taken = match self.rounds {
            0 => TAKEN,
            _ if change > FALLS * self.change => (LESS * self.taken).max(TAKEN_MIN),
            _ => (MORE * self.taken).min(1.0),
        };
        self.change = change;
        self.taken
    }
}
