//! Why a mesh file was refused.

use std::path::PathBuf;

/// Why a `.msh` file was refused; lines count from 1.
#[derive(Debug, thiserror::Error)]
pub enum GmshError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// File.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not the format that is read here.
    #[error(
        "line {line}: MSH version {found}; this reads 4.1. In Gmsh: File > Export, 'Version 4 ASCII', or \
         gmsh -format msh41 -save"
    )]
    Version {
        /// Line.
        line: usize,
        /// Version found.
        found: String,
    },
    /// Binary file.
    #[error(
        "line {line}: binary MSH file; export it as ASCII (gmsh -bin 0 -save, or Mesh.Binary = 0)"
    )]
    Binary {
        /// Line.
        line: usize,
    },
    /// The text breaks the format's grammar.
    #[error("line {line}: expected {expected}, found '{found}'")]
    Syntax {
        /// Line.
        line: usize,
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends inside ${section}; it is cut short")]
    Truncated {
        /// Section.
        section: String,
    },
    /// A section that a mesh needs is not there.
    #[error("the file has no ${section} section; {hint}")]
    MissingSection {
        /// Section.
        section: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// A node tag occurs twice.
    #[error("line {line}: node {tag} is defined twice")]
    DuplicateNode {
        /// Line of the second.
        line: usize,
        /// Tag.
        tag: u64,
    },
    /// An element names a node that does not exist.
    #[error("line {line}: element {element} uses node {tag}, which does not exist")]
    MissingNode {
        /// Line of the element.
        line: usize,
        /// Element tag.
        element: u64,
        /// Node tag.
        tag: u64,
    },
    /// A solid or surface element of a type that is not supported.
    #[error(
        "line {line}: element type {element_type} is not supported; use hexahedra (8, 20 or 27 nodes) or \
         tetrahedra (4 or 10), with quadrangles (4, 8 or 9) and triangles (3 or 6) for surfaces"
    )]
    UnsupportedElement {
        /// Line of the element block.
        line: usize,
        /// Gmsh's number of the type.
        element_type: u32,
    },
    /// An element of a mesh without volumes that is not of the plane.
    #[error(
        "line {line}: the mesh has no volumes, so it is taken as plane strain, and element type \
         {element_type} is not supported there; use quadrangles (4, 8 or 9 nodes; Recombine Surface in \
         Gmsh) with lines (2 or 3) for surfaces, or mesh the volumes (gmsh -3)"
    )]
    UnsupportedPlanarElement {
        /// Line of the element block.
        line: usize,
        /// Gmsh's number of the type.
        element_type: u32,
    },
    /// A mesh without volumes that is not in the plane z = 0.
    #[error(
        "line {line}: the mesh has no volumes, so it is taken as plane strain, but element {element} \
         has a node at z = {z_mm} mm; put it in the plane z = 0 or mesh the volumes (gmsh -3)"
    )]
    NotFlat {
        /// Line of the element.
        line: usize,
        /// Element tag.
        element: u64,
        /// Offending coordinate, mm.
        z_mm: f64,
    },
    /// Solid elements that nobody gave a region.
    #[error(
        "line {line}: the elements of volume (in the plane: surface) {entity} belong to no physical \
         group; put it in one named {known}"
    )]
    NoPhysicalGroup {
        /// Line of the element block.
        line: usize,
        /// Volume tag, in the plane surface tag.
        entity: i32,
        /// Names of groups that are regions.
        known: String,
    },
    /// A volume in two groups would be of two regions.
    #[error(
        "line {line}: volume (in the plane: surface) {entity} belongs to {count} physical groups; it can have one region"
    )]
    SeveralRegions {
        /// Line of the element block.
        line: usize,
        /// Volume tag, in the plane surface tag.
        entity: i32,
        /// Groups.
        count: usize,
    },
    /// A physical group without a name.
    #[error(
        "line {line}: physical group {tag} of dimension {dimension} has no name in $PhysicalNames"
    )]
    UnnamedGroup {
        /// Line of the element block.
        line: usize,
        /// Dimension.
        dimension: u8,
        /// Group tag.
        tag: i32,
    },
    /// A volume's group is not a region.
    #[error("line {line}: '{name}' is not a region; volumes (in the plane surfaces) are {known}")]
    UnknownRegion {
        /// Line of the name.
        line: usize,
        /// Name.
        name: String,
        /// Names of groups that are regions.
        known: String,
    },
    /// An element folds.
    #[error(
        "line {line}: element {element} is inverted or flat (det dX/dxi = {determinant:.3e}); reorient \
         the volume in Gmsh or untangle its high-order nodes"
    )]
    InvertedElement {
        /// Line.
        line: usize,
        /// Element tag.
        element: u64,
        /// Smallest Jacobian determinant found.
        determinant: f64,
    },
    /// An element all but folds.
    #[error(
        "line {line}: element {element} is a sliver: its angles leave it {shape:.1e} of the volume of a \
         brick with its edges, {least:.0e} is the least; remesh there (Gmsh: Tools > Statistics finds them)"
    )]
    Sliver {
        /// Line.
        line: usize,
        /// Element tag.
        element: u64,
        /// Least scaled Jacobian at a quadrature point.
        shape: f64,
        /// Least that is accepted.
        least: f64,
    },
    /// An element is far longer than thick.
    #[error(
        "line {line}: element {element} is {aspect:.1e} times as long as thick, at most {most:.0e} can be \
         solved; are two of its nodes all but one?"
    )]
    Aspect {
        /// Line.
        line: usize,
        /// Element tag.
        element: u64,
        /// Longest over shortest column of `dX/dxi`.
        aspect: f64,
        /// Most that is accepted.
        most: f64,
    },
    /// Two elements on the same corners.
    #[error(
        "line {line}: element {element} has the same corners as element {first} of line {first_line}; \
         remove one (Gmsh: Mesh > Reclassify or Coherence, or the volume is in the file twice)"
    )]
    DuplicateElement {
        /// Line of the second.
        line: usize,
        /// Its tag.
        element: u64,
        /// Tag of the first.
        first: u64,
        /// Line of the first.
        first_line: usize,
    },
    /// Lengths that no body under a fingertip-sized indenter has.
    #[error(
        "the mesh is {extent:.3e} mm across, {least} to {most} mm is believed: lengths in the file are taken \
         as mm; was {meant} meant? In Gmsh scale it with Mesh.ScalingFactor"
    )]
    Units {
        /// Largest extent, mm.
        extent: f64,
        /// Least that is believed, mm.
        least: f64,
        /// Most that is believed, mm.
        most: f64,
        /// Unit that would make it one.
        meant: &'static str,
    },
    /// A surface face on no solid element.
    #[error("line {line}: face {element} of surface '{name}' is not a side of a solid element")]
    LooseFace {
        /// Line.
        line: usize,
        /// Element tag of the face.
        element: u64,
        /// Surface name.
        name: String,
    },
    /// A named surface of faces of two kinds.
    #[error(
        "line {line}: surface '{name}' mixes faces of different kinds; give each its own group"
    )]
    MixedSurface {
        /// Line.
        line: usize,
        /// Surface name.
        name: String,
    },
    /// No solid element at all.
    #[error(
        "the mesh has no solid element; mesh the volumes (gmsh -3; for plane strain the surfaces, gmsh -2, \
         recombined to quadrangles) and save all of them or put them in physical groups"
    )]
    NoSolid,
}
