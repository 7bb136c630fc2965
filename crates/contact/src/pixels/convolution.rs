//! Products with the compliance of the layers, which is the same everywhere, on a window of pixels.

use crate::layers::SurfaceCompliance;
use papilla_fft::{Grid, Line, Scratch, Wave};
use std::f64::consts::TAU;
use std::fmt;
use std::sync::Arc;

/// Lengths of windows: a transform of each is fast.
const LENGTHS: [usize; 17] =
    [16, 20, 24, 32, 40, 48, 56, 64, 72, 80, 96, 112, 128, 160, 192, 224, 288];

/// Longest of them.
pub(super) const LENGTH_MAX: usize = LENGTHS[LENGTHS.len() - 1];

/// Steps of the pixels' distance, as a share of it: a frame like the last one needs no new table.
const PITCH_STEP: f64 = 2.5e-3;

/// Units of work that the compliance of one wave takes: a logarithm and an exponential.
const WAVE: u64 = 60;

/// Where pressure stands in a window.
#[derive(Clone, Copy)]
pub(super) struct Cells<'a> {
    /// Of each pressure.
    pub own: &'a [u32],
    /// Which pressure stands once more, behind a mirror, and where.
    pub images: &'a [[u32; 2]],
}

/// Transforms along windows of all lengths; made once, for any number of fingers.
#[derive(Debug)]
pub(super) struct Plans(Vec<Line>);

impl Plans {
    pub(super) fn new() -> Self {
        Self(Line::all(&LENGTHS))
    }

    fn of(&self, length: usize) -> Option<&Line> {
        self.0.iter().find(|line| line.length() == length)
    }
}

/// Memory for a window of any of the lengths, either way.
pub(super) struct Convolution {
    plans: Arc<Plans>,
    rows: usize,
    columns: usize,
    /// Rows, the first, that pressure stands in.
    pressed: usize,
    /// Logarithms of the pixels' distances, in steps.
    steps: [i32; 2],
    /// `[rows][columns]`.
    grid: Vec<f32>,
    /// `[columns / 2 + 1][rows]`.
    waves: Vec<Wave>,
    scratch: Scratch,
    /// `[columns / 2 + 1][rows]`: compliance over the number of pixels, mm/MPa.
    compliance: Vec<f32>,
    /// The window that it is of; the same of the window before.
    told_for: Option<(usize, usize, [i32; 2])>,
    earlier: Vec<f32>,
    earlier_for: Option<(usize, usize, [i32; 2])>,
}

impl fmt::Debug for Convolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rows, columns, .. } = self;
        f.debug_struct("Convolution").field("rows", rows).field("columns", columns).finish()
    }
}

impl Convolution {
    pub(super) fn new(plans: Arc<Plans>) -> Self {
        let half = LENGTH_MAX * (LENGTH_MAX / 2 + 1);
        Self {
            scratch: Scratch::of(&plans.0),
            plans,
            rows: 0,
            columns: 0,
            pressed: 0,
            steps: [0; 2],
            grid: vec![0.0; LENGTH_MAX * LENGTH_MAX],
            waves: vec![Wave::new(0.0, 0.0); half],
            compliance: vec![0.0; half],
            told_for: None,
            earlier: vec![0.0; half],
            earlier_for: None,
        }
    }

    /// Takes a window of at least so many rows and columns, as far as there is one, of pixels
    /// `pitch_mm` apart along rows and columns; pressure stands in the first `pressed` rows.
    pub(super) fn open(
        &mut self,
        [rows, columns]: [usize; 2],
        pressed: usize,
        [across_mm, along_mm]: [f64; 2],
        surface: &SurfaceCompliance,
    ) {
        let fitting = |least| LENGTHS.into_iter().find(|l| *l >= least).unwrap_or(LENGTH_MAX);
        let steps = [across_mm, along_mm].map(|mm| (mm.ln() / PITCH_STEP).round() as i32);
        let window = (fitting(rows), fitting(columns), steps);
        self.pressed = pressed.min(window.0);
        if (self.rows, self.columns, self.steps) == window {
            return;
        }
        (self.rows, self.columns, self.steps) = window;
        let [across_mm, along_mm] = steps.map(|step| (f64::from(step) * PITCH_STEP).exp());
        let wave = |index: usize, length: usize, pitch_mm: f64| {
            TAU * index.min(length - index) as f64 / (length as f64 * pitch_mm)
        };
        // Frames to and fro over a step of the distance, or of the window's size, find their table again.
        std::mem::swap(&mut self.compliance, &mut self.earlier);
        std::mem::swap(&mut self.told_for, &mut self.earlier_for);
        if self.told_for == Some(window) {
            return;
        }
        self.told_for = Some(window);
        let pixels = (self.rows * self.columns) as f64;
        for column in 0..=self.columns / 2 {
            let x = wave(column, self.columns, along_mm);
            let table = &mut self.compliance[column * self.rows..][..self.rows];
            for row in 0..=self.rows / 2 {
                let y = wave(row, self.rows, across_mm);
                let k = (x * x + y * y).sqrt();
                table[row] = (surface.at(k) / pixels) as f32;
            }
            // Waves up are as waves down.
            for row in self.rows / 2 + 1..self.rows {
                table[row] = table[self.rows - row];
            }
        }
    }

