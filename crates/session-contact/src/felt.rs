//! The facts of a contact by which the error of its force is estimated.

use papilla_contact::{Contact, Person};
use papilla_proto::contact::ContactMethod;
use papilla_vector::norm;

/// What contact found of rigid objects without friction, on a finger of reference width and
/// stiffness: by these numbers the error of a force is told. There is none of a solve that did not
/// settle, that is beyond what the contact model was made for, or of a body that is held on the side
/// from which it came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// By which method.
    pub method: ContactMethod,
    /// Size of the force, N.
    pub force_n: f32,
    /// Centre of pressure in the finger's frame, mm.
    pub centre_mm: [f32; 3],
}

impl Felt {
    /// What a method found on this person's finger.
    #[must_use]
    pub fn of(method: ContactMethod, found: &Contact, person: Person) -> Option<Self> {
        let Contact { force_n, centre_mm, quality, .. } = found;
        if !quality.settled || quality.out_of_range || quality.is_held {
            return None;
        }
        let Person { width, stiffness } = person;
        let force_n = norm(*force_n);
        Some(Self {
            method,
            force_n: (force_n / (stiffness * width * width)) as f32,
            centre_mm: centre_mm.map(|at| (at / width) as f32),
        })
    }
}
