//! What is agreed, what waits, what is on its way.

use std::{
    collections::HashMap,
    sync::Arc,
    time::{Duration, Instant},
};

use papilla_proto::{
    FrameHeader, Hello, Problem, Ready, SEALED_MAGIC, SampleType, ServerMessage, SessionError,
};
use tokio::sync::oneshot;

use super::{Frame, told::Told};
use crate::{Answer, PapillaError, Status};

/// After so long a frame without an answer is lost, unless the program says otherwise.
pub(super) const TIMEOUT: Duration = Duration::from_secs(5);

/// Waits for its turn or its answer.
#[derive(Debug)]
struct Pending {
    sequence: u32,
    finger: u8,
    client_time_us: u64,
    born: Instant,
    ready: Arc<Ready>,
    outcome: oneshot::Sender<Answer>,
}

impl Pending {
    fn end(self, status: Status) {
        let answer = Answer {
            finger: self.finger,
            ..Answer::without_map(self.sequence, self.client_time_us, status)
        };
        // Err: nobody waits for it any more.
        let _ = self.outcome.send(answer);
    }
}

/// New terms that are being agreed on.
#[derive(Debug)]
pub(super) struct Asked {
    pub(super) hello: Hello,
    pub(super) said: bool,
    pub(super) reply: oneshot::Sender<Result<Arc<Ready>, PapillaError>>,
}

/// How far the session is on its way to another connection.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) enum Moving {
    #[default]
    Stays,
    /// The service asks for it; frames go on over this one.
    Asked,
    /// The other one is there: what the service remembers is to be asked for.
    SealDue,
    /// It was asked for, and frames wait.
    SealSaid,
    /// It is here.
    Sealed(Vec<u8>),
    /// The service does not say it, for this reason.
    Refused(String),
}

/// What the writer is to send.
pub(super) enum Next {
    Seal,
    Hello(Box<Hello>),
    Frame(Vec<u8>),
}

/// A frame that has not left.
#[derive(Debug)]
struct Waiting {
    finger: u8,
    pending: Pending,
    message: Vec<u8>,
}

#[derive(Debug)]
pub(super) struct State {
    pub(super) hello: Hello,
    pub(super) ready: Arc<Ready>,
    pub(super) asked: Option<Asked>,
    pub(super) moving: Moving,
    /// States that were asked for and have not come: a late one is not that of the last move.
    seals_due: u32,
    pub(super) superseded_by_client: u64,
    tiers: HashMap<u16, String>,
    sequence: u32,
    /// At most one a finger, in the order in which they came.
    waiting: Vec<Waiting>,
    sent: Vec<Pending>,
    over: bool,
    /// After so long a frame without an answer is lost.
    pub(super) timeout: Duration,
    /// Nothing more is to be expected of the connection: it owed an answer for too long.
    pub(super) is_stalled: bool,
    pub(super) told: Told,
}

impl State {
    pub(super) fn new(hello: Hello, ready: Ready) -> Self {
        let mut state = Self {
            hello,
            ready: Arc::new(ready),
            asked: None,
            moving: Moving::Stays,
            seals_due: 0,
            superseded_by_client: 0,
            tiers: HashMap::new(),
            sequence: 0,
            waiting: Vec::new(),
            sent: Vec::new(),
            over: false,
            timeout: TIMEOUT,
            is_stalled: false,
            told: Told::default(),
        };
        state.agree(Arc::clone(&state.ready));
        state
    }

    pub(super) fn agree(&mut self, ready: Arc<Ready>) {
        self.tiers.insert(ready.tier_number, ready.tier.clone());
        for (number, name) in (0..).zip(ready.tier_names.iter().flatten()) {
            self.tiers.insert(number, name.clone());
        }
        self.told.question(&ready);
        self.ready = ready;
    }

    /// Ends the frames whose time is over: they are lost. True where one of them had left.
    pub(super) fn expire(&mut self) -> bool {
        let timeout = self.timeout;
        let waiting =
            self.waiting.extract_if(.., |waiting| waiting.pending.born.elapsed() > timeout);
        let mut late: Vec<Pending> = waiting.map(|waiting| waiting.pending).collect();
        let waited = late.len();
        late.extend(self.sent.extract_if(.., |pending| pending.born.elapsed() > timeout));
        self.is_stalled |= late.len() > waited;
        if !late.is_empty() {
            self.told
                .once("timeout", || format!("no answer within {timeout:?}; such frames are lost"));
        }
        late.into_iter().for_each(|pending| pending.end(Status::Lost));
        self.is_stalled
    }

