//! Coulomb friction: the forces along the skin under objects that move.
//!
//! An object carries a point in contact along from where contact began, as long as `|q| <= mu f`.
//! Beyond that the point slips, and its force stays at `mu f` against the slip. The *anchor* is the
//! place on the object from which the point would be carried. For the normal forces of each
//! linearisation, [`DiscSolver`] finds the tangential forces; they settle together with the normal
//! ones. Afterwards the anchors of points that slipped move with the points, and those of points
//! that stuck stay. So nothing creeps, however many frames an object rests.

use super::{PRODUCTS_MIN, Solver};
use crate::discs::{DiscSolver, Tangential, size, steps, to_disc};
use crate::model::ContactModel;
use crate::objects::View;
use crate::patch::{Patch, Slots};
use papilla_vector::single::{cross, dot};

/// Slip against a force below its bound that is accepted, reference mm.
const VIOLATION_MM: f32 = 2e-5;
/// Most products with the matrix in a linearisation.
const PRODUCTS_MAX: u32 = 60;
/// Least compliance along the skin that steps count on, as part of the greatest along normals.
const STEP_PART: f32 = 1e-3;
/// Part of its bound below which a force holds a point where it is.
const HELD: f32 = 0.999;

/// Where a point would be carried from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Vertex of the skin.
    pub vertex: u32,
    /// Index of the object; of what is told by gaps 0.
    pub object: u32,
    /// Place in the object's own frame, mm; of what is told by gaps in the finger's.
    pub place_mm: [f64; 3],
}

/// What a vertex has to do with the nearest object.
#[derive(Clone, Copy, Debug, Default)]
struct Touch {
    friction: f32,
    object: u32,
    anchor: Option<Anchor>,
    /// The anchor after this frame.
    next: Option<Anchor>,
}

/// Normals that the compliance along them was made for, and a bound of its eigenvalues.
type MadeFor<'a> = (&'a [Vec<f32>; 3], f32);
/// Two tangents of each slot, component by component.
type Tangents = [[Vec<f32>; 3]; 2];

/// Memory of the friction of one finger.
#[derive(Debug)]
pub(super) struct Friction {
    /// Whether anything of this frame has friction.
    pub(super) is_rough: bool,
    /// Largest slip left in the last linearisation against a force below its bound, mm.
    pub(super) violation_mm: f32,
    /// By vertex.
    touches: Vec<Touch>,
    /// Vertices with an anchor.
    anchored: Vec<u32>,
    discs: DiscSolver,
    /// Compliance between the near slots along the tangents `[11, 12, 21, 22]`, rows as in the
    /// patch, and how many slots it was made for; none if it has to be made anew.
    matrix: [Vec<f32>; 4],
    pub(super) made: usize,
    /// By slot: two tangents that the matrix was made along, and now.
    made_along: Tangents,
    tangent: Tangents,
    step: Vec<f32>,
    bound: Vec<f32>,
    force: [Vec<f32>; 2],
    slip: [Vec<f32>; 2],
    /// Change of the normal forces, N, and what it displaces, mm.
    change: [Vec<f32>; 3],
    linear: [Vec<f32>; 3],
}

impl Friction {
    pub(super) fn new(vertices: usize, [slots, row]: [usize; 2]) -> Self {
        let zeros = || vec![0.0; slots];
        let vector = || std::array::from_fn(|_| zeros());
        Self {
            is_rough: false,
            violation_mm: 0.0,
            touches: vec![Touch::default(); vertices],
            anchored: Vec::with_capacity(vertices),
            discs: DiscSolver::new(slots),
            matrix: std::array::from_fn(|_| vec![0.0; slots * row]),
            made: 0,
            made_along: [vector(), vector()],
            tangent: [vector(), vector()],
            step: zeros(),
            bound: zeros(),
            force: [zeros(), zeros()],
            slip: [zeros(), zeros()],
            change: vector(),
            linear: vector(),
        }
    }

    /// Begins a frame in which something has friction, or nothing.
    pub(super) fn expect(&mut self, is_rough: bool) {
        self.is_rough = is_rough;
        if !is_rough {
            self.forget();
        }
    }

    /// Moves anchors with the things that they are on, by what is said of each vertex, mm.
    pub(super) fn carry(&mut self, moved_mm: impl Fn(usize) -> [f64; 3]) {
        for vertex in &self.anchored {
            let moved = moved_mm(*vertex as usize);
            if let Some(anchor) = &mut self.touches[*vertex as usize].anchor {
                anchor.place_mm.iter_mut().zip(moved).for_each(|(place, by)| *place += by);
            }
        }
    }

