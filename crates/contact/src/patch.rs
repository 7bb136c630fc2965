//! The vertices that may be in contact, and how they move each other.
//!
//! Compliance of a whole finger does not fit a cache. A patch holds the blocks of its own vertices
//! in nine dense planes, from frame to frame: a vertex that comes costs a row and a column. The
//! first [`Patch::near`] slots are those that can carry force.

use crate::kernels::{dot, vectorized};
use crate::model::ContactModel;

/// No slot.
const NONE: u16 = u16::MAX;
/// Most vertices of a patch.
pub(crate) const SLOTS_MAX: usize = 512;

/// Values of the slots, vectors component by component.
#[derive(Clone, Debug)]
pub(crate) struct Slots {
    /// Force on the skin, N.
    pub force: [Vec<f32>; 3],
    /// Force on the skin after the last complementarity solve, N.
    pub found: [Vec<f32>; 3],
    /// Last change of force that the solve asked for, N.
    pub change: [Vec<f32>; 3],
    /// Displacement by compliance alone, mm.
    pub linear: [Vec<f32>; 3],
    /// Displacement, mm.
    pub moved: [Vec<f32>; 3],
    /// Displacement before the last one, mm.
    pub before: [Vec<f32>; 3],
    /// Outward normal of the nearest object.
    pub normal: [Vec<f32>; 3],
    /// Distance of the displaced vertex from it, mm.
    pub gap: Vec<f32>,
    /// Size of the force, N.
    pub size: Vec<f32>,
    /// Compliance of the nearest object at the vertex, mm/N.
    pub object: Vec<f32>,
}

/// The patch.
#[derive(Debug)]
pub(crate) struct Patch {
    ids: Vec<u32>,
    slot_of: Vec<u16>,
    stride: usize,
    planes: Vec<f32>,
    near: usize,
    pub values: Slots,
}

impl Slots {
    fn new(slots: usize) -> Self {
        let zeros = || vec![0.0f32; slots];
        let vector = || std::array::from_fn(|_| zeros());
        Self {
            force: vector(),
            found: vector(),
            change: vector(),
            linear: vector(),
            moved: vector(),
            before: vector(),
            normal: vector(),
            gap: zeros(),
            size: zeros(),
            object: zeros(),
        }
    }

    fn columns(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        let Self { force, found, change, linear, moved, before, normal, gap, size, object } = self;
        [force, found, change, linear, moved, before, normal]
            .into_iter()
            .flatten()
            .chain([gap, size, object])
    }
}

impl Patch {
    pub(crate) fn new(vertices: usize) -> Self {
        let stride = vertices.min(SLOTS_MAX);
        Self {
            ids: Vec::with_capacity(stride),
            slot_of: vec![NONE; vertices],
            stride,
            planes: vec![0.0; 9 * stride * stride],
            near: 0,
            values: Slots::new(stride),
        }
    }

    /// Vertices in it.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.ids
    }

    /// Vertices that can carry force.
    pub(crate) fn near(&self) -> usize {
        self.near
    }

    pub(crate) fn slot(&self, vertex: u32) -> Option<usize> {
        Some(self.slot_of[vertex as usize]).filter(|s| *s != NONE).map(usize::from)
    }

    pub(crate) fn clear(&mut self) {
        while !self.ids.is_empty() {
            self.remove(self.ids.len() - 1);
        }
    }

    /// Takes a vertex in, at rest and without force; `false` if there is no room.
    pub(crate) fn add(&mut self, model: &ContactModel, vertex: u32) -> bool {
        let (slot, stride, v) = (self.ids.len(), self.stride, model.vertices());
        if slot == stride {
            return false;
        }
        self.ids.push(vertex);
        self.slot_of[vertex as usize] = slot as u16;
        let plane = stride * stride;
        for pair in 0..9 {
            let turned = 3 * (pair % 3) + pair / 3;
            let row = &model.compliance[(9 * vertex as usize + pair) * v..][..v];
            for (k, &other) in self.ids.iter().enumerate() {
                let value = row[other as usize];
                self.planes[pair * plane + slot * stride + k] = value;
                self.planes[turned * plane + k * stride + slot] = value;
            }
        }
        for column in self.values.columns() {
            column[slot] = 0.0;
        }
        true
    }

    /// Takes the vertex of a slot out; another one may take its slot.
    pub(crate) fn remove(&mut self, slot: usize) {
        let mut slot = slot;
        if slot < self.near {
            self.near -= 1;
            self.swap(slot, self.near);
            slot = self.near;
        }
        self.swap(slot, self.ids.len() - 1);
        if let Some(vertex) = self.ids.pop() {
            self.slot_of[vertex as usize] = NONE;
        }
    }

    /// Lets the vertex of a slot carry force.
    pub(crate) fn bring_near(&mut self, slot: usize) {
        if slot >= self.near {
            self.swap(slot, self.near);
            self.near += 1;
        }
    }

    /// The reverse of [`Self::bring_near`].
    pub(crate) fn send_far(&mut self, slot: usize) {
        if slot < self.near {
            self.near -= 1;
            self.swap(slot, self.near);
        }
    }

    fn swap(&mut self, a: usize, b: usize) {
        if a == b {
            return;
        }
        let (n, stride) = (self.ids.len(), self.stride);
        for plane in self.planes.chunks_exact_mut(stride * stride) {
            let (low, high) = (a.min(b), a.max(b));
            let (head, tail) = plane.split_at_mut(high * stride);
            head[low * stride..][..n].swap_with_slice(&mut tail[..n]);
            for row in plane.chunks_exact_mut(stride).take(n) {
                row.swap(a, b);
            }
        }
        for column in self.values.columns() {
            column.swap(a, b);
        }
        self.ids.swap(a, b);
        for slot in [a, b] {
            self.slot_of[self.ids[slot] as usize] = slot as u16;
        }
    }

    /// Displacement of every slot by compliance alone under the forces of the near ones.
    pub(crate) fn displace(&mut self) {
        let (n, m, stride) = (self.ids.len(), self.near, self.stride);
        let Slots { force, linear, .. } = &mut self.values;
        let planes = &self.planes;
        vectorized(|| {
            for a in 0..3 {
                for i in 0..n {
                    let mut sum = 0.0;
                    for b in 0..3 {
                        let row = &planes[((3 * a + b) * stride + i) * stride..][..m];
                        sum += dot(row, &force[b][..m]);
                    }
                    linear[a][i] = sum;
                }
            }
        });
    }

    /// Fills rows of compliance along the objects' normals between the near slots; rows are
    /// `self.stride()` apart.
    pub(crate) fn along_normals(&self, matrix: &mut [f32]) {
        let (m, stride) = (self.near, self.stride);
        let Slots { normal, object, .. } = &self.values;
        let [x, y, z] = [0, 1, 2].map(|b| &normal[b][..m]);
        vectorized(|| {
            for i in 0..m {
                let plane = |pair: usize| &self.planes[(pair * stride + i) * stride..][..m];
                let own = [x[i], y[i], z[i]];
                let row = &mut matrix[i * stride..][..m];
                row.fill(0.0);
                for (b, other) in [x, y, z].into_iter().enumerate() {
                    let (p, q, r) = (plane(b), plane(3 + b), plane(6 + b));
                    for k in 0..m {
                        row[k] += (own[0] * p[k] + own[1] * q[k] + own[2] * r[k]) * other[k];
                    }
                }
                row[i] += object[i];
            }
        });
    }

    pub(crate) fn stride(&self) -> usize {
        self.stride
    }
}
