//! Compliance between the vertices that press on a window and those that move it, close together.
//!
//! Compliance of the whole finger is read from afar in each round, and that takes longer than to multiply
//! by it. What a window needs of it is a third of the tiles that it lies in, and nearly the same from
//! frame to frame.

use crate::kernels::{add_scaled, run};
use crate::model::ContactModel;
use pulp::{Simd, WithSimd};

/// Most vertices that push, and that move: 1.2 MB. Windows of more take the whole finger's.
const PUSHING_MAX: usize = 128;
const MOVING_MAX: usize = 256;
/// Rows are whole numbers of these: no value is summed otherwise for its place.
const BLOCK: usize = 16;
/// No place.
const NONE: u16 = u16::MAX;

/// A part of the compliance.
#[derive(Debug)]
pub(super) struct Close {
    pushing: Places,
    moving: Places,
    /// `[pushing][3 b + a][moving]`: displacement along `a` under a force along `b`, mm/N.
    values: Vec<f32>,
    moved: [Vec<f32>; 3],
}

/// Vertices, and the place of each of the finger's among them.
#[derive(Debug)]
struct Places {
    ids: Vec<u32>,
    of: Vec<u16>,
}

impl Places {
    fn new(vertices: usize, most: usize) -> Self {
        Self { ids: Vec::with_capacity(most), of: vec![NONE; vertices] }
    }

    fn at(&self, vertex: u32) -> Option<usize> {
        Some(self.of[vertex as usize]).filter(|at| *at != NONE).map(usize::from)
    }

    fn push(&mut self, vertex: u32) {
        self.of[vertex as usize] = self.ids.len() as u16;
        self.ids.push(vertex);
    }

    fn missing(&self, vertices: &[u32]) -> usize {
        vertices.iter().filter(|vertex| self.at(**vertex).is_none()).count()
    }

    fn clear(&mut self) {
        for id in self.ids.drain(..) {
            self.of[id as usize] = NONE;
        }
    }
}

impl Close {
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            pushing: Places::new(vertices, PUSHING_MAX),
            moving: Places::new(vertices, MOVING_MAX),
            values: vec![0.0; PUSHING_MAX * 9 * MOVING_MAX],
            moved: std::array::from_fn(|_| vec![0.0; MOVING_MAX]),
        }
    }

    /// Displacement of the vertices `moving` under forces (N) on `pushing`, mm; false if they are too
    /// many.
    pub(super) fn displace(
        &mut self,
        model: &ContactModel,
        (pushing, forces): (&[u32], [&[f32]; 3]),
        moving: &[u32],
        linear: &mut [Vec<f32>; 3],
    ) -> bool {
        if pushing.len() > PUSHING_MAX || moving.len() > MOVING_MAX {
            return false;
        }
        self.take(model, pushing, moving);
        let Self { pushing: places, moving: movers, values, moved } = self;
        let length = movers.ids.len().next_multiple_of(BLOCK);
        run(Displace { values, places, pushing, forces, length, moved });
        for (slot, vertex) in moving.iter().enumerate() {
            let at = usize::from(movers.of[*vertex as usize]);
            for (linear, moved) in linear.iter_mut().zip(&*moved) {
                linear[slot] = moved[at];
            }
        }
        true
    }

    /// Holds at least these vertices; others stay until there is no room.
    fn take(&mut self, model: &ContactModel, pushing: &[u32], moving: &[u32]) {
        let (more_push, more_move) = (self.pushing.missing(pushing), self.moving.missing(moving));
        let is_full = self.pushing.ids.len() + more_push > PUSHING_MAX
            || self.moving.ids.len() + more_move > MOVING_MAX
            || self.moving.ids.len() > 2 * moving.len() + BLOCK;
        if is_full {
            self.pushing.clear();
            self.moving.clear();
        }
        let compliance = &model.compliance;
        for vertex in moving {
            if self.moving.at(*vertex).is_some() {
                continue;
            }
            let at = self.moving.ids.len();
            self.moving.push(*vertex);
            for (row, pusher) in self.pushing.ids.iter().enumerate() {
                let pair = compliance.pair(*vertex as usize, *pusher as usize);
                write(&mut self.values, row, at, pair);
            }
        }
        for vertex in pushing {
            if self.pushing.at(*vertex).is_some() {
                continue;
            }
            let row = self.pushing.ids.len();
            self.pushing.push(*vertex);
            for at in 0..self.moving.ids.len() {
                let mover = self.moving.ids[at] as usize;
                // The transpose of what a force on the other one does, which lies together in memory.
                let back = compliance.pair(*vertex as usize, mover);
                let pair = std::array::from_fn(|i| back[3 * (i % 3) + i / 3]);
                write(&mut self.values, row, at, pair);
            }
        }
    }
}

