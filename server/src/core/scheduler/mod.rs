//! The inference pool: N dedicated threads, each with its own session of every tier.
//!
//! tokio only moves bytes. A connection puts a [`Job`] into its [`Slot`] and the
//! slot into the bounded [`Queue`](queue::Queue), where turns are shared by [`Account`], that is by
//! session; a thread takes it from there, decodes,
//! checks, infers, encodes, and hands the [`Done`] to the slot's [`Sink`].

mod account;
mod exchange;
mod job;
mod queue;
mod slot;
mod work;

use std::{
    sync::{Arc, atomic::Ordering},
    thread::{self, JoinHandle},
    time::Duration,
};

use papilla_metrics::Metrics;

pub(crate) use exchange::{Exchange, Sessions};
pub(crate) use job::{Done, Job, JobOptions, Outcome, OutputMeta, is_past};
pub(crate) use slot::{Account, Sink, Slot};

use self::{exchange::Inbox, queue::Queue, work::Worker};
use crate::{
    StartError,
    core::catalogue::Catalogue,
    priority::{Priorities, Role},
};
use job::Times;
use slot::Offer;

/// The inference threads and the queue that they take slots from.
pub(crate) struct Pool {
    queue: Arc<Queue>,
    inboxes: Vec<Arc<Inbox>>,
    threads: Vec<JoinHandle<()>>,
}

/// What connections use to put jobs into the pool.
#[derive(Clone)]
pub(crate) struct PoolHandle {
    queue: Arc<Queue>,
    metrics: Arc<Metrics>,
}

impl Pool {
    /// Starts `threads` threads; returns once each has its sessions ready and warm.
    ///
    /// `places` bounds the queue: the greatest number of slots that may exist.
    pub(crate) fn start(
        catalogue: &Arc<Catalogue>,
        metrics: &Arc<Metrics>,
        threads: usize,
        places: usize,
        priorities: &Priorities,
    ) -> Result<Self, StartError> {
        let queue = Arc::new(Queue::new(places, threads));
        let inboxes: Vec<_> = (0..threads).map(|_| Arc::default()).collect();
        let mut pool = Self {
            queue: Arc::clone(&queue),
            inboxes: inboxes.clone(),
            threads: Vec::with_capacity(threads),
        };
        let (report, reports) = std::sync::mpsc::sync_channel(threads);
        for (number, inbox) in inboxes.into_iter().enumerate() {
            let (catalogue, metrics) = (Arc::clone(catalogue), Arc::clone(metrics));
            let (queue, report) = (Arc::clone(&queue), report.clone());
            let priorities = priorities.clone();
            let thread = thread::Builder::new()
                .name(format!("infer-{number}"))
                .spawn(move || match Worker::prepare(&catalogue, metrics) {
                    Ok(mut worker) => {
                        priorities.enter(Role::Rendering);
                        let _ = report.send(Ok(()));
                        // The starting thread reads reports until every sender has been dropped.
                        drop(report);
                        worker.run(&queue, &inbox);
                    }
                    Err(error) => {
                        let _ = report.send(Err(error));
                    }
                })
                .map_err(StartError::Thread)?;
            pool.threads.push(thread);
        }
        drop(report);
        let mut ready = 0;
        while let Ok(result) = reports.recv() {
            if let Err(error) = result {
                pool.stop();
                return Err(error);
            }
            ready += 1;
        }
        if ready == threads { Ok(pool) } else { Err(StartError::WorkerPanicked) }
    }

    pub(crate) fn handle(&self, metrics: &Arc<Metrics>) -> PoolHandle {
        PoolHandle { queue: Arc::clone(&self.queue), metrics: Arc::clone(metrics) }
    }

    /// What a reload uses to hand new models to the threads.
    pub(crate) fn exchange(&self) -> Exchange {
        Exchange::new(self.inboxes.clone())
    }

    /// Ends the threads once the queue is empty, and waits for them.
    pub(crate) fn stop(&mut self) {
        self.queue.close();
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("an inference thread panicked");
            }
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.stop();
    }
}

impl PoolHandle {
    /// Puts `job` into `slot`, and the slot into the queue unless it is there already.
    ///
    /// Returns the job that was replaced, if one waited in the slot and had not been started.
    ///
    /// # Errors
    /// The job was not taken: the pool is closed, or full. It cannot be full as long as there are
    /// no more slots than the pool was started for.
    pub(crate) fn submit(&self, slot: &Arc<Slot>, job: Job) -> Result<Option<Job>, NotTaken> {
        if !job.options.is_contact_alone {
            self.metrics.tier(job.tier).asked.fetch_add(1, Ordering::Relaxed);
        }
        if let Some(contact_us) = job.options.contact_us {
            self.metrics.contact.asked_us.fetch_add(contact_us, Ordering::Relaxed);
        }
        match slot.offer(job) {
            Offer::Scheduled { replaced } => Ok(replaced),
            Offer::Schedule => {
                if self.queue.push(Arc::clone(slot)) {
                    self.metrics.queue_length.set(self.queue.len());
                    Ok(None)
                } else {
                    slot.retract().map_or(Ok(None), |_| Err(NotTaken))
                }
            }
        }
    }
}

/// The pool did not take the job.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct NotTaken;

/// Longest wait of a thread for work before it checks its inbox; every wait is timed.
const POP_TIMEOUT: Duration = Duration::from_millis(500);

#[cfg(test)]
mod tests;
