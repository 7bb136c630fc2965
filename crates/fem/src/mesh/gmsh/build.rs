//! From the file's records to a [`Mesh`], with every check that needs more than
//! one line.

use super::GmshError;
use super::order::{self, flipped};
use super::parse::{Raw, RawBlock};
use crate::element::ElementKind;
use crate::element::geometry::jacobian;
use crate::mesh::{Block, Mesh, Region, Surface};
use std::collections::HashMap;

/// The mesh being built.
struct Builder<'a> {
    raw: &'a Raw,
    /// Names of the regions.
    regions: &'a [&'a str],
    /// Whether the mesh is plane strain: no volumes, quadrangles instead.
    planar: bool,
    mesh: Mesh,
    /// New number of each node of the file; nodes of no solid element are left out.
    number: HashMap<u32, u32>,
    /// Solid elements of each side, by sorted corners: region and outward corners.
    owners: HashMap<Vec<u32>, Vec<(Region, Vec<u32>)>>,
    /// Line and tag of each solid element, by sorted corners.
    seen: HashMap<Vec<u32>, (usize, u64)>,
}

/// Least share of a brick's volume, by its angles, that an element may keep.
const SCALED_JACOBIAN_MIN: f64 = 1e-3;
/// Most that an element may be longer than thick: stiffness goes with the square, and
/// preconditioners are of single precision.
const ASPECT_MAX: f64 = 1e4;
/// Extents that are believed to be in mm: a finger is 25 mm long, a ridge 0.5 mm wide.
const EXTENT_MM: [f64; 2] = [0.1, 1000.0];

pub(super) fn build(raw: &Raw, regions: &[&str]) -> Result<Mesh, GmshError> {
    let mut b = Builder {
        raw,
        regions,
        planar: !raw.blocks.iter().any(|b| b.entity.0 == 3),
        mesh: Mesh::default(),
        number: HashMap::new(),
        owners: HashMap::new(),
        seen: HashMap::new(),
    };
    let dimension = if b.planar { 2 } else { 3 };
    for block in raw.blocks.iter().filter(|b| b.entity.0 == dimension) {
        b.solids(block)?;
    }
    if b.mesh.blocks.is_empty() {
        return Err(GmshError::NoSolid);
    }
    b.check_units()?;
    for block in raw.blocks.iter().filter(|b| b.entity.0 < dimension) {
        for name in b.group_names(block)? {
            if block.entity.0 == dimension - 1 {
                b.faces(block, &name)?;
            } else {
                b.nodes(block, &name)?;
            }
        }
    }
    for set in b.mesh.node_sets.values_mut() {
        set.sort_unstable();
        set.dedup();
    }
    Ok(b.mesh)
}

