//! The topology of a triangulated disc.

use super::FlattenError;
use std::collections::BTreeMap;

/// A triangle mesh that is known to be a manifold, oriented disc.
#[derive(Debug)]
pub(super) struct Disc {
    pub(super) vertex_count: usize,
    pub(super) triangles: Vec<[usize; 3]>,
    /// Boundary vertices, in the order in which the triangles pass them.
    pub(super) boundary: Vec<usize>,
    /// Number of each interior vertex among the interior ones; `None` on the boundary.
    pub(super) interior: Vec<Option<usize>>,
    pub(super) interior_count: usize,
}

impl Disc {
    pub(super) fn new(
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
    ) -> Result<Self, FlattenError> {
        check_input(positions, triangles)?;
        let count = positions.len();
        let edges = directed_edges(triangles)?;
        let next = boundary_successors(&edges, count)?;
        check_fans(triangles, &edges, count)?;
        let boundary_edges = next.iter().flatten().count();
        let undirected_edges = (edges.len() + boundary_edges) / 2;
        let euler = count as i64 - undirected_edges as i64 + triangles.len() as i64;
        let (boundaries, boundary) = walk_boundaries(&next);
        // One connected surface with one boundary loop has Euler characteristic 1 - 2 x
        // handles; a second part adds 1 and, if closed, no loop: hence the third test.
        if boundaries != 1 || euler != 1 || components(triangles, count) != 1 {
            return Err(FlattenError::NotADisc { boundaries, euler });
        }
        let mut interior_count = 0;
        let number = |on_boundary: &Option<usize>| {
            on_boundary.is_none().then(|| {
                interior_count += 1;
                interior_count - 1
            })
        };
        let interior = next.iter().map(number).collect();
        let triangles = triangles.iter().map(|t| t.map(|v| v as usize)).collect();
        Ok(Self { vertex_count: count, triangles, boundary, interior, interior_count })
    }
}

fn check_input(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), FlattenError> {
    if triangles.is_empty() {
        return Err(FlattenError::Empty);
    }
    let count = positions.len();
    let mut used = vec![false; count];
    for (triangle, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            let slot = used.get_mut(vertex as usize);
            *slot.ok_or(FlattenError::Index { triangle, vertex, count })? = true;
        }
    }
    if let Some(vertex) = used.iter().position(|used| !used) {
        return Err(FlattenError::UnusedVertex { vertex });
    }
    match positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        Some(vertex) => Err(FlattenError::NotFinite { vertex }),
        None => Ok(()),
    }
}

/// Triangle of each directed edge.
type Edges = BTreeMap<(u32, u32), usize>;

fn directed_edges(triangles: &[[u32; 3]]) -> Result<Edges, FlattenError> {
    let mut edges = Edges::new();
    for (triangle, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            if from == to {
                return Err(FlattenError::Degenerate { triangle, angle_rad: 0.0 });
            }
            if edges.insert((from, to), triangle).is_some() {
                return Err(FlattenError::NonManifoldEdge { from, to, triangle });
            }
        }
    }
    Ok(edges)
}

/// For each boundary vertex the next one along its loop.
fn boundary_successors(edges: &Edges, count: usize) -> Result<Vec<Option<usize>>, FlattenError> {
    let mut next = vec![None; count];
    for &(from, to) in edges.keys() {
        if edges.contains_key(&(to, from)) {
            continue;
        }
        if next[from as usize].replace(to as usize).is_some() {
            return Err(FlattenError::NonManifoldVertex { vertex: from });
        }
    }
    Ok(next)
}

/// Each vertex's triangles must hang together over shared edges.
fn check_fans(triangles: &[[u32; 3]], edges: &Edges, count: usize) -> Result<(), FlattenError> {
    let mut around = vec![Vec::new(); count];
    for (triangle, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            around[vertex as usize].push(triangle);
        }
    }
    for (vertex, fan) in (0u32..).zip(&around) {
        // From triangle to triangle, over the edge that enters and the one that leaves.
        let mut reached = vec![fan[0]];
        let mut at = 0;
        while at < reached.len() {
            for &other in &triangles[reached[at]] {
                for edge in [(vertex, other), (other, vertex)] {
                    if let Some(&neighbour) = edges.get(&edge)
                        && !reached.contains(&neighbour)
                    {
                        reached.push(neighbour);
                    }
                }
            }
            at += 1;
        }
        if reached.len() != fan.len() {
            return Err(FlattenError::NonManifoldVertex { vertex });
        }
    }
    Ok(())
}

/// Number of boundary loops, and the vertices of the first. Each boundary vertex has one
/// successor and one predecessor, so every walk comes back to where it began.
fn walk_boundaries(next: &[Option<usize>]) -> (usize, Vec<usize>) {
    let mut seen = vec![false; next.len()];
    let mut first_loop = Vec::new();
    let mut loops = 0;
    for start in 0..next.len() {
        if seen[start] || next[start].is_none() {
            continue;
        }
        let mut vertex = start;
        while let (false, Some(following)) = (seen[vertex], next[vertex]) {
            seen[vertex] = true;
            if loops == 0 {
                first_loop.push(vertex);
            }
            vertex = following;
        }
        loops += 1;
    }
    (loops, first_loop)
}

fn components(triangles: &[[u32; 3]], count: usize) -> usize {
    let mut parent: Vec<usize> = (0..count).collect();
    let mut parts = count;
    for corners in triangles {
        let [a, b, c] = corners.map(|v| v as usize);
        for (p, q) in [(a, b), (b, c)] {
            let (p, q) = (root(&mut parent, p), root(&mut parent, q));
            if p != q {
                parent[p] = q;
                parts -= 1;
            }
        }
    }
    parts
}

fn root(parent: &mut [usize], mut vertex: usize) -> usize {
    while parent[vertex] != vertex {
        parent[vertex] = parent[parent[vertex]];
        vertex = parent[vertex];
    }
    vertex
}
