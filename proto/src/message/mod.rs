//! The JSON messages of a session: the client's hello, the server's ready and errors.

mod moving;
mod tagged;

use serde::{Deserialize, Serialize};

pub use self::moving::{Reconnect, ReconnectReason, Resumption, SEALED_MAGIC};
use self::tagged::WithoutType;
use crate::{
    ErrorCode, PROTOCOL_VERSION, Problem, RuntimeEffect, SampleType,
    contact::{AnnouncedFinger, AnnouncedObject, ContactMethod, Input, MethodError, SampleLayout},
    effects::{Afferents, ContactWindow, Layout, OutOfRange, Place, Relaxation, Section},
    json::{self, JsonError},
    spikes::{PlacedUnit, Spikes},
};

/// Longest text of a client that is read, bytes: five times a display of the most actuators that
/// the service takes.
pub const CLIENT_MESSAGE_BYTES_MAX: usize = 512 << 10;

/// What a client says in text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
#[non_exhaustive]
#[expect(clippy::large_enum_variant, reason = "one is read at a time, and none is kept")]
pub enum ClientMessage {
    /// Opens the session; must be the first message. Later ones set new terms.
    Hello(Hello),
    /// Asks for what the session remembers, sealed, once every frame before it is answered.
    Seal,
}

/// Why a text is no message of a client.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// It is not JSON, or its `type` is not that of a message.
    #[error("{0}")]
    Unknown(JsonError),
    /// It is a hello, but a member is misspelt, missing or of a wrong type.
    #[error("{0}")]
    Hello(JsonError),
}

impl MessageError {
    /// What is wrong, and where.
    #[must_use]
    pub fn json(&self) -> &JsonError {
        match self {
            Self::Unknown(error) | Self::Hello(error) => error,
        }
    }
}

impl ClientMessage {
    /// Reads the text of a message, [`CLIENT_MESSAGE_BYTES_MAX`] at most. Its members may come in
    /// any order; no text in it is longer than [`TEXT_BYTES_MAX`](json::TEXT_BYTES_MAX).
    ///
    /// # Errors
    /// What is wrong with it, with the member and its place.
    pub fn from_json(text: &[u8]) -> Result<Self, MessageError> {
        #[derive(Deserialize)]
        struct Kind {
            r#type: String,
        }
        if text.len() > CLIENT_MESSAGE_BYTES_MAX {
            let length = text.len();
            let reason = format!("{length} bytes; {CLIENT_MESSAGE_BYTES_MAX} at most are read");
            return Err(MessageError::Unknown(JsonError { member: None, reason, place: None }));
        }
        let kind: Kind = json::read_bounded(text).map_err(MessageError::Unknown)?;
        match kind.r#type.as_str() {
            "hello" => {}
            "seal" => return Ok(Self::Seal),
            other => {
                let reason = format!("'{other}' is no message of a client; 'hello' is");
                let member = Some("type".to_owned());
                return Err(MessageError::Unknown(JsonError { member, reason, place: None }));
            }
        }
        json::read_with(text, |deserializer| Hello::deserialize(WithoutType(deserializer)))
            .map(Self::Hello)
            .map_err(MessageError::Hello)
    }
}

