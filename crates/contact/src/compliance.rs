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
    tiles: Vec<f32>,
    side: usize,
    /// Place of each vertex.
    rank: Vec<u32>,
}

impl Compliance {
    /// Of a packed upper triangle; vertices stand in the order of `rank`.
    pub(crate) fn unpacked(packed: &[f32], rank: Vec<u32>) -> Result<Self, ModelError> {
        let (v, side) = (rank.len(), rank.len().div_ceil(TILE));
        let mut built = Self { tiles: vec![0.0; side * side * TILE_LEN], side, rank };
        let mut values = packed.iter();
        for i in 0..3 * v {
            for k in i..3 * v {
                let &value = values.next().unwrap_or(&0.0);
                if i == k && !(value >= 0.0) {
                    let (array, index, rule) =
                        ("compliance_mm_per_n", i, "a force cannot pull its own point back");
                    return Err(ModelError::Value { array, index, value: f64::from(value), rule });
                }
                for [i, k] in [[i, k], [k, i]] {
                    let at = built.first(i / 3, k / 3) + 3 * (i % 3) * TILE * TILE;
                    built.tiles[at + (k % 3) * TILE * TILE] = value;
                }
            }
        }
        Ok(built)
    }

    /// Where the first component pair of two vertices lies; the others follow by `TILE^2`.
    fn first(&self, pushing: usize, moving: usize) -> usize {
        let [p, m] = [pushing, moving].map(|vertex| self.rank[vertex] as usize);
        (p / TILE * self.side + m / TILE) * TILE_LEN + p % TILE * TILE + m % TILE
    }

    /// Displacement of a vertex under forces on another one: `[3 a + b]` along `a` under a force
    /// along `b`, mm/N.
    pub(crate) fn pair(&self, moving: usize, pushing: usize) -> [f32; 9] {
        // What pushes and what moves may change places, and then neighbours of what pushes
        // share lines of a cache.
        let first = self.first(moving, pushing);
        std::array::from_fn(|pair| self.tiles[first + pair * TILE * TILE])
    }

    /// Tiles of a side.
    pub(crate) fn side(&self) -> usize {
        self.side
    }

    /// All tiles.
    pub(crate) fn tiles(&self) -> &[f32] {
        &self.tiles
    }

    /// Tile of a vertex, and its place there.
    pub(crate) fn place(&self, vertex: usize) -> [usize; 2] {
        let rank = self.rank[vertex] as usize;
        [rank / TILE, rank % TILE]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{DisplaceTiles, Vectors, run};

    /// Vertices that fill no whole number of tiles, in an order of their own.
    fn random(v: usize) -> (Vec<Vec<f32>>, Compliance) {
        let mut random = fastrand::Rng::with_seed(7);
        let mut full = vec![vec![0.0; 3 * v]; 3 * v];
        let mut packed = Vec::new();
        for i in 0..3 * v {
            for k in i..3 * v {
                let value = random.f32();
                (full[i][k], full[k][i]) = (value, value);
                packed.push(value);
            }
        }
        let mut rank: Vec<u32> = (0..v as u32).collect();
        random.shuffle(&mut rank);
        (full, Compliance::unpacked(&packed, rank).expect("a compliance"))
    }

    #[test]
    fn a_pair_is_what_the_triangle_holds() {
        let (full, compliance) = random(19);
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

    #[test]
    fn tiles_move_as_the_whole_matrix_does() {
        let (full, compliance) = random(19);
        let tiles = compliance.side();
        let (mut force, mut moved) =
            (vec![Vectors::default(); tiles], vec![Vectors::default(); tiles]);
        let mut flat = vec![0.0f32; 57];
        for (vertex, component, value) in [(3, 0, 0.5), (11, 2, -1.5), (18, 1, 2.0)] {
            let [tile, at] = compliance.place(vertex);
            force[tile][component][at] = value;
            flat[3 * vertex + component] = value;
        }
        let all: Vec<u32> = (0..tiles as u32).collect();
        let [pushing, moving] = [&all[..], &all[..]];
        let (compliance, moved) = (&compliance, &mut moved[..]);
        run(DisplaceTiles { compliance, pushing, force: &force, moving, moved: &mut *moved });
        for vertex in 0..19 {
            let [tile, at] = compliance.place(vertex);
            for component in 0..3 {
                let row = &full[3 * vertex + component];
                let due: f32 = row.iter().zip(&flat).map(|(c, f)| c * f).sum();
                let found = moved[tile][component][at];
                assert!((found - due).abs() <= 1e-5 * due.abs().max(1.0), "{found} {due}");
            }
        }
    }
}
