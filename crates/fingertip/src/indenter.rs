//! Why an indenter is refused; its shapes are [`papilla_sdf`]'s.

pub use papilla_sdf::*;
use std::path::PathBuf;

/// Why an indenter was refused, or does not meet the body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IndenterError {
    /// A dimension makes no sense.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// A picture cannot be taken as a height map.
    #[error("indenter.file: {} cannot be a height map: {message}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// Why, and the cure.
        message: String,
    },
    /// A file cannot be taken as a mesh.
    #[error("indenter.file: {} is no mesh to press with: {message}", path.display())]
    MeshFile {
        /// The file.
        path: PathBuf,
        /// Why, and the cure.
        message: String,
    },
    /// It goes by.
    #[error(
        "the indenter never meets the body on its way: bring it nearer by motion.offset_mm and \
         the angles, or take a larger one"
    )]
    NeverTouches,
    /// It fits between the points that contact is found at.
    #[error(
        "the indenter meets no point at which contact is found: it is {width_mm:.3} mm wide, and the \
         nodes of the skin are about {spacing_mm:.3} mm apart. Take geometry.order = \"graded\" or a \
         finer mesh, or an indenter as wide as a few distances of nodes"
    )]
    BetweenNodes {
        /// Width of its narrowest part, mm.
        width_mm: f64,
        /// Distance of nodes, mm.
        spacing_mm: f64,
    },
    /// It would have to go into bone.
    #[error(
        "motion.depth_mm = {depth_mm}: the indenter would reach the bone, which does not give way, at \
         {room_mm:.2} mm. Press less deep"
    )]
    BeyondBone {
        /// Depth that was asked for, mm.
        depth_mm: f64,
        /// Depth at which the bone of the undeformed body begins, mm.
        room_mm: f64,
    },
    /// A part of it fits between the nodes that contact is found at.
    #[error(
        "the indenter is finer than the mesh: {by_mm:.3} mm of it goes in between the nodes of a face \
         {face_mm:.3} mm wide before one is touched. Take a finer mesh, or an indenter as wide as a few faces"
    )]
    FinerThanMesh {
        /// How deep a face's middle is in the indenter at first touch of a node, mm.
        by_mm: f64,
        /// Width of the face, mm.
        face_mm: f64,
    },
    /// It is rounded by less than the smallest cells of a graded mesh can follow.
    #[error(
        "the indenter is finer than the mesh can be: nodes would have to be {wanted_mm:.3} mm apart \
         and are {spacing_mm:.3} mm. Round its edges by {radius_mm:.3} mm at least"
    )]
    FinerThanCells {
        /// Distance of nodes that its curvature asks for, mm.
        wanted_mm: f64,
        /// Distance that there is, mm.
        spacing_mm: f64,
        /// Radius of curvature that this resolves, mm.
        radius_mm: f64,
    },
    /// It is in the body before it moves.
    #[error(
        "the indenter starts {by_mm:.3e} mm inside the body: move it back along its way \
         (motion.offset_mm, angles)"
    )]
    StartsInside {
        /// How deep, mm.
        by_mm: f64,
    },
}

impl From<ShapeError> for IndenterError {
    fn from(error: ShapeError) -> Self {
        match error {
            ShapeError::Value(value) => Self::Value(value),
            ShapeError::Picture { path, message } => Self::Picture { path, message },
            ShapeError::MeshFile { path, message } => Self::MeshFile { path, message },
        }
    }
}

impl From<TouchError> for IndenterError {
    fn from(error: TouchError) -> Self {
        match error {
            TouchError::NeverTouches => Self::NeverTouches,
            TouchError::StartsInside { by_mm } => Self::StartsInside { by_mm },
        }
    }
}