    /// Units of work that the table of a window takes, which counts in each frame: whether it is still
    /// there from an earlier one is no matter of the frame.
    pub(super) fn table_work(&self) -> u64 {
        WAVE * ((self.rows / 2 + 1) * (self.columns / 2 + 1)) as u64
    }

    /// Units of work that a product takes: transforms there and back.
    pub(super) fn work(&self) -> u64 {
        let cells = (self.rows * self.columns).max(1) as u64;
        cells * u64::from(cells.ilog2())
    }

    /// Pixels of a row.
    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    /// Rows.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// `1 / h^2` by the pixels' distances `h` down and along rows, and the square of the mean (of
    /// logarithms) between the wave numbers of the window and of a pixel, mm^-2.
    pub(super) fn bends(&self) -> [f32; 3] {
        let pitch_mm = self.steps.map(|step| (f64::from(step) * PITCH_STEP).exp());
        let [down, along] = pitch_mm.map(|h| 1.0 / (h * h));
        let longest = pitch_mm[0] * self.rows as f64;
        let longest = longest.max(pitch_mm[1] * self.columns as f64);
        let middle = TAU / longest * (4.0 * (down + along)).sqrt();
        [down, along, middle].map(|v| v as f32)
    }

    /// The window, to be filled with pressure (MPa) before, and read displacement (mm) after
    /// [`Self::apply`].
    fn grid(&mut self) -> &mut [f32] {
        &mut self.grid[..self.rows * self.columns]
    }

    /// Displacement of the window (mm) under pressure (MPa) on some of its cells, none elsewhere.
    pub(super) fn press(&mut self, cells: Cells<'_>, pressure: &[f32]) -> &[f32] {
        self.fill(cells, pressure);
        self.apply(self.rows);
        self.grid()
    }

    /// The same of the rows that pressure stands in; the others tell nothing.
    pub(super) fn press_rows(&mut self, cells: Cells<'_>, pressure: &[f32]) -> &[f32] {
        self.fill(cells, pressure);
        self.apply(self.pressed);
        self.grid()
    }

    fn fill(&mut self, cells: Cells<'_>, pressure: &[f32]) {
        let filled = self.pressed * self.columns;
        let grid = &mut self.grid()[..filled];
        grid.fill(0.0);
        for (cell, p) in cells.own.iter().zip(pressure) {
            grid[*cell as usize] = *p;
        }
        for [i, cell] in cells.images {
            if let Some(p) = pressure.get(*i as usize) {
                grid[*cell as usize] = *p;
            }
        }
    }

    /// Pressure to displacement of the first `wanted` rows. The window is periodic.
    fn apply(&mut self, wanted: usize) {
        let Self { plans, rows, columns, pressed, grid, waves, scratch, compliance, .. } = self;
        let (Some(along), Some(across)) = (plans.of(*columns), plans.of(*rows)) else { return };
        let transform = Grid { rows: across, columns: along };
        let waves = &mut waves[..*rows * transform.half()];
        transform.forward(grid, *pressed, waves, scratch);
        for (wave, compliance) in waves.iter_mut().zip(&*compliance) {
            *wave *= *compliance;
        }
        transform.back(waves, wanted, grid, scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layer::Layer;

    /// A wave moves as the table says; all else stays still.
    #[test]
    fn a_wave_of_pressure_moves_by_its_compliance() {
        let layers = [Layer { young_mpa: 0.1, poisson: 0.4, thickness_mm: 3.0 }];
        let surface = SurfaceCompliance::new(&layers);
        let mut convolution = Convolution::new(Arc::new(Plans::new()));
        // At steps of the table.
        let [across_mm, along_mm] = [-760.0, -850.0].map(|step| (step * PITCH_STEP).exp());
        convolution.open([44, 60], 48, [across_mm, along_mm], &surface);
        assert_eq!([convolution.rows(), convolution.columns()], [48, 64]);
        let phase = |i: usize| TAU * (3.0 * (i / 64) as f64 / 48.0 + 5.0 * (i % 64) as f64 / 64.0);
        for (i, p) in convolution.grid().iter_mut().enumerate() {
            *p = phase(i).cos() as f32;
        }
        convolution.apply(48);
        let k = (TAU * 3.0 / (48.0 * across_mm)).hypot(TAU * 5.0 / (64.0 * along_mm));
        for (i, u) in convolution.grid().iter().enumerate() {
            let due = surface.at(k) * phase(i).cos();
            assert!((f64::from(*u) - due).abs() < 1e-5 * surface.at(k), "{i}: {u} {due}");
        }
    }
}