/// Fills in what one vertex does to another: `[3 a + b]` along `a` under a force along `b`.
fn write(values: &mut [f32], row: usize, at: usize, pair: [f32; 9]) {
    for a in 0..3 {
        for b in 0..3 {
            values[(9 * row + 3 * b + a) * MOVING_MAX + at] = pair[3 * a + b];
        }
    }
}

struct Displace<'a> {
    values: &'a [f32],
    places: &'a Places,
    pushing: &'a [u32],
    forces: [&'a [f32]; 3],
    length: usize,
    moved: &'a mut [Vec<f32>; 3],
}

impl WithSimd for Displace<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { values, places, pushing, forces, length, moved } = self;
        for moved in &mut *moved {
            moved[..length].fill(0.0);
        }
        for (k, vertex) in pushing.iter().enumerate() {
            let row = usize::from(places.of[*vertex as usize]);
            for (b, force) in forces.iter().enumerate() {
                for (a, moved) in moved.iter_mut().enumerate() {
                    let column = &values[(9 * row + 3 * b + a) * MOVING_MAX..][..length];
                    add_scaled(simd, &mut moved[..length], force[k], column);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compliance::Compliance;
    use crate::model::{Arrays, Header};

    /// Whatever was asked before, as the whole compliance says; more than there is room for is refused.
    #[test]
    fn a_part_moves_as_the_whole_does() {
        let side = 40u32;
        let places: Vec<u32> = (0..side * side).collect();
        let place = |i: &u32| [(i % side) as f32, (i / side) as f32, 0.0];
        let triangles: Vec<u32> = places
            .iter()
            .filter(|i| **i % side + 1 < side && **i / side + 1 < side)
            .flat_map(|a| [*a, a + side, a + 1, a + 1, a + side, a + side + 1])
            .collect();
        let header = Header {
            vertices: places.len(),
            triangles: triangles.len() / 3,
            share_max: 1.0,
            ..Header::current()
        };
        let arrays = Arrays::half_space(
            places.iter().flat_map(place).collect(),
            [0.0, 0.0, -1.0].repeat(places.len()),
            vec![1.0; places.len()],
            triangles,
            0.2,
        );
        let model = ContactModel::new(header, arrays).expect("a model");
        let compliance: &Compliance = &model.compliance;
        let mut close = Close::new(places.len());
        let mut random = fastrand::Rng::with_seed(3);
        let mut linear: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; MOVING_MAX]);
        for _ in 0..12 {
            let pushing = random.choose_multiple(places.iter().copied(), 60);
            let moving = random.choose_multiple(places.iter().copied(), 150);
            let forces: [Vec<f32>; 3] =
                std::array::from_fn(|_| pushing.iter().map(|_| random.f32() - 0.5).collect());
            let of = forces.each_ref().map(|force| &force[..]);
            assert!(close.displace(&model, (&pushing, of), &moving, &mut linear));
            for (slot, moves) in moving.iter().enumerate() {
                for a in 0..3 {
                    let one = |(k, pushes): (usize, &u32)| -> f32 {
                        let pair = compliance.pair(*moves as usize, *pushes as usize);
                        (0..3).map(|b| pair[3 * a + b] * forces[b][k]).sum()
                    };
                    let due: f32 = pushing.iter().enumerate().map(one).sum();
                    let found = linear[a][slot];
                    assert!((found - due).abs() <= 1e-4 * due.abs().max(0.1), "{found} {due}");
                }
            }
        }
        let all = &places[..PUSHING_MAX + 1];
        let force = vec![0.0; all.len()];
        let forces = [&force[..], &force[..], &force[..]];
        assert!(!close.displace(&model, (all, forces), &places[..9], &mut linear));
    }
}
