//! What a session can ask for beside the SED map: the run-time effects and their parameters.
//!
//! A hello names its effects; what it does not name is neither computed nor allocated. What an
//! effect needs to know goes into the hello's member of the same name, whose members all have a
//! default unless the text says otherwise.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::error::{ErrorCode, Problem, shortened};

/// An effect of the session, as opposed to one that a model was trained with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RuntimeEffect {
    /// The answer's map is cut to the pixels in contact and a margin.
    ContactWindow,
    /// The answer carries a [`Summary`](crate::Summary).
    Summary,
    /// The answer carries values at listed points.
    Points,
    /// The answer carries the intensities of a display's actuators.
    Actuators,
    /// The answer carries the firing rate of SA1 afferents, Hz, beside SED: of the map, and of points.
    Afferents,
    /// The answer carries the [spikes](crate::spikes) of touch units.
    Spikes,
    /// The tissue creeps under the pressure.
    Relaxation,
    /// SED feels traction along the skin.
    ShearEnergy,
}

impl RuntimeEffect {
    /// All of them, in the order in which they act.
    pub const ALL: [Self; 8] = [
        Self::Relaxation,
        Self::ShearEnergy,
        Self::Afferents,
        Self::Spikes,
        Self::ContactWindow,
        Self::Summary,
        Self::Points,
        Self::Actuators,
    ];

    /// The name in a hello.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::ContactWindow => "contact_window",
            Self::Summary => "summary",
            Self::Points => "points",
            Self::Actuators => "actuators",
            Self::Afferents => "afferents",
            Self::Spikes => "spikes",
            Self::Relaxation => "relaxation",
            Self::ShearEnergy => "shear_energy",
        }
    }

    /// What it changes, in a line.
    #[must_use]
    pub const fn what(self) -> &'static str {
        match self {
            Self::ContactWindow => "cuts the answer's map to the pixels in contact and a margin",
            Self::Summary => "adds force, contact area, and SED's maximum, centroid and moments",
            Self::Points => "adds values at listed points of the finger",
            Self::Actuators => "adds the intensity of every actuator of a display",
            Self::Afferents => "adds the firing rate of SA1 afferents to the map and to points",
            Self::Spikes => "adds when SA1, RA and Pacinian units of the finger fire",
            Self::Relaxation => "lets the tissue creep: a Prony filter on pressure before the map",
            Self::ShearEnergy => "adds to SED what traction along the skin changes",
        }
    }
}

impl fmt::Display for RuntimeEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for RuntimeEffect {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        Self::ALL.into_iter().find(|effect| effect.as_str() == text).ok_or(())
    }
}

/// The problem of an effect that no session has and its tier does not render; `tier` is the tier's name
/// and what it renders, if a tier is asked at all. The problem names all effects, and the one that was
/// probably meant.
#[must_use]
pub fn unknown_effect(effect: &str, tier: Option<(&str, &[String])>) -> Problem {
    let of_sessions = RuntimeEffect::ALL.map(RuntimeEffect::as_str);
    let (whose, rendered) = match tier {
        Some((name, rendered)) => (format!("tier {name} has "), rendered),
        None => ("there is ".to_owned(), &[][..]),
    };
    let known = of_sessions.into_iter().chain(rendered.iter().map(String::as_str));
    let meant = papilla_json::meant(effect, known);
    let (effect, of_sessions) = (shortened(effect), of_sessions.join(", "));
    let mut message = format!("{whose}no effect '{effect}'{meant}; sessions have {of_sessions}");
    if !rendered.is_empty() {
        message += &format!("; this tier renders {}", rendered.join(", "));
    }
    Problem::new(ErrorCode::UnknownEffect, message).at("effects")
}

/// Parameters of [`RuntimeEffect::ContactWindow`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactWindow {
    /// Width of the margin on each side, pixels.
    pub margin_px: u16,
}

impl Default for ContactWindow {
    /// 24 px: some 3 mm on the shipped atlas, where SED under an edge has fallen to a few percent.
    fn default() -> Self {
        Self { margin_px: 24 }
    }
}

/// A place on the interface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// In the map, `[u, v]`: column + 0.5, row + 0.5 at a pixel's centre.
    Px([f32; 2]),
    /// On the undeformed finger, `[x, y, z]`: the nearest pixel of the interface is taken.
    Mm([f32; 3]),
}

/// One electrode or tactor; a member that is left out is the [`Layout`]'s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Actuator {
    /// Where it sits. Due.
    pub at: Place,
    /// Radius of its receptive field on the undeformed interface, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f32>,
    /// Intensity per unit of input above the threshold.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<f32>,
    /// Input below which it is silent, J/m3 or Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f32>,
}

/// What actuators are driven by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActuatorInput {
    /// Strain energy density, J/m3.
    #[default]
    Sed,
    /// Firing rate of SA1 afferents, Hz; needs [`RuntimeEffect::Afferents`].
    Sa1Rate,
}

/// How intensities are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// By the formula of the [`Layout`], each actuator for itself.
    #[default]
    Formula,
    /// Together: pins that press with `intensity / gain` Pa, so that SED on a half-space comes
    /// closest to the frame's.
    Fitted,
    /// The same, corrected once by the SED that the network gives for those pins: it is asked twice
    /// a frame.
    Corrected,
}