/// Opens a session: what the client wants and how it will send it.
///
/// Unknown members are refused, so that a misspelt wish is not silently dropped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    /// Version of the protocol the client speaks: [`PROTOCOL_VERSION`](crate::PROTOCOL_VERSION).
    #[serde(default = "spoken")]
    pub version: u32,
    /// Effects the scene calls for, by name; the tier must render them all, but for those of the
    /// session ([`RuntimeEffect`](crate::RuntimeEffect)).
    #[serde(default)]
    pub effects: Vec<String>,
    /// Time a frame may spend in the server, us; also the deadline of frames
    /// that name none. None: no deadline.
    #[serde(default)]
    pub budget_us: Option<u32>,
    /// Tier by name. None: the server takes the most accurate that meets the budget.
    #[serde(default)]
    pub tier: Option<String>,
    /// Sample type of the pressure frames and, unless `answer_sample_type` says otherwise, of
    /// their answers.
    #[serde(default)]
    pub sample_type: SampleType,
    /// Pa per unit of u16 and u8 frames whose header says scale 0.
    #[serde(default)]
    pub pressure_scale_pa: Option<f32>,
    /// Hash of the atlas the client draws with; refused if the tier has another.
    #[serde(default)]
    pub atlas_hash: Option<String>,
    /// Sample type of the answers, if another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer_sample_type: Option<SampleType>,
    /// False: answers carry no map, only what the effects add.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<bool>,
    /// Pressure above which a pixel is in contact, Pa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_pa: Option<f32>,
    /// What becomes of pressure above what the tier was trained on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub out_of_range: Option<OutOfRange>,
    /// A frame that was held up on its way for longer than this, us, against the fastest by
    /// the client's clock, is answered stale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stale_after_us: Option<u32>,
    /// Parameters of the effect `contact_window`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_window: Option<ContactWindow>,
    /// Parameters of the effect `points`: where. Due.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<Place>>,
    /// Parameters of the effect `actuators`: the display. Due.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actuators: Option<Layout>,
    /// Parameters of the effect `afferents`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub afferents: Option<Afferents>,
    /// Parameters of the effect `spikes`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spikes: Option<Spikes>,
    /// Parameters of the effect `relaxation`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Relaxation>,
    /// True: the client follows a [`Reconnect`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reconnect: Option<bool>,
    /// True: the next message is what another session of this client remembers, sealed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resume: Option<bool>,
    /// What frames hold.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<Input>,
    /// Where samples of pressure and gaps are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input_layout: Option<SampleLayout>,
    /// Where samples of answers are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer_layout: Option<SampleLayout>,
    /// The objects whose poses frames hold. Due with them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objects: Option<Vec<AnnouncedObject>>,
    /// The fingers; none: one, the service's default finger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingers: Option<Vec<AnnouncedFinger>>,
    /// How pressure is found of objects or gaps; none: by the most accurate method that can
    /// serve the hello, which [`Ready::method`] names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<ContactMethod>,
    /// Whether each frame holds a net force to be met.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_target: Option<bool>,
    /// Whether answers tell how wrong they are likely to be: the section
    /// [`ErrorEstimate`](crate::ErrorEstimate).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_estimate: Option<bool>,
    /// Whether answers tell the local stiffness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<bool>,
    /// Whether, and where, answers carry the pressure that was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<SampleLayout>,
    /// Whether answers carry the traction along the skin at the atlas' vertices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear: Option<bool>,
    /// Whether answers carry how far the skin has moved, at the atlas' vertices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<bool>,
    /// Coulomb's coefficient of friction of what gaps tell of, 0 to 10; none: it is slippery.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Whether frames of gaps hold how fast things move at each vertex.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<bool>,
    /// Whether frames of pressure at vertices hold the traction along the skin too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<bool>,
}

impl Hello {
    /// Whether frames or contact tell traction along the skin.
    #[must_use]
    pub fn has_traction(&self) -> bool {
        let rough = |friction: Option<f64>| friction.is_some_and(|f| f != 0.0);
        self.traction == Some(true)
            || rough(self.friction)
            || self.objects.iter().flatten().any(|object| rough(object.friction))
    }

    /// Whether the hello is of the protocol that is spoken.
    ///
    /// # Errors
    /// It names another version.
    pub fn check_version(&self) -> Result<(), Problem> {
        if self.version == spoken() {
            return Ok(());
        }
        let message = format!(
            "version {} is not spoken here; name {PROTOCOL_VERSION}, or leave the member out",
            self.version
        );
        Err(Problem::new(ErrorCode::UnknownVersion, message).at("version"))
    }
}

fn spoken() -> u32 {
    PROTOCOL_VERSION.into()
}

impl Default for Hello {
    /// A hello without a wish.
    fn default() -> Self {
        Self {
            version: spoken(),
            effects: Vec::new(),
            budget_us: None,
            tier: None,
            sample_type: SampleType::F32,
            pressure_scale_pa: None,
            atlas_hash: None,
            answer_sample_type: None,
            map: None,
            contact_pa: None,
            out_of_range: None,
            stale_after_us: None,
            contact_window: None,
            points: None,
            actuators: None,
            afferents: None,
            spikes: None,
            relaxation: None,
            reconnect: None,
            resume: None,
            input: None,
            input_layout: None,
            answer_layout: None,
            objects: None,
            fingers: None,
            method: None,
            force_target: None,
            error_estimate: None,
            stiffness: None,
            pressure: None,
            shear: None,
            displacement: None,
            friction: None,
            velocity: None,
            traction: None,
        }
    }
}

/// What a server says in text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ServerMessage {
    /// The session is open; binary frames may follow.
    Ready(Box<Ready>),
    /// Something was refused.
    Error(SessionError),
    /// The client is to open another connection and to go on there.
    Reconnect(Reconnect),
}

