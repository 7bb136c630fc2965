//! What traction along the skin adds to the strain energy density (SED) at the interface.
//!
//! Networks compute SED from pressure alone. The closed form for layered skin gives the strain at
//! the interface that pressure `p` and traction `q` make together, and the strain that `p` makes
//! alone. The difference of their energies `E`, on the dermis' side, is added to the SED of the
//! network:
//!
//! ```text
//! SED = network(p) + E(e(p) + e(q)) - E(e(p)),   at least 0
//! ```
//!
//! In this form strains are small and the skin is plane. The error of these assumptions enters only
//! with the added part. The map is computed on cells of 2 x 2 pixels (.27 mm; the vertices that
//! carry traction are .7 mm apart), as one period of waves.

use crate::interface::{InterfaceResponse, Response};
use crate::model::ContactModel;
use papilla_atlas::PA_PER_MPA;
use papilla_atlas::{Atlas, MAP_LEN, Patch, Raster};
use papilla_fft::{Grid, Line, Scratch, Wave};
use papilla_vector::norm;
use std::f64::consts::TAU;
use std::fmt;
use std::sync::Arc;

/// Pixels of the map along a side, and of the grid on which waves are.
const MAP_SIDE: usize = 224;
const SIDE: usize = MAP_SIDE / 2;
const CELLS: usize = SIDE * SIDE;
const HALF: usize = SIDE / 2 + 1;
const WAVES: usize = SIDE * HALF;
const J_PER_M3_PER_MPA: f32 = 1e6;

/// Strain `xx yy xy` and traction `xz yz zz` (MPa) at the interface.
type Six<T> = [T; 6];

/// What has to be known of a finger's skin and interface; made once, for any number of fingers.
pub struct InterfaceSkin {
    skin: Arc<Raster>,
    /// Pixels of the interface.
    interface: Vec<u32>,
    /// By vertex: unit vectors along columns and along rows of the map.
    tangents: Vec<[[f32; 3]; 2]>,
    /// By wave: cosine and sine of its direction, wave number (1/mm), and the response.
    waves: Vec<([f32; 3], [f32; 8])>,
    /// Lame's constants below the interface, MPa.
    lame_mpa: [f32; 2],
    /// Along rows and columns of the grid.
    line: Line,
}

impl fmt::Debug for InterfaceSkin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InterfaceSkin").field("lame_mpa", &self.lame_mpa).finish_non_exhaustive()
    }
}

impl InterfaceSkin {
    /// The skin of an atlas and of a model of it; none if the model names fewer than two layers, or
    /// has other vertices than the atlas.
    #[must_use]
    pub fn new(model: &ContactModel, atlas: &Atlas, skin: Arc<Raster>) -> Option<Self> {
        let layers = &model.header().layers;
        let below = layers.get(1)?;
        if model.vertices() != atlas.vertex_count() {
            return None;
        }
        let response = InterfaceResponse::new(layers);
        let period_mm = MAP_SIDE as f64 * f64::from(atlas.mm_per_px());
        Some(Self {
            tangents: tangents(model, &atlas.patch(skin.patch()).uv_px),
            skin,
            interface: Raster::new(atlas, Patch::Interface).indices().to_vec(),
            waves: (0..WAVES).map(|at| wave(at, period_mm, &response)).collect(),
            lame_mpa: below.lame_mpa().map(|v| v as f32),
            line: Line::new(SIDE),
        })
    }

    fn transform(&self) -> Grid<'_> {
        Grid { rows: &self.line, columns: &self.line }
    }
}

/// Unit vectors along columns and rows of the map at each vertex, along the skin.
fn tangents(model: &ContactModel, uv_px: &[[f32; 2]]) -> Vec<[[f32; 3]; 2]> {
    let mut sums = vec![[[0.0f64; 3]; 2]; uv_px.len()];
    for corners in &model.triangles {
        let [a, b, c] = corners.map(|corner| corner as usize);
        let side = |to: usize| {
            let uv: [f64; 2] = [0, 1].map(|i| f64::from(uv_px[to][i] - uv_px[a][i]));
            let mm: [f64; 3] =
                std::array::from_fn(|i| model.positions_mm[to][i] - model.positions_mm[a][i]);
            (uv, mm)
        };
        let (([u1, v1], x1), ([u2, v2], x2)) = (side(b), side(c));
        let turn = (u1 * v2 - u2 * v1).signum();
        for corner in [a, b, c] {
            for i in 0..3 {
                // Slopes times twice the triangle's area in the map.
                sums[corner][0][i] += turn * (v2 * x1[i] - v1 * x2[i]);
                sums[corner][1][i] += turn * (u1 * x2[i] - u2 * x1[i]);
            }
        }
    }
    let unit = |v: [f64; 3]| {
        let size = norm(v).max(f64::MIN_POSITIVE);
        v.map(|x| x / size)
    };
    let pair = |[along, down]: [[f64; 3]; 2]| {
        let along = unit(along);
        let part: f64 = (0..3).map(|i| along[i] * down[i]).sum();
        let down = unit(std::array::from_fn(|i| down[i] - part * along[i]));
        [along, down].map(|v| v.map(|x| x as f32))
    };
    sums.into_iter().map(pair).collect()
}

