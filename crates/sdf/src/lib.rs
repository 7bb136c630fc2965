//! Rigid shapes as signed distance functions, and where they lie: for finite elements that
//! are pressed by them and for whoever asks how far a point is from one.
//!
//! Distance is positive outside the indenter; its gradient is the outward unit
//! normal, which is the direction in which the indenter pushes the skin. In its
//! own frame an indenter presses towards +z. A shape is one file: its
//! dimensions with defaults and rules, its distance and its reach; a line in
//! [`IndenterSpec`] makes it known to files.
//!
//! ```
//! use papilla_sdf::{Placement, SignedDistance, Sphere};
//!
//! let sphere = Sphere { radius_mm: 5.0 };
//! assert_eq!(sphere.distance([0.0, 0.0, 7.0]).gap_mm, 2.0);
//! let lower = Placement::turned(0.0, 0.0, 0.0, [0.0, 0.0, -3.0]);
//! let found = lower.distance(&sphere, [0.0, 0.0, 7.0]);
//! assert_eq!((found.gap_mm, found.normal), (5.0, [0.0, 0.0, 1.0]));
//! ```

mod announced;
mod beneath;
mod capsule;
mod cuboid;
mod cylinder;
mod dots;
#[cfg(feature = "files")]
pub mod files;
mod grating;
mod heightmap;
mod mesh;
mod mesh_file;
mod placed;
mod plate;
mod punch;
mod revolved;
mod ring;
mod rules;
mod spec;
mod sphere;
#[cfg(test)]
mod testing;
mod torus;
mod touch;
mod union;
mod wedge;

pub use announced::{AnnouncedError, AnnouncedPart, AnnouncedShape, AnnouncedUnion, HeightGrid};
pub use beneath::{Body, beneath, may_be_covered};
pub use capsule::Capsule;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use dots::Dots;
pub use grating::Grating;
pub use heightmap::{HeightField, Heightmap};
pub use mesh::{Decimated, Mended, Mesh, MeshDistance, MeshError, TRIANGLES_MAX};
pub use mesh_file::{FileSurface, LengthUnit, MeshFile};
pub use placed::{Placed, Placement};
pub use plate::{Plate, RoundedPlate};
pub use punch::Punch;
pub use ring::Ring;
pub use rules::{BadValue, ShapeError};
pub use spec::{IndenterSpec, Part, Union};
pub use sphere::Sphere;
pub use torus::Torus;
pub use touch::{TouchError, first_touch_travel};
pub use union::{AnyOf, Ball};
pub use wedge::Wedge;

/// Signed distance with its first two derivatives at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Gap, mm; negative inside.
    pub gap_mm: f64,
    /// Gradient of the gap: the outward unit normal. Of a shape whose gap is
    /// approximate it is of unit length on the surface only.
    pub normal: [f64; 3],
    /// Second derivative of the gap, 1/mm (the curvature of the level set).
    pub hessian: [[f64; 3]; 3],
}

/// A rigid body with a signed distance function, in its own frame.
pub trait SignedDistance: Send + Sync {
    /// Distance from `p` (mm).
    fn distance(&self, p: [f64; 3]) -> Distance;

    /// How far the body goes along the unit vector `direction`, mm from the
    /// local origin (its support function); infinite where it has no end.
    fn reach_mm(&self, direction: [f64; 3]) -> f64;

    /// Width of its narrowest part that can press, mm; infinite where that is not known.
    fn narrowest_mm(&self) -> f64 {
        f64::INFINITY
    }

    /// A distance that is certainly free around `p`, mm; negative inside. The gap,
    /// unless that is approximate.
    fn clearance_mm(&self, p: [f64; 3]) -> f64 {
        self.distance(p).gap_mm
    }

    /// Gap of the nearest surface, mm; of a union also where another part covers it. Its sign tells
    /// inside from outside.
    fn side_mm(&self, p: [f64; 3]) -> f64 {
        self.distance(p).gap_mm
    }

    /// Mean time of a distance near the body, in those of a sphere's: an estimate that depends on
    /// the body alone and not on the machine.
    fn cost(&self) -> f64 {
        1.0
    }

    /// What was done to meshes in it to make bodies of them, and to have fewer triangles, for people;
    /// empty of a body that is as it was told.
    fn mended(&self) -> Vec<String> {
        Vec::new()
    }

    /// Tells the faces through which a point leaves the body, in any order: of each the gap of its
    /// plane, negative where `p` lies behind it, and its outward unit normal. The nearest surface
    /// is among them where `p` is inside. `each` returns the depth beyond which none is asked for.
    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        each(self.distance(p));
    }
}