    /// Encodes a frame and lets it wait in place of the one of its finger that waits.
    pub(super) fn put(
        &mut self,
        frame: &Frame<'_>,
        client_time_us: u64,
    ) -> Result<oneshot::Receiver<Answer>, PapillaError> {
        let sample_type = self.ready.sample_type;
        self.put_message(0, client_time_us, |sequence| {
            encode(frame, sequence, client_time_us, sample_type)
        })
    }

    /// The same of any message.
    pub(super) fn put_message(
        &mut self,
        finger: u8,
        client_time_us: u64,
        message: impl FnOnce(u32) -> Result<Vec<u8>, Problem>,
    ) -> Result<oneshot::Receiver<Answer>, PapillaError> {
        if self.over {
            return Err(PapillaError::Closed);
        }
        self.sequence = self.sequence.wrapping_add(1);
        let sequence = self.sequence;
        let (outcome, receiver) = oneshot::channel();
        let ready = Arc::clone(&self.ready);
        let born = Instant::now();
        let pending = Pending { sequence, finger, client_time_us, born, ready, outcome };
        match message(sequence) {
            Err(problem) => pending.end(Status::Error(problem)),
            Ok(message) => {
                let new = Waiting { finger, pending, message };
                match self.waiting.iter_mut().find(|waiting| waiting.finger == finger) {
                    Some(place) => {
                        let old = std::mem::replace(place, new);
                        self.superseded_by_client += 1;
                        old.pending.end(Status::Superseded { by_client: true });
                    }
                    None => self.waiting.push(new),
                }
            }
        }
        Ok(receiver)
    }

    /// What to send next; a frame not while terms are being agreed on. It then counts as sent.
    pub(super) fn next(&mut self) -> Option<Next> {
        if matches!(self.moving, Moving::SealSaid | Moving::Sealed(_)) {
            return None;
        }
        if let Some(asked) = &mut self.asked {
            if asked.said {
                return None;
            }
            asked.said = true;
            return Some(Next::Hello(Box::new(asked.hello.clone())));
        }
        if self.moving == Moving::SealDue {
            self.moving = Moving::SealSaid;
            self.seals_due += 1;
            return Some(Next::Seal);
        }
        if self.waiting.is_empty() {
            return None;
        }
        let Waiting { mut pending, message, .. } = self.waiting.remove(0);
        // New terms may have come while it waited. Another sample type is the service's to refuse.
        pending.ready = Arc::clone(&self.ready);
        self.sent.push(pending);
        Some(Next::Frame(message))
    }

    /// Takes a binary message.
    pub(super) fn on_binary(&mut self, message: &[u8]) -> Result<(), PapillaError> {
        if message.starts_with(&SEALED_MAGIC) {
            self.seal_came(Moving::Sealed(message.to_vec()));
            return Ok(());
        }
        let header = FrameHeader::decode(message)?;
        let Some(pending) = self.forget(header.sequence) else { return Ok(()) };
        let tier = self.tiers.get(&header.tier).cloned().unwrap_or_default();
        let answer = Answer::read(&header, message, &pending.ready, tier)?;
        if answer.out_of_range {
            let tier = &answer.tier;
            self.told.once("out_of_range", || {
                format!("pressure is beyond what tier {tier} knows; such answers are flagged")
            });
        }
        if answer.coarse_clock {
            self.told.once("coarse_clock", || {
                "the times of the frames have steps above 20 ms, stand still, or are in ms or ns in \
                 place of us; rates, spikes and creep in such answers are wrong, and flagged \
                 coarse_clock"
                    .to_owned()
            });
        }
        // Err: nobody waits for it any more.
        let _ = pending.outcome.send(answer);
        Ok(())
    }

