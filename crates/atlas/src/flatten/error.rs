//! Why a surface cannot be flattened, or an atlas not be made.

use thiserror::Error;

/// Why a surface is not flattened.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FlattenError {
    /// No triangles.
    #[error("the surface has no triangles")]
    Empty,
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, but there are {count} vertices")]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// Vertex it names.
        vertex: u32,
        /// Vertices given.
        count: usize,
    },
    /// NaN or infinity in a position.
    #[error("the position of vertex {vertex} is not finite")]
    NotFinite {
        /// Vertex concerned.
        vertex: usize,
    },
    /// A triangle without area, for which angles mean nothing.
    #[error("triangle {triangle} is degenerate: its smallest angle is {angle_rad:.1e} rad")]
    Degenerate {
        /// Index of the triangle.
        triangle: usize,
        /// Its smallest angle, rad.
        angle_rad: f64,
    },
    /// More than two triangles on an edge, or two that run along it in one direction.
    #[error(
        "edge {from}-{to} is not manifold, or triangle {triangle} is wound against its neighbour"
    )]
    NonManifoldEdge {
        /// First vertex.
        from: u32,
        /// Second vertex.
        to: u32,
        /// The triangle that meets the edge once too often.
        triangle: usize,
    },
    /// Parts of the surface that touch in one vertex only.
    #[error("the triangles around vertex {vertex} do not form one fan")]
    NonManifoldVertex {
        /// Vertex concerned.
        vertex: u32,
    },
    /// A vertex of no triangle.
    #[error("vertex {vertex} belongs to no triangle; leave it out")]
    UnusedVertex {
        /// Vertex concerned.
        vertex: usize,
    },
    /// A closed surface, several parts, holes or handles.
    #[error(
        "the surface is not a disc: {boundaries} boundary loops (1 is due), Euler characteristic {euler} (1 is due); cut it into discs"
    )]
    NotADisc {
        /// Closed boundary curves.
        boundaries: usize,
        /// Vertices less edges plus triangles.
        euler: i64,
    },
    /// Newton's method did not reach a flat set of angles.
    #[error(
        "angle-based flattening did not converge in {iterations} iterations (residual {residual_rad:.1e} rad); refine the mesh where it curves most, or cut the patch smaller"
    )]
    NotConverged {
        /// Newton steps done.
        iterations: usize,
        /// Largest residual, rad.
        residual_rad: f64,
    },
    /// A matrix that must be positive definite is not.
    #[error("the linear system of {step} could not be solved: {reason}")]
    Linear {
        /// What was being solved.
        step: &'static str,
        /// The solver's words.
        reason: String,
    },
}

/// Why no atlas is made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BuildAtlasError {
    /// The two patches do not have the same number of vertices.
    #[error("the skin has {skin} vertices and the interface {interface}; they must correspond")]
    Counts {
        /// Vertices of the skin.
        skin: usize,
        /// Vertices of the interface.
        interface: usize,
    },
    /// A patch could not be flattened.
    #[error("the {patch} could not be flattened: {source}")]
    Flatten {
        /// `skin` or `interface`.
        patch: crate::Patch,
        /// Why.
        #[source]
        source: FlattenError,
    },
    /// The layout breaks a rule of the atlas, such as a fold.
    #[error("the flattened patches do not make an atlas: {0}")]
    Atlas(#[from] crate::AtlasError),
}