    /// Takes note of the object that is nearest to a vertex.
    pub(super) fn meet(&mut self, vertex: usize, object: u32, friction: f64) {
        let touch = &mut self.touches[vertex];
        (touch.object, touch.friction) = (object, friction as f32);
    }

    pub(super) fn forget(&mut self) {
        for vertex in self.anchored.drain(..) {
            self.touches[vertex as usize].anchor = None;
        }
        self.made = 0;
    }

    /// Anchors, by vertex in the order of slots.
    pub(super) fn anchors(&self) -> impl Iterator<Item = Anchor> + '_ {
        self.anchored.iter().filter_map(|vertex| self.touches[*vertex as usize].anchor)
    }

    /// Takes an anchor; false: of no vertex, or the vertex' second one.
    pub(super) fn hold(&mut self, anchor: Anchor) -> bool {
        let Some(touch) = self.touches.get_mut(anchor.vertex as usize) else { return false };
        let is_first = touch.anchor.replace(anchor).is_none();
        if is_first {
            self.anchored.push(anchor.vertex);
        }
        is_first && anchor.place_mm.iter().all(|v| v.is_finite())
    }

    /// Adds to the forces that were found along normals what resists slip, with the compliance
    /// scaled by `scale`; returns products with the matrix, of which so many are `left`.
    fn resist(
        &mut self,
        view: View<'_>,
        model: &ContactModel,
        patch: &mut Patch,
        made_for: MadeFor<'_>,
        (scale, left): (f32, u32),
    ) -> u32 {
        let m = patch.near();
        patch.count(9 * m * m);
        self.make_matrix(patch, made_for);
        for slot in 0..m {
            let [n, was] =
                [&patch.values.normal, &self.made_along[0]].map(|v| [0, 1, 2].map(|i| v[i][slot]));
            put(&mut self.tangent, slot, n, was);
        }
        self.find_slips(view, model, patch, scale);
        let Self { matrix, step, bound, force: [q1, q2], slip, discs, .. } = self;
        let matrix = Tangential { blocks: matrix, stride: patch.stride(), step: &step[..m] };
        let ends = (VIOLATION_MM, left.clamp(PRODUCTS_MIN, PRODUCTS_MAX));
        let slip = slip.each_ref().map(|s| &s[..m]);
        let effort = discs.solve(matrix, slip, &bound[..m], [&mut q1[..m], &mut q2[..m]], ends);
        self.violation_mm = effort.violation_mm;
        self.add_to_found(patch);
        effort.products
    }

    /// Bounds, slips without tangential forces, and these forces as they are.
    fn find_slips(&mut self, view: View<'_>, model: &ContactModel, patch: &Patch, scale: f32) {
        let (m, v) = (patch.near(), &patch.values);
        for (i, change) in self.change.iter_mut().enumerate() {
            for (slot, change) in change[..m].iter_mut().enumerate() {
                *change = v.found[i][slot] - v.force[i][slot];
            }
        }
        patch.displacement(self.change.each_ref().map(|c| &c[..m]), &mut self.linear);
        for slot in 0..m {
            let vertex = patch.vertices()[slot] as usize;
            let touch = self.touches[vertex];
            let held = touch.anchor.filter(|a| a.object == touch.object && v.size[slot] > 0.0);
            let from = held.and_then(|a| view.off_object(a.object, a.place_mm));
            self.bound[slot] = from.map_or(0.0, |_| touch.friction * v.size[slot]);
            // Compliance that is not scaled finds the same forces for slips over the scale.
            let gone = from.map_or([0.0; 3], |from| {
                std::array::from_fn(|i| {
                    let way = from[i] - model.positions_mm[vertex][i];
                    (f64::from(v.moved[i][slot]) - way) as f32 / scale + self.linear[i][slot]
                })
            });
            let was = [0, 1, 2].map(|i| v.force[i][slot]);
            for k in 0..2 {
                let t = [0, 1, 2].map(|i| self.tangent[k][i][slot]);
                (self.slip[k][slot], self.force[k][slot]) = (dot(t, gone), dot(t, was));
            }
        }
    }

    fn add_to_found(&self, patch: &mut Patch) {
        for slot in 0..patch.near() {
            for (found, shear) in patch.values.found.iter_mut().zip(self.shear_n(slot)) {
                found[slot] += shear;
            }
        }
    }

    /// Force of a slot along the skin, N.
    pub(super) fn shear_n(&self, slot: usize) -> [f32; 3] {
        let [a, b] = [self.force[0][slot], self.force[1][slot]];
        [0, 1, 2].map(|i| a * self.tangent[0][i][slot] + b * self.tangent[1][i][slot])
    }

    /// Adds the tangential part of the forces gone on from to those that were taken for the answer.
    pub(super) fn take_mean(&mut self, patch: &mut Patch) {
        for slot in 0..patch.near() {
            let Slots { force, size, .. } = &patch.values;
            let was = [0, 1, 2].map(|i| force[i][slot]);
            let along = |k: usize| dot([0, 1, 2].map(|i| self.tangent[k][i][slot]), was);
            let friction = self.touches[patch.vertices()[slot] as usize].friction;
            let bound = if self.bound[slot] > 0.0 { friction * size[slot] } else { 0.0 };
            [self.force[0][slot], self.force[1][slot]] = to_disc([along(0), along(1)], bound);
        }
        self.add_to_found(patch);
    }

    /// Compliance along tangents of the normals that the matrix along normals was made for.
    fn make_matrix(&mut self, patch: &Patch, (made_for, norm): MadeFor<'_>) {
        let m = patch.near();
        if self.made == m {
            return;
        }
        for slot in 0..m {
            let n = [0, 1, 2].map(|i| made_for[i][slot]);
            let flat = if n[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            put(&mut self.made_along, slot, n, flat);
        }
        let [a, b] = self.made_along.each_ref().map(|t| t.each_ref().map(|v| &v[..m]));
        for (block, [rows, columns]) in self.matrix.iter_mut().zip([[a, a], [a, b], [b, a], [b, b]])
        {
            patch.along(rows, columns, block);
        }
        let least = (STEP_PART * norm).max(f32::MIN_POSITIVE.sqrt());
        steps(&self.matrix, patch.stride(), least, &mut self.step[..m]);
        self.made = m;
    }

    /// Gives points in contact and near it the anchors of the next frame, and others none.
    fn follow(&mut self, view: View<'_>, model: &ContactModel, patch: &Patch) {
        let v = &patch.values;
        for slot in 0..patch.near() {
            let vertex = patch.vertices()[slot];
            let touch = &mut self.touches[vertex as usize];
            let q = size([self.force[0][slot], self.force[1][slot]]);
            let sticks = v.size[slot] > 0.0 && q < HELD * touch.friction * v.size[slot];
            let held = touch.anchor.filter(|a| sticks && a.object == touch.object);
            touch.next = held.or_else(|| {
                let p = model.positions_mm[vertex as usize];
                let at = std::array::from_fn(|i| p[i] + f64::from(v.moved[i][slot]));
                let object = Some(touch.object).filter(|_| touch.friction > 0.0)?;
                let place_mm = view.on_object(object, at)?;
                Some(Anchor { vertex, object, place_mm })
            });
        }
        for vertex in self.anchored.drain(..) {
            self.touches[vertex as usize].anchor = None;
        }
        for vertex in &patch.vertices()[..patch.near()] {
            let touch = &mut self.touches[*vertex as usize];
            touch.anchor = touch.next.take();
            if touch.anchor.is_some() {
                self.anchored.push(*vertex);
            }
        }
    }
}