    /// A sealed state came, or a refusal in place of one.
    fn seal_came(&mut self, as_what: Moving) {
        self.seals_due = self.seals_due.saturating_sub(1);
        if self.seals_due == 0 && self.moving == Moving::SealSaid {
            self.moving = as_what;
        }
    }

    /// The service did not say what it remembers: the session stays until it is asked again.
    pub(super) fn stay(&mut self, why: &str) {
        self.moving = Moving::Stays;
        let words = format!(
            "the service asked the session to move, and did not say what it remembers ({why}): it \
             goes on over its old connection, and starts anew when that ends"
        );
        self.told.once(&words, || words.clone());
    }

    /// Takes a text message.
    pub(super) fn on_text(&mut self, message: ServerMessage) {
        match message {
            ServerMessage::Ready(ready) => {
                let ready = Arc::new(*ready);
                self.agree(Arc::clone(&ready));
                if let Some(Asked { hello, reply, .. }) = self.asked.take() {
                    self.hello = hello;
                    let _ = reply.send(Ok(ready));
                }
            }
            ServerMessage::Reconnect(_) if self.moving == Moving::Stays => {
                self.moving = Moving::Asked;
            }
            ServerMessage::Error(SessionError { code, message, field, sequence, .. }) => {
                let problem = Problem { code, message, field };
                match sequence {
                    Some(sequence) => self.refuse(sequence, problem),
                    None => {
                        if let Some(asked) = self.asked.take_if(|asked| asked.said) {
                            let _ = asked.reply.send(Err(PapillaError::Refused(problem)));
                        } else if self.seals_due > 0 {
                            self.seal_came(Moving::Refused(problem.message));
                        }
                    }
                }
            }
            _ => {}
        }
    }

    /// A frame is refused; of one whose time is over nobody wants to know.
    fn refuse(&mut self, sequence: u32, problem: Problem) {
        let Some(pending) = self.forget(sequence) else { return };
        // Whoever looks at maps alone would not see it.
        self.told.once("error", || format!("a frame was refused: {}", problem.message));
        pending.end(Status::Error(problem));
    }

    /// The connection broke: what was sent is lost, what waits goes on waiting.
    pub(super) fn lose(&mut self) {
        self.sent.drain(..).for_each(|pending| pending.end(Status::Lost));
        self.moving = Moving::Stays;
        self.seals_due = 0;
        self.is_stalled = false;
        if let Some(asked) = self.asked.take_if(|asked| asked.said) {
            let reason = "the connection broke".to_owned();
            let _ = asked.reply.send(Err(PapillaError::Protocol(reason)));
        }
    }

    /// The session goes on over another connection. Every frame that had left was answered.
    pub(super) fn moved(&mut self, ready: Arc<Ready>) {
        self.moving = Moving::Stays;
        self.seals_due = 0;
        self.agree(ready);
    }

    /// No session will follow.
    pub(super) fn end(&mut self) {
        self.over = true;
        self.lose();
        self.waiting.drain(..).for_each(|waiting| waiting.pending.end(Status::Lost));
        self.asked = None;
    }

    fn forget(&mut self, sequence: u32) -> Option<Pending> {
        let at = self.sent.iter().position(|pending| pending.sequence == sequence)?;
        Some(self.sent.remove(at))
    }
}

/// The message of a frame.
fn encode(
    frame: &Frame<'_>,
    sequence: u32,
    client_time_us: u64,
    sample_type: SampleType,
) -> Result<Vec<u8>, Problem> {
    let Frame { pressure_pa, window, deadline_us, .. } = *frame;
    let top_pa = pressure_pa.iter().copied().fold(0.0, f32::max);
    // The finest scale that clips nothing.
    let scale =
        if sample_type.is_scaled() && top_pa > 0.0 { top_pa / sample_type.unit_max() } else { 1.0 };
    let header = FrameHeader::pressure(sequence, client_time_us, deadline_us, sample_type, scale)
        .windowed(window);
    let head = header.encode();
    let mut message = vec![0; head.len() + window.pixel_count() * sample_type.bytes()];
    message[..head.len()].copy_from_slice(&head);
    sample_type
        .encode(pressure_pa, scale, &mut message[head.len()..])
        .map_err(|error| Problem::new(error.code(), error.to_string()).at("pressure_pa"))?;
    Ok(message)
}
