//! What a solver keeps from frame to frame, as the start of the next frame here or in another
//! process.

use super::{Anchor, Reached, Side, Solver};
use crate::bounded::Symmetric;

/// The warm start of a [`Solver`]: from the same memory the same frame gets the same bits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    /// Vertices that may be in contact, slot by slot; the order decides the order of sums.
    pub vertices: Vec<u32>,
    /// How many of them, the first, can carry force.
    pub near: usize,
    /// Length of the patch's rows.
    pub stride: usize,
    /// How many of them the matrix holds: `near` or none.
    pub made: usize,
    /// By slot: force x y z and its size, N.
    pub forces_n: Vec<[f32; 4]>,
    /// By row of the matrix: normal x y z and compliance of the object (mm/N) that it was made with.
    pub made_with: Vec<[f32; 4]>,
    /// Where a net force was met: travel, mm, and slope, N/mm.
    pub reached: Option<[f64; 2]>,
    /// Where points in contact would be carried from by friction.
    pub anchors: Vec<Anchor>,
    /// By object, from which side it came.
    pub sides: Vec<Side>,
}

impl Solver {
    /// What the next frame starts from.
    #[must_use]
    pub fn memory(&self) -> Memory {
        let (patch, values) = (&self.patch, &self.patch.values);
        let [x, y, z] = &values.force;
        let [a, b, c] = &self.made_for;
        let slots = 0..patch.vertices().len();
        Memory {
            vertices: patch.vertices().to_vec(),
            near: patch.near(),
            stride: patch.stride(),
            made: self.made,
            forces_n: slots.map(|i| [x[i], y[i], z[i], values.size[i]]).collect(),
            made_with: (0..self.made).map(|i| [a[i], b[i], c[i], self.made_with[i]]).collect(),
            reached: self.reached.map(|r| [r.travel_mm, r.slope_n_per_mm]),
            anchors: self.friction.iter().flat_map(|f| f.anchors()).collect(),
            sides: self.sides.kept().to_vec(),
        }
    }

    /// Starts the next frame from the memory of a solver of the same model and settings. False:
    /// the memory fits no patch, and the next frame starts from nothing.
    #[must_use]
    pub fn recall(&mut self, memory: &Memory) -> bool {
        self.reset();
        let Memory { vertices, near, stride, made, forces_n, made_with, .. } = memory;
        let Memory { reached, anchors, sides, .. } = memory;
        let fits = forces_n.len() == vertices.len()
            && *near <= vertices.len()
            && (*made == 0 || made == near)
            && made_with.len() == *made
            && self.patch.refill(&self.model, vertices, *near, *stride)
            && self.sides.recall(sides)
            && anchors.iter().all(|a| self.friction.as_mut().is_some_and(|f| f.hold(*a)));
        if !fits {
            self.reset();
            return false;
        }
        let values = &mut self.patch.values;
        for (row, [x, y, z, give]) in made_with.iter().enumerate() {
            for (i, part) in [x, y, z].into_iter().enumerate() {
                (values.normal[i][row], self.made_for[i][row]) = (*part, *part);
            }
            (values.object[row], self.made_with[row]) = (*give, *give);
        }
        if *made > 0 {
            self.patch.along_normals(&mut self.matrix);
            self.norm = Symmetric::new(&self.matrix, self.patch.stride(), *made).norm;
        }
        self.made = *made;
        let values = &mut self.patch.values;
        for (slot, [x, y, z, size]) in forces_n.iter().enumerate() {
            for (i, part) in [x, y, z].into_iter().enumerate() {
                values.force[i][slot] = *part;
            }
            values.size[slot] = *size;
        }
        self.reached =
            reached.map(|[travel_mm, slope_n_per_mm]| Reached { travel_mm, slope_n_per_mm });
        true
    }
}
