//! The compliance between the vertices of a finger, stored so that neighbours are close in memory.

use crate::error::ModelError;

/// Vertices of a tile's side.
pub(crate) const TILE: usize = 8;
/// Values of a tile.
pub(crate) const TILE_LEN: usize = 9 * TILE * TILE;

/// Compliance by tiles of [`TILE`] vertices that push and as many that move:
/// `[tile][tile][3 b + a][pushing][moving]` is the displacement along `a` under a force along `b`,
/// mm/N. A few vertices that push a few others so need a few stretches of memory.
#[derive(Debug)]
pub(crate) struct Compliance {
    tiles: Tiles,
    side: usize,
    /// Place of each vertex.
    rank: Vec<u32>,
}

/// The values of all tiles.
#[derive(Debug)]
pub(crate) enum Tiles {
    /// In mm/N.
    Values(Vec<f32>),
    /// In whole steps of so many mm/N, as a file has them: in half the memory the same values, to
    /// the bit.
    Steps { steps: Vec<i16>, mm_per_n: f32 },
}

impl Tiles {
    /// The value at a place, mm/N.
    fn value(&self, at: usize) -> f32 {
        match self {
            Self::Values(values) => values[at],
            Self::Steps { steps, mm_per_n } => f32::from(steps[at]) * mm_per_n,
        }
    }
}

impl Compliance {
    /// Of a packed upper triangle (mm/N); vertices stand in the order of `rank`. If all values are
    /// whole multiples of `step_mm_per_n`, small enough for 16 bits, they are stored as such.
    pub(crate) fn unpacked(
        packed: &[f32],
        rank: Vec<u32>,
        step_mm_per_n: f32,
    ) -> Result<Self, ModelError> {
        let size = 3 * rank.len();
        let mut diagonal = 0;
        for index in 0..size {
            let value = packed.get(diagonal).copied().unwrap_or_default();
            if !(value >= 0.0) {
                let (array, rule) =
                    ("compliance_mm_per_n", "a force cannot pull its own point back");
                return Err(ModelError::Value { array, index, value: f64::from(value), rule });
            }
            diagonal += size - index;
        }
        let side = rank.len().div_ceil(TILE);
        let steps = |value: f32| (value / step_mm_per_n).round() as i16;
        let is_whole =
            |value: &f32| (f32::from(steps(*value)) * step_mm_per_n).to_bits() == value.to_bits();
        let tiles = if step_mm_per_n > 0.0 && packed.iter().all(is_whole) {
            let steps = tiled(packed, &rank, side, steps);
            Tiles::Steps { steps, mm_per_n: step_mm_per_n }
        } else {
            Tiles::Values(tiled(packed, &rank, side, |value| value))
        };
        Ok(Self { tiles, side, rank })
    }

    /// Displacement of a vertex under forces on another one: `[3 a + b]` along `a` under a force
    /// along `b`, mm/N.
    pub(crate) fn pair(&self, moving: usize, pushing: usize) -> [f32; 9] {
        // What pushes and what moves may change places, and then neighbours of what pushes
        // share lines of a cache.
        let first = first(&self.rank, self.side, [moving, pushing]);
        std::array::from_fn(|pair| self.tiles.value(first + pair * TILE * TILE))
    }

    /// Tiles of a side.
    pub(crate) fn side(&self) -> usize {
        self.side
    }

    /// All tiles.
    pub(crate) fn tiles(&self) -> &Tiles {
        &self.tiles
    }

    /// Tile of a vertex, and its place there.
    pub(crate) fn place(&self, vertex: usize) -> [usize; 2] {
        let rank = self.rank[vertex] as usize;
        [rank / TILE, rank % TILE]
    }
}

/// Where the first component pair of two vertices, one that pushes and one that moves, lies; the
/// others follow by `TILE^2`.
fn first(rank: &[u32], side: usize, vertices: [usize; 2]) -> usize {
    let [p, m] = vertices.map(|vertex| rank[vertex] as usize);
    (p / TILE * side + m / TILE) * TILE_LEN + p % TILE * TILE + m % TILE
}

