//! Maps of a shard's values: drawn from the atlas' vertices, or read off the cells of its mesh.

use super::{Cells, DatasetError};
use ndarray::{Ix1, Ix2};
use papilla_atlas::{Atlas, AtlasError, Patch, Raster};
use papilla_output::OutputError;
use papilla_output::npz::NpzArrays;
use std::collections::HashMap;
use std::path::Path;

/// Where the pixels of both patches lie among vertices and, in a dataset of meshes that
/// differ, on the lattice of their cells.
#[derive(Debug)]
pub struct Maps {
    skin: Pixels,
    interface: Pixels,
}

#[derive(Debug)]
struct Pixels {
    raster: Raster,
    /// Side, row and column of each pixel of the raster; empty where all values are at vertices.
    place: Vec<(u32, [f64; 2])>,
}

impl Maps {
    /// For the maps of the dataset in `folder`, which is of this atlas. One without a `raster.npz` has
    /// all its values at vertices.
    ///
    /// # Errors
    /// [`DatasetError::Output`] where `raster.npz` cannot be read.
    pub fn read(folder: &Path, atlas: &Atlas) -> Result<Self, DatasetError> {
        let path = folder.join("raster.npz");
        if !path.exists() {
            let at_vertices =
                |patch| Pixels { raster: Raster::new(atlas, patch), place: Vec::new() };
            let [skin, interface] = Patch::ALL.map(at_vertices);
            return Ok(Self { skin, interface });
        }
        let bytes = std::fs::read(&path).map_err(OutputError::io("read", &path))?;
        let mut npz = NpzArrays::new(&path, &bytes)?;
        let mut pixels = |patch: Patch| -> Result<Pixels, DatasetError> {
            let raster = Raster::new(atlas, patch);
            let name = |part: &str| format!("{}_{part}", patch.name());
            let mut place = Vec::new();
            if npz.has(&name("side"))? {
                let sides = npz.get::<u32, Ix1>(&name("side"))?;
                let rows = npz.get::<f32, Ix2>(&name("place"))?;
                let at = rows.outer_iter().map(|p| [f64::from(p[0]), f64::from(p[1])]);
                place = sides.iter().copied().zip(at).collect();
                if place.len() != raster.pixel_count() {
                    return Err(OutputError::malformed(&path, &"places are not the pixels'").into());
                }
            }
            Ok(Pixels { raster, place })
        };
        Ok(Self { skin: pixels(Patch::Skin)?, interface: pixels(Patch::Interface)? })
    }

    /// The raster of a patch.
    #[must_use]
    pub const fn raster(&self, patch: Patch) -> &Raster {
        &self.of_patch(patch).raster
    }

    const fn of_patch(&self, patch: Patch) -> &Pixels {
        match patch {
            Patch::Skin => &self.skin,
            Patch::Interface => &self.interface,
        }
    }

    /// How maps of a patch are drawn from the values of a shard with these cells.
    ///
    /// # Errors
    /// [`DatasetError::Output`] where a pixel lies in no cell.
    pub fn reader(
        &self,
        patch: Patch,
        cells: Option<&Cells>,
    ) -> Result<MapReader<'_>, DatasetError> {
        let Pixels { raster, place } = self.of_patch(patch);
        let Some(cells) = cells else { return Ok(MapReader { raster, nodes: Vec::new() }) };
        let functions = match patch {
            Patch::Skin => hats,
            Patch::Interface => quadratics,
        };
        let found = Finder::new(cells);
        let lost = || OutputError::malformed("raster.npz".as_ref(), &"a pixel lies in no cell");
        let node = |&(side, at): &(u32, [f64; 2])| {
            let (cell, [r, s]) = found.cell(side, at).ok_or_else(lost)?;
            let (r, s) = (functions(r), functions(s));
            let weights = std::array::from_fn(|n| (r[n / 3] * s[n % 3]) as f32);
            Ok((cells.nodes[cell], weights))
        };
        if place.len() != raster.pixel_count() {
            return Err(lost().into());
        }
        let nodes = place.iter().map(node).collect::<Result<_, OutputError>>()?;
        Ok(MapReader { raster, nodes })
    }
}

/// Draws maps of one patch from the values of one shard.
pub struct MapReader<'a> {
    raster: &'a Raster,
    /// Nodes and weights of each pixel; empty where values are at the atlas' vertices.
    nodes: Vec<([u32; 9], [f32; 9])>,
}

