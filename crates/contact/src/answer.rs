//! The answer of a contact solve: pressure, force, and how far to trust them.

use crate::model::ContactModel;
use crate::patch::Patch;
use papilla_atlas::PA_PER_MPA;
use papilla_vector::{cross, minus, norm};

/// Pressure and its sums. Filled anew by each frame; keeps its memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contact {
    /// True normal pressure at each vertex of the skin, Pa.
    pub pressure_pa: Vec<f32>,
    /// True tangential traction on the skin at each vertex, Pa, in the finger's frame; empty of a
    /// solver without friction.
    pub shear_pa: Vec<[f32; 3]>,
    /// Force on the finger, N, in its frame.
    pub force_n: [f64; 3],
    /// Torque of it about the origin of the finger's frame, N mm.
    pub torque_n_mm: [f64; 3],
    /// Deformed area of the vertices in contact, mm2.
    pub area_mm2: f64,
    /// Centre of pressure on the deformed skin, mm; the origin without contact.
    pub centre_mm: [f64; 3],
    /// Deepest point left inside an object, mm.
    pub penetration_mm: f64,
    /// Change of force for a small travel of the objects along it, N/mm, if asked for and found.
    pub stiffness_n_per_mm: Option<f64>,
    /// What the answer is worth.
    pub quality: Quality,
    /// What it took.
    pub effort: Effort,
    /// Vertices with pressure.
    touched: Vec<u32>,
}

/// What an answer is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Share of the second-order displacement; 0 of a method without.
    pub share: f32,
    /// Whether the deformation is beyond what the model was made for, or more vertices could
    /// touch than are looked at.
    pub out_of_range: bool,
    /// Whether the iteration settled, the force of the only object did not fall while that moved
    /// further in, and the skin is not pushed aside.
    pub settled: bool,
    /// Whether it is such a fall alone for which the answer is not settled.
    pub has_faded: bool,
    /// Whether too much of the force, without friction, leads along the skin.
    pub is_aside: bool,
    /// Whether a body lies so deep, or is so thin, that it is held on the side from which it came.
    pub is_held: bool,
    /// Whether a body lies in the finger where nothing was found to press: between vertices, or in its
    /// back.
    pub is_missed: bool,
}

/// Part of the force into the skin that may lead along it, and what is always allowed, N: blunt bodies
/// stay below half of that part.
const ASIDE_MAX: f64 = 0.3;
const ASIDE_N: f64 = 1e-3;

/// Sums of the forces of a frame without friction, along the skin and into it, N. Skin without friction
/// is pushed along its own normal. The forces here have the normals of objects, which at an edge between
/// vertices or pixels are those of one face alone.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Aside {
    along_n: [f64; 3],
    into_n: f64,
}

impl Aside {
    /// Adds a force where the skin has this outward normal.
    pub(crate) fn add(&mut self, force_n: [f64; 3], skin: [f32; 3]) {
        let skin = skin.map(f64::from);
        let out_n: f64 = (0..3).map(|i| force_n[i] * skin[i]).sum();
        self.into_n -= out_n;
        for i in 0..3 {
            self.along_n[i] += force_n[i] - out_n * skin[i];
        }
    }

    /// Takes note of whether too much leads along the skin.
    pub(crate) fn judge(self, quality: &mut Quality) {
        let along_n = norm(self.along_n);
        quality.is_aside = along_n > ASIDE_N + ASIDE_MAX * self.into_n.max(0.0);
        quality.settled &= !quality.is_aside;
    }
}

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Distances asked of objects.
    pub distances: u32,
    /// Linearisations of the contact.
    pub iterations: u32,
    /// Products with the matrix of the vertices in contact.
    pub products: u32,
    /// Vertices that could touch.
    pub candidates: u32,
    /// Multiply-adds of products, transforms and distances, as they are counted: the frame's budget
    /// is of these.
    pub work: u64,
}

/// Factors between the reference finger and this one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Person {
    /// Width of the finger over that of the reference finger.
    pub width: f64,
    /// Stiffness of its tissue over that of the reference finger.
    pub stiffness: f64,
}

impl Default for Person {
    fn default() -> Self {
        Self { width: 1.0, stiffness: 1.0 }
    }
}

impl Effort {
    pub(crate) const fn plus(self, other: Self) -> Self {
        Self {
            distances: self.distances + other.distances,
            iterations: self.iterations + other.iterations,
            products: self.products + other.products,
            candidates: other.candidates,
            work: self.work + other.work,
        }
    }
}

impl Contact {
    /// Memory for a finger of `vertices`.
    #[must_use]
    pub fn new(vertices: usize) -> Self {
        Self {
            pressure_pa: vec![0.0; vertices],
            touched: Vec::with_capacity(vertices),
            ..Self::default()
        }
    }

    /// Nothing touches.
    pub(crate) fn clear(&mut self) {
        for &vertex in &self.touched {
            self.pressure_pa[vertex as usize] = 0.0;
            if let Some(shear_pa) = self.shear_pa.get_mut(vertex as usize) {
                *shear_pa = [0.0; 3];
            }
        }
        let shear_pa = std::mem::take(&mut self.shear_pa);
        let pressure_pa = std::mem::take(&mut self.pressure_pa);
        let mut touched = std::mem::take(&mut self.touched);
        touched.clear();
        let quality = Quality { settled: true, ..Quality::default() };
        *self = Self { pressure_pa, shear_pa, touched, quality, ..Self::default() };
    }

