//! The effects of a session: what it asks for beside the map of SED. Each effect has a file.
//!
//! A frame passes them in this order: `relaxation` before the network, `shear_energy` after it (the
//! finger of the session computes it, since it knows the traction), `afferents` and `spikes`, and then
//! those that use their results. **Invariant:** an effect that the hello did not name is neither
//! computed nor allocated. One that it named takes its memory at the hello, and none in a frame.
//!
//! ```
//! use bytes::BytesMut;
//! use papilla_proto::{
//!     HEADER_LEN, Hello, MAP_LEN, Summary,
//!     atlas::{Atlas, Patch, PatchVertices, Raster},
//! };
//! use papilla_session_effects::{Effects, Finger, Shared};
//!
//! // A plane finger: both surfaces are one square of 18 mm, 0.1 mm a pixel.
//! let uv_px = vec![[20.0, 20.0], [200.0, 20.0], [200.0, 200.0], [20.0, 200.0]];
//! let positions_mm = uv_px.iter().map(|[u, v]| [0.1 * v, -0.1 * u, 0.0]).collect();
//! let patch = PatchVertices { positions_mm, uv_px };
//! let atlas = Atlas::new(0.1, vec![[0, 2, 1], [0, 3, 2]], patch.clone(), patch)?;
//! let [skin, interface] = [Patch::Skin, Patch::Interface].map(|of| Raster::new(&atlas, of));
//! let shared = Shared::default();
//! let finger = Finger { atlas: &atlas, skin: &skin, interface: &interface, shared: &shared };
//!
//! let hello = Hello {
//!     effects: vec!["summary".to_owned()],
//!     map: Some(false),
//!     ..Hello::default()
//! };
//! let mut effects = Effects::of(&hello, finger)?.expect("the hello names one");
//!
//! let (pressure_pa, sed_j_per_m3) = (vec![1000.0; MAP_LEN], vec![5.0; MAP_LEN]);
//! let mut answer = BytesMut::zeroed(HEADER_LEN);
//! effects.write(&pressure_pa, &sed_j_per_m3, 0, &mut answer)?;
//! let summary = Summary::decode(&answer[HEADER_LEN..]).expect("it lies there");
//! // 1000 Pa on 324 mm2.
//! assert!((summary.force_n - 0.324).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod actuators;
mod afferents;
mod cost;
mod finger;
mod geometry;
mod pins;
mod points;
mod relaxation;
mod spikes;
mod summary;
mod vertices;
mod window;

#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Instant;

use bytes::BytesMut;
use papilla_proto::{
    ErrorCode, HEADER_LEN, Hello, MAP_LEN, Problem, RuntimeEffect, SUMMARY_LEN, SampleError,
    SampleType, Window,
    contact::SampleLayout,
    effects::{ActuatorInput, Drive, Layout, RATES_HEAD_LEN, Section, SectionName},
    finite::first_not_finite_in,
    flags,
    sample::require_finite,
    spikes::PlacedUnit,
};

use papilla_session_state::{Clock, Pace, Reader, StateError, Writer};

pub use cost::measure;
pub use finger::{Cost, Finger, Shared};

use self::{
    actuators::Actuators, afferents::Afferents, geometry::Geometry, pins::Pins, points::Points,
    relaxation::Relaxation, spikes::Spikes, summary::Contact, vertices::Vertices,
};

/// The effects of one session and their state.
#[derive(Debug)]
pub struct Effects {
    /// Those that were asked for, in the order in which they act.
    names: Vec<RuntimeEffect>,
    /// What the payload of an answer holds.
    sections: Vec<Section>,
    sample_type: SampleType,
    contact_pa: f32,
    map: bool,
    vertices: Option<Vertices>,
    relaxation: Option<Relaxation>,
    afferents: Option<Afferents>,
    /// Whether the map of rates goes beside that of SED.
    shows_rates: bool,
    spikes: Option<(Arc<Geometry>, Spikes)>,
    /// The client's, where something goes by it.
    clock: Option<Clock>,
    /// Whether its times are in us.
    pace: Pace,
    /// Nobody knows what presses in this frame.
    is_lost: bool,
    margin_px: Option<u16>,
    summary: Option<Arc<Geometry>>,
    points: Option<Points>,
    actuators: Option<Display>,
}

