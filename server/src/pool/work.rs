//! One inference thread: decode, check, infer, encode.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    time::{Duration, Instant},
};

use papilla_engine::Session;
use papilla_proto::{ErrorCode, HEADER_LEN, MAP_LEN, Problem, check_pressure};

use super::{
    Done, Job, LOOK_AROUND, Outcome, Stage, Times,
    buffer::Recycler,
    exchange::Inbox,
    queue::{Next, Queue},
};
use crate::{
    StartError,
    codec::{self, Map, Quantity},
    metrics::Metrics,
    models::Catalogue,
    problem,
    speed::round_press,
};

/// Everything a thread owns; nothing is allocated after `prepare`.
pub(super) struct Worker {
    catalogue: Arc<Catalogue>,
    metrics: Arc<Metrics>,
    /// One per tier, in the catalogue's order.
    sessions: Vec<Box<dyn Session>>,
    pressure_pa: Vec<f32>,
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
            sed_j_per_m3: vec![0.0; MAP_LEN],
        };
        for (index, tier) in catalogue.tiers.iter().enumerate() {
            let failed = |source| StartError::Engine { tier: tier.name.clone(), source };
            worker.sessions.push(tier.model.session().map_err(failed)?);
            worker.warm_up(index).map_err(failed)?;
        }
        Ok(worker)
    }

    /// Runs the tier on a round press: it touches the memory that frames will use.
    fn warm_up(&mut self, index: usize) -> Result<(), papilla_engine::EngineError> {
        round_press(self.catalogue.tiers[index].pressure_max_pa, &mut self.pressure_pa);
        self.sessions[index].infer(&self.pressure_pa, &mut self.sed_j_per_m3)
    }

    /// Serves the queue until it is closed and empty.
    pub(super) fn run(&mut self, queue: &Queue, inbox: &Inbox) {
        loop {
            let next = queue.pop(LOOK_AROUND);
            // After the wait: a job for a new tier comes only once its session is there.
            inbox.collect(&mut self.catalogue, &mut self.sessions);
            let slot = match next {
                Next::Slot(slot) => slot,
                Next::Nothing => continue,
                Next::Closed => return,
            };
            self.metrics.queue_length.set(queue.len());
            let abandoned = slot.is_abandoned();
            let Some((job, mut recycler)) = slot.take() else { continue };
            let done = if abandoned {
                let gone = Problem::new(ErrorCode::Internal, "the client is gone");
                finished(&job, Times::default(), Outcome::Failed(gone))
            } else {
                self.serve(&job, &mut recycler)
            };
            // The frame's memory goes back to the socket's reader before the answer leaves.
            drop(job);
            if slot.finish(done, recycler) {
                queue.push_again(slot);
            }
        }
    }

    /// Renders one job; a panic below becomes an error of this job alone.
    fn serve(&mut self, job: &Job, recycler: &mut Recycler) -> Done {
        let mut times = Times { queue: job.received.elapsed(), ..Times::default() };
        let outcome = if job.is_late() {
            Outcome::Late(Stage::Dequeue)
        } else {
            let rendered =
                catch_unwind(AssertUnwindSafe(|| self.render(job, recycler, &mut times)));
            rendered.unwrap_or_else(|_| self.recover(job.tier))
        };
        let tier = self.metrics.tier(job.tier);
        tier.queue.observe(times.queue);
        if let Outcome::Map { .. } = outcome {
            tier.decode.observe(times.decode);
            tier.encode.observe(times.encode);
            if times.infer > Duration::ZERO {
                tier.infer.observe(times.infer);
            }
        }
        finished(job, times, outcome)
    }

    /// A fresh session takes the place of one that panicked.
    fn recover(&mut self, index: usize) -> Outcome {
        let tier = &self.catalogue.tiers[index];
        if let Ok(session) = tier.model.session() {
            self.sessions[index] = session;
        }
        Outcome::Failed(problem::internal("the inference panicked", &tier.name))
    }

    fn render(&mut self, job: &Job, recycler: &mut Recycler, times: &mut Times) -> Outcome {
        match self.try_render(job, recycler, times) {
            Ok(outcome) => outcome,
            Err(problem) => Outcome::Failed(problem),
        }
    }

    fn try_render(
        &mut self,
        job: &Job,
        recycler: &mut Recycler,
        times: &mut Times,
    ) -> Result<Outcome, Problem> {
        let tier = &self.catalogue.tiers[job.tier];
        let start = Instant::now();
        codec::decode(job.input, &job.payload, &mut self.pressure_pa)?;
        let summary =
            check_pressure(&self.pressure_pa, tier.pressure_max_pa).map_err(problem::of_map)?;
        let decoded = Instant::now();
        times.decode = decoded - start;

        if summary.is_zero() {
            // Nothing touches the finger: nothing is felt, and no network is asked.
            self.sed_j_per_m3.fill(0.0);
            self.metrics.zero_maps.inc();
        } else if job.deadline.is_some_and(|deadline| decoded + tier.speed.floor() >= deadline) {
            return Ok(Outcome::Late(Stage::Inference));
        } else {
            self.sessions[job.tier]
                .infer(&self.pressure_pa, &mut self.sed_j_per_m3)
                .map_err(|error| problem::internal("the inference failed", &error))?;
            times.infer = decoded.elapsed();
            tier.speed.learn(times.infer);
        }

        let start = Instant::now();
        let room = job.header.map_or(0, |_| HEADER_LEN);
        let buffer = recycler.claim(room + job.output.size_hint());
        buffer.resize(room, 0);
        let map = Map {
            quantity: Quantity::Sed,
            values: &self.sed_j_per_m3,
            value_max: tier.sed_max_j_per_m3,
            source: &tier.name,
        };
        let scale = codec::encode(job.output, map, buffer)?;
        let bytes = buffer.split();
        times.encode = start.elapsed();
        Ok(Outcome::Map { bytes, scale })
    }
}

fn finished(job: &Job, times: Times, outcome: Outcome) -> Done {
    Done {
        tier: job.tier,
        header: job.header,
        received: job.received,
        deadline: job.deadline,
        times,
        outcome,
    }
}
