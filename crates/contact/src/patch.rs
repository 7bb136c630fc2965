//! The vertices that may be in contact, and the compliance between them.
//!
//! The compliance of a whole finger does not fit into a cache. A patch stores the blocks of its own
//! vertices densely and keeps them from frame to frame, so that a new vertex costs one row and one
//! column. The first [`Patch::near`] slots are those that can carry force.

use crate::kernels::{Along, Displace, run};
use crate::model::ContactModel;

/// No slot.
const NONE: u16 = u16::MAX;
/// Most vertices of a patch.
pub(crate) const SLOTS_MAX: usize = 512;
/// Rows are an odd number of these long: of a length that is a power of two all would fall into
/// the same few lines of a cache.
const BLOCK: usize = 16;
/// Units of work of a value that lies alone in a line of a cache, which is fetched for it.
const LINE: usize = 16;

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
    slots_max: usize,
    /// Length of a row; follows the number of vertices.
    stride: usize,
    /// `[slot][component pair][slot]`.
    blocks: Vec<f32>,
    near: usize,
    /// Units of work since [`Patch::take_work`].
    work: u64,
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
        let slots_max = vertices.min(SLOTS_MAX);
        Self {
            ids: Vec::with_capacity(slots_max),
            slot_of: vec![NONE; vertices],
            slots_max,
            stride: row_length(0),
            blocks: vec![0.0; 9 * slots_max * row_length(slots_max)],
            near: 0,
            work: 0,
            values: Slots::new(slots_max),
        }
    }

    /// Units of work of all that was done since this was asked last.
    pub(crate) fn take_work(&mut self) -> u64 {
        std::mem::take(&mut self.work)
    }

    /// Counts units of work.
    pub(crate) fn count(&mut self, units: usize) {
        self.work += units as u64;
    }

    /// Most vertices that it can hold, and the length of a row of them.
    pub(crate) fn room(&self) -> [usize; 2] {
        [self.slots_max, row_length(self.slots_max)]
    }

    /// Makes rows as long as `slots` vertices need, with some to spare, or shorter if that is
    /// much less; what is close together stays in the caches.
    pub(crate) fn make_room(&mut self, slots: usize) {
        let (slots, n) = (slots.min(self.slots_max).max(self.ids.len()), self.ids.len());
        let (old, new) = (self.stride, row_length((slots + slots / 8).min(self.slots_max)));
        if slots > old {
            self.count(9 * n * n);
            for row in (0..9 * n).rev() {
                self.blocks.copy_within(row * old..row * old + n, row * new);
            }
        } else if 2 * new < old {
            self.count(9 * n * n);
            for row in 0..9 * n {
                self.blocks.copy_within(row * old..row * old + n, row * new);
            }
        } else {
            return;
        }
        self.stride = new;
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

    /// Takes a vertex in, at rest and without force, if there is room.
    pub(crate) fn add(&mut self, model: &ContactModel, vertex: u32) {
        let slot = self.ids.len();
        if slot == self.slots_max {
            return;
        }
        if slot >= self.stride {
            self.make_room(slot + 1);
        }
        let stride = self.stride;
        // A row is filled, and a column, in which each value lies alone.
        self.count(9 * (1 + LINE) * (slot + 1));
        self.ids.push(vertex);
        self.slot_of[vertex as usize] = slot as u16;
        for (k, &other) in self.ids.iter().enumerate() {
            let values = model.compliance.pair(vertex as usize, other as usize);
            for (pair, value) in values.into_iter().enumerate() {
                let turned = 3 * (pair % 3) + pair / 3;
                self.blocks[(9 * slot + pair) * stride + k] = value;
                self.blocks[(9 * k + turned) * stride + slot] = value;
            }
        }
        for column in self.values.columns() {
            column[slot] = 0.0;
        }
    }

    /// Holds these vertices in this order and none else, without force; the first `near` can carry
    /// it. False: they cannot be held so.
    pub(crate) fn refill(
        &mut self,
        model: &ContactModel,
        vertices: &[u32],
        near: usize,
        stride: usize,
    ) -> bool {
        self.clear();
        let fits = vertices.len() <= self.slots_max
            && near <= vertices.len()
            && (row_length(vertices.len())..=row_length(self.slots_max)).contains(&stride)
            && row_length(stride) == stride;
        if !fits {
            return false;
        }
        self.stride = stride;
        for &vertex in vertices {
            if vertex as usize >= model.vertices() || self.slot(vertex).is_some() {
                return false;
            }
            self.add(model, vertex);
        }
        self.near = near;
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
        self.count(9 * (2 + 2 * LINE) * n);
        let (low, high) = (a.min(b), a.max(b));
        let (head, tail) = self.blocks.split_at_mut(9 * high * stride);
        for pair in 0..9 {
            let own = &mut head[(9 * low + pair) * stride..][..n];
            own.swap_with_slice(&mut tail[pair * stride..][..n]);
        }
        for row in self.blocks.chunks_exact_mut(stride).take(9 * n) {
            row.swap(a, b);
        }
        for column in self.values.columns() {
            column.swap(a, b);
        }
        self.ids.swap(a, b);
        for slot in [a, b] {
            self.slot_of[self.ids[slot] as usize] = slot as u16;
        }
    }

    /// Displacement of the first `rows` slots by compliance alone under the forces of the near ones.
    pub(crate) fn displace(&mut self, rows: usize) {
        let m = self.near;
        self.count(9 * rows * m);
        let Slots { force, linear, .. } = &mut self.values;
        let [x, y, z] = force;
        let force = [&x[..m], &y[..m], &z[..m]];
        run(Displace { blocks: &self.blocks, stride: self.stride, rows, force, linear });
    }

    /// Lets `displace` fill displacements from the vertices and their linear displacements.
    pub(crate) fn move_by(
        &mut self,
        rows: usize,
        displace: impl FnOnce(&[u32], &[Vec<f32>; 3], &mut [Vec<f32>; 3]),
    ) {
        let Slots { linear, moved, .. } = &mut self.values;
        displace(&self.ids[..rows], linear, moved);
    }

    /// Fills rows of compliance along the objects' normals between the near slots; rows are
    /// `self.stride()` apart.
    pub(crate) fn along_normals(&self, matrix: &mut [f32]) {
        let (m, stride) = (self.near, self.stride);
        let Slots { normal, object, .. } = &self.values;
        let normal = normal.each_ref().map(|v| &v[..m]);
        self.along(normal, normal, matrix);
        for (i, give) in object[..m].iter().enumerate() {
            matrix[i * stride + i] += give;
        }
    }

    /// Fills rows of compliance between near slots, from unit vectors `columns` to `rows`.
    pub(crate) fn along(&self, rows: [&[f32]; 3], columns: [&[f32]; 3], matrix: &mut [f32]) {
        run(Along { blocks: &self.blocks, stride: self.stride, rows, columns, matrix });
    }

    /// Displacement of the near slots by compliance alone under forces on them.
    pub(crate) fn displacement(&self, force: [&[f32]; 3], linear: &mut [Vec<f32>; 3]) {
        let (blocks, stride, rows) = (&self.blocks[..], self.stride, self.near);
        run(Displace { blocks, stride, rows, force, linear });
    }

    pub(crate) fn stride(&self) -> usize {
        self.stride
    }
}

/// Length of a row for a number of slots.
fn row_length(slots: usize) -> usize {
    let blocks = slots.div_ceil(BLOCK).max(1);
    BLOCK * (blocks + usize::from(blocks.is_multiple_of(2)))
}
