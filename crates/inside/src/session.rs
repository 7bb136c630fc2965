//! One hand: frames in, sections of answers out.

use std::{
    sync::{Arc, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use bytes::BytesMut;
use papilla_codec::{Input, Map, Output, Quantity, decode, encode, scale_of};
use papilla_engine::EngineError;
use papilla_proto::{
    ErrorCode, ErrorEstimate, FrameHeader, HEADER_LEN, Hello, MAP_LEN, MAP_SIDE_PX, MapSummary,
    PROTOCOL_VERSION, PressureRange, Problem, Ready, RuntimeEffect, SampleType, Window,
    effects::{OutOfRange, Section, SectionName},
    flags,
};
use papilla_render::{Known, KnownErrors, Maps, Read, Rendering, Source, source_of};
use papilla_session_contact::{Finger, FrameForm, Hand};
use papilla_session_effects as effects;
use papilla_session_effects::Effects;

use crate::{Model, Network, hello};

/// A hand, and the memory of its frames: after [`open`](Self::open) only the network allocates.
pub struct Session {
    model: Arc<Model>,
    /// The network that `network` is a session of.
    of: Arc<Network>,
    network: Box<dyn papilla_engine::Session>,
    hand: Hand,
    /// Of each finger; none if the bare map is asked for.
    effects: Vec<Effects>,
    range: PressureRange,
    hello: Hello,
    maps: Maps,
    /// Room for a header, and behind it the sections of the last answer.
    message: BytesMut,
    /// Time that the network took when the session was opened.
    infer: Duration,
}

/// What a frame says.
#[derive(Debug, Clone, Copy)]
pub enum Frame<'a> {
    /// Nobody knows where things are, or what presses.
    NotTracked,
    /// A whole map of pressure, Pa, where the hello's frames are maps.
    Map(&'a [f32]),
    /// Samples of a part of the map, where the hello's frames are maps.
    Window {
        /// Which.
        window: Window,
        /// Type of the samples.
        sample_type: SampleType,
        /// Pa per unit of scaled samples; 0 for the hello's.
        scale: f32,
        /// The samples.
        payload: &'a [u8],
    },
    /// All other samples: poses, gaps, pressure at vertices.
    Rows {
        /// Type of the samples.
        sample_type: SampleType,
        /// Pa per unit of scaled samples; 0 for the hello's.
        scale: f32,
        /// The samples.
        payload: &'a [u8],
    },
}

/// What is not a section of an answer.
#[derive(Debug, Clone, Copy)]
pub struct Made {
    /// Bits of [`papilla_proto::flags`].
    pub flags: u8,
    /// Whether the network was asked, or would have been with a contact.
    pub shows_sed: bool,
    /// The pixels of the map that is sent.
    pub window: Window,
    /// Unit of scaled samples of SED.
    pub scale: f32,
    /// Time in the network.
    pub infer: Duration,
    /// How wrong the answer is likely to be.
    pub errors: ErrorEstimate,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("model", &self.model).finish_non_exhaustive()
    }
}

fn of_engine(error: &EngineError) -> Problem {
    Problem::new(ErrorCode::Internal, format!("the inference failed: {error}"))
}

impl Session {
    /// Takes all memory that the frames of this hello need.
    ///
    /// # Errors
    /// A member is unusable or missing; the problem names it.
    pub fn open(model: &Arc<Model>, hello: &Hello) -> Result<Self, Problem> {
        hello::check_form(hello)?;
        let of = hello::choose(hello, model)?;
        let Model { bundle, interface, shared, .. } = &**model;
        let hand = Hand::of(hello, bundle.skin())?;
        let (atlas, skin) = (&bundle.atlas, &bundle.raster);
        let finger = effects::Finger { atlas, skin, interface, shared };
        let mut effects = Vec::with_capacity(hand.fingers().len());
        for _ in hand.fingers() {
            effects.extend(Effects::of(hello, finger)?);
        }
        let mut network = of.model.session().map_err(|error| of_engine(&error))?;
        let mut maps = Maps::default();
        let mut infer = Duration::ZERO;
        if effects.first().is_none_or(Effects::shows_sed) {
            // The network's memory is touched before the first frame.
            let start = Instant::now();
            maps.infer(network.as_mut()).map_err(|error| of_engine(&error))?;
            infer = start.elapsed();
        }
        let range = PressureRange {
            trained_max_pa: of.model.info().pressure_max_pa,
            beyond: hello.out_of_range.unwrap_or(OutOfRange::Clamp),
        };
        let mut session = Self {
            model: Arc::clone(model),
            of,
            network,
            hand,
            effects,
            range,
            hello: hello.clone(),
            maps,
            message: BytesMut::new(),
            infer,
        };
        let end = |s: &Section| (s.offset + s.bytes) as usize;
        let most = session.sections().iter().map(end).max().unwrap_or(0);
        session.message.reserve(most);
        Ok(session)
    }

    /// What the hello's frames look like.
    #[must_use]
    pub fn form(&self) -> FrameForm {
        self.hand.form()
    }

    /// The fingers, and how pressure is found.
    #[must_use]
    pub fn hand(&self) -> &Hand {
        &self.hand
    }

    /// Whether effects were asked for; if not, answers hold the bare map, which
    /// [`append_map`](Self::append_map) adds.
    #[must_use]
    pub fn has_effects(&self) -> bool {
        !self.effects.is_empty()
    }

    /// The sections of an answer, each with its place behind the header.
    #[must_use]
    pub fn sections(&self) -> Vec<Section> {
        let output = Output::Samples(self.answer_sample_type());
        let (offset, bytes) = (HEADER_LEN as u32, output.size_hint() as u32);
        let bare = [Section { name: SectionName::Map, offset, bytes }];
        let rest = self.effects.first().map_or(&bare[..], Effects::sections);
        let behind = self.hand.sections_len() as u32;
        let moved = rest.iter().map(|s| Section { offset: s.offset + behind, ..*s });
        self.hand.sections().iter().copied().chain(moved).collect()
    }

    /// Whether a header is that of a frame this session takes; the number of its finger.
    ///
    /// # Errors
    /// The first that does not fit; the problem names the field of the header.
    pub fn check(&self, header: &FrameHeader) -> Result<usize, Problem> {
        self.hand.form().accept(header, self.hello.sample_type)
    }

    /// Type of the samples of answers.
    #[must_use]
    pub fn answer_sample_type(&self) -> SampleType {
        self.hello.answer_sample_type.unwrap_or(self.hello.sample_type)
    }

    /// Whether anything that was asked for shows SED.
    fn shows_sed(&self) -> bool {
        self.effects.first().is_none_or(Effects::shows_sed)
    }

    /// What the session agreed to, as a service says it. Latency is that of one run of the network.
    #[must_use]
    pub fn ready(&self) -> Ready {
        let Self { model, of, hand, .. } = self;
        let info = of.model.info();
        let method = hand.method();
        let errors = model.bundle.contact_errors.as_ref();
        let effects = self.effects.first();
        let unlearnt = model.unlearnt(of, self.hello.input.unwrap_or_default());
        let unlearnt = unlearnt.filter(|_| self.shows_sed());
        Ready {
            version: PROTOCOL_VERSION.into(),
            session: 0,
            tier: info.name.clone(),
            effects: info.effects.clone(),
            atlas_hash: info.atlas_hash.clone(),
            predicted_latency_us: u64::try_from(self.infer.as_micros()).unwrap_or(u64::MAX),
            budget_us: None,
            meets_budget: None,
            width: MAP_SIDE_PX as u32,
            height: MAP_SIDE_PX as u32,
            sample_type: self.hello.sample_type,
            pressure_max_pa: info.pressure_max_pa,
            sed_scale_j_per_m3: scale_of(
                Output::Samples(self.answer_sample_type()),
                info.sed_max_j_per_m3,
            ),
            tier_number: 0,
            tier_names: None,
            answer_sample_type: self.answer_sample_type(),
            session_effects: effects.map(|e| e.names().to_vec()).unwrap_or_default(),
            sections: self.sections(),
            units: effects.and_then(Effects::units).map(<[_]>::to_vec),
            state: None,
            vertices: model.bundle.atlas.vertex_count() as u32,
            fingers: hand.fingers().len() as u32,
            contact_us: None,
            finger_terms: None,
            method,
            expected_error: errors.zip(method).and_then(|(errors, of)| errors.of(of)).cloned(),
            warnings: hand.warnings().iter().cloned().chain(unlearnt).collect(),
        }
    }

    /// The effects that were asked for.
    #[must_use]
    pub fn effects(&self) -> &[RuntimeEffect] {
        self.effects.first().map_or(&[], Effects::names)
    }

    /// Sections of the answer to the last frame that was rendered, the first at byte 0.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.message.get(HEADER_LEN..).unwrap_or_default()
    }

    /// The answer to the last frame that was rendered, as a service would send it: this header, and the
    /// sections behind it.
    pub fn message(&mut self, header: &FrameHeader) -> &[u8] {
        if let Some(room) = self.message.first_chunk_mut() {
            *room = header.encode();
        }
        &self.message
    }

    /// SED of the last frame that was rendered, 224 x 224, J/m3.
    #[must_use]
    pub fn sed_j_per_m3(&self) -> &[f32] {
        &self.maps.sed_j_per_m3
    }

    /// Renders a frame of a finger, at a time of the client's clock.
    ///
    /// # Errors
    /// Poses, gaps or pressure that cannot be, or a frame of another kind than the hello's; the session
    /// goes on.
    pub fn render(
        &mut self,
        finger: usize,
        frame: Frame<'_>,
        time_us: u64,
    ) -> Result<Made, Problem> {
        self.message.clear();
        self.message.resize(HEADER_LEN, 0);
        let shows_sed = self.shows_sed();
        let Self { model, of, hand, effects, maps, range, network, message: answer, .. } = self;
        let Some(of_finger) = hand.fingers().get(finger) else {
            let fingers = hand.fingers().len();
            let message = format!("finger {finger} was not announced; there are {fingers}");
            return Err(Problem::new(ErrorCode::BadContact, message).at("finger"));
        };
        let mut of_finger = lock(of_finger);
        let mut effects = effects.get_mut(finger);
        let is_tracked = !matches!(frame, Frame::NotTracked);
        let hello_scale = self.hello.pressure_scale_pa;
        let unit = |scale: f32| match hello_scale {
            Some(of_hello) if scale.abs() <= 0.0 => of_hello,
            _ => scale,
        };
        if of_finger.reads_windows() == matches!(frame, Frame::Rows { .. }) && is_tracked {
            let message = "the frame is of another kind than the hello's";
            return Err(Problem::new(ErrorCode::WrongType, message).at("kind"));
        }
        let (summary, mut found, source) = match frame {
            Frame::NotTracked => {
                let effects = effects.as_deref_mut();
                let (summary, flags) = papilla_render::lose(maps, Some(&mut of_finger), effects);
                (summary, flags, Source::Other)
            }
            Frame::Map(pressure_pa) => {
                if pressure_pa.len() != MAP_LEN {
                    let message = format!("{} numbers came, {MAP_LEN} are due", pressure_pa.len());
                    return Err(Problem::new(ErrorCode::WrongLength, message).at("count"));
                }
                maps.pressure_pa.copy_from_slice(pressure_pa);
                (maps.check_of(&of_finger, *range, &model.bundle.pixels)?, 0, Source::Map)
            }
            Frame::Window { window, sample_type, scale, payload } => {
                let input = Input::Window { window, sample_type, scale: unit(scale) };
                decode(input, payload, &mut maps.pressure_pa)?;
                (maps.check_of(&of_finger, *range, &model.bundle.pixels)?, 0, Source::Map)
            }
            Frame::Rows { sample_type, scale, payload } => {
                let rows = papilla_session_contact::Frame {
                    payload,
                    sample_type,
                    scale: unit(scale),
                    time_us,
                };
                let taken = maps.take(&mut of_finger, rows, *range, shows_sed)?;
                (MapSummary { peak_pa: taken.peak_pa }, taken.flags, source_of(&taken))
            }
        };
        let tells_error = of_finger.tells_error();
        let known = Known {
            skin: &model.bundle.pixels,
            input_max: of.card.input_statistics_max,
            response_max_per_mpa: of.card.response_max_per_mpa,
            errors: model
                .error_laws
                .as_ref()
                .filter(|_| tells_error)
                .map(|laws| KnownErrors { laws, onnx_sha256: Some(&of.card.onnx_sha256) }),
        };
        let read = Read { summary, range: *range, time_us, is_tracked, shows_sed, source };
        let mut rendering =
            Rendering::begin(maps, Some(&mut of_finger), effects.as_deref_mut(), known, read);
        let mut infer = Duration::ZERO;
        if rendering.touches() {
            let start = Instant::now();
            rendering.infer(network.as_mut()).map_err(|error| of_engine(&error))?;
            infer = start.elapsed();
        }
        found |= rendering.flags();
        let (time_us, errors) = (rendering.time_us(), rendering.error_estimate());
        rendering.end(network.as_mut()).map_err(|error| of_engine(&error))?;
        of_finger.write(answer);
        papilla_render::require_finite(&answer[HEADER_LEN..])?;
        if tells_error {
            answer.extend_from_slice(&errors.encode());
        }
        let (window, scale) = (Window::WHOLE, 1.0);
        let mut made = Made { flags: found, shows_sed, window, scale, infer, errors };
        if let Some(effects) = effects {
            let written = effects.write(&maps.pressure_pa, &maps.sed_j_per_m3, time_us, answer);
            let written = written.map_err(|error| {
                Problem::new(ErrorCode::Internal, format!("the answer cannot be written: {error}"))
            })?;
            (made.window, made.scale) = (written.window, written.scale);
            made.flags |= if written.is_clipped { flags::OUT_OF_RANGE } else { 0 };
        }
        Ok(made)
    }

    /// Appends the bare map to the sections, where no effects were asked for.
    ///
    /// # Errors
    /// A value is not finite.
    pub fn append_map(&mut self, made: &mut Made) -> Result<(), Problem> {
        let sample_type = self.answer_sample_type();
        let values = &self.maps.sed_j_per_m3[..];
        if sample_type.clips(values) {
            made.flags |= flags::OUT_OF_RANGE;
        }
        let map = Map { quantity: Quantity::Sed, values, source: &self.of.card.name };
        made.scale =
            encode(Output::Samples(sample_type), map, &mut self.message).map_err(|error| {
                Problem::new(ErrorCode::Internal, format!("the map cannot be encoded: {error}"))
            })?;
        Ok(())
    }
}

/// A session belongs to one thread, so nobody waits here.
fn lock(finger: &std::sync::Mutex<Finger>) -> MutexGuard<'_, Finger> {
    finger.lock().unwrap_or_else(PoisonError::into_inner)
}