/// A display, by how its intensities are found.
#[derive(Debug)]
enum Display {
    Formula(ActuatorInput, Actuators),
    Pins(Box<Pins>),
}

impl Display {
    fn new(layout: &Layout, finger: Finger<'_>, has_rates: bool) -> Result<Self, Problem> {
        if layout.input == ActuatorInput::Sa1Rate && !has_rates {
            let message = "input 'sa1_rate' needs the effect 'afferents'";
            return Err(unusable("actuators", message));
        }
        let geometry = finger.geometry();
        if layout.drive == Drive::Formula {
            return Ok(Self::Formula(layout.input, Actuators::new(layout, &geometry)?));
        }
        Ok(Self::Pins(Box::new(Pins::new(layout, finger, &geometry)?)))
    }

    fn len(&self) -> usize {
        match self {
            Self::Formula(_, actuators) => actuators.len(),
            Self::Pins(pins) => pins.len(),
        }
    }
}

/// What [`Effects::write`] put into an answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Written {
    /// The pixels whose samples were written.
    pub window: Window,
    /// Unit of scaled samples of SED.
    pub scale: f32,
    /// Whether a sample was beyond what its type can hold, and is smaller than what it stands for.
    pub is_clipped: bool,
}

/// Why an answer cannot be written: a fault of the caller or of ours, never of a client.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WriteError {
    /// Values of the map that are not finite, or a scale that is none.
    #[error(transparent)]
    Samples(#[from] SampleError),
    /// A number of a section is not finite.
    #[error("number {index} of the section {section:?} is not finite")]
    NotFinite {
        /// The section.
        section: SectionName,
        /// Its place in the section, from 0.
        index: usize,
    },
}

/// A refusal of an effect's parameters.
fn unusable(field: &str, message: impl Into<String>) -> Problem {
    Problem::new(ErrorCode::BadEffect, message).at(field)
}

/// Refuses the last finger if its answers would be laid out otherwise than those of the first; `effects`
/// are those of the fingers up to it.
///
/// # Errors
/// The sections differ.
pub fn check_alike(effects: &[Effects]) -> Result<(), Problem> {
    if effects.last().map(Effects::sections) == effects.first().map(Effects::sections) {
        return Ok(());
    }
    let message = "answers would be laid out otherwise than those of fingers[0], since its atlas has \
                   not as many vertices, or the effect 'spikes' not as many units: ask for the \
                   layout \"map\", give the units by their places, or open a session for each of \
                   these fingers";
    let last = effects.len() - 1;
    Err(Problem::new(ErrorCode::BadContact, message).at(format!("fingers[{last}].name")))
}

