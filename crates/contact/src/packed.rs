//! Stores compliance in few bytes: whole steps, predicted from neighbours, with residuals that
//! mostly take one byte.
//!
//! The displacement of a vertex differs little from that of its neighbour, and from that under a
//! force at the next vertex. Each vertex i has a parent p(i), the nearest one of those before it.
//! Of the steps `q` the file holds `q[i][k] - q[p(i)][k] - q[i][p(k)] + q[p(i)][p(k)]`, a mixed
//! second difference, from which the steps are found again exactly.

use std::io::{self, Read};

/// Most steps of an entry: they and their differences are exact in f32.
pub(crate) const STEPS_MAX: f32 = 4_194_304.0;
/// Bytes of the longest residual, 7 bits each: four times [`STEPS_MAX`], and a sign.
const RESIDUAL_BYTES_MAX: u32 = 4;

/// The nearest vertex before each; the first one's is itself.
pub(crate) fn parents(positions_mm: &[f32]) -> Vec<u32> {
    let places = positions_mm.as_chunks::<3>().0;
    let nearest = |v: usize| {
        let away =
            |p: &usize| -> f32 { (0..3).map(|i| (places[*p][i] - places[v][i]).powi(2)).sum() };
        (0..v).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(v) as u32
    };
    (0..places.len()).map(nearest).collect()
}

/// The upper triangle of a symmetric matrix, row by row, and how its entries tell of each other.
struct Triangle {
    /// Where column 0 of each row would lie.
    rows: Vec<usize>,
    /// The same component of the parent; none of the first vertex.
    parents: Vec<Option<usize>>,
}

impl Triangle {
    fn of(parents: &[u32]) -> Self {
        let size = 3 * parents.len();
        let parent = |i: usize| {
            let (vertex, parent) = (i / 3, parents[i / 3] as usize);
            (parent < vertex).then_some(3 * parent + i % 3)
        };
        Self {
            rows: (0..size).map(|i| i * (2 * size - i + 1) / 2 - i).collect(),
            parents: (0..size).map(parent).collect(),
        }
    }

    /// Rows and columns of the entries, in their order.
    fn entries(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let size = self.rows.len();
        (0..size).flat_map(move |i| (i..size).map(move |k| [i, k]))
    }

    /// What the entries before one say of it.
    fn told(&self, steps: &[f32], [i, k]: [usize; 2]) -> i32 {
        let of = |i: Option<usize>, k: Option<usize>| match (i, k) {
            (Some(i), Some(k)) => steps[self.rows[i.min(k)] + i.max(k)] as i32,
            _ => 0,
        };
        let (above, left) = (self.parents[i], self.parents[k]);
        of(above, Some(k)) + of(Some(i), left) - of(above, left)
    }
}

/// Appends the residuals of an upper triangle in whole steps.
pub(crate) fn write(steps: &[f32], parents: &[u32], bytes: &mut Vec<u8>) {
    let triangle = Triangle::of(parents);
    for (step, entry) in steps.iter().zip(triangle.entries()) {
        let residual = *step as i32 - triangle.told(steps, entry);
        // The sign last, so that what is small is short.
        let mut rest = ((residual << 1) ^ (residual >> 31)) as u32;
        while rest > 127 {
            bytes.push(rest as u8 | 128);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
}

/// Reads what [`write`] wrote.
///
/// # Errors
/// The bytes end, or are not of steps.
pub(crate) fn read(parents: &[u32], bytes: &mut impl Read) -> io::Result<Vec<f32>> {
    let triangle = Triangle::of(parents);
    let size = triangle.rows.len();
    let mut steps = vec![0.0; size * (size + 1) / 2];
    for (at, entry) in triangle.entries().enumerate() {
        let mut rest = 0;
        for place in 0..RESIDUAL_BYTES_MAX {
            let mut byte = [0];
            bytes.read_exact(&mut byte)?;
            rest |= u32::from(byte[0] & 127) << (7 * place);
            if byte[0] < 128 {
                break;
            }
        }
        let residual = (rest >> 1) as i32 ^ -((rest & 1) as i32);
        let step = (triangle.told(&steps, entry) + residual) as f32;
        if step.abs() > STEPS_MAX {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "a step that none can be"));
        }
        steps[at] = step;
    }
    Ok(steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places that are not in order, and every size of residual up to the greatest.
    #[test]
    fn steps_come_back_and_damage_is_told() {
        let mut random = fastrand::Rng::with_seed(7);
        let positions: Vec<f32> = (0..3 * 9).map(|_| random.f32()).collect();
        let parents = parents(&positions);
        assert!(parents.iter().enumerate().all(|(v, p)| (*p as usize) < v || v == 0));
        let size = 3 * parents.len();
        for most in [1.0, 60.0, 1e4, STEPS_MAX] {
            let step = |_| (most * (2.0 * random.f32() - 1.0)).round();
            let steps: Vec<f32> = (0..size * (size + 1) / 2).map(step).collect();
            let mut bytes = Vec::new();
            write(&steps, &parents, &mut bytes);
            assert_eq!(read(&parents, &mut &bytes[..]).expect("steps"), steps);
            assert!(read(&parents, &mut &bytes[..bytes.len() - 1]).is_err(), "cut");
            assert!(read(&parents, &mut &[255; 4000][..]).is_err(), "too far");
        }
    }

    /// What is smooth takes a byte an entry.
    #[test]
    fn neighbours_tell_of_each_other() {
        let positions: Vec<f32> = (0..40).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
        let parents = parents(&positions);
        let triangle = Triangle::of(&parents);
        let smooth = |[i, k]: [usize; 2]| (1e4 / (1.0 + (i / 3).abs_diff(k / 3) as f32)).round();
        let steps: Vec<f32> = triangle.entries().map(smooth).collect();
        let mut bytes = Vec::new();
        write(&steps, &parents, &mut bytes);
        assert!(steps.iter().all(|s| *s > 128.0), "alone each takes two bytes or more");
        assert!(bytes.len() < 3 * steps.len() / 2, "{} for {}", bytes.len(), steps.len());
    }
}