/// A display: parameters of [`RuntimeEffect::Actuators`].
///
/// By [`Drive::Formula`], `intensity = min(max, gain (m - threshold)+)`, where `m` is the input's mean over the pixels
/// within `radius_mm` of the actuator (chord on the undeformed interface) with the weight
/// `A_i (1 - d_i^2 / radius^2)`; the nearest pixel alone if none is that near.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// The actuators, in the order of the answer. Due.
    pub actuators: Vec<Actuator>,
    /// What drives them.
    #[serde(default)]
    pub input: ActuatorInput,
    /// How intensities are found.
    #[serde(default)]
    pub drive: Drive,
    /// Radius of a receptive field, or of a pin, mm. Due unless every actuator has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f32>,
    /// Intensity per unit of input above the threshold. Due unless every actuator has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<f32>,
    /// Input below which an actuator is silent, J/m3 or Hz.
    #[serde(default)]
    pub threshold: f32,
    /// Greatest intensity.
    #[serde(default = "one")]
    pub max: f32,
}

fn one() -> f32 {
    1.0
}

/// Parameters of [`RuntimeEffect::Afferents`]: `sigma = sqrt(2 E_ref SED)`,
/// `rate = k_s (sigma - theta)+ + k_d (d sigma / dt)+`, time by the client's clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Afferents {
    /// Modulus that turns SED into a stress, kPa: that of the dermis.
    pub e_ref_kpa: f32,
    /// Stress below which a unit is silent, kPa.
    pub theta_kpa: f32,
    /// Static sensitivity, Hz/kPa.
    pub k_s_hz_per_kpa: f32,
    /// Dynamic sensitivity, Hz/(kPa/s).
    pub k_d_hz_s_per_kpa: f32,
    /// Whether the map of rates comes with the answer, wherever the map of SED does.
    pub map: bool,
}

impl Default for Afferents {
    fn default() -> Self {
        Self {
            e_ref_kpa: 80.0,
            theta_kpa: 8.0,
            k_s_hz_per_kpa: 1.0,
            k_d_hz_s_per_kpa: 0.2,
            map: true,
        }
    }
}

/// Bytes before the samples of [`SectionName::Rates`]: their scale as f32, Hz per unit of u16 and u8
/// (else 1), and zeros.
pub const RATES_HEAD_LEN: usize = 16;

/// A tissue whose relaxation is known (`docs/concepts/physics.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tissue {
    /// Skin, where SED is read.
    Skin,
    /// The tissue below it. It takes most of the strain: with its constants the filter follows a
    /// layered finger best (`docs/concepts/physics.md`).
    #[default]
    Subcutaneous,
}

impl Tissue {
    /// Its Prony series: Chen, Shuai & Zhu, Table 2, second and first set.
    #[must_use]
    pub const fn prony(self) -> [PronyTerm; 2] {
        match self {
            Self::Skin => {
                [PronyTerm { g: 0.2566, tau_s: 0.3834 }, PronyTerm { g: 0.2225, tau_s: 4.6731 }]
            }
            Self::Subcutaneous => {
                [PronyTerm { g: 0.0864, tau_s: 0.2136 }, PronyTerm { g: 0.2136, tau_s: 8.854 }]
            }
        }
    }
}

/// One term of `G(t)/G(0) = 1 - sum g_i (1 - exp(-t / tau_i))`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PronyTerm {
    /// Share of the modulus that relaxes.
    pub g: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
}

/// Which moduli the elastic map stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moduli {
    /// Those at once: an indenter that is held goes on sinking in, SED grows.
    #[default]
    Instantaneous,
    /// Those of long holds: the finger is stiffer at first.
    LongTerm,
}

/// Parameters of [`RuntimeEffect::Relaxation`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Relaxation {
    /// Whose constants are taken.
    pub tissue: Tissue,
    /// Other constants, one to six terms of different times, `sum g < 1`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prony: Option<Vec<PronyTerm>>,
    /// Which moduli the elastic map stands for.
    pub moduli: Moduli,
}

/// What becomes of pressure above what the tier was trained on. Sessions clamp unless their hello
/// says otherwise; whatever has no flags to show refuses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutOfRange {
    /// The frame is refused with the error `out_of_range`.
    #[default]
    Refuse,
    /// It is rendered as it is and its answer flagged, up to ten times that pressure: the network
    /// extrapolates.
    Flag,
    /// The network sees the greatest pressure that it knows instead, and the answer is flagged, up
    /// to ten thousand times that pressure. Force and area of a summary stay those that were sent.
    Clamp,
}

/// One part of the payload of an answer. Parts begin at multiples of 16, which the
/// parts before them reach with zeros.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// What it holds.
    pub name: SectionName,
    /// Where it begins in the message, bytes.
    pub offset: u32,
    /// Its bytes; of the map, whose window may differ from answer to answer, the most.
    pub bytes: u32,
}

/// What a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SectionName {
    /// A [`Touch`](crate::contact::Touch).
    Touch,
    /// Pressure, one f32 a vertex or pixel.
    Pressure,
    /// Traction along the skin, three f32 a vertex, Pa, in the finger's frame.
    Shear,
    /// How far the skin has moved, three f32 a vertex, mm, in the finger's frame.
    Displacement,
    /// How wrong the answer is likely to be: an [`ErrorEstimate`](crate::ErrorEstimate).
    ErrorEstimate,
    /// A [`Summary`](crate::Summary).
    Summary,
    /// SED, one f32 a point, J/m3.
    Points,
    /// Firing rate of SA1 afferents, one f32 a point, Hz.
    PointRates,
    /// One f32 an actuator.
    Actuators,
    /// [`Fired`](crate::spikes::Fired): who fired, and when.
    Spikes,
    /// Firing rates of SA1 afferents where the map of SED, or its vertices, are, Hz: a head of
    /// [`RATES_HEAD_LEN`] bytes, then samples. It is never cut to a window.
    Rates,
    /// The samples of the map, SED; always last.
    Map,
    /// SED at the vertices of the atlas, in place of the map.
    Vertices,
}

#[cfg(test)]
mod tests;
