//! Fast Fourier transforms of real grids, with `rustfft` and `realfft`.
//!
//! Those two crates are generic over the kind of number, so the compiler translates them anew into
//! each crate that makes a plan, which takes it most of a minute. Here they are translated once, and
//! everybody else calls functions that are not generic.
//!
//! A [`Grid`] is `[rows][columns]` real numbers. Its waves lie turned, `[columns / 2 + 1][rows]`, so
//! that both transforms run along memory. Neither transform scales: there and back multiplies by the
//! number of cells.
//!
//! ```
//! use papilla_fft::{Grid, Line};
//!
//! let (rows, columns) = (Line::new(6), Line::new(8));
//! let grid = Grid { rows: &rows, columns: &columns };
//! let mut scratch = grid.scratch();
//! let mut waves = grid.waves();
//! let mut cells: Vec<f32> = (0..48).map(|i| i as f32).collect();
//! grid.forward(&mut cells, 6, &mut waves, &mut scratch);
//! assert_eq!(waves[0].re, 47.0 * 48.0 / 2.0);
//! grid.back(&mut waves, 6, &mut cells, &mut scratch);
//! assert!((cells[5] / 48.0 - 5.0).abs() < 1e-5);
//! ```

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};
use std::fmt;
use std::sync::Arc;

/// A complex number, the amplitude of a wave.
pub type Wave = rustfft::num_complex::Complex<f32>;

/// Transforms along lines of one length, as rows (of real numbers) or as columns (of waves).
#[derive(Clone)]
pub struct Line {
    length: usize,
    real: (Arc<dyn RealToComplex<f32>>, Arc<dyn ComplexToReal<f32>>),
    complex: (Arc<dyn Fft<f32>>, Arc<dyn Fft<f32>>),
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Line").field(&self.length).finish()
    }
}

impl Line {
    /// A plan for lines of this length.
    #[must_use]
    pub fn new(length: usize) -> Self {
        Self::planned(length, &mut RealFftPlanner::new(), &mut FftPlanner::new())
    }

    /// Plans for lines of these lengths; they share their tables.
    #[must_use]
    pub fn all(lengths: &[usize]) -> Vec<Self> {
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        lengths.iter().map(|length| Self::planned(*length, &mut real, &mut complex)).collect()
    }

    fn planned(
        length: usize,
        real: &mut RealFftPlanner<f32>,
        complex: &mut FftPlanner<f32>,
    ) -> Self {
        Self {
            length,
            real: (real.plan_fft_forward(length), real.plan_fft_inverse(length)),
            complex: (complex.plan_fft_forward(length), complex.plan_fft_inverse(length)),
        }
    }

    /// Numbers along the line.
    #[must_use]
    pub fn length(&self) -> usize {
        self.length
    }

    /// Waves that its transforms need as memory.
    #[must_use]
    pub fn scratch_len(&self) -> usize {
        let real = self.real.0.get_scratch_len().max(self.real.1.get_scratch_len());
        let [there, back] = [&self.complex.0, &self.complex.1].map(|c| c.get_inplace_scratch_len());
        real.max(there).max(back)
    }
}

/// Memory for the transforms of a [`Grid`], which allocate nothing.
pub struct Scratch {
    /// Waves before they are turned, `[rows][columns / 2 + 1]`.
    upright: Vec<Wave>,
    line: Vec<Wave>,
}

impl fmt::Debug for Scratch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scratch").field("waves", &self.upright.len()).finish()
    }
}

impl Scratch {
    /// For any grid whose rows and columns are among `lines`.
    #[must_use]
    pub fn of(lines: &[Line]) -> Self {
        let length = lines.iter().map(Line::length).max().unwrap_or(0);
        let line = lines.iter().map(Line::scratch_len).max().unwrap_or(0);
        let zero = Wave::new(0.0, 0.0);
        Self { upright: vec![zero; length * (length / 2 + 1)], line: vec![zero; line] }
    }
}

/// A real grid of as many rows as `rows` is long, each as long as `columns`.
#[derive(Clone, Copy, Debug)]
pub struct Grid<'a> {
    /// Along a column.
    pub rows: &'a Line,
    /// Along a row.
    pub columns: &'a Line,
}

impl Grid<'_> {
    /// Waves of a row of real numbers: the others are their conjugates.
    #[must_use]
    pub fn half(&self) -> usize {
        self.columns.length / 2 + 1
    }

    /// Memory for its waves.
    #[must_use]
    pub fn waves(&self) -> Vec<Wave> {
        vec![Wave::new(0.0, 0.0); self.rows.length * self.half()]
    }

    /// Memory for its transforms.
    #[must_use]
    pub fn scratch(&self) -> Scratch {
        let line = self.rows.scratch_len().max(self.columns.scratch_len());
        Scratch { upright: self.waves(), line: vec![Wave::new(0.0, 0.0); line] }
    }

    /// From `cells`, which it overwrites, to `waves`, `[columns / 2 + 1][rows]`. Only the first
    /// `filled` rows are read; the others are taken to be zero.
    ///
    /// # Panics
    /// If the memory is not the grid's.
    pub fn forward(
        &self,
        cells: &mut [f32],
        filled: usize,
        waves: &mut [Wave],
        scratch: &mut Scratch,
    ) {
        let (columns, half) = (self.columns.length, self.half());
        let upright = &mut scratch.upright[..self.rows.length * half];
        let filled_cells = &mut cells[..filled * columns];
        // Lengths are those of the plan, so nothing here can be refused.
        for (row, to) in filled_cells.chunks_exact_mut(columns).zip(upright.chunks_exact_mut(half))
        {
            _ = self.columns.real.0.process_with_scratch(row, to, &mut scratch.line);
        }
        upright[filled * half..].fill(Wave::new(0.0, 0.0));
        turn(upright, half, waves);
        self.rows.complex.0.process_with_scratch(waves, &mut scratch.line);
    }

    /// From `waves`, which it overwrites, to the first `wanted` rows of `cells`.
    ///
    /// # Panics
    /// If the memory is not the grid's.
    pub fn back(
        &self,
        waves: &mut [Wave],
        wanted: usize,
        cells: &mut [f32],
        scratch: &mut Scratch,
    ) {
        let (columns, half) = (self.columns.length, self.half());
        let upright = &mut scratch.upright[..self.rows.length * half];
        self.rows.complex.1.process_with_scratch(waves, &mut scratch.line);
        turn(waves, self.rows.length, upright);
        let wanted_cells = &mut cells[..wanted * columns];
        for (row, from) in
            wanted_cells.chunks_exact_mut(columns).zip(upright.chunks_exact_mut(half))
        {
            // Rounding leaves a trace in the two waves that are real; `realfft` refuses it.
            from[0].im = 0.0;
            from[half - 1].im = 0.0;
            _ = self.columns.real.1.process_with_scratch(from, row, &mut scratch.line);
        }
    }
}

/// Transposes lines of `length`, some lines at once so that both sides are read and written along.
fn turn(from: &[Wave], length: usize, to: &mut [Wave]) {
    const TOGETHER: usize = 8;
    let lines = from.len() / length;
    for first in (0..lines).step_by(TOGETHER) {
        let last = (first + TOGETHER).min(lines);
        for column in 0..length {
            for (line, to) in (first..last).zip(&mut to[column * lines + first..]) {
                *to = from[line * length + column];
            }
        }
    }
}
