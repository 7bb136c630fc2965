//! Transforms against their definition, and there and back.

use papilla_fft::{Grid, Line, Scratch, Wave};
use std::f64::consts::TAU;

fn cells(count: usize) -> Vec<f32> {
    (0..count).map(|i| ((i * i) as f32 * 0.37).sin()).collect()
}

/// `sum over cells of f exp(-2 pi i (r m / rows + c n / columns))`, in double precision.
fn by_definition(f: &[f32], [rows, columns]: [usize; 2], [m, n]: [usize; 2]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (i, f) in f.iter().enumerate() {
        let (r, c) = (i / columns, i % columns);
        let angle = -TAU * ((r * m) as f64 / rows as f64 + (c * n) as f64 / columns as f64);
        sum[0] += f64::from(*f) * angle.cos();
        sum[1] += f64::from(*f) * angle.sin();
    }
    sum
}

#[test]
fn waves_are_those_of_the_definition_and_lead_back() {
    let all = Line::all(&[16, 20, 48]);
    let mut scratch = Scratch::of(&all);
    for rows in &all {
        for columns in &all {
            let grid = Grid { rows, columns };
            let shape = [rows.length(), columns.length()];
            let count = shape[0] * shape[1];
            let given = cells(count);
            let (mut held, mut waves) = (given.clone(), grid.waves());
            grid.forward(&mut held, shape[0], &mut waves, &mut scratch);
            let tolerance = 1e-5 * count as f64;
            for wave in [[0, 0], [3, 5], [shape[0] - 1, 1], [shape[0] / 2, shape[1] / 2]] {
                let due = by_definition(&given, shape, wave);
                let Wave { re, im } = waves[wave[1] * shape[0] + wave[0]];
                assert!((f64::from(re) - due[0]).abs() < tolerance, "{shape:?} {wave:?}");
                assert!((f64::from(im) - due[1]).abs() < tolerance, "{shape:?} {wave:?}");
            }
            grid.back(&mut waves, shape[0], &mut held, &mut scratch);
            for (back, given) in held.iter().zip(&given) {
                assert!((back / count as f32 - given).abs() < 1e-5, "{shape:?}");
            }
        }
    }
}

/// What lies below the filled rows is neither read nor asked for.
#[test]
fn rows_beyond_the_filled_ones_are_zero() {
    let (rows, columns) = (Line::new(20), Line::new(16));
    let grid = Grid { rows: &rows, columns: &columns };
    let mut scratch = grid.scratch();
    let (mut part, mut whole) = (vec![f32::NAN; 320], vec![0.0; 320]);
    part[..7 * 16].copy_from_slice(&cells(7 * 16));
    whole[..7 * 16].copy_from_slice(&cells(7 * 16));
    let (mut from_part, mut from_whole) = (grid.waves(), grid.waves());
    grid.forward(&mut part, 7, &mut from_part, &mut scratch);
    grid.forward(&mut whole, 20, &mut from_whole, &mut scratch);
    assert_eq!(from_part, from_whole);
    let mut few = vec![f32::NAN; 320];
    grid.back(&mut from_part, 3, &mut few, &mut scratch);
    assert!(few[..48].iter().all(|v| v.is_finite()) && few[48..].iter().all(|v| v.is_nan()));
}
