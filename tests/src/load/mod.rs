//! An open-loop load generator: frames leave at their instants whether or not answers come.
//!
//! Every time is counted from the instant at which a frame was **meant** to leave, so that
//! a server that stalls the sender does not hide the wait of the frames that queued behind
//! (coordinated omission). One thread keeps the beat of all sessions; the delay between
//! the intended instant and the actual sending is reported beside the rest.

mod compare;
mod content;
mod options;
mod pacer;
mod report;
mod session;
mod tally;
mod verify;

use std::{
    path::PathBuf,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use papilla_proto::{Hello, Ready, SampleError, atlas::AtlasError};
use tokio::sync::mpsc;

pub use compare::{Comparison, Ratios, compare};
pub use content::Content;
pub use options::{Arrivals, Options};
pub use report::{Percentiles, Report, Verification};
pub use verify::TOLERANCE;

use crate::{http::HttpError, socket, socket::SocketError};
use content::Encoded;
use pacer::Plan;
use tally::Tally;
use verify::Reference;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The service does not answer.
    #[error(transparent)]
    Http(#[from] HttpError),
    /// A session cannot be opened.
    #[error(transparent)]
    Socket(#[from] SocketError),
    /// The service answers with something else than maps, atlas or presses.
    #[error("{path} of the service: {reason}")]
    Service {
        /// What was asked for.
        path: String,
        /// What is wrong with the answer.
        reason: String,
    },
    /// There are no presses to send.
    #[error("{0} holds no press to send; name a dataset with --dataset")]
    NoPresses(String),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] model_export::ExportError),
    /// A press does not fit its atlas.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
    /// A map cannot be encoded.
    #[error(transparent)]
    Encode(#[from] SampleError),
    /// f16 ends at 65504.
    #[error("the presses reach {0} Pa, f16 ends at 65504; take another --sample-type")]
    BeyondF16(f32),
    /// A file for --verify cannot be read.
    #[error("{path}: {source}; --models names the folder of the models that the service runs")]
    Model {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The model for --verify cannot be run.
    #[error(transparent)]
    Engine(#[from] papilla_engine::EngineError),
    /// A task of the generator's own died.
    #[error("a task of the load generator died: {0}")]
    Task(String),
}

/// Time between the last preparation and the first frame.
const RUN_UP: Duration = Duration::from_millis(100);

/// Runs the load that `options` describe, to its end.
///
/// # Errors
/// [`LoadError`] if it cannot be run at all; what goes wrong on the way is in the report.
pub async fn run(options: &Options) -> Result<Report, LoadError> {
    let target = Target::new(options).await?;
    let tally = target.load(options).await?;
    Ok(Report::new(options, &target.content, &target.ready, &tally))
}

/// A service and what it is to be loaded with.
struct Target {
    content: Content,
    encoded: Encoded,
    hello: Hello,
    ready: Ready,
    reference: Option<Arc<Reference>>,
}

impl Target {
    async fn new(options: &Options) -> Result<Self, LoadError> {
        let content = match &options.dataset {
            Some(folder) => Content::from_dataset(folder, &options.split, options.maps.get())?,
            None => Content::from_server(&options.server, options.maps.get()).await?,
        };
        let encoded = Encoded::new(&content, options.sample_type)?;
        // The first session learns the tier; all others ask for that one, so that all load the same.
        let mut hello = Hello {
            version: options.protocol,
            budget_us: options.budget(),
            tier: options.tier.clone(),
            sample_type: options.sample_type,
            atlas_hash: Some(content.atlas_hash.clone()),
            ..Hello::default()
        };
        let (ready, mut probe, _) = socket::open(&options.server, &hello).await?;
        probe.close().await;
        hello.tier = Some(ready.tier.clone());
        let reference = if options.verify {
            Some(Arc::new(Reference::new(&options.models, &ready.tier, &encoded)?))
        } else {
            None
        };
        Ok(Self { content, encoded, hello, ready, reference })
    }

    /// Opens the sessions, lets the load run, and adds up what they saw.
    async fn load(&self, options: &Options) -> Result<Tally, LoadError> {
        let mut open = Vec::new();
        for _ in 0..options.sessions.get() {
            let (_, sender, receiver) = socket::open(&options.server, &self.hello).await?;
            open.push((sender, receiver));
        }
        let shared = Arc::new(session::Shared {
            plan: Plan::new(options, Instant::now() + RUN_UP),
            encoded: self.encoded.clone(),
            reference: self.reference.clone(),
            deadline: options.deadline().map(|us| Duration::from_micros(us.into())),
            version: options.protocol,
            drain: Duration::from_secs(options.drain_s),
        });
        let (mut beats, mut tasks) = (Vec::new(), Vec::new());
        for (session, (sender, receiver)) in open.into_iter().enumerate() {
            // Unbounded, but never more than the frames of the plan: the beat must not wait.
            let (beat, beaten) = mpsc::unbounded_channel();
            beats.push(beat);
            let shared = shared.clone();
            tasks.push(tokio::spawn(session::run(shared, session, sender, receiver, beaten)));
        }
        let plan = shared.plan.clone();
        let pacer = thread::spawn(move || plan.keep(&beats));
        let mut total = Tally::default();
        for task in tasks {
            total.add(&task.await.map_err(|error| LoadError::Task(error.to_string()))?);
        }
        pacer.join().map_err(|_| LoadError::Task("the pacer".to_owned()))?;
        Ok(total)
    }
}
