//! One hand: frames in, sections of answers out.

mod ready;

use std::{
    sync::{Arc, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use bytes::BytesMut;
use papilla_codec::{Input, Map, Output, Quantity, decode, encode};
use papilla_engine::EngineError;
use papilla_proto::{
    ErrorCode, ErrorEstimate, FrameHeader, HEADER_LEN, Hello, MAP_LEN, MapSummary, PressureRange,
    Problem, RuntimeEffect, SampleType, Window,
    effects::{OutOfRange, Section, SectionName},
    flags,
};
use papilla_render::{Known, KnownErrors, Maps, Read, Rendering, Source, source_of};
use papilla_session_contact::{Finger, FrameForm, Hand, of_finger};
use papilla_session_effects as effects;
use papilla_session_effects::{Effects, check_alike};

use crate::{Model, Network, hello};

/// What fingers of one folder share in a session.
struct Part {
    model: Arc<Model>,
    /// The network that `network` is a session of.
    of: Arc<Network>,
    network: Box<dyn papilla_engine::Session>,
    range: PressureRange,
    /// Time that the network took when the session was opened.
    infer: Duration,
}

/// A hand, and the memory of its frames: after [`open`](Self::open) only the network allocates.
pub struct Session {
    /// One for each folder that a finger is of, in the order of the fingers.
    parts: Vec<Part>,
    /// The part of each finger.
    part_of: Vec<usize>,
    hand: Hand,
    /// Of each finger; none if the bare map is asked for.
    effects: Vec<Effects>,
    hello: Hello,
    maps: Maps,
    /// Room for a header, and behind it the sections of the last answer.
    message: BytesMut,
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
    /// Number of the network, as `ready` gives it.
    pub tier: u16,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let models = self.parts.iter().map(|part| &part.model);
        f.debug_list().entries(models).finish()
    }
}

fn of_engine(error: &EngineError) -> Problem {
    Problem::new(ErrorCode::Internal, format!("the inference failed: {error}"))
}

impl Part {
    fn new(hello: &Hello, model: &Arc<Model>) -> Result<Self, Problem> {
        let of = hello::choose(hello, model)?;
        let network = of.model.session().map_err(|error| of_engine(&error))?;
        let range = PressureRange {
            trained_max_pa: of.model.info().pressure_max_pa,
            beyond: hello.out_of_range.unwrap_or(OutOfRange::Clamp),
        };
        Ok(Self { model: Arc::clone(model), of, network, range, infer: Duration::ZERO })
    }
}

impl Session {
    /// Takes all memory that the frames of this hello need. All its fingers are of this model.
    ///
    /// # Errors
    /// A member is unusable or missing; the problem names it.
    pub fn open(model: &Arc<Model>, hello: &Hello) -> Result<Self, Problem> {
        Self::open_each(model, &[], hello)
    }

    /// The same with fingers by name: a finger that the hello names is of the model beside its name, and all
    /// others of the first one.
    ///
    /// # Errors
    /// As [`Self::open`], also for a name that is not there, and for fingers whose answers would be laid out
    /// otherwise than those of the first.
    pub fn open_each(
        model: &Arc<Model>,
        named: &[(String, Arc<Model>)],
        hello: &Hello,
    ) -> Result<Self, Problem> {
        hello::check_form(hello, named)?;
        let models = hello::models(hello, model, named);
        let (mut parts, mut part_of): (Vec<Part>, Vec<usize>) = (Vec::new(), Vec::new());
        for (number, model) in models.iter().enumerate() {
            let known = parts.iter().position(|part| Arc::ptr_eq(&part.model, model));
            part_of.push(known.unwrap_or(parts.len()));
            if known.is_none() {
                let part = Part::new(hello, model);
                parts.push(part.map_err(|problem| of_finger(hello, number, problem))?);
            }
        }
        let skins: Vec<_> = models.iter().map(|model| model.bundle.skin()).collect();
        let hand = Hand::of_each(hello, skins[0], &skins, &|| true)?;
        let mut effects: Vec<Effects> = Vec::new();
        for (number, model) in models.iter().enumerate() {
            let Model { bundle, interface, shared, .. } = &***model;
            let (atlas, skin) = (&bundle.atlas, &bundle.raster);
            let of = Effects::of(hello, effects::Finger { atlas, skin, interface, shared });
            effects.extend(of.map_err(|problem| of_finger(hello, number, problem))?);
            check_alike(&effects).map_err(|problem| of_finger(hello, number, problem))?;
        }
        let mut maps = Maps::default();
        if effects.first().is_none_or(Effects::shows_sed) {
            // The networks' memory is touched before the first frame.
            for part in &mut parts {
                let start = Instant::now();
                maps.infer(part.network.as_mut()).map_err(|error| of_engine(&error))?;
                part.infer = start.elapsed();
            }
        }
        let message = BytesMut::new();
        let mut session =
            Self { parts, part_of, hand, effects, hello: hello.clone(), maps, message };
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
        let Self { parts, part_of, hand, effects, maps, message: answer, .. } = self;
        let Some(of_finger) = hand.fingers().get(finger) else {
            let fingers = hand.fingers().len();
            let message = format!("finger {finger} was not announced; there are {fingers}");
            return Err(Problem::new(ErrorCode::BadContact, message).at("finger"));
        };
        let tier = part_of[finger];
        let Part { model, of, network, range, .. } = &mut parts[tier];
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
            errors: model.error_laws.as_ref().map(|laws| KnownErrors {
                laws,
                onnx_sha256: Some(&of.card.onnx_sha256),
                is_asked: tells_error,
            }),
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
        let tier = tier as u16;
        let mut made = Made { flags: found, shows_sed, window, scale, infer, errors, tier };
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
        let source = &self.parts[usize::from(made.tier)].of.card.name;
        let map = Map { quantity: Quantity::Sed, values, source };
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