impl Effects {
    /// The effects that a hello asks for; none if it asks for the bare map.
    ///
    /// Takes some milliseconds if there are points or actuators to be placed.
    ///
    /// # Errors
    /// Parameters are unusable, missing, or of an effect that is not named.
    pub fn of(hello: &Hello, finger: Finger<'_>) -> Result<Option<Self>, Problem> {
        let names = named(hello)?;
        let contact_pa = hello.contact_pa.unwrap_or(0.0);
        if !(contact_pa.is_finite() && contact_pa >= 0.0) {
            let message = format!("{contact_pa} Pa is no pressure; name 0 or more");
            return Err(unusable("contact_pa", message));
        }
        let map = hello.map.unwrap_or(true);
        let by_vertices = hello.answer_layout == Some(SampleLayout::Vertices);
        if names.is_empty() && map && !by_vertices {
            return Ok(None);
        }
        let has = |effect| names.contains(&effect);
        let geometry = || finger.geometry();
        let relaxation = has(RuntimeEffect::Relaxation)
            .then(|| Relaxation::new(&hello.relaxation.clone().unwrap_or_default()))
            .transpose()?;
        let afferents = has(RuntimeEffect::Afferents)
            .then(|| Afferents::new(hello.afferents.unwrap_or_default()))
            .transpose()?;
        let spikes = has(RuntimeEffect::Spikes)
            .then(|| {
                let (of, geometry) = (hello.spikes.clone().unwrap_or_default(), geometry());
                Spikes::new(&of, finger, &geometry).map(|spikes| (geometry, spikes))
            })
            .transpose()?;
        let points = match &hello.points {
            Some(places) => Some(Points::new(places, &geometry())?),
            None => None,
        };
        let place = |layout| Display::new(layout, finger, afferents.is_some());
        let actuators = hello.actuators.as_ref().map(place).transpose()?;
        let summary = has(RuntimeEffect::Summary).then(geometry);
        let margin_px = has(RuntimeEffect::ContactWindow)
            .then(|| hello.contact_window.unwrap_or_default().margin_px);
        let sample_type = hello.answer_sample_type.unwrap_or(hello.sample_type);
        let has_time = relaxation.is_some() || afferents.is_some() || spikes.is_some();
        let mut effects = Self {
            names,
            sections: Vec::new(),
            sample_type,
            contact_pa,
            map: map && !by_vertices,
            vertices: (map && by_vertices).then(|| Vertices::new(finger)),
            relaxation,
            shows_rates: map && hello.afferents.unwrap_or_default().map,
            afferents,
            spikes,
            clock: has_time.then(Clock::new),
            pace: Pace::default(),
            is_lost: false,
            margin_px,
            summary,
            points,
            actuators,
        };
        effects.sections = effects.laid_out();
        Ok(Some(effects))
    }

    /// Each section with its place behind the header.
    fn laid_out(&self) -> Vec<Section> {
        let floats = |count: usize| 4 * count;
        let rates = self.afferents.as_ref();
        let shown = match (&self.vertices, self.map) {
            (Some(vertices), _) => vertices.len(),
            (None, true) => MAP_LEN,
            (None, false) => 0,
        };
        let rate_map = rates
            .filter(|_| self.shows_rates)
            .map(|_| RATES_HEAD_LEN + shown * self.sample_type.bytes());
        let parts = [
            (SectionName::Summary, self.summary.as_ref().map(|_| SUMMARY_LEN)),
            (SectionName::Points, self.points.as_ref().map(|points| floats(points.len()))),
            (
                SectionName::PointRates,
                self.points.as_ref().zip(rates).map(|(points, _)| floats(points.len())),
            ),
            (SectionName::Actuators, self.actuators.as_ref().map(|display| floats(display.len()))),
            (SectionName::Spikes, self.spikes.as_ref().map(|(_, spikes)| spikes.len())),
            (SectionName::Rates, rate_map),
            (SectionName::Map, self.map.then(|| MAP_LEN * self.sample_type.bytes())),
            (
                SectionName::Vertices,
                self.vertices.as_ref().map(|v| v.len() * self.sample_type.bytes()),
            ),
        ];
        let mut offset = HEADER_LEN;
        let mut sections = Vec::new();
        for (name, bytes) in parts {
            let Some(bytes) = bytes else { continue };
            sections.push(Section { name, offset: offset as u32, bytes: bytes as u32 });
            offset = (offset + bytes).next_multiple_of(16);
        }
        sections
    }

    /// Whether anything that was asked for shows SED: without, the network need not be asked.
    #[must_use]
    pub fn shows_sed(&self) -> bool {
        !self.sections.is_empty()
    }

    /// The effects that were asked for, in the order in which they act.
    #[must_use]
    pub fn names(&self) -> &[RuntimeEffect] {
        &self.names
    }

