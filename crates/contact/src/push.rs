//! Forces at some of the vertices, and how far they move other vertices.

use crate::kernels::{DisplaceTiles, Vectors, run};
use crate::model::ContactModel;
use crate::second_order::Amplitudes;

/// Vertices under force. All memory is taken at construction.
#[derive(Debug)]
pub(crate) struct Push {
    vertices: Vec<u32>,
    /// Their forces, one after the other, N.
    packed: [Vec<f32>; 3],
    /// Tiles of the compliance under force, and what pushes and moves in each.
    tiles: Vec<u32>,
    is_pushing: Vec<bool>,
    force: Vec<Vectors>,
    moved: Vec<Vectors>,
}

impl Push {
    pub(crate) fn new(model: &ContactModel) -> Self {
        let (vertices, tiles) = (model.vertices(), model.compliance.side());
        Self {
            vertices: Vec::with_capacity(vertices),
            packed: std::array::from_fn(|_| vec![0.0; vertices]),
            tiles: Vec::with_capacity(tiles),
            is_pushing: vec![false; tiles],
            force: vec![Vectors::default(); tiles],
            moved: vec![Vectors::default(); tiles],
        }
    }

    /// Takes the force of each vertex, N, in place of those before.
    pub(crate) fn take(&mut self, model: &ContactModel, force_n: impl Fn(usize) -> [f32; 3]) {
        for tile in self.tiles.drain(..) {
            self.force[tile as usize] = Vectors::default();
            self.is_pushing[tile as usize] = false;
        }
        self.vertices.clear();
        for vertex in 0..model.vertices() {
            let force = force_n(vertex);
            if force.iter().all(|f| *f == 0.0) {
                continue;
            }
            let at = self.vertices.len();
            self.vertices.push(vertex as u32);
            let [tile, place] = model.compliance.place(vertex);
            self.is_pushing[tile] = true;
            for i in 0..3 {
                self.packed[i][at] = force[i];
                self.force[tile][i][place] = force[i];
            }
        }
        // In their order in memory, whichever came first.
        let tiles = self.is_pushing.iter().enumerate().filter(|(_, is_pushing)| **is_pushing);
        self.tiles.extend(tiles.map(|(tile, _)| tile as u32));
    }

    /// Vertices under force.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Their forces, N.
    pub(crate) fn forces(&self) -> [&[f32]; 3] {
        self.packed.each_ref().map(|force| &force[..self.vertices.len()])
    }

    /// Displacement of `vertices`, all of them in `tiles`, to first order: compliance times forces, mm.
    pub(crate) fn displace(
        &mut self,
        model: &ContactModel,
        [tiles, vertices]: [&[u32]; 2],
        linear: &mut [Vec<f32>; 3],
    ) {
        let Self { tiles: pushing, force, moved, .. } = self;
        let compliance = &model.compliance;
        run(DisplaceTiles { compliance, pushing, force, moving: tiles, moved });
        for (slot, vertex) in vertices.iter().enumerate() {
            let [tile, at] = compliance.place(*vertex as usize);
            for (linear, moved) in linear.iter_mut().zip(&self.moved[tile]) {
                linear[slot] = moved[at];
            }
        }
    }

    /// Displacement of `vertices` in all: `linear` and the second order, if `amplitudes` are given, mm.
    pub(crate) fn add_second_order(
        &self,
        model: &ContactModel,
        amplitudes: Option<&mut Amplitudes>,
        vertices: &[u32],
        linear: &[Vec<f32>; 3],
        moved: &mut [Vec<f32>; 3],
    ) {
        if let (Some(a), Some(s)) = (amplitudes, &model.second_order) {
            s.evaluate(&self.vertices, self.forces(), a);
            s.displace(a, vertices, linear, moved);
        } else {
            let n = vertices.len();
            for (moved, linear) in moved.iter_mut().zip(linear) {
                moved[..n].copy_from_slice(&linear[..n]);
            }
        }
    }
}