/// Direction, wave number and response of a wave, `[column][row]`. The shortest waves have no
/// direction that a real map could tell; they give nothing.
fn wave(at: usize, period_mm: f64, response: &InterfaceResponse) -> ([f32; 3], [f32; 8]) {
    let (column, row) = (at / SIDE, at % SIDE);
    if column == SIDE / 2 || row == SIDE / 2 {
        return ([1.0, 0.0, 0.0], [0.0; 8]);
    }
    let down = if row < SIDE / 2 { row as f64 } else { row as f64 - SIDE as f64 };
    let [x, y] = [column as f64, down].map(|n| TAU * n / period_mm);
    let k = x.hypot(y);
    let [c, s] = if k > 0.0 { [x / k, y / k] } else { [1.0, 0.0] };
    let Response { along: [a, b], shear: [d, e], normal: [f, g], across: [h, i] } = response.at(k);
    let cells = CELLS as f64;
    ([c, s, k].map(|v| v as f32), [a, b, d, e, f, g, h, i].map(|v| (v / cells) as f32))
}

/// Memory of one finger. Nothing is allocated after construction.
pub struct ShearEnergy {
    of: Arc<InterfaceSkin>,
    /// A vertex' traction along one direction, and its map.
    vertices: Vec<f32>,
    map: Vec<f32>,
    grid: Vec<f32>,
    turned: Vec<Wave>,
    scratch: Scratch,
    /// By wave: pressure, traction along columns and along rows.
    loads: [Vec<Wave>; 3],
    /// Strain and traction at the interface, of pressure and of traction along the skin.
    of_pressure: Six<Vec<f32>>,
    of_shear: Six<Vec<f32>>,
}

impl fmt::Debug for ShearEnergy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ShearEnergy").field("of", &self.of).finish_non_exhaustive()
    }
}

impl ShearEnergy {
    /// A finger that nothing touches.
    #[must_use]
    pub fn new(of: Arc<InterfaceSkin>) -> Self {
        let zero = Wave::new(0.0, 0.0);
        let waves = || vec![zero; WAVES];
        let cells = || vec![0.0; CELLS];
        Self {
            vertices: vec![0.0; of.tangents.len()],
            scratch: of.transform().scratch(),
            of,
            map: vec![0.0; MAP_LEN],
            grid: cells(),
            turned: waves(),
            loads: [waves(), waves(), waves()],
            of_pressure: std::array::from_fn(|_| cells()),
            of_shear: std::array::from_fn(|_| cells()),
        }
    }

    /// Adds to `sed_j_per_m3` (224 x 224), which a network made of `pressure_pa` (224 x 224), what
    /// traction along the skin at the vertices changes (Pa, in the finger's frame). All are of the
    /// finger of reference stiffness times `1 / to_reference`, and SED of that finger itself. Traction
    /// greater than `limit_pa` is felt as one of that size.
    ///
    /// Without traction nothing is done.
    pub fn add(
        &mut self,
        pressure_pa: &[f32],
        shear_pa: &[[f32; 3]],
        to_reference: f32,
        limit_pa: f32,
        sed_j_per_m3: &mut [f32],
    ) {
        if shear_pa.iter().flatten().all(|q| *q == 0.0) {
            return;
        }
        let of = Arc::clone(&self.of);
        self.map.copy_from_slice(pressure_pa);
        self.transform(0, &of, 1.0 / PA_PER_MPA as f32);
        for way in 0..2 {
            for ((value, q), tangents) in self.vertices.iter_mut().zip(shear_pa).zip(&of.tangents) {
                let t = tangents[way];
                *value = within(*q, limit_pa) * (q[0] * t[0] + q[1] * t[1] + q[2] * t[2]);
            }
            // Both lengths are those of the atlas.
            _ = of.skin.rasterise(&self.vertices, &mut self.map);
            self.transform(1 + way, &of, to_reference / PA_PER_MPA as f32);
        }
        for part in 0..6 {
            self.field(part, &of, false);
            self.field(part, &of, true);
        }
        self.grid_of_change(&of);
        for &pixel in &of.interface {
            let sed = &mut sed_j_per_m3[pixel as usize];
            let sum = *sed + between(&self.grid, pixel as usize);
            // What is no number stays none, so that whoever sends it sees it.
            *sed = if sum < 0.0 { 0.0 } else { sum };
        }
    }

