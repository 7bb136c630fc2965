//! One inference thread: it decodes, checks, computes and encodes.

use std::{
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use bytes::BytesMut;
use papilla_codec::{Input, Map, Output, Quantity, decode, encode};
use papilla_engine::EngineError;
use papilla_metrics::{Metrics, Stage};
use papilla_processor::thread_time;
use papilla_proto::{
    ERROR_ESTIMATE_LEN, ErrorCode, ErrorEstimate, MapSummary, PressureRange, Problem, flags,
};
use papilla_render::{
    Known, KnownErrors, Maps, Read, Rendering, Source, require_finite, source_of,
};
use papilla_session_contact::{Finger, Frame};

use super::{
    Done, Job, JobOptions, Outcome, OutputMeta, POP_TIMEOUT, Slot, Times,
    account::{LONG, Spent},
    exchange::{Inbox, OfFinger},
    queue::{Next, Queue},
};
use crate::{
    StartError,
    core::{
        buffers::{HEADROOM, Recycler},
        catalogue::{Catalogue, places},
    },
    problem,
};

/// Everything that an inference thread owns. No frame allocates any of it.
pub(super) struct Worker {
    metrics: Arc<Metrics>,
    /// Indexed by the places of the fingers.
    fingers: Vec<OfFinger>,
    maps: Maps,
}

impl Worker {
    /// Makes and warms a session of every tier that is loaded.
    pub(super) fn prepare(
        catalogue: &Arc<Catalogue>,
        metrics: Arc<Metrics>,
    ) -> Result<Self, StartError> {
        let mut maps = Maps::default();
        let mut sessions = Vec::with_capacity(catalogue.tiers.len());
        for tier in &catalogue.tiers {
            let Maps { pressure_pa, sed_j_per_m3, .. } = &mut maps;
            let session =
                tier.model().map(|model| tier.warm_session(&**model, pressure_pa, sed_j_per_m3));
            sessions.push(session.transpose()?);
        }
        let fingers = vec![OfFinger { catalogue: Arc::clone(catalogue), sessions }];
        Ok(Self { metrics, fingers, maps })
    }

    /// Serves the queue until it is closed and empty.
    pub(super) fn run(&mut self, queue: &Queue, inbox: &Inbox) {
        loop {
            let next = queue.pop(POP_TIMEOUT);
            // This comes after the wait: a job for a new tier is submitted only once its session is
            // in the inbox.
            inbox.collect(&mut self.fingers);
            let turn = match next {
                Next::Turn(turn) => turn,
                Next::Nothing => continue,
                Next::Closed => return,
            };
            self.metrics.queue_length.set(queue.len());
            let (spent, is_again) = self.take_turn(&turn.slot);
            queue.done(turn, spent, is_again);
        }
    }

    /// Serves a slot. Returns what that cost, and whether another job has come meanwhile.
    fn take_turn(&mut self, slot: &Slot) -> (Spent, bool) {
        let (begun, cpu_begun) = (Instant::now(), thread_time());
        let mut spent = Spent { busy: Duration::ZERO, beside_network: None };
        let abandoned = slot.is_abandoned();
        let Some((mut job, mut recycler)) = slot.take() else { return (spent, false) };
        let done = if abandoned {
            finished(&job, Progress::default(), Outcome::Gone)
        } else {
            self.serve(&mut job, &mut recycler)
        };
        let is_rendered = matches!(done.outcome, Outcome::Map { .. });
        // A frame that failed or was late counts against its account if it took long. If it was
        // short, that says nothing, since it was not rendered.
        let beside_network =
            thread_time().saturating_sub(cpu_begun).saturating_sub(done.times.network);
        if is_rendered || beside_network > LONG {
            spent.beside_network = Some(beside_network);
        }
        if beside_network > LONG {
            self.metrics.long_frames.inc();
        }
        let is_again = slot.finish(done, recycler);
        spent.busy = begun.elapsed();
        (spent, is_again)
    }

    /// Renders one job. A panic becomes an error of this job alone.
    fn serve(&mut self, job: &mut Job, recycler: &mut Recycler) -> Done {
        let mut progress = Progress::default();
        progress.times.queue = job.received.elapsed();
        let outcome = if job.is_late() {
            Outcome::Late(Stage::Dequeue)
        } else {
            let rendered =
                catch_unwind(AssertUnwindSafe(|| self.render(job, recycler, &mut progress)));
            rendered.unwrap_or_else(|_| self.recover(job.tier))
        };
        let (tier, times) = (self.metrics.tier(job.tier), progress.times);
        tier.queue.observe(times.queue);
        if let Outcome::Map { .. } = outcome {
            tier.decode.observe(times.decode);
            tier.encode.observe(times.encode);
            if times.infer > Duration::ZERO {
                tier.infer.observe(times.infer);
            }
        }
        finished(job, progress, outcome)
    }

    /// Replaces the engine session that panicked by a new one.
    fn recover(&mut self, number: usize) -> Outcome {
        let (finger, place) = places(number);
        let OfFinger { catalogue, sessions } = &mut self.fingers[finger];
        let tier = &catalogue.tiers[place];
        if let Some(Ok(session)) = tier.model().map(|model| model.session()) {
            sessions[place] = Some(session);
        }
        Outcome::Failed(problem::internal("the inference panicked", &tier.name))
    }

    fn render(
        &mut self,
        job: &mut Job,
        recycler: &mut Recycler,
        progress: &mut Progress,
    ) -> Outcome {
        match self.try_render(job, recycler, progress) {
            Ok(outcome) => outcome,
            Err(problem) => Outcome::Failed(problem),
        }
    }

    fn try_render(
        &mut self,
        job: &mut Job,
        recycler: &mut Recycler,
        Progress { times, meta }: &mut Progress,
    ) -> Result<Outcome, Problem> {
        let start = Instant::now();
        // Taken out of the job, and dropped before the network runs, so that the session gets the
        // frame's memory back early.
        let payload = mem::take(&mut job.payload);
        let options = &job.options;
        let mut effects = options.effects.as_ref().map(|e| lock(e));
        let mut finger = options.finger.as_ref().map(|f| lock(f));
        // A finger whose effects show no SED needs no network: poses go in and forces come out.
        let shows_sed = finger.is_none() || effects.as_ref().is_none_or(|e| e.shows_sed());
        let is_tracked = options.header.is_none_or(|header| header.is_tracked());
        let (summary, range, source) = if !is_tracked {
            let (maps, finger) = (&mut self.maps, finger.as_deref_mut());
            let (summary, flags) = papilla_render::lose(maps, finger, effects.as_deref_mut());
            meta.flags |= flags;
            (summary, self.range(job), Source::Other)
        } else if let Some(finger) = &mut finger {
            self.take(job, finger, &payload, shows_sed, meta)?
        } else {
            self.decode(job, &payload)?
        };
        drop(payload);
        let (of, place) = places(job.tier);
        let OfFinger { catalogue, sessions } = &mut self.fingers[of];
        let tier = &catalogue.tiers[place];
        let &JobOptions { headroom, time_us, .. } = options;
        // A map without a finger came by HTTP: headers of the answer state the error.
        let tells_error = finger.as_ref().is_none_or(|finger| finger.tells_error());
        let known = Known {
            skin: &catalogue.skin_pixels,
            input_max: tier.input_statistics_max,
            response_max_per_mpa: tier.response_max_per_mpa,
            errors: catalogue.error_laws.as_ref().map(|laws| KnownErrors {
                laws,
                is_asked: tells_error,
                // The error laws do not hold for a network that was trained on another finger.
                onnx_sha256: tier.trained_on.is_none().then_some(&tier.onnx_sha256),
            }),
        };
        let read = Read { summary, range, time_us, is_tracked, shows_sed, source };
        let (finger_here, effects_here) = (finger.as_deref_mut(), effects.as_deref_mut());
        let mut rendering =
            Rendering::begin(&mut self.maps, finger_here, effects_here, known, read);
        let time_us = rendering.time_us();
        let Some(session) = sessions[place].as_deref_mut() else {
            return Err(problem::internal("a frame of a tier that is not loaded", &tier.name));
        };
        let decoded = Instant::now();
        times.decode = decoded - start;

        let deadline = job.deadline;
        let misses =
            |deadline: Instant| tier.latency.will_miss(deadline.saturating_duration_since(decoded));
        let of_network = |doing: &'static str| {
            move |error: EngineError| {
                problem::internal(doing, &format_args!("{}.onnx: {error}", tier.name))
            }
        };
        if !rendering.touches() {
            if shows_sed {
                self.metrics.zero_maps.inc();
            }
        } else if deadline.is_some_and(misses) {
            meta.flags |= rendering.flags();
            return Ok(Outcome::Late(Stage::Inference));
        } else {
            let cpu_begun = thread_time();
            rendering.infer(session).map_err(of_network("the inference failed"))?;
            // To a network that was trained on another finger every map is unfamiliar.
            meta.flags |= if tier.trained_on.is_some() { flags::UNFAMILIAR } else { 0 };
            times.network = thread_time().saturating_sub(cpu_begun);
            times.infer = decoded.elapsed();
            tier.latency.learn(times.infer);
        }
        meta.flags |= rendering.flags();
        let start = Instant::now();
        meta.errors = rendering.error_estimate();
        let corrects = "the drive of the actuators cannot be corrected";
        rendering.end(session).map_err(of_network(corrects))?;
        let extra = finger.as_ref().map_or(0, |finger| finger.sections_len() + ERROR_ESTIMATE_LEN);
        let (bytes, scale) = if let Some(effects) = &mut effects {
            let buffer = recycler.claim(HEADROOM + effects.size_hint() + extra);
            begin_answer(buffer, headroom, finger.as_deref_mut(), &meta.errors)?;
            let Maps { pressure_pa, sed_j_per_m3: sed, .. } = &self.maps;
            let written = effects
                .write(pressure_pa, sed, time_us, buffer)
                .map_err(|error| problem::internal("the answer cannot be written", &error))?;
            meta.window = written.window;
            meta.flags |= if written.is_clipped { flags::OUT_OF_RANGE } else { 0 };
            (buffer.split(), written.scale)
        } else {
            let buffer = recycler.claim(headroom + job.output.size_hint() + extra);
            begin_answer(buffer, headroom, finger.as_deref_mut(), &meta.errors)?;
            let map = Map {
                quantity: Quantity::Sed,
                values: &self.maps.sed_j_per_m3,
                source: &tier.name,
            };
            if matches!(job.output, Output::Samples(of) if of.clips(map.values)) {
                meta.flags |= flags::OUT_OF_RANGE;
            }
            let scale = encode(job.output, map, buffer)
                .map_err(|error| problem::internal("the map cannot be encoded", &error))?;
            (buffer.split(), scale)
        };
        times.encode = start.elapsed();
        Ok(Outcome::Map { bytes, scale })
    }

    /// Reads a frame of a finger and finds its pressure, which is left in `self.maps` as that on a
    /// finger of reference stiffness.
    fn take(
        &mut self,
        job: &Job,
        finger: &mut Finger,
        payload: &[u8],
        shows_sed: bool,
        meta: &mut OutputMeta,
    ) -> Result<(MapSummary, PressureRange, Source), Problem> {
        if finger.reads_windows() {
            decode(job.input, payload, &mut self.maps.pressure_pa)?;
            let (of, range) = (places(job.tier).0, self.range(job));
            let skin = &self.fingers[of].catalogue.skin_pixels;
            return Ok((self.maps.check_of(finger, range, skin)?, range, Source::Map));
        }
        let Input::Window { sample_type, scale, .. } = job.input else {
            return Err(Problem::new(ErrorCode::Internal, "a frame that is no window"));
        };
        let range = self.range(job);
        let frame = Frame { payload, sample_type, scale, time_us: job.options.time_us };
        let taken = self.maps.take(finger, frame, range, shows_sed)?;
        meta.flags |= taken.flags;
        if let Some(iterations) = taken.iterations {
            self.metrics.contact.solved(taken.flags, iterations);
        }
        Ok((MapSummary { peak_pa: taken.peak_pa }, range, source_of(&taken)))
    }

    fn range(&self, job: &Job) -> PressureRange {
        let (finger, place) = places(job.tier);
        PressureRange {
            trained_max_pa: self.fingers[finger].catalogue.tiers[place].pressure_max_pa,
            beyond: job.options.out_of_range,
        }
    }

    /// Decodes and checks a pressure map, and sets the pixels off the skin to zero.
    fn decode(
        &mut self,
        job: &Job,
        payload: &[u8],
    ) -> Result<(MapSummary, PressureRange, Source), Problem> {
        decode(job.input, payload, &mut self.maps.pressure_pa)?;
        let (finger, range) = (places(job.tier).0, self.range(job));
        let skin = &self.fingers[finger].catalogue.skin_pixels;
        Ok((self.maps.check(range, skin)?, range, Source::Map))
    }
}

/// Begins an answer behind `headroom` free bytes: with what the finger felt, and how wrong the answer
/// is likely to be, if it has a finger.
///
/// # Errors
/// What the finger felt is not finite.
fn begin_answer(
    buffer: &mut BytesMut,
    headroom: usize,
    finger: Option<&mut Finger>,
    errors: &ErrorEstimate,
) -> Result<(), Problem> {
    buffer.resize(headroom, 0);
    let Some(finger) = finger else { return Ok(()) };
    finger.write(buffer);
    require_finite(&buffer[headroom..])?;
    if finger.tells_error() {
        buffer.extend_from_slice(&errors.encode());
    }
    Ok(())
}

/// Nobody ever waits here: at most one job of a finger is being rendered.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is known of a job so far: times, flags and error estimate.
#[derive(Debug, Default)]
struct Progress {
    times: Times,
    meta: OutputMeta,
}

fn finished(job: &Job, Progress { times, meta }: Progress, outcome: Outcome) -> Done {
    Done {
        tier: job.tier,
        header: job.options.header,
        received: job.received,
        deadline: job.deadline,
        times,
        meta,
        output: job.output,
        outcome,
    }
}