/// The session is open, and on these terms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ready {
    /// Version of the protocol the server speaks.
    pub version: u32,
    /// Number of the session, for logs.
    pub session: u64,
    /// The tier that will render.
    pub tier: String,
    /// Effects the tier renders.
    pub effects: Vec<String>,
    /// Hash of the tier's atlas.
    pub atlas_hash: String,
    /// Time from receipt to answer that the server expects on an idle machine, us.
    pub predicted_latency_us: u64,
    /// Deadline of frames that name none, us; None: no deadline.
    pub budget_us: Option<u32>,
    /// Whether the tier is expected to meet that budget; None without one. False: it is the
    /// fastest there is, or the one the hello named.
    #[serde(default)]
    pub meets_budget: Option<bool>,
    /// Columns of every map.
    pub width: u32,
    /// Rows of every map.
    pub height: u32,
    /// Sample type of frames both ways.
    pub sample_type: SampleType,
    /// Greatest pressure the tier takes, Pa.
    pub pressure_max_pa: f32,
    /// J/m3 per unit of u16 and u8 answers that reach the greatest SED the tier knows, 1 for
    /// floats. The header of each answer has its own.
    pub sed_scale_j_per_m3: f32,
    /// Number that answers name the tier by.
    pub tier_number: u16,
    /// Names of the tiers by the numbers that answers give, where the budget chooses among them
    /// while the session lasts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tier_names: Option<Vec<String>>,
    /// Sample type of the answers.
    pub answer_sample_type: SampleType,
    /// Effects of the session, in the order in which they act.
    pub session_effects: Vec<RuntimeEffect>,
    /// What the payload of an answer with status ok holds, and where.
    pub sections: Vec<Section>,
    /// The units of the effect `spikes`, by number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<Vec<PlacedUnit>>,
    /// What became of the state that the hello brought.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<Resumption>,
    /// Vertices of the atlas, for what is laid out by them.
    pub vertices: u32,
    /// Fingers of the session.
    pub fingers: u32,
    /// The terms of each finger by its number, where the hello names any; what this message says
    /// beside them is of the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finger_terms: Option<Vec<FingerTerms>>,
    /// Time of the contact solve that is expected, us; within `predicted_latency_us`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_us: Option<u64>,
    /// How pressure is found; none where frames are pressure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<ContactMethod>,
    /// What that method errs against finite elements; none if nobody measured it with this finger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_error: Option<MethodError>,
    /// What of the hello is met, but perhaps not as it was meant; clients show each once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
}

/// On what terms one finger of a session is rendered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FingerTerms {
    /// The finger's name.
    pub name: String,
    /// The tier that will render it.
    pub tier: String,
    /// Number that its answers name the tier by.
    pub tier_number: u16,
    /// The finger whose presses trained that tier, if another: SED is then by similarity alone,
    /// and answers are flagged [`UNFAMILIAR`](crate::flags::UNFAMILIAR).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trained_on: Option<String>,
    /// Hash of its atlas.
    pub atlas_hash: String,
    /// Vertices of its atlas.
    pub vertices: u32,
    /// Greatest pressure its tier takes, Pa.
    pub pressure_max_pa: f32,
    /// As [`Ready::sed_scale_j_per_m3`].
    pub sed_scale_j_per_m3: f32,
    /// Time from receipt to answer that is expected of its frames on an idle machine, us.
    pub predicted_latency_us: u64,
    /// How its pressure is found; none where frames are pressure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<ContactMethod>,
    /// What that method errs with this finger; none if nobody measured it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_error: Option<MethodError>,
    /// Its units of the effect `spikes`, by number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<Vec<PlacedUnit>>,
}

/// A member of the hello that is met, but perhaps not as it was meant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    /// The member, dotted.
    pub member: String,
    /// The value that raises the question, where it is a number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// What it means here, and what may have been meant or can be done.
    pub question: String,
}

/// Something was refused; says whether the session goes on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SessionError {
    /// The code.
    pub code: ErrorCode,
    /// What went wrong, where, and what to do about it.
    pub message: String,
    /// Name of the member or header field at fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
    /// Sequence of the frame at fault, where it could be read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sequence: Option<u32>,
    /// Whether the server closes the session after this message.
    pub closes: bool,
}

impl SessionError {
    /// The session error that says `problem`.
    #[must_use]
    pub fn new(problem: Problem, sequence: Option<u32>, closes: bool) -> Self {
        let Problem { code, message, field } = problem;
        Self { code, message, field, sequence, closes }
    }
}

#[cfg(test)]
mod tests;