    /// Means of the map over 2 x 2 pixels, as waves.
    fn transform(&mut self, load: usize, of: &InterfaceSkin, factor: f32) {
        let Self { map, grid, scratch, loads, .. } = self;
        for (at, cell) in grid.iter_mut().enumerate() {
            let first = 2 * (at / SIDE) * MAP_SIDE + 2 * (at % SIDE);
            let rows = [first, first + MAP_SIDE].map(|i| map[i] + map[i + 1]);
            *cell = 0.25 * factor * (rows[0] + rows[1]);
        }
        of.transform().forward(grid, SIDE, &mut loads[load], scratch);
    }

    /// One of the six numbers at the interface, of pressure or of traction along the skin.
    fn field(&mut self, part: usize, of: &InterfaceSkin, is_shear: bool) {
        let Self { turned, scratch, loads: [p, x, y], of_pressure, of_shear, .. } = self;
        let number = if is_shear { shear_number } else { pressure_number };
        for (at, (turned, wave)) in turned.iter_mut().zip(&of.waves).enumerate() {
            *turned = number(part, wave, [p[at], x[at], y[at]]);
        }
        let out = if is_shear { &mut of_shear[part] } else { &mut of_pressure[part] };
        of.transform().back(turned, SIDE, out, scratch);
    }

    /// The change of energy density below the interface by cell, J/m3.
    fn grid_of_change(&mut self, of: &InterfaceSkin) {
        let Self { grid, of_pressure, of_shear, .. } = self;
        for (at, change) in grid.iter_mut().enumerate() {
            let alone: Six<f32> = std::array::from_fn(|i| of_pressure[i][at]);
            let both: Six<f32> = std::array::from_fn(|i| alone[i] + of_shear[i][at]);
            let change_mpa = energy_mpa(of.lame_mpa, both) - energy_mpa(of.lame_mpa, alone);
            *change = J_PER_M3_PER_MPA * change_mpa;
        }
    }
}

/// The part of a traction that is felt: what makes it no greater than `limit_pa`.
fn within(q: [f32; 3], limit_pa: f32) -> f32 {
    let size = q.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
    if size > f64::from(limit_pa) { (f64::from(limit_pa) / size) as f32 } else { 1.0 }
}

/// A wave of one of the six numbers, of pressure.
fn pressure_number(part: usize, wave: &([f32; 3], [f32; 8]), [p, _, _]: [Wave; 3]) -> Wave {
    let ([c, s, k], [_, along, _, shear, _, normal, _, _]) = *wave;
    let (strain, traction) = (-k * along, shear);
    match part {
        0 => p * (c * c * strain),
        1 => p * (s * s * strain),
        2 => p * (c * s * strain),
        3 => Wave::i() * p * (c * traction),
        4 => Wave::i() * p * (s * traction),
        _ => -p * normal,
    }
}

/// The same of traction along the skin.
fn shear_number(part: usize, wave: &([f32; 3], [f32; 8]), [_, x, y]: [Wave; 3]) -> Wave {
    let ([c, s, k], [along, _, shear, _, normal, _, moved, twist]) = *wave;
    let (q_k, q_t) = (x * c + y * s, y * c - x * s);
    let strain = Wave::i() * q_k * (k * along);
    let slide = Wave::i() * q_t * (0.5 * k * moved);
    match part {
        0 => strain * (c * c) - slide * (2.0 * c * s),
        1 => strain * (s * s) + slide * (2.0 * c * s),
        2 => strain * (c * s) + slide * (c * c - s * s),
        3 => q_k * (c * shear) - q_t * (s * twist),
        4 => q_k * (s * shear) + q_t * (c * twist),
        _ => Wave::i() * q_k * normal,
    }
}

/// Energy density of Hooke's law, MPa, of strains in the plane and tractions on it.
fn energy_mpa([lambda, mu]: [f32; 2], [xx, yy, xy, t_x, t_y, t_z]: Six<f32>) -> f32 {
    let zz = (t_z - lambda * (xx + yy)) / (lambda + 2.0 * mu);
    let [xz, yz] = [t_x, t_y].map(|t| 0.5 * t / mu);
    let trace = xx + yy + zz;
    let square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz);
    0.5 * lambda * trace * trace + mu * square
}

/// The value of a grid of 2 x 2 pixels at a pixel, linear between the middles of cells.
fn between(grid: &[f32], pixel: usize) -> f32 {
    let [row, column] = [pixel / MAP_SIDE, pixel % MAP_SIDE].map(|i| {
        let near = i / 2;
        let other = if i % 2 == 0 { near.saturating_sub(1) } else { (near + 1).min(SIDE - 1) };
        [near, other]
    });
    let line =
        |row: usize| 0.75 * grid[row * SIDE + column[0]] + 0.25 * grid[row * SIDE + column[1]];
    0.75 * line(row[0]) + 0.25 * line(row[1])
}

#[cfg(test)]
mod tests;
