//! How the vertices of a finger move each other, neighbours beside each other in memory.

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