impl Builder<'_> {
    /// Names of the physical groups of a block's entity.
    fn group_names(&self, block: &RawBlock) -> Result<Vec<String>, GmshError> {
        let (dimension, _) = block.entity;
        let groups = self.raw.groups.get(&block.entity).map_or(&[][..], Vec::as_slice);
        let name = |&tag: &i32| match self.raw.names.get(&(dimension, tag)) {
            Some((name, _)) => Ok(name.clone()),
            None => Err(GmshError::UnnamedGroup { line: block.line, dimension, tag }),
        };
        groups.iter().map(name).collect()
    }

    /// File indices of an element's nodes.
    fn indices(
        &self,
        (line, element, tags): &(usize, u64, Vec<u64>),
        expected: usize,
    ) -> Result<Vec<u32>, GmshError> {
        if tags.len() != expected {
            return Err(GmshError::Syntax {
                line: *line,
                expected: "as many nodes as the element type has",
                found: format!("{} nodes instead of {expected}", tags.len()),
            });
        }
        let index = |tag: &u64| {
            self.raw.node_of_tag.get(tag).copied().ok_or(GmshError::MissingNode {
                line: *line,
                element: *element,
                tag: *tag,
            })
        };
        tags.iter().map(index).collect()
    }

    /// Number of a node of the file in the mesh, new if not met before.
    fn node(&mut self, index: u32) -> u32 {
        let next = self.mesh.nodes.len() as u32;
        let number = *self.number.entry(index).or_insert(next);
        if number == next {
            let mut x = self.raw.positions[index as usize];
            if self.planar {
                x[2] = 0.0;
            }
            self.mesh.nodes.push(x);
        }
        number
    }

    fn region(&self, block: &RawBlock) -> Result<Region, GmshError> {
        let (line, entity) = (block.line, block.entity.1);
        let names = self.group_names(block)?;
        let [name] = names.as_slice() else {
            return Err(match names.len() {
                0 => GmshError::NoPhysicalGroup { line, entity, known: self.known() },
                count => GmshError::SeveralRegions { line, entity, count },
            });
        };
        let region = self.regions.iter().position(|r| r == name);
        region.map(|r| Region(r as u8)).ok_or_else(|| {
            let dimension = block.entity.0;
            let mut names = self.raw.names.iter();
            let named = names.find(|((d, _), (n, _))| *d == dimension && n == name);
            GmshError::UnknownRegion {
                line: named.map_or(line, |(_, v)| v.1),
                name: name.clone(),
                known: self.known(),
            }
        })
    }

    /// The names of the regions, for messages.
    fn known(&self) -> String {
        match self.regions {
            [] => String::new(),
            [one] => (*one).into(),
            [first @ .., last] => format!("{} or {last}", first.join(", ")),
        }
    }

    fn solids(&mut self, block: &RawBlock) -> Result<(), GmshError> {
        let Some(solid) = order::solid(block.element_type, self.planar) else {
            return Err(self.unsupported(block));
        };
        let region = self.region(block)?;
        let at = match self.mesh.blocks.iter().position(|b| b.kind == solid.kind) {
            Some(at) => at,
            None => {
                let empty =
                    Block { kind: solid.kind, connectivity: Vec::new(), region: Vec::new() };
                self.mesh.blocks.push(empty);
                self.mesh.blocks.len() - 1
            }
        };
        for element in &block.elements {
            let file = self.indices(element, solid.kind.nodes())?;
            if self.planar {
                self.check_flat(&file, element)?;
            }
            let mut nodes: Vec<u32> = solid.from_gmsh.iter().map(|&i| self.node(file[i])).collect();
            if self.planar && self.turns_clockwise(&nodes[..4]) {
                let turned = &order::QUAD_TURNED[..nodes.len()];
                nodes = turned.iter().map(|&i| nodes[i]).collect();
            }
            self.check_shape(solid.kind, &nodes, element)?;
            self.check_single(&nodes[..corners(solid.kind)], element)?;
            for side in solid.kind.sides() {
                let corners: Vec<u32> = side.iter().map(|&c| nodes[c]).collect();
                self.owners.entry(sorted(&corners)).or_default().push((region, corners));
            }
            self.mesh.blocks[at].connectivity.extend(nodes);
            self.mesh.blocks[at].region.push(region);
        }
        Ok(())
    }

    fn unsupported(&self, block: &RawBlock) -> GmshError {
        let (line, element_type) = (block.line, block.element_type);
        if self.planar {
            GmshError::UnsupportedPlanarElement { line, element_type }
        } else {
            GmshError::UnsupportedElement { line, element_type }
        }
    }

    /// A planar mesh lies in z = 0, up to the rounding of the file's numbers.
    fn check_flat(
        &self,
        file: &[u32],
        &(line, element, _): &(usize, u64, Vec<u64>),
    ) -> Result<(), GmshError> {
        let at = |n: &u32| self.raw.positions[*n as usize];
        let size = file.iter().map(at).flat_map(|x| [x[0].abs(), x[1].abs()]).fold(0.0, f64::max);
        match file.iter().map(|n| at(n)[2]).find(|z| z.abs() > 1e-12 * size) {
            Some(z_mm) => Err(GmshError::NotFlat { line, element, z_mm }),
            None => Ok(()),
        }
    }

    /// Whether the quadrangle with these corners has negative area: an element
    /// of the plane has no inside, so its numbering is simply turned.
    fn turns_clockwise(&self, corners: &[u32]) -> bool {
        let x = |i: usize| self.mesh.nodes[corners[i] as usize];
        let [p, q]: [[f64; 2]; 2] =
            [(0, 2), (1, 3)].map(|(a, b)| [0, 1].map(|i| x(b)[i] - x(a)[i]));
        p[0] * q[1] - p[1] * q[0] < 0.0
    }

    fn check_shape(
        &self,
        kind: ElementKind,
        nodes: &[u32],
        &(line, element, _): &(usize, u64, Vec<u64>),
    ) -> Result<(), GmshError> {
        let (mut value, mut gradient) = (vec![0.0; nodes.len()], vec![[0.0; 3]; nodes.len()]);
        for q in kind.quadrature() {
            kind.shape(q.xi, &mut value, &mut gradient);
            let positions = nodes.iter().map(|&n| self.mesh.nodes[n as usize]);
            let (_, determinant) = jacobian(positions, &gradient);
            if !(determinant > 0.0) {
                return Err(GmshError::InvertedElement { line, element, determinant });
            }
            let edges = self.edges(kind, nodes, &gradient);
            let shape = determinant / edges.iter().product::<f64>();
            if shape < SCALED_JACOBIAN_MIN {
                return Err(GmshError::Sliver { line, element, shape, least: SCALED_JACOBIAN_MIN });
            }
            let longest = edges.iter().copied().fold(0.0, f64::max);
            let aspect = longest / edges.iter().copied().fold(f64::INFINITY, f64::min);
            if aspect > ASPECT_MAX {
                return Err(GmshError::Aspect { line, element, aspect, most: ASPECT_MAX });
            }
        }
        Ok(())
    }

    /// Lengths of the columns of `dX/dxi`, mm.
    fn edges(&self, kind: ElementKind, nodes: &[u32], gradient: &[[f64; 3]]) -> Vec<f64> {
        let column = |k: usize| -> [f64; 3] {
            std::array::from_fn(|i| {
                let of = |(&n, d): (&u32, &[f64; 3])| self.mesh.nodes[n as usize][i] * d[k];
                nodes.iter().zip(gradient).map(of).sum()
            })
        };
        (0..kind.dimension()).map(|k| papilla_vector::norm(column(k))).collect()
    }

    /// An element on the corners of another would count its material twice.
    fn check_single(
        &mut self,
        corners: &[u32],
        &(line, element, _): &(usize, u64, Vec<u64>),
    ) -> Result<(), GmshError> {
        match self.seen.insert(sorted(corners), (line, element)) {
            Some((first_line, first)) => {
                Err(GmshError::DuplicateElement { line, element, first, first_line })
            }
            None => Ok(()),
        }
    }

    fn check_units(&self) -> Result<(), GmshError> {
        let along = |i: usize| {
            let of = self.mesh.nodes.iter().map(move |p| p[i]);
            of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
        };
        let extent = (0..3).map(along).fold(0.0, f64::max);
        let [least, most] = EXTENT_MM;
        let meant = if extent < least { "m" } else { "um" };
        if extent < least || extent > most {
            return Err(GmshError::Units { extent, least, most, meant });
        }
        Ok(())
    }

    /// Faces of a named surface, turned to look outward; on a surface between
    /// two regions outward is away from the one of the higher number.
    fn faces(&mut self, block: &RawBlock, name: &str) -> Result<(), GmshError> {
        let Some(kind) = order::surface(block.element_type, self.planar) else {
            return Err(self.unsupported(block));
        };
        for element in &block.elements {
            let (line, tag) = (element.0, element.1);
            let loose = || GmshError::LooseFace { line, element: tag, name: name.into() };
            let file = self.indices(element, kind.nodes())?;
            let mut nodes = Vec::with_capacity(kind.nodes());
            for index in &file {
                nodes.push(*self.number.get(index).ok_or_else(loose)?);
            }
            let key = sorted(&nodes[..kind.corners()]);
            let owners = self.owners.get(&key).ok_or_else(loose)?;
            let (_, outward) =
                owners.iter().max_by_key(|(region, _)| region.index()).ok_or_else(loose)?;
            if !turns_alike(&nodes, outward) {
                nodes = flipped(kind).iter().map(|&i| nodes[i]).collect();
            }
            self.mesh.node_sets.entry(name.into()).or_default().extend(&nodes);
            let empty = || Surface { kind, connectivity: Vec::new() };
            let surface = self.mesh.surfaces.entry(name.into()).or_insert_with(empty);
            if surface.kind != kind {
                return Err(GmshError::MixedSurface { line, name: name.into() });
            }
            surface.connectivity.extend(nodes);
        }
        Ok(())
    }

    /// Nodes of a named point or curve.
    fn nodes(&mut self, block: &RawBlock, name: &str) -> Result<(), GmshError> {
        for element in &block.elements {
            for index in self.indices(element, element.2.len())? {
                if let Some(&n) = self.number.get(&index) {
                    self.mesh.node_sets.entry(name.into()).or_default().push(n);
                }
            }
        }
        Ok(())
    }
}

/// Corner nodes, which come first.
fn corners(kind: ElementKind) -> usize {
    kind.sides().iter().copied().flatten().max().map_or(0, |last| last + 1)
}

fn sorted(nodes: &[u32]) -> Vec<u32> {
    let mut key = nodes.to_vec();
    key.sort_unstable();
    key
}

/// Whether the face's corners turn as `outward` does; an edge's: run as it does.
fn turns_alike(face: &[u32], outward: &[u32]) -> bool {
    if outward.len() == 2 {
        return face[0] == outward[0];
    }
    let at = outward.iter().position(|n| *n == face[0]).unwrap_or(0);
    outward[(at + 1) % outward.len()] == face[1]
}
