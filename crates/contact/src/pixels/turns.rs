//! The forces that vertices and pixels hand to each other, from round to round and from frame to
//! frame.

use super::JUMP;
use super::change::Change;

/// Farthest that a round goes beyond, or stays behind, what it found.
const SHARE_MAX: f32 = 0.7;
/// Rounds from which on they take only a part of what is left of the residual: flanks of narrow things
/// push skin aside, which gives way up to ten times as far as pixels expect.
const LATE: usize = 4;
/// That part at first. A round takes [`LESS`] of it where its residual points back from the one before,
/// so that rounds go to and fro, and [`MORE`] where the cosine between them is above [`ONWARD`]: forces
/// then have a long way to go, and how fast the residual falls tells nothing.
const TAKEN: f32 = 0.45;
const ONWARD: f32 = 0.5;
const LESS: f32 = 0.7;
const MORE: f32 = 1.3;
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
    /// Vertices, in their order, of which one of all these is not zero, or can become so.
    active: Vec<u32>,
    is_active: Vec<bool>,
    rounds: usize,
    /// Part of the residual that late rounds take.
    taken: f32,
    /// Whether the next frame starts from this one, and this one from the last.
    warm: bool,
    started_warm: bool,
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
            active: Vec::with_capacity(vertices),
            is_active: vec![false; vertices],
            rounds: 0,
            taken: TAKEN,
            warm: false,
            started_warm: false,
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

    /// Vertices, in their order, that can have a force in this frame.
    pub(super) fn active(&self) -> &[u32] {
        &self.active
    }

    /// Whether the next frame starts from this one.
    pub(super) fn is_warm(&self) -> bool {
        self.warm
    }

    /// Whether this frame started from the last one.
    pub(super) fn starts_warm(&self) -> bool {
        self.started_warm
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
        self.is_active.fill(true);
        self.without.iter_mut().for_each(|f| f.fill(0.0));
        &mut self.without
    }

    /// The next frame starts from nothing.
    pub(super) fn forget(&mut self) {
        self.warm = false;
    }

    /// Sets the forces that a frame starts from: those of the last frame, moved on as the vertices
    /// move by themselves; after a jump, theirs. Returns whether the last frame is a start.
    ///
    /// Forces of this frame are under the window's vertices `ids`.
    pub(super) fn begin(&mut self, ids: &[u32], force_n: &mut Vectors) -> bool {
        self.find_active(ids, force_n);
        let (mut change, mut size) = (0.0, 0.0);
        for i in 0..3 {
            let (now, last) = (&self.without[i], &self.last[i]);
            for vertex in self.active.iter().map(|vertex| *vertex as usize) {
                change += (now[vertex] - last[vertex]).abs();
                size += now[vertex].abs();
            }
        }
        let warm = self.warm && change <= JUMP * size;
        for (i, force) in force_n.iter_mut().enumerate() {
            let (now, last) = (&self.without[i], &self.last[i]);
            for vertex in self.active.iter().map(|vertex| *vertex as usize) {
                let (now, last) = (now[vertex], last[vertex]);
                force[vertex] = if warm { force[vertex] + now - last } else { now };
            }
        }
        (self.rounds, self.warm, self.started_warm) = (0, true, warm);
        warm
    }

    /// Vertices that are zero in all of this stay so: they need not be gone through.
    fn find_active(&mut self, ids: &[u32], force_n: &Vectors) {
        let Self { without, last, residual, from, before, active, is_active, .. } = self;
        let all = [&*without, last, residual, from, before, force_n];
        for vertex in active.drain(..).map(|vertex| vertex as usize) {
            is_active[vertex] = all.iter().any(|of| of.iter().any(|f| f[vertex] != 0.0));
        }
        for id in ids {
            is_active[*id as usize] = true;
        }
        for (vertex, is_active) in is_active.iter_mut().enumerate() {
            *is_active |= without.iter().any(|f| f[vertex] != 0.0);
            if *is_active {
                active.push(vertex as u32);
            }
        }
    }

    /// Moves `force_n` on; returns the change over the sum of forces.
    pub(super) fn take(&mut self, force_n: &mut Vectors) -> f32 {
        let mut change = Change::default();
        let (mut along, mut square) = (0.0f32, 0.0f32);
        let (mut onward, mut now_square, mut last_square) = (0.0f32, 0.0f32, 0.0f32);
        for (i, force) in force_n.iter().enumerate() {
            let (found, residual) = (&self.found[i], &mut self.residual[i]);
            for vertex in self.active.iter().map(|vertex| *vertex as usize) {
                let now = change.count(force[vertex], found[vertex]);
                let by = now - residual[vertex];
                along += now * by;
                square += by * by;
                onward += now * residual[vertex];
                now_square += now * now;
                last_square += residual[vertex] * residual[vertex];
                residual[vertex] = now;
            }
        }
        if change.is_out_of_reach() {
            // Half as far, and from there anew.
            force_n.iter_mut().flatten().for_each(|force| *force *= 0.5);
            self.rounds = 0;
            return change.part();
        }
        let share = if square > 0.0 { along / square } else { 0.0 };
        let late = self.late_part(onward / (now_square * last_square).sqrt());
        let (share, taken) = match self.rounds {
            0 => (0.0, 1.0 - FIRST),
            rounds => (share.clamp(-SHARE_MAX, SHARE_MAX), if rounds < LATE { 1.0 } else { late }),
        };
        let is_first = self.rounds == 0;
        for (i, force) in force_n.iter_mut().enumerate() {
            let (found, from, before) = (&self.found[i], &mut self.from[i], &mut self.before[i]);
            for vertex in self.active.iter().map(|vertex| *vertex as usize) {
                let (force, found) = (&mut force[vertex], found[vertex]);
                let (from, before) = (&mut from[vertex], &mut before[vertex]);
                if is_first {
                    // What ran away in another frame is of no account here.
                    (*from, *before) = (*force, found);
                }
                let start = *force + share * (*from - *force);
                let end = found + share * (*before - found);
                (*from, *before) = (*force, found);
                *force = start + taken * (end - start);
            }
        }
        self.rounds += 1;
        change.part()
    }

    /// Part of the residual that a late round takes, by the cosine between its residual and the last one.
    fn late_part(&mut self, cosine: f32) -> f32 {
        self.taken = match self.rounds {
            0 => TAKEN,
            _ if cosine < 0.0 => (LESS * self.taken).max(TAKEN_MIN),
            _ if cosine > ONWARD => (MORE * self.taken).min(1.0),
            _ => self.taken,
        };
        self.taken
    }
}
