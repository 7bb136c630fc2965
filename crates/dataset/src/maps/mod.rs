//! Maps of a shard's values: drawn from the atlas' vertices, or read off the cells of its mesh.
//!
//! SED is read in the middle of a pixel. Pressure is the mean over a pixel: ridges and edges of
//! contact are thinner than one, and the mean keeps the force.
//!
//! Everything that shows a state of finite elements as a map draws it here: `fe-datagen solve`,
//! pictures and replays of datasets, the evaluation of models.

mod finder;
mod points;
mod states;

pub use states::{Field, ShardMaps};

use super::{Cells, DatasetError, Shard, TriangleOnLattice};
use crate::lattice::places;
use finder::Finder;
use ndarray::{Ix1, Ix2};
use papilla_atlas::{Atlas, Patch, Raster};
use papilla_output::OutputError;
use papilla_output::npz::NpzArrays;
use std::path::Path;

/// Where the pixels of both patches lie among vertices and, in a dataset of meshes that
/// differ, on the lattice of their cells.
#[derive(Debug)]
pub struct Maps {
    skin: Pixels,
    interface: Pixels,
}

/// A side of the lattice, and row and column there.
type Place = (u32, [f64; 2]);

#[derive(Debug)]
struct Pixels {
    raster: Raster,
    /// Points of which a pixel's value is the mean, as many for each pixel of the raster, one after
    /// the other; empty where all values are at vertices.
    points: Vec<Place>,
}

impl Pixels {
    /// `places`: the middle of each pixel on the lattice; empty where values are at vertices.
    fn new(raster: Raster, places: Vec<Place>) -> Self {
        let points = match raster.patch() {
            Patch::Skin => points::within(&raster, &places),
            Patch::Interface => places,
        };
        Self { raster, points }
    }
}

impl Maps {
    /// For maps of states that are known at the vertices of this atlas, or at nodes of cells on the
    /// lattice that its triangles lie on.
    ///
    /// # Panics
    /// If `lattice` has fewer entries than the atlas has triangles.
    #[must_use]
    pub fn new(atlas: &Atlas, lattice: Option<&[TriangleOnLattice]>) -> Self {
        let [skin, interface] = Patch::ALL.map(|patch| {
            let raster = Raster::new(atlas, patch);
            let wide = |(side, at): (u32, [f32; 2])| (side, at.map(f64::from));
            let on = lattice.map(|lattice| places(&raster, lattice).map(wide).collect());
            Pixels::new(raster, on.unwrap_or_default())
        });
        Self { skin, interface }
    }

    /// For the maps of the dataset in `folder`, which is of this atlas. One without a `raster.npz` has
    /// all its values at vertices.
    ///
    /// # Errors
    /// [`DatasetError::Output`] where `raster.npz` cannot be read.
    pub fn read(folder: &Path, atlas: &Atlas) -> Result<Self, DatasetError> {
        let path = folder.join("raster.npz");
        if !path.exists() {
            return Ok(Self::new(atlas, None));
        }
        let bytes = std::fs::read(&path).map_err(OutputError::io("read", &path))?;
        let mut npz = NpzArrays::new(&path, &bytes)?;
        let mut pixels = |patch: Patch| -> Result<Pixels, DatasetError> {
            let raster = Raster::new(atlas, patch);
            let name = |part: &str| format!("{}_{part}", patch.name());
            let mut middles = Vec::new();
            if npz.has(&name("side"))? {
                let sides = npz.get::<u32, Ix1>(&name("side"))?;
                let rows = npz.get::<f32, Ix2>(&name("place"))?;
                let at = rows.outer_iter().map(|p| [f64::from(p[0]), f64::from(p[1])]);
                middles = sides.iter().copied().zip(at).collect();
                if middles.len() != raster.pixel_count() {
                    return Err(OutputError::malformed(&path, &"places are not the pixels'").into());
                }
            }
            Ok(Pixels::new(raster, middles))
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

    /// Maps of a shard's states.
    #[must_use]
    pub const fn of<'a>(&'a self, shard: &'a Shard) -> ShardMaps<'a> {
        ShardMaps::new(self, shard)
    }

    /// How maps of a patch are drawn from the values of a shard with these cells.
    fn reader(&self, patch: Patch, cells: Option<&Cells>) -> Result<MapReader<'_>, DatasetError> {
        let Pixels { raster, points } = self.of_patch(patch);
        let mut reader = MapReader { raster, ends: Vec::new(), terms: Vec::new() };
        let Some(cells) = cells else { return Ok(reader) };
        let functions = match patch {
            Patch::Skin => hats,
            Patch::Interface => quadratics,
        };
        let lost = || OutputError::malformed("raster.npz".as_ref(), &"a pixel lies in no cell");
        let each = points.len() / raster.pixel_count().max(1);
        if each == 0 {
            return Err(lost().into());
        }
        let mut found = Finder::new(cells);
        // Of a pixel: its cells, and what its value is of the values at their nodes.
        let mut within: Vec<(usize, [f64; 9])> = Vec::new();
        for points in points.chunks_exact(each) {
            within.clear();
            for &(side, at) in points {
                let (cell, [r, s]) = found.cell(side, at).ok_or_else(lost)?;
                let (r, s) = (functions(r), functions(s));
                let known = within.iter().position(|(known, _)| *known == cell);
                let entry = known.unwrap_or(within.len());
                if known.is_none() {
                    within.push((cell, [0.0; 9]));
                }
                for (n, weight) in within[entry].1.iter_mut().enumerate() {
                    *weight += r[n / 3] * s[n % 3] / each as f64;
                }
            }
            let term = |&(cell, weights): &(usize, [f64; 9])| {
                (cells.nodes[cell], weights.map(|weight| weight as f32))
            };
            reader.terms.extend(within.iter().map(term));
            reader.ends.push(reader.terms.len());
        }
        Ok(reader)
    }
}

/// Draws maps of one patch from the values of one shard.
struct MapReader<'a> {
    raster: &'a Raster,
    /// Where the terms of each pixel end; empty where values are at the atlas' vertices.
    ends: Vec<usize>,
    /// Nodes of a cell, and their weights.
    terms: Vec<([u32; 9], [f32; 9])>,
}

impl MapReader<'_> {
    /// Overwrites a map; 0 outside the patch. Where a quadratic overshoots, never negative.
    fn draw(&self, values: &[f32], map: &mut [f32]) -> Result<(), DatasetError> {
        if self.ends.is_empty() {
            return self
                .raster
                .rasterise(values, map)
                .map_err(|error| OutputError::malformed("a state".as_ref(), &error).into());
        }
        map.fill(0.0);
        let mut begin = 0;
        for (&at, &end) in self.raster.indices().iter().zip(&self.ends) {
            let sum: f32 = self.terms[begin..end]
                .iter()
                .flat_map(|(nodes, weights)| nodes.iter().zip(weights))
                .map(|(n, w)| w * values[*n as usize])
                .sum();
            map[at as usize] = sum.max(0.0);
            begin = end;
        }
        Ok(())
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