impl MapReader<'_> {
    /// True inside the patch.
    #[must_use]
    pub fn mask(&self) -> &[bool] {
        self.raster.mask()
    }

    /// Overwrites a map of 224 x 224; 0 outside the patch. Where a quadratic overshoots, never
    /// negative.
    ///
    /// # Errors
    /// [`AtlasError::BufferLength`] if there are not as many values as vertices.
    ///
    /// # Panics
    /// If there are fewer values than nodes of the cells.
    pub fn draw(&self, values: &[f32], map: &mut [f32]) -> Result<(), AtlasError> {
        if self.nodes.is_empty() {
            return self.raster.rasterise(values, map);
        }
        map.fill(0.0);
        for (&at, (nodes, weights)) in self.raster.indices().iter().zip(&self.nodes) {
            let sum: f32 = nodes.iter().zip(weights).map(|(n, w)| w * values[*n as usize]).sum();
            map[at as usize] = sum.max(0.0);
        }
        Ok(())
    }
}

/// Finds the cell of a place: cells begin at multiples of their sizes.
struct Finder {
    sizes: Vec<[u32; 2]>,
    cells: HashMap<[u32; 5], usize>,
}

impl Finder {
    fn new(cells: &Cells) -> Self {
        let mut sizes: Vec<[u32; 2]> = cells.place.iter().map(|p| [p[3], p[4]]).collect();
        sizes.sort_unstable();
        sizes.dedup();
        Self { sizes, cells: cells.place.iter().enumerate().map(|(n, p)| (*p, n)).collect() }
    }

    /// A cell, and where along its rows and columns, -1 to 1.
    fn cell(&self, side: u32, [row, column]: [f64; 2]) -> Option<(usize, [f64; 2])> {
        // A place on the last row or column belongs to the cell before it.
        const BEFORE: f64 = 1e-3;
        for back in [[0.0, 0.0], [BEFORE, 0.0], [0.0, BEFORE], [BEFORE, BEFORE]] {
            let at = [row - back[0], column - back[1]];
            for &size in &self.sizes {
                let first = [0, 1].map(|k| (at[k].max(0.0) as u32) / size[k] * size[k]);
                if let Some(&n) = self.cells.get(&[side, first[0], first[1], size[0], size[1]]) {
                    let within = [row, column];
                    let xi = [0, 1].map(|k| {
                        2.0 * (within[k] - f64::from(first[k])) / f64::from(size[k]) - 1.0
                    });
                    return Some((n, xi));
                }
            }
        }
        None
    }
}

// The two families of `papilla_fem::element::shape`, which who reads a dataset does not compile.

/// Quadratic functions of nodes at -1, 0 and 1.
fn quadratics(x: f64) -> [f64; 3] {
    [0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)]
}

/// Functions that are linear between those nodes.
fn hats(x: f64) -> [f64; 3] {
    [(-x).max(0.0), 1.0 - x.abs(), x.max(0.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_cells;

    #[test]
    fn a_place_is_found_in_its_cell() {
        let cells = two_cells();
        let found = Finder::new(&cells);
        assert_eq!(found.cell(1, [0.0, 64.0]), Some((0, [-1.0, 0.0])));
        assert_eq!(found.cell(1, [32.0, 160.0]), Some((1, [-0.5, -0.5])));
        // The far corner belongs to the last cell.
        assert_eq!(found.cell(1, [128.0, 200.0]), Some((1, [1.0, 0.125])));
        assert_eq!(found.cell(1, [128.0, 256.0]), Some((1, [1.0, 1.0])));
        assert_eq!(found.cell(0, [0.0, 0.0]), None);
        assert_eq!(found.cell(1, [0.0, 300.0]), None);
    }

    /// Of a field that is a quadratic of the place, SED is read exactly; of one that is linear, pressure.
    #[test]
    fn fields_of_the_functions_order_are_read_exactly() {
        let field = |p: [f64; 2]| 1.0 + 0.3 * p[0] - 0.2 * p[1] + 0.1 * p[0] * p[1] + p[1] * p[1];
        for x in [-1.0, -0.4, 0.0, 0.7, 1.0] {
            let (q, h) = (quadratics(x), hats(x));
            let nodes = [-1.0, 0.0, 1.0];
            let sum = |w: [f64; 3], f: &dyn Fn(f64) -> f64| -> f64 {
                (0..3).map(|n| w[n] * f(nodes[n])).sum()
            };
            assert!((sum(q, &|y| field([0.2, y])) - field([0.2, x])).abs() < 1e-14);
            assert!((sum(h, &|y| 2.0 - 3.0 * y) - (2.0 - 3.0 * x)).abs() < 1e-14);
        }
    }
}
