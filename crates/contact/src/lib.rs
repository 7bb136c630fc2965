//! Contact in real time: from the poses of objects to the pressure on a finger.
//!
//! A [`ContactModel`] holds how a finger's skin moves under forces. A [`Solver`] finds the
//! pressure that keeps the skin out of [`Object`]s, frame by frame:
//! `p >= 0`, `gap >= 0`, `p gap = 0` at every vertex, on the displaced skin.
//! Explained, with the error and the time of each method, in `docs/concepts/contact.md`.
//!
//! ```
//! use papilla_contact::{Arrays, Contact, ContactModel, Header, Object, Settings, Solver};
//! use papilla_sdf::{Placement, Sphere};
//! use std::sync::Arc;
//!
//! // A skin of four vertices that looks down, on a half-space of .2 MPa.
//! let positions_mm = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
//! let normals = [0.0, 0.0, -1.0].repeat(4);
//! let triangles = vec![0, 2, 1, 1, 2, 3];
//! let arrays = Arrays::half_space(positions_mm, normals, vec![0.25; 4], triangles, 0.2);
//! let header = Header { vertices: 4, triangles: 2, share_max: 1.0, ..Header::current() };
//! let model = Arc::new(ContactModel::new(header, arrays)?);
//!
//! let mut solver = Solver::new(model.clone(), Settings::default())?;
//! let mut contact = Contact::new(model.vertices());
//! let below = Placement::turned(0.0, 0.0, 0.0, [0.5, 0.5, -9.9]);
//! solver.solve(&[Object::rigid(Arc::new(Sphere { radius_mm: 10.0 }), below)], &mut contact)?;
//! assert!(contact.force_n[2] > 0.0 && contact.penetration_mm < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod answer;
mod back;
mod bounded;
mod budget;
mod clusters;
mod compliance;
mod counting;
mod discs;
mod displacement;
mod error;
mod file;
mod finger_file;
mod force_target;
mod gaps;
mod half_space;
mod held;
mod interface;
mod kernels;
mod ladder;
mod layer;
mod layers;
mod model;
mod nearest;
mod object;
mod objects;
mod packed;
mod patch;
mod pixels;
mod push;
mod second_order;
mod shear_energy;
mod slopes;
mod solver;
mod springs;

pub use answer::{Contact, Effort, Person, Quality};
pub use budget::WORK_MAX;
pub use displacement::Displacement;
pub use error::{ContactError, ModelError};
pub use finger_file::{FingerFileError, finger_file_sha256};
pub use force_target::NetForce;
pub use gaps::Gaps;
pub use ladder::Method;
pub use layer::Layer;
pub use model::{Arrays, ContactModel, Header};
pub use nearest::FRICTION_MAX;
pub use object::Object;
pub use objects::Scene;
pub use pixels::{PixelContact, PixelMemory, PixelSkin, PixelSpacing};
pub use shear_energy::{InterfaceSkin, ShearEnergy};
pub use solver::{Anchor, Hardest, Memory, Settings, Side, Solver};