/// Puts the tangent nearest to `toward` at a slot, and the one across it.
fn put(tangents: &mut Tangents, slot: usize, n: [f32; 3], toward: [f32; 3]) {
    let up = dot(n, toward);
    let flat: [f32; 3] = std::array::from_fn(|i| toward[i] - up * n[i]);
    let part = 1.0 / dot(flat, flat).sqrt().max(f32::MIN_POSITIVE);
    let t = flat.map(|v| part * v);
    for (tangent, value) in tangents.iter_mut().zip([t, cross(n, t)]) {
        for (column, value) in tangent.iter_mut().zip(value) {
            column[slot] = value;
        }
    }
}

impl Solver {
    /// Adds what resists slip to the forces that were found, if anything has friction.
    pub(super) fn resist_slip(&mut self, view: View<'_>, scale: f32, left: u32) -> u32 {
        let Self { friction, model, patch, made_for, norm, .. } = self;
        match friction {
            Some(f) if f.is_rough => f.resist(view, model, patch, (made_for, *norm), (scale, left)),
            _ => 0,
        }
    }

    /// Ends a frame: what stuck is held where it was, what slipped where it is.
    pub(crate) fn follow_slip(&mut self, view: View<'_>) {
        let Self { friction, model, patch, sides, .. } = self;
        if let Some(friction) = friction.as_mut().filter(|f| f.is_rough) {
            friction.follow(sides.view(view), model, patch);
        }
        sides.keep();
    }
}