    /// Whether one of them changes the pressure on the tissue, or the SED of it: creep, and traction
    /// along the skin.
    #[must_use]
    pub fn changes_tissue(&self) -> bool {
        let changes = |of: &RuntimeEffect| {
            matches!(of, RuntimeEffect::Relaxation | RuntimeEffect::ShearEnergy)
        };
        self.names.iter().any(changes)
    }

    /// What the payload of an answer holds.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The units of the effect `spikes`, by number; none without it.
    #[must_use]
    pub fn units(&self) -> Option<&[PlacedUnit]> {
        self.spikes.as_ref().map(|(_, spikes)| spikes.placed())
    }

    /// Most bytes of an answer, its header included.
    #[must_use]
    pub fn size_hint(&self) -> usize {
        self.sections.last().map_or(HEADER_LEN, |s| (s.offset + s.bytes) as usize)
    }

    /// Whether an answer depends on the frames before it.
    #[must_use]
    pub fn has_state(&self) -> bool {
        self.clock.is_some()
    }

    /// The time of the next frame, us, by which [`before`](Self::before) and [`write`](Self::write) go:
    /// the client's stamp, or, of a clock that ticks coarsely, a time within its tick.
    pub fn time_us(&mut self, stamp_us: u64) -> u64 {
        let Some(clock) = &mut self.clock else { return stamp_us };
        self.pace.take(stamp_us, Instant::now());
        clock.time_us(stamp_us)
    }

    /// Bits of [`flags`] that tell of the client's clock.
    #[must_use]
    pub fn clock_flags(&self) -> u8 {
        let is_coarse = self.clock.as_ref().is_some_and(Clock::is_coarse);
        if is_coarse || self.pace.is_of_another_unit() { flags::COARSE_CLOCK } else { 0 }
    }

    /// In place of [`before`](Self::before) where nobody knows what presses: the answer to this frame
    /// shows nothing, and what effects remember waits for the next.
    pub fn lose(&mut self) {
        self.is_lost = true;
        self.clock.iter_mut().for_each(Clock::forget);
        self.relaxation.iter_mut().for_each(Relaxation::lose);
        self.afferents.iter_mut().for_each(Afferents::lose);
        self.spikes.iter_mut().for_each(|(_, spikes)| spikes.lose());
    }

    /// Writes what answers depend on of the frames before.
    pub fn save(&self, state: &mut Writer) {
        if let Some(clock) = &self.clock {
            clock.save(state);
        }
        if let Some(relaxation) = &self.relaxation {
            relaxation.save(state);
        }
        if let Some(afferents) = &self.afferents {
            afferents.save(state);
        }
        if let Some((_, spikes)) = &self.spikes {
            spikes.save(state);
        }
    }