/// Both triangles of a packed upper one, tile by tile.
fn tiled<T: Copy + Default>(
    packed: &[f32],
    rank: &[u32],
    side: usize,
    stored: impl Fn(f32) -> T,
) -> Vec<T> {
    let size = 3 * rank.len();
    let mut tiles = vec![T::default(); side * side * TILE_LEN];
    let entries = (0..size).flat_map(|i| (i..size).map(move |k| [i, k]));
    for ([i, k], value) in entries.zip(packed) {
        let value = stored(*value);
        for [i, k] in [[i, k], [k, i]] {
            let pair = 3 * (i % 3) + k % 3;
            tiles[first(rank, side, [i / 3, k / 3]) + pair * TILE * TILE] = value;
        }
    }
    tiles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{DisplaceTiles, Vectors, run};

    /// A step of a file.
    const STEP_MM_PER_N: f32 = 0.0078;

    /// Vertices that fill no whole number of tiles, in an order of their own; whole steps, or not.
    fn random(v: usize, is_whole: bool) -> (Vec<Vec<f32>>, Compliance) {
        let mut random = fastrand::Rng::with_seed(7);
        let mut full = vec![vec![0.0; 3 * v]; 3 * v];
        let mut packed = Vec::new();
        for i in 0..3 * v {
            for k in i..3 * v {
                let value = match is_whole {
                    true => random.u32(0..=i16::MAX as u32) as f32 * STEP_MM_PER_N,
                    false => random.f32(),
                };
                (full[i][k], full[k][i]) = (value, value);
                packed.push(value);
            }
        }
        let mut rank: Vec<u32> = (0..v as u32).collect();
        random.shuffle(&mut rank);
        let compliance = Compliance::unpacked(&packed, rank, STEP_MM_PER_N).expect("a compliance");
        assert_eq!(matches!(compliance.tiles, Tiles::Steps { .. }), is_whole);
        (full, compliance)
    }

    #[test]
    fn a_pair_is_what_the_triangle_holds() {
        for (full, compliance) in [random(19, false), random(19, true)] {
            for moving in 0..19 {
                for pushing in 0..19 {
                    let pair = compliance.pair(moving, pushing);
                    for (at, value) in pair.into_iter().enumerate() {
                        let due: f32 = full[3 * moving + at / 3][3 * pushing + at % 3];
                        assert_eq!(value.to_bits(), due.to_bits(), "{moving} {pushing} {at}");
                    }
                }
            }
        }
    }

    /// The displacement of 19 vertices under three forces, by tiles.
    fn moved(compliance: &Compliance, forces: &[(usize, usize, f32)]) -> Vec<f32> {
        let tiles = compliance.side();
        let (mut force, mut moved) =
            (vec![Vectors::default(); tiles], vec![Vectors::default(); tiles]);
        for (vertex, component, value) in forces {
            let [tile, at] = compliance.place(*vertex);
            force[tile][*component][at] = *value;
        }
        let all: Vec<u32> = (0..tiles as u32).collect();
        let [pushing, moving] = [&all[..], &all[..]];
        run(DisplaceTiles { compliance, pushing, force: &force, moving, moved: &mut moved[..] });
        let of = |i: usize| {
            let [tile, at] = compliance.place(i / 3);
            moved[tile][i % 3][at]
        };
        (0..57).map(of).collect()
    }

    #[test]
    fn tiles_move_as_the_whole_matrix_does() {
        let forces = [(3, 0, 0.5), (11, 2, -1.5), (18, 1, 2.0)];
        for (full, compliance) in [random(19, false), random(19, true)] {
            for (row, found) in full.iter().zip(moved(&compliance, &forces)) {
                let due: f32 =
                    forces.iter().map(|(vertex, i, force)| row[3 * vertex + i] * force).sum();
                assert!((found - due).abs() <= 1e-5 * due.abs().max(1.0), "{found} {due}");
            }
        }
    }

    /// How values are stored shows in no bit of an answer.
    #[test]
    fn steps_move_as_their_values_do() {
        let (_, steps) = random(19, true);
        let count = steps.side * steps.side * TILE_LEN;
        let values = (0..count).map(|at| steps.tiles.value(at)).collect();
        let values =
            Compliance { tiles: Tiles::Values(values), side: steps.side, rank: steps.rank.clone() };
        let forces = [(0, 1, 0.3), (7, 2, -1.7), (12, 0, 2.1), (18, 2, 0.01)];
        let bits = |of: &Compliance| moved(of, &forces).into_iter().map(f32::to_bits);
        assert!(bits(&steps).eq(bits(&values)));
    }
}