    /// Puts pressure (Pa) at a vertex.
    pub(crate) fn press(&mut self, vertex: u32, pressure_pa: f32) {
        self.pressure_pa[vertex as usize] = pressure_pa;
        self.touched.push(vertex);
    }

    /// Whether every number is one.
    pub(crate) fn is_finite(&self) -> bool {
        self.touched.iter().all(|v| self.pressure_pa[*v as usize].is_finite())
            && self.force_n.iter().chain(&self.torque_n_mm).all(|v| v.is_finite())
    }

    /// Multiplies all that presses by `strength`, whose derivative by travel is `slope_per_mm`.
    pub(crate) fn strengthen(&mut self, strength: f64, slope_per_mm: f64) {
        let size = norm(self.force_n);
        for vertex in &self.touched {
            self.pressure_pa[*vertex as usize] *= strength as f32;
            if let Some(shear_pa) = self.shear_pa.get_mut(*vertex as usize) {
                shear_pa.iter_mut().for_each(|q| *q *= strength as f32);
            }
        }
        self.force_n.iter_mut().chain(&mut self.torque_n_mm).for_each(|f| *f *= strength);
        self.stiffness_n_per_mm = self.stiffness_n_per_mm.map(|_| size * slope_per_mm);
    }

    /// Vertices with pressure.
    #[must_use]
    pub fn touched(&self) -> &[u32] {
        &self.touched
    }

    /// Adds force `force_n` at `at_mm` with deformed area `area_mm2`, all of the reference finger.
    pub(crate) fn add(&mut self, at_mm: [f64; 3], force_n: [f64; 3], size_n: f64, area_mm2: f64) {
        let [x, y, z] = at_mm;
        let [fx, fy, fz] = force_n;
        let torque = [y * fz - z * fy, z * fx - x * fz, x * fy - y * fx];
        for i in 0..3 {
            self.force_n[i] += force_n[i];
            self.torque_n_mm[i] += torque[i];
            self.centre_mm[i] += size_n * at_mm[i];
        }
        self.area_mm2 += area_mm2;
    }

    /// From the reference finger to a person's; `size_n` is the sum of the sizes of the forces.
    ///
    /// Lengths grow with the width, stresses with the stiffness, and so forces with
    /// stiffness width^2, torques with stiffness width^3, force over travel with stiffness width:
    /// equilibrium and laws without an inner length know no other scale.
    pub(crate) fn finish(&mut self, person: Person, size_n: f64) {
        let Person { width, stiffness } = person;
        let force = stiffness * width * width;
        for i in 0..3 {
            self.force_n[i] *= force;
            self.torque_n_mm[i] *= force * width;
            self.centre_mm[i] *= if size_n > 0.0 { width / size_n } else { 0.0 };
        }
        self.area_mm2 *= width * width;
        self.penetration_mm *= width;
    }
}

/// Sums the patch's forces into `out`; `shear_n` is the part of each slot along the skin.
pub(crate) fn collect(
    model: &ContactModel,
    patch: &Patch,
    person: Person,
    shear_n: impl Fn(usize) -> [f32; 3],
    out: &mut Contact,
) {
    let v = &patch.values;
    let (mut size_n, mut aside) = (0.0, Aside::default());
    for slot in 0..patch.near() {
        let size = f64::from(v.size[slot]);
        if !(size > 0.0) {
            continue;
        }
        let vertex = patch.vertices()[slot];
        let area = f64::from(model.areas_mm2[vertex as usize]) * stretch(model, patch, vertex);
        let pressure = person.stiffness * PA_PER_MPA * size / area;
        out.press(vertex, pressure as f32);
        if let Some(shear_pa) = out.shear_pa.get_mut(vertex as usize) {
            let per = person.stiffness * PA_PER_MPA / area;
            *shear_pa = shear_n(slot).map(|force| (per * f64::from(force)) as f32);
        }
        let at = std::array::from_fn(|i| {
            model.positions_mm[vertex as usize][i] + f64::from(v.moved[i][slot])
        });
        let found = [0, 1, 2].map(|i| v.found[i][slot]);
        let shear = shear_n(slot);
        aside
            .add([0, 1, 2].map(|i| f64::from(found[i] - shear[i])), model.normals[vertex as usize]);
        out.add(at, found.map(f64::from), size, area);
        size_n += size;
    }
    aside.judge(&mut out.quality);
    out.finish(person, size_n);
}

/// Deformed over undeformed area round a vertex.
fn stretch(model: &ContactModel, patch: &Patch, vertex: u32) -> f64 {
    let (mut rest, mut deformed) = (0.0, 0.0);
    for &triangle in &model.around[vertex as usize] {
        let corners = model.triangles[triangle as usize];
        let [Some(a), Some(b), Some(c)] = corners.map(|corner| patch.slot(corner)) else {
            continue;
        };
        let x = corners.map(|corner| model.positions_mm[corner as usize]);
        let moved = |slot: usize| [0, 1, 2].map(|i| f64::from(patch.values.moved[i][slot]));
        let u = [a, b, c].map(moved);
        rest += area(x);
        deformed += area(std::array::from_fn(|k| std::array::from_fn(|i| x[k][i] + u[k][i])));
    }
    if rest > 0.0 && deformed > 0.1 * rest { deformed / rest } else { 1.0 }
}

fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    0.5 * norm(cross(minus(b, a), minus(c, a)))
}