    /// Goes on from what the effects of the same hello have [saved](Self::save).
    ///
    /// # Errors
    /// The state is of other effects; these are of no use any more.
    pub fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        if let Some(clock) = &mut self.clock {
            clock.restore(state)?;
        }
        if let Some(relaxation) = &mut self.relaxation {
            relaxation.restore(state)?;
        }
        if let Some(afferents) = &mut self.afferents {
            afferents.restore(state)?;
        }
        if let Some((_, spikes)) = &mut self.spikes {
            spikes.restore(state)?;
        }
        Ok(())
    }

    /// What acts before the network: turns the pressure that was sent into that which the elastic
    /// map is to be asked about. The greatest pressure that results; none if nothing changed.
    pub fn before(&mut self, pressure_pa: &mut [f32], time_us: u64) -> Option<f32> {
        self.relaxation.as_mut().map(|relaxation| relaxation.step(pressure_pa, time_us))
    }

    /// Fits the drive of pins to the frame's SED, both of the finger that the network knows;
    /// `infer` asks the network about their pressure. Nothing to do, and nothing asked, if the
    /// display has another [drive](Drive).
    ///
    /// # Errors
    /// Those of `infer`.
    pub fn fit<E>(
        &mut self,
        sed_j_per_m3: &[f32],
        infer: impl FnOnce(&[f32], &mut [f32]) -> Result<(), E>,
    ) -> Result<(), E> {
        match &mut self.actuators {
            Some(Display::Pins(pins)) => pins.fit(sed_j_per_m3, infer),
            _ => Ok(()),
        }
    }

    /// The pressures that [`fit`](Self::fit) found, Pa, one a pin: to be turned into this person's.
    pub fn pin_pa_mut(&mut self) -> &mut [f32] {
        match &mut self.actuators {
            Some(Display::Pins(pins)) => pins.drive_pa_mut(),
            _ => &mut [],
        }
    }

    /// What acts after the network: appends every section to `bytes`, which holds the header.
    ///
    /// `pressure_pa` is what [`before`](Self::before) left.
    ///
    /// # Errors
    /// A number of the answer is not finite: a fault of the caller.
    pub fn write(
        &mut self,
        pressure_pa: &[f32],
        sed_j_per_m3: &[f32],
        time_us: u64,
        bytes: &mut BytesMut,
    ) -> Result<Written, WriteError> {
        let before = bytes.len();
        require_finite(sed_j_per_m3)?;
        let written = self.append(pressure_pa, sed_j_per_m3, time_us, bytes)?;
        self.check_sections(&bytes[before..])?;
        Ok(written)
    }

    /// The last look at what was written.
    fn check_sections(&self, written: &[u8]) -> Result<(), WriteError> {
        for &Section { name, offset, bytes } in &self.sections {
            let is_f32 = match name {
                SectionName::Spikes => false,
                SectionName::Map | SectionName::Vertices | SectionName::Rates => {
                    self.sample_type == SampleType::F32
                }
                _ => true,
            };
            let first = offset as usize - HEADER_LEN;
            // A window is shorter than the whole map.
            let end = (first + bytes as usize).min(written.len());
            let found = written.get(first..end).filter(|_| is_f32).and_then(first_not_finite_in);
            if let Some(index) = found {
                return Err(WriteError::NotFinite { section: name, index });
            }
        }
        Ok(())
    }

    fn append(
        &mut self,
        pressure_pa: &[f32],
        sed_j_per_m3: &[f32],
        time_us: u64,
        bytes: &mut BytesMut,
    ) -> Result<Written, SampleError> {
        let is_lost = std::mem::take(&mut self.is_lost);
        if let Some(afferents) = self.afferents.as_mut().filter(|_| !is_lost) {
            afferents.step(sed_j_per_m3, time_us);
        }
        let rate_hz = self.afferents.as_ref().map(Afferents::rate_hz);
        rate_hz.map_or(Ok(()), require_finite)?;
        let felt = self.relaxation.as_ref().filter(|_| !is_lost);
        let sent_pa = felt.map_or(pressure_pa, Relaxation::sent_pa);
        if let Some(geometry) = &self.summary {
            let contact = Contact { pressure_pa: sent_pa, above_pa: self.contact_pa };
            let summary = summary::of(geometry, contact, sed_j_per_m3, rate_hz);
            bytes.extend_from_slice(&summary.encode());
        }
        if let Some(points) = &self.points {
            for map in [Some(sed_j_per_m3), rate_hz].into_iter().flatten() {
                pad(bytes);
                points.write(map, bytes);
            }
        }
        if let Some(display) = &self.actuators {
            pad(bytes);
            match display {
                Display::Formula(ActuatorInput::Sed, by) => by.write(sed_j_per_m3, bytes),
                Display::Formula(ActuatorInput::Sa1Rate, by) => {
                    by.write(rate_hz.unwrap_or_default(), bytes);
                }
                Display::Pins(pins) => pins.write(bytes),
            }
        }
        if let Some((geometry, spikes)) = &mut self.spikes {
            pad(bytes);
            if !is_lost {
                spikes.step(geometry, sent_pa, sed_j_per_m3, time_us);
            }
            spikes.write(time_us, bytes);
        }
        if let Some(rate_hz) = rate_hz.filter(|_| self.shows_rates) {
            pad(bytes);
            let head = bytes.len();
            bytes.resize(head + RATES_HEAD_LEN, 0);
            let scale = match &mut self.vertices {
                Some(vertices) => vertices.write(rate_hz, self.sample_type, bytes)?,
                None => window::encode(Window::WHOLE, self.sample_type, rate_hz, bytes)?,
            };
            bytes[head..head + 4].copy_from_slice(&scale.to_le_bytes());
        }
        if let Some(vertices) = &mut self.vertices {
            pad(bytes);
            let scale = vertices.write(sed_j_per_m3, self.sample_type, bytes)?;
            return Ok(Written {
                window: Window::EMPTY,
                scale,
                is_clipped: self.sample_type.clips(sed_j_per_m3),
            });
        }
        if !self.map {
            return Ok(Written { window: Window::EMPTY, scale: 1.0, is_clipped: false });
        }
        pad(bytes);
        let window = self
            .margin_px
            .map_or(Window::WHOLE, |margin| Window::around(sent_pa, self.contact_pa, margin));
        let scale = window::encode(window, self.sample_type, sed_j_per_m3, bytes)?;
        Ok(Written { window, scale, is_clipped: self.sample_type.clips(sed_j_per_m3) })
    }
}

