//! An open-loop load generator: frames leave at their instants whether or not answers come.
//!
//! Every time is counted from the instant at which a frame was **meant** to leave, so that
//! a server that stalls the sender does not hide the wait of the frames that queued behind
//! (coordinated omission). The delay between the intended instant and the actual sending is
//! reported beside the rest. A session has a thread that keeps its beat and sends, and one that
//! hears; clients of HTTP share one thread that keeps the beat.

mod compare;
mod contact;
mod content;
mod floor;
mod follow;
mod options;
mod pacer;
mod post;
mod report;
mod session;
mod steal;
mod tally;
mod verify;
mod wire;

use std::{
    io,
    path::PathBuf,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use papilla_proto::{FrameKind, Hello, SampleError, SampleType, atlas::AtlasError};
use tokio::{
    runtime::Handle,
    sync::mpsc,
    task::{JoinHandle, spawn_blocking},
};

pub use compare::{Comparison, Ratios, compare};
pub use contact::Contact;
pub use content::Content;
pub use floor::{Floor, floor};
pub use options::{Arrivals, Options, Speak};
pub use report::{Percentiles, Report, Verification};
pub use verify::TOLERANCE;

use crate::{http::HttpError, socket, socket::SocketError};
use content::Encoded;
use follow::Follow;
use pacer::Plan;
use post::Letter;
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
    /// The service answers with something else than maps, atlas or states.
    #[error("{path} of the service: {reason}")]
    Service {
        /// What was asked for.
        path: String,
        /// What is wrong with the answer.
        reason: String,
    },
    /// There are no maps to send.
    #[error("{0} holds no map to send; name a dataset with --dataset")]
    NoMaps(String),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] papilla_model_export::ExportError),
    /// A state does not fit its atlas.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
    /// A map cannot be encoded.
    #[error(transparent)]
    Encode(#[from] SampleError),
    /// f16 ends at 65504.
    #[error("the maps reach {0} Pa, f16 ends at 65504; take another --sample-type")]
    BeyondF16(f32),
    /// A file for --verify cannot be read.
    #[error("{path}: {source}; --models names the folder of the models that the service runs")]
    Model {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The model for --verify cannot be run.
    #[error(transparent)]
    Engine(#[from] papilla_engine::EngineError),
    /// Over HTTP nobody says which tier renders, and samples are float32.
    #[error("--speak http and --speak oip need --tier, and --sample-type f32")]
    NoTier,
    /// A connection cannot be used.
    #[error("a connection cannot be used: {0}")]
    Connection(#[from] io::Error),
    /// A task of the generator's own died.
    #[error("a task of the load generator died: {0}")]
    Task(String),
}

/// Time for the echo beside a run of poses.
const ECHO: Duration = Duration::from_secs(2);

/// Time between the last preparation and the first frame.
const RUN_UP: Duration = Duration::from_millis(100);

/// Runs the load that `options` describe, to its end.
///
/// # Errors
/// [`LoadError`] if it cannot be run at all; what goes wrong on the way is in the report.
pub async fn run(options: &Options) -> Result<Report, LoadError> {
    let target = Target::new(options).await?;
    let tally = target.load(options).await?;
    let echo = match options.contact {
        Some(_) if tally.ok > 0 => Some(floor::echo(tally.bytes, ECHO).await?),
        _ => None,
    };
    Ok(Report::new(options, &target, &tally, echo.as_ref()))
}

/// A service and what it is to be loaded with.
struct Target {
    /// Where the frames are from, for people.
    source: String,
    encoded: Encoded,
    /// What frames of sessions hold.
    kind: FrameKind,
    tier: String,
    predicted_latency_us: Option<u64>,
    opening: Opening,
    reference: Option<Arc<Reference>>,
}

/// How a client begins.
enum Opening {
    Session(Box<Hello>),
    Post(Letter),
}

impl Target {
    async fn new(options: &Options) -> Result<Self, LoadError> {
        let (encoded, source, atlas_hash) = if options.contact.is_some() {
            let (encoded, atlas_hash) = contact::poses(&options.server, options.rate_hz).await?;
            (encoded, "a ball that goes down and up".to_owned(), atlas_hash)
        } else {
            let content = match &options.dataset {
                Some(folder) => Content::from_dataset(folder, options.split, options.maps.get())?,
                None => Content::from_server(&options.server, options.maps.get()).await?,
            };
            let encoded = Encoded::new(&content, options.sample_type)?;
            (encoded, content.source, content.atlas_hash)
        };
        let kind = if options.contact.is_some() { FrameKind::Objects } else { FrameKind::Pressure };
        let (tier, predicted_latency_us, opening) = match options.speak {
            Speak::Session => Self::agree(options, atlas_hash).await?,
            speak => {
                let tier = options.tier.clone().ok_or(LoadError::NoTier)?;
                if options.sample_type != SampleType::F32 {
                    return Err(LoadError::NoTier);
                }
                let letter = Letter::new(&options.server, speak, &tier, options.budget());
                (tier, None, Opening::Post(letter))
            }
        };
        let reference = if options.verify {
            Some(Arc::new(Reference::new(&options.models, &tier, &encoded)?))
        } else {
            None
        };
        Ok(Self { source, encoded, kind, tier, predicted_latency_us, opening, reference })
    }

    /// Opens a first session, which learns the tier: all others ask for that one, so that all
    /// load the same.
    async fn agree(
        options: &Options,
        atlas_hash: String,
    ) -> Result<(String, Option<u64>, Opening), LoadError> {
        let mut hello = Hello {
            budget_us: options.budget(),
            tier: options.tier.clone(),
            sample_type: options.sample_type,
            atlas_hash: Some(atlas_hash),
            reconnect: options.follow.then_some(true),
            ..Hello::default()
        };
        if let Some(contact) = options.contact {
            contact.ask(options.fingers, options.method, &mut hello);
        }
        let (ready, mut probe, _) = socket::open(&options.server, &hello).await?;
        probe.close().await;
        hello.tier = Some(ready.tier.clone());
        Ok((ready.tier, Some(ready.predicted_latency_us), Opening::Session(Box::new(hello))))
    }

    /// How sessions go on over another connection, if they are to.
    fn follow(&self, options: &Options) -> Option<Follow> {
        match &self.opening {
            Opening::Session(hello) if options.follow => Some(Follow {
                server: options.server.clone(),
                hello: (**hello).clone(),
                runtime: Handle::current(),
            }),
            _ => None,
        }
    }

    /// Opens the sessions, lets the load run, and adds up what they saw.
    async fn load(&self, options: &Options) -> Result<Tally, LoadError> {
        let mut open = Vec::new();
        for _ in 0..options.sessions.get() {
            open.push(self.opening.open(&options.server).await?);
        }
        let shared = Arc::new(session::Shared {
            plan: Plan::new(options, Instant::now() + RUN_UP),
            encoded: self.encoded.clone(),
            reference: self.reference.clone(),
            deadline: options.deadline().map(|us| Duration::from_micros(us.into())),
            kind: self.kind,
            follow: self.follow(options),
            drain: Duration::from_secs(options.drain_s),
        });
        let (mut beats, mut tasks) = (Vec::new(), Vec::new());
        for (session, client) in open.into_iter().enumerate() {
            tasks.push(client.start(shared.clone(), session, &mut beats));
        }
        let before = steal::Ticks::now();
        let plan = shared.plan.clone();
        let pacer = thread::spawn(move || plan.keep(&beats));
        let mut total = Tally::default();
        for task in tasks {
            total.add(&task.await.map_err(|error| LoadError::Task(error.to_string()))?);
        }
        pacer.join().map_err(|_| LoadError::Task("the pacer".to_owned()))?;
        total.processor = steal::Ticks::now().since(before);
        Ok(total)
    }
}

/// A client that is connected.
enum Client {
    Session(wire::Mouth, wire::Hearer),
    Post(post::Post),
}

impl Opening {
    async fn open(&self, server: &str) -> Result<Client, LoadError> {
        Ok(match self {
            Self::Session(hello) => {
                let (_, sender, receiver) = socket::open(server, hello).await?;
                let (mouth, hearer) = wire::halves(socket::into_stream(sender, receiver)?)?;
                Client::Session(mouth, hearer)
            }
            Self::Post(letter) => Client::Post(letter.connect().await?),
        })
    }
}

impl Client {
    /// Begins; a client that does not keep its beat by itself puts its end of one into `beats`.
    fn start(
        self,
        shared: Arc<session::Shared>,
        session: usize,
        beats: &mut Vec<mpsc::UnboundedSender<u32>>,
    ) -> JoinHandle<Tally> {
        match self {
            Self::Session(mouth, hearer) => {
                spawn_blocking(move || session::run(&shared, session, mouth, hearer))
            }
            Self::Post(post) => {
                // Unbounded, but never more than the frames of the plan: the beat must not wait.
                let (beat, beaten) = mpsc::unbounded_channel();
                beats.push(beat);
                tokio::spawn(post::run(shared, session, post, beaten))
            }
        }
    }
}
