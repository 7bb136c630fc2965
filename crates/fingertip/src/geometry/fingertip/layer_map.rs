//! How thick a layer of the skin is, over the template's (u, v).
//!
//! A map has [`ROWS`] rows from v = 0 (the tip's pole) to v = 2 (the base plane), and [`COLUMNS`] columns
//! once round the finger, from u = 0 (the palmar line). Between them lies the same spline as of a
//! [`super::SkinOffset`], whose control values they are: so what is finer than 2 mm is smoothed.

use super::SurfaceParameter;
use super::offset::{COLUMNS, ROWS, SkinOffset, weights};

/// Thickness of a layer, mm, `[row along v][column along u]`.
#[derive(Clone, Debug)]
pub struct LayerMap {
    /// As they were given.
    mm: Vec<Vec<f64>>,
    /// Without harmonics that a row near the pole cannot have.
    control: Vec<Vec<f64>>,
}

impl PartialEq for LayerMap {
    fn eq(&self, other: &Self) -> bool {
        self.mm == other.mm
    }
}

/// Why a map was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayerMapError {
    /// Another number of rows.
    #[error(
        "a map of a layer has {ROWS} rows from v = 0 at the tip to v = 2 at the end, this one has {0}"
    )]
    Rows(usize),
    /// A row of another length.
    #[error(
        "a row of a layer's map has {COLUMNS} numbers once round the finger, from u = 0 in the middle of the pad: \
         row {row} has {found}"
    )]
    Columns {
        /// From 1.
        row: usize,
        /// Its numbers.
        found: usize,
    },
    /// No number.
    #[error("line {line}: '{text}' is not a number of mm")]
    Number {
        /// From 1.
        line: usize,
        /// What stands there.
        text: String,
    },
}

impl LayerMap {
    /// From its rows.
    ///
    /// # Errors
    /// [`LayerMapError`] if their number or length is another one.
    pub fn new(mm: Vec<Vec<f64>>) -> Result<Self, LayerMapError> {
        if mm.len() != ROWS {
            return Err(LayerMapError::Rows(mm.len()));
        }
        if let Some(row) = mm.iter().position(|row| row.len() != COLUMNS) {
            return Err(LayerMapError::Columns { row: row + 1, found: mm[row].len() });
        }
        let control = SkinOffset::smooth(mm.clone()).offset_mm;
        Ok(Self { mm, control })
    }

    /// From lines of numbers with commas between them; empty lines and those that begin with # do
    /// not count.
    ///
    /// # Errors
    /// [`LayerMapError`] names the line.
    pub fn from_csv(text: &str) -> Result<Self, LayerMapError> {
        let mut rows = Vec::new();
        for (k, line) in text.lines().enumerate() {
            let line_of_numbers = line.trim();
            if line_of_numbers.is_empty() || line_of_numbers.starts_with('#') {
                continue;
            }
            let number = |text: &str| {
                let failed = || LayerMapError::Number { line: k + 1, text: text.trim().to_owned() };
                text.trim().parse::<f64>().map_err(|_| failed())
            };
            rows.push(line_of_numbers.split(',').map(number).collect::<Result<Vec<f64>, _>>()?);
        }
        Self::new(rows)
    }

    /// Its rows, mm.
    #[must_use]
    pub fn rows_mm(&self) -> &[Vec<f64>] {
        &self.mm
    }

    /// The thickness below a point of the skin, mm.
    #[must_use]
    pub fn at(&self, s: SurfaceParameter) -> f64 {
        weights(s).iter().map(|&(row, column, w)| w * self.control[row][column]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::fingertip::FingertipShape;
    use crate::geometry::fingertip::offset::at_uv;
    use std::sync::Arc;

    fn shaped(dermis: impl Fn(usize, usize) -> f64) -> FingertipShape {
        let row = |i: usize| (0..COLUMNS).map(|j| dermis(i, j)).collect();
        let map = LayerMap::new((0..ROWS).map(row).collect()).unwrap();
        FingertipShape { dermis_map: Some(Arc::new(map)), ..FingertipShape::default() }
    }

    #[test]
    fn a_map_of_one_number_is_that_number() {
        let (mapped, plain) = (shaped(|_, _| 1.0), FingertipShape::default());
        for uv in [[0.0, 0.0], [0.1, 0.5], [0.97, 1.3], [0.4, 2.0]] {
            let (a, b) = (mapped.layers(at_uv(uv)).unwrap(), plain.layers(at_uv(uv)).unwrap());
            for (p, q) in a.iter().flatten().zip(b.iter().flatten()) {
                assert!((p - q).abs() < 1e-12, "{uv:?}: {p} {q}");
            }
        }
    }

    #[test]
    fn the_dermis_is_as_thick_as_its_map_says() {
        // Thicker towards one side of the pad.
        let turn = |j: usize| std::f64::consts::TAU * j as f64 / COLUMNS as f64;
        let shape = shaped(|i, j| 0.9 + if i > 2 { 0.2 * turn(j).sin() } else { 0.0 });
        let thickness = |uv: [f64; 2]| {
            let [_, top, below, _] = shape.layers(at_uv(uv)).unwrap();
            (0..3).map(|i| (top[i] - below[i]).powi(2)).sum::<f64>().sqrt()
        };
        // The spline takes 1.2 % off a wave that goes once round.
        for (u, due) in [(0.0, 0.9), (0.1, 1.0162), (0.9, 0.7838)] {
            assert!((thickness([u, 1.0]) - due).abs() < 1e-3, "{u}: {}", thickness([u, 1.0]));
        }
        shape.validate_layers().unwrap();
    }

    #[test]
    fn a_map_that_leaves_no_fat_is_refused_where_it_does() {
        let shape = shaped(|i, j| if i == 11 && j == 2 { 9.0 } else { 1.0 });
        let e = shape.validate_layers().unwrap_err().to_string();
        assert!(e.contains("epidermis and dermis are") && e.contains("they may take"), "{e}");
        // Row 11 is v = 1.375, behind the thickest section at x = 11.25.
        let x: f64 = e.split("x = ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
        assert!((13.0..19.5).contains(&x), "{e}");
    }

    #[test]
    fn another_shape_is_refused() {
        assert_eq!(LayerMap::new(vec![vec![0.2; COLUMNS]; 3]), Err(LayerMapError::Rows(3)));
        let mut rows = vec![vec![0.2; COLUMNS]; ROWS];
        rows[4].pop();
        assert_eq!(LayerMap::new(rows), Err(LayerMapError::Columns { row: 5, found: COLUMNS - 1 }));
        let line = format!("{}0.2\n", "0.2, ".repeat(COLUMNS - 1));
        let text = format!("# v = 0 first\n\n{}", line.repeat(ROWS));
        assert_eq!(LayerMap::from_csv(&text).unwrap().rows_mm(), vec![vec![0.2; COLUMNS]; ROWS]);
        let e = LayerMap::from_csv("0.2, thin\n").unwrap_err().to_string();
        assert!(e.contains("line 1: 'thin'"), "{e}");
    }
}