/// Zeros up to the next multiple of 16, where a section begins.
fn pad(bytes: &mut BytesMut) {
    bytes.resize(bytes.len().next_multiple_of(16), 0);
}

/// The run-time effects that a hello names, in the order in which they act.
fn named(hello: &Hello) -> Result<Vec<RuntimeEffect>, Problem> {
    let names: Vec<RuntimeEffect> = RuntimeEffect::ALL
        .into_iter()
        .filter(|effect| hello.effects.iter().any(|name| name == effect.as_str()))
        .collect();
    for (effect, given, due) in [
        (RuntimeEffect::ContactWindow, hello.contact_window.is_some(), false),
        (RuntimeEffect::Points, hello.points.is_some(), true),
        (RuntimeEffect::Actuators, hello.actuators.is_some(), true),
        (RuntimeEffect::Afferents, hello.afferents.is_some(), false),
        (RuntimeEffect::Spikes, hello.spikes.is_some(), false),
        (RuntimeEffect::Relaxation, hello.relaxation.is_some(), false),
    ] {
        let named = names.contains(&effect);
        if given && !named {
            let message = format!("'{effect}' has parameters, but 'effects' does not name it");
            return Err(unusable(effect.as_str(), message));
        }
        if named && due && !given {
            let message = format!("the effect '{effect}' needs the member '{effect}'");
            return Err(unusable(effect.as_str(), message));
        }
    }
    if names.contains(&RuntimeEffect::ShearEnergy) {
        if !hello.has_traction() {
            let message = "'shear_energy' needs traction: objects or gaps with friction, or \
                           pressure with 'traction'";
            return Err(unusable("shear_energy", message));
        }
        if names.contains(&RuntimeEffect::Relaxation) {
            let message = "'shear_energy' and 'relaxation': traction has no creep here; name one";
            return Err(unusable("shear_energy", message));
        }
    }
    let by_vertices = hello.answer_layout == Some(SampleLayout::Vertices);
    if names.contains(&RuntimeEffect::ContactWindow) && (hello.map == Some(false) || by_vertices) {
        let message = if by_vertices {
            "'contact_window' cuts the map, but 'answer_layout' is 'vertices'"
        } else {
            "'contact_window' cuts the map, but 'map' is false"
        };
        return Err(unusable("contact_window", message));
    }
    Ok(names)
}
