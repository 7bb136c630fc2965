//! One inference thread: decode, check, infer, encode.

use std::{
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use papilla_codec::{Input, Map, Quantity, decode, encode};
use papilla_engine::Session;
use papilla_metrics::{Metrics, Stage};
use papilla_proto::{
    ErrorCode, InputStatistics, MAP_LEN, MapSummary, PressureRange, Problem, flags, keep_inside,
};
use papilla_session_contact::Finger;

use super::{
    Done, Job, JobOptions, Outcome, OutputMeta, POP_TIMEOUT, Times,
    exchange::Inbox,
    queue::{Next, Queue},
};
use crate::{
    StartError,
    core::{
        buffers::{HEADROOM, Recycler},
        catalogue::Catalogue,
    },
    problem,
};

/// Share of the greatest pressure that none of 2824 FE states has at the edge of the atlas: it is
/// zero there in all of them.
const RIM_SHARE: f32 = 0.01;

/// Everything a thread owns; nothing is allocated after `prepare`.
pub(super) struct Worker {
    catalogue: Arc<Catalogue>,
    metrics: Arc<Metrics>,
    /// One per tier, in the catalogue's order.
    sessions: Vec<Box<dyn Session>>,
    pressure_pa: Vec<f32>,
    /// What the network sees in place of pressure beyond its range.
    clamped_pa: Vec<f32>,
    sed_j_per_m3: Vec<f32>,
}

impl Worker {
    /// Makes and warms a session of every tier.
    pub(super) fn prepare(
        catalogue: &Arc<Catalogue>,
        metrics: Arc<Metrics>,
    ) -> Result<Self, StartError> {
        let mut worker = Self {
            sessions: Vec::with_capacity(catalogue.tiers.len()),
            catalogue: Arc::clone(catalogue),
            metrics,
            pressure_pa: vec![0.0; MAP_LEN],
            clamped_pa: vec![0.0; MAP_LEN],
            sed_j_per_m3: vec![0.0; MAP_LEN],
        };
        for tier in &catalogue.tiers {
            let session = tier.warm_session(&mut worker.pressure_pa, &mut worker.sed_j_per_m3)?;
            worker.sessions.push(session);
        }
        Ok(worker)
    }

    /// Serves the queue until it is closed and empty.
    pub(super) fn run(&mut self, queue: &Queue, inbox: &Inbox) {
        loop {
            let next = queue.pop(POP_TIMEOUT);
            // After the wait: a job for a new tier comes only once its session is there.
            inbox.collect(&mut self.catalogue, &mut self.sessions);
            let slot = match next {
                Next::Slot(slot) => slot,
                Next::Nothing => continue,
                Next::Closed => return,
            };
            self.metrics.queue_length.set(queue.len());
            let abandoned = slot.is_abandoned();
            let Some((mut job, mut recycler)) = slot.take() else { continue };
            let done = if abandoned {
                finished(&job, Progress::default(), Outcome::Gone)
            } else {
                self.serve(&mut job, &mut recycler)
            };
            if slot.finish(done, recycler) {
                queue.push_again(slot);
            }
        }
    }

    /// Renders one job; a panic below becomes an error of this job alone.
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

    /// A fresh session takes the place of one that panicked.
    fn recover(&mut self, index: usize) -> Outcome {
        let tier = &self.catalogue.tiers[index];
        if let Ok(session) = tier.model.session() {
            self.sessions[index] = session;
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
        // The frame's memory goes back to its session before the network is asked.
        let payload = mem::take(&mut job.payload);
        let options = &job.options;
        let mut effects = options.effects.as_ref().map(|e| lock(e));
        let mut finger = options.finger.as_ref().map(|f| lock(f));
        // Without anything that shows SED, poses go in and forces come out.
        let shows_sed = finger.is_none() || effects.as_ref().is_none_or(|e| e.shows_sed());
        let (mut summary, range) = match &mut finger {
            Some(finger) => self.take(job, finger, &payload, shows_sed, meta)?,
            None => self.decode(job, &payload)?,
        };
        drop(payload);
        let tier = &self.catalogue.tiers[job.tier];
        let &JobOptions { headroom, time_us, .. } = options;
        if let Some(effects) = &mut effects {
            let peak_pa = effects.before(&mut self.pressure_pa, time_us);
            summary.peak_pa = peak_pa.unwrap_or(summary.peak_pa);
        }
        meta.flags |= if shows_sed && range.is_left_by(summary) { flags::OUT_OF_RANGE } else { 0 };
        let least_pa = RIM_SHARE * summary.peak_pa;
        let is_cut_off =
            shows_sed && self.catalogue.rim.iter().any(|&i| self.pressure_pa[i] > least_pa);
        meta.flags |= if is_cut_off { flags::CUT_OFF } else { 0 };
        let is_clamped = range.clamp(&self.pressure_pa, summary, &mut self.clamped_pa);
        let seen_pa = if is_clamped { &self.clamped_pa } else { &self.pressure_pa };
        let is_outside = |trained| InputStatistics::of(seen_pa).is_out_of_distribution(trained);
        let is_out_of_distribution =
            shows_sed && !summary.is_zero() && tier.input_statistics_max.is_some_and(is_outside);
        meta.flags |= if is_out_of_distribution { flags::UNFAMILIAR } else { 0 };
        let decoded = Instant::now();
        times.decode = decoded - start;

        if !shows_sed {
            // The map is not even drawn.
        } else if summary.is_zero() {
            // Nothing touches the finger: SED is zero, and no network is asked.
            self.sed_j_per_m3.fill(0.0);
            self.metrics.zero_maps.inc();
            meta.flags |= flags::NO_CONTACT;
        } else if job.deadline.is_some_and(|deadline| {
            tier.latency.will_miss(deadline.saturating_duration_since(decoded))
        }) {
            return Ok(Outcome::Late(Stage::Inference));
        } else {
            self.sessions[job.tier].infer(seen_pa, &mut self.sed_j_per_m3).map_err(|error| {
                let error = format_args!("{}.onnx: {error}", tier.name);
                problem::internal("the inference failed", &error)
            })?;
            times.infer = decoded.elapsed();
            tier.latency.learn(times.infer);
        }

        let start = Instant::now();
        let extra = finger.as_ref().map_or(0, |finger| finger.sections_len());
        if let Some(finger) = finger.as_ref().filter(|_| shows_sed) {
            finger.to_person(&mut self.pressure_pa);
            finger.to_person(&mut self.sed_j_per_m3);
        }
        let (bytes, scale) = if let Some(effects) = &mut effects {
            let buffer = recycler.claim(HEADROOM + effects.size_hint() + extra);
            buffer.resize(headroom, 0);
            if let Some(finger) = &mut finger {
                finger.write(buffer);
            }
            let (pressure_pa, sed) = (&self.pressure_pa, &self.sed_j_per_m3);
            let written = effects
                .write(pressure_pa, sed, time_us, buffer)
                .map_err(|error| problem::internal("the window cannot be encoded", &error))?;
            (meta.kind, meta.window) = (written.kind, written.window);
            (buffer.split(), written.scale)
        } else {
            let buffer = recycler.claim(headroom + job.output.size_hint() + extra);
            buffer.resize(headroom, 0);
            if let Some(finger) = &mut finger {
                finger.write(buffer);
            }
            let map =
                Map { quantity: Quantity::Sed, values: &self.sed_j_per_m3, source: &tier.name };
            let scale = encode(job.output, map, buffer)
                .map_err(|error| problem::internal("the map cannot be encoded", &error))?;
            (buffer.split(), scale)
        };
        times.encode = start.elapsed();
        Ok(Outcome::Map { bytes, scale })
    }

    /// Reads a frame of version 3; pressure on a finger of reference stiffness is left.
    fn take(
        &mut self,
        job: &Job,
        finger: &mut Finger,
        payload: &[u8],
        shows_sed: bool,
        meta: &mut OutputMeta,
    ) -> Result<(MapSummary, PressureRange), Problem> {
        if finger.reads_windows() {
            let (summary, range) = self.decode(job, payload)?;
            let part = finger.to_reference(&mut self.pressure_pa);
            return Ok((MapSummary { peak_pa: summary.peak_pa * part }, range));
        }
        let Input::Window { sample_type, scale, .. } = job.input else {
            return Err(Problem::new(ErrorCode::Internal, "a frame that is no window"));
        };
        let map_pa = shows_sed.then_some(&mut self.pressure_pa[..]);
        let taken = finger.take(payload, sample_type, scale, map_pa)?;
        meta.flags |= taken.flags;
        if let Some(iterations) = taken.iterations {
            self.metrics.contact.solved(taken.flags, iterations);
        }
        let range = self.range(job);
        if finger.takes_pressure() {
            range.check(&self.pressure_pa).map_err(problem::of_map)?;
        }
        Ok((MapSummary { peak_pa: taken.peak_pa }, range))
    }

    fn range(&self, job: &Job) -> PressureRange {
        PressureRange {
            trained_max_pa: self.catalogue.tiers[job.tier].pressure_max_pa,
            beyond: job.options.out_of_range,
        }
    }

    /// Decodes and checks the pressure; what lies off the skin is taken off.
    fn decode(
        &mut self,
        job: &Job,
        payload: &[u8],
    ) -> Result<(MapSummary, PressureRange), Problem> {
        decode(job.input, payload, &mut self.pressure_pa)?;
        let range = self.range(job);
        range.check(&self.pressure_pa).map_err(problem::of_map)?;
        let summary = keep_inside(&mut self.pressure_pa, &self.catalogue.skin_mask);
        Ok((summary, range))
    }
}

/// One job of a session is with a thread at a time, so nobody waits here.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How far a job has come.
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
