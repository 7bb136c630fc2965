//! What can stop a contact solve.

/// A model that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// Not a contact model at all, or cut off.
    #[error("not a contact model: {0}; make one with `fe-datagen contact`")]
    Format(&'static str),
    /// The header does not say what it has to.
    #[error("the contact model's header: {0}; make the model again with `fe-datagen contact`")]
    Header(#[from] serde_json::Error),
    /// Another version of the format.
    #[error(
        "a contact model of format {found}, this program reads {expected}; make it again with \
         `fe-datagen contact`"
    )]
    Version {
        /// Found.
        found: u32,
        /// Read here.
        expected: u32,
    },
    /// An array that is not as long as the header says.
    #[error("`{array}` of the contact model has {found} values instead of {expected}")]
    Length {
        /// Array.
        array: &'static str,
        /// Found.
        found: usize,
        /// Expected.
        expected: usize,
    },
    /// An array that cannot be unpacked.
    #[error("`{array}` of the contact model is damaged or cut off: {source}")]
    Damaged {
        /// Array.
        array: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// A number that cannot be.
    #[error("`{array}[{index}]` of the contact model is {value}, {rule}")]
    Value {
        /// Array.
        array: &'static str,
        /// Position.
        index: usize,
        /// Found.
        value: f64,
        /// What it has to be.
        rule: &'static str,
    },
    /// The model is of another finger, though maybe of the same atlas: bone and tissues do not show there.
    #[error(
        "the contact model was made of another finger.toml, or skin, than the one beside it; make it \
         anew with `fe-datagen finger build`"
    )]
    Finger,
    /// The model is of another atlas.
    #[error("the contact model is of atlas {found}, the session's atlas is {expected}")]
    Atlas {
        /// The model's.
        found: String,
        /// The session's.
        expected: String,
    },
}

/// A frame that cannot be answered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// A number that is not finite or out of range.
    #[error("{member} is {value}: {rule}")]
    Value {
        /// Member of the request.
        member: &'static str,
        /// Found.
        value: f64,
        /// What it has to be.
        rule: &'static str,
    },
    /// A matrix that is no rotation.
    #[error(
        "objects[{object}].rotation is no rotation: its columns miss length 1 or right angles by \
         {miss:.1e}; send orthonormal columns, right-handed"
    )]
    Rotation {
        /// Index of the object.
        object: usize,
        /// Largest deviation of `R^T R` from the unit matrix.
        miss: f64,
    },
    /// Another number of gaps than vertices.
    #[error("{found} gaps for a finger of {expected} vertices")]
    Gaps {
        /// Found.
        found: usize,
        /// Expected.
        expected: usize,
    },
    /// A depth that is none.
    #[error("depth_mm[{vertex}] is {value}: it has to be finite and within 100 m")]
    Depth {
        /// Vertex.
        vertex: usize,
        /// Found.
        value: f32,
    },
    /// A motion that is none.
    #[error("moved_mm[{vertex}] is {value}: it has to be finite and within 100 m")]
    Moved {
        /// Vertex.
        vertex: usize,
        /// Found.
        value: f32,
    },
    /// Friction where none can be found.
    #[error("something has friction, but {0}")]
    Friction(&'static str),
    /// The iteration ran away; the last frame is forgotten.
    #[error("no finite pressure was found for this frame; the next one starts anew")]
    Diverged,
    /// A force that no depth within reach gives.
    #[error("no depth up to {depth_mm} mm gives {wanted_n} N: {reached_n} N are reached")]
    Force {
        /// Wanted, N.
        wanted_n: f64,
        /// Reached, N.
        reached_n: f64,
        /// Largest depth tried, mm.
        depth_mm: f64,
    },
}
