//! The terms of a session: hello and ready, at its start and whenever the client asks anew.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use bytes::Bytes;
use papilla_proto::{
    ClientMessage, ErrorCode, HEADER_LEN_V2, Hello, MAP_SIDE_PX, MessageError, PROTOCOL_VERSIONS,
    Problem, Ready, RuntimeEffect, SampleType, ServerMessage,
    effects::{OutOfRange, Section, SectionName},
    error::shortened,
    json::JsonError,
};
use tokio::{task::spawn_blocking, time::timeout};

use super::{
    End, close,
    connection::{Connection, Event},
    drained,
    reply::tier_number,
};
use crate::{
    codec::{Output, scale_of},
    core::{buffers::HEADROOM, catalogue::Tier, effects::Effects},
    problem,
    transport::app::App,
};

/// Refused hellos after which the session ends.
const ATTEMPTS: usize = 8;

/// What hello and ready agreed on.
pub(super) struct Terms {
    /// Index of the tier in the catalogue.
    pub(super) tier: usize,
    /// Deadline of frames that name none, us.
    pub(super) budget_us: Option<u32>,
    /// Version of the frames, both ways.
    pub(super) version: u32,
    /// Sample type of the client's frames.
    pub(super) sample_type: SampleType,
    /// Sample type of the answers.
    pub(super) answer_sample_type: SampleType,
    /// Pa per unit of frames whose header says 0.
    pub(super) pressure_scale_pa: Option<f32>,
    /// Whether pressure above what the tier was trained on is taken and flagged.
    pub(super) takes_more: bool,
    /// Longest delay on the way of a frame that is not stale, us.
    pub(super) stale_after_us: Option<u32>,
    /// What was asked for beside the bare map.
    pub(super) effects: Option<Arc<Mutex<Effects>>>,
    /// What the client is told of them.
    info: ReadyInfo,
    _permit: Permit,
}

impl Terms {
    /// Most bytes of an answer, its heads included.
    pub(super) fn answer_len_max(&self) -> usize {
        let plain = HEADER_LEN_V2 + Output::Samples(self.answer_sample_type).size_hint();
        let effects = self.effects.as_ref();
        HEADROOM
            + effects.map_or(plain, |effects| {
                effects.lock().unwrap_or_else(PoisonError::into_inner).size_hint()
            })
    }
}

/// Waits for a hello that can be met, and answers ready.
pub(super) async fn agree(connection: &mut Connection, number: u64) -> Result<Terms, End> {
    let patience = connection.app.timeouts.io;
    let result = timeout(patience, async {
        for _ in 0..ATTEMPTS {
            match attempt(connection).await? {
                Ok(agreed) => return Ok(agreed),
                Err(problem) => connection.reply.complain(problem, None),
            }
        }
        let message = format!("{ATTEMPTS} messages and no hello that can be met");
        Err(End::Refused(Problem::new(ErrorCode::BadJson, message), close::POLICY))
    });
    let (terms, hello) = match result.await {
        Ok(agreed) => agreed?,
        Err(_) => {
            let message = format!("no hello within {patience:?}");
            return Err(End::Refused(Problem::new(ErrorCode::Timeout, message), close::POLICY));
        }
    };
    let ready = ready(&connection.app, number, &terms);
    tracing::debug!(session = number, ?hello, tier = %ready.tier, "session ready");
    connection.reply.say(&ServerMessage::Ready(ready));
    Ok(terms)
}

/// One message; a problem is one the session survives.
async fn attempt(connection: &mut Connection) -> Result<Result<(Terms, Hello), Problem>, End> {
    let text = match connection.next(false).await? {
        Event::Draining => return Err(drained()),
        Event::Text(text) => text,
        Event::Binary(..) => {
            let message = "the first message is the JSON hello, in text";
            return Ok(Err(Problem::new(ErrorCode::UnexpectedBinary, message)));
        }
    };
    match parse(&text).await {
        Ok(ClientMessage::Hello(hello)) => Ok(meet(&connection.app, hello).await),
        Ok(_) => Ok(Err(Problem::new(ErrorCode::BadJson, "a hello is due"))),
        Err(MessageError::Hello(error)) => Ok(Err(error.into())),
        Err(MessageError::Unknown(error)) => {
            let mut problem = Problem::from(error);
            problem.message.push_str("; {\"type\":\"hello\",\"version\":1,…} is due");
            Ok(Err(problem))
        }
    }
}

/// Longest text parsed by a thread that moves bytes, bytes: some 50 us of work.
const PARSED_INLINE_MAX: usize = 16 * 1024;

async fn parse(text: &Bytes) -> Result<ClientMessage, MessageError> {
    if text.len() <= PARSED_INLINE_MAX {
        return ClientMessage::from_json(text);
    }
    let text = text.clone();
    let parsing = spawn_blocking(move || ClientMessage::from_json(&text));
    parsing.await.unwrap_or_else(|error| {
        let reason = format!("it cannot be read: {error}");
        Err(MessageError::Unknown(JsonError { member: None, reason, place: None }))
    })
}

/// New terms for an open session; frames that the server has accepted keep the old ones.
///
/// # Errors
/// The text is no hello, a misspelt one, or one that cannot be met; the old terms stand.
pub(super) async fn renew(
    app: &Arc<App>,
    text: &Bytes,
    number: u64,
) -> Result<(Terms, Ready), Problem> {
    const DUE: &str = "binary frames are due once the session is ready, or a hello for new terms";
    let hello = match parse(text).await {
        Ok(ClientMessage::Hello(hello)) => hello,
        Ok(_) => return Err(Problem::new(ErrorCode::UnexpectedText, DUE)),
        Err(MessageError::Hello(error)) => return Err(error.into()),
        Err(MessageError::Unknown(error)) => {
            let message = format!("{DUE}, and this is neither: {error}");
            return Err(Problem::new(ErrorCode::UnexpectedText, message));
        }
    };
    let (terms, _) = meet(app, hello).await?;
    let ready = ready(app, number, &terms);
    Ok((terms, ready))
}

/// A place in the count of a tier's sessions; given back when it is dropped.
struct Permit(Arc<AtomicUsize>);

impl Permit {
    fn take(tier: &Tier) -> Self {
        tier.sessions.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(&tier.sessions))
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// What `ready` says of the effects of a session.
#[derive(Default)]
struct ReadyInfo {
    names: Vec<RuntimeEffect>,
    sections: Vec<Section>,
    /// Greatest value that the map shows.
    value_max: Option<f32>,
}

/// Whether and how the hello can be met. Effects may have to place points and take some MiB: that
/// is not for a thread that moves bytes.
async fn meet(app: &Arc<App>, hello: Hello) -> Result<(Terms, Hello), Problem> {
    if hello.version == 1 {
        return meet_now(app, &hello).map(|terms| (terms, hello));
    }
    let shared = Arc::clone(app);
    let meeting = spawn_blocking(move || meet_now(&shared, &hello).map(|terms| (terms, hello)));
    match timeout(app.timeouts.io, meeting).await {
        Ok(Ok(result)) => result,
        Ok(Err(error)) => Err(problem::internal("the hello cannot be worked out", &error)),
        Err(error) => Err(problem::internal("the hello takes too long to work out", &error)),
    }
}

fn check_version(hello: &Hello) -> Result<(), Problem> {
    let refuse = |message: String, field: &str| {
        Err(Problem::new(ErrorCode::UnknownVersion, message).at(field))
    };
    if !PROTOCOL_VERSIONS.map(u32::from).contains(&hello.version) {
        let message = format!("version {} is not spoken here, 1 and 2 are", hello.version);
        return refuse(message, "version");
    }
    match hello.member_of_version_2() {
        Some(member) if hello.version < 2 => {
            refuse(format!("'{member}' needs version 2 of the protocol"), member)
        }
        _ => Ok(()),
    }
}

/// The effects of the session that a hello names; all others are the tier's.
fn runtime_effect(name: &str) -> Option<RuntimeEffect> {
    name.parse().ok()
}

fn meet_now(app: &App, hello: &Hello) -> Result<Terms, Problem> {
    check_version(hello)?;
    let is_of_tier = |name: &&String| hello.version == 1 || runtime_effect(name).is_none();
    let wanted: Vec<String> = hello.effects.iter().filter(is_of_tier).cloned().collect();
    let budget_us = hello.budget_us.filter(|&us| us > 0);
    let catalogue = app.catalogue();
    let index = match &hello.tier {
        Some(name) => catalogue.tier_named(name)?,
        None => catalogue.choose(budget_us, &wanted).unwrap_or(catalogue.default),
    };
    let tier = &catalogue.tiers[index];
    if let Some(effect) = wanted.iter().find(|effect| !tier.effects.contains(effect)) {
        let (effect, rendered) = (shortened(effect), tier.effects.join(", "));
        let hint = runtime_effect(&effect).map_or("", |_| "; effects of sessions need version 2");
        let message = format!("tier {} renders {rendered}, but not '{effect}'{hint}", tier.name);
        return Err(Problem::new(ErrorCode::UnknownEffect, message).at("effects"));
    }
    if let Some(hash) = hello.atlas_hash.as_ref().filter(|&hash| *hash != tier.atlas_hash) {
        let (hash, ours) = (shortened(hash), &tier.atlas_hash);
        let message = format!("the client has atlas {hash}, tier {} has {ours}", tier.name);
        return Err(Problem::new(ErrorCode::AtlasMismatch, message).at("atlas_hash"));
    }
    if let Some(scale) = hello.pressure_scale_pa.filter(|s| !(s.is_finite() && *s > 0.0)) {
        let message = format!("{scale} Pa per unit is no scale; it must be finite and above zero");
        return Err(Problem::new(ErrorCode::BadScale, message).at("pressure_scale_pa"));
    }
    let effects = if hello.version > 1 { Effects::of(hello, catalogue.finger())? } else { None };
    let info = effects.as_ref().map_or_else(ReadyInfo::default, |effects| ReadyInfo {
        names: effects.names.clone(),
        sections: effects.sections.clone(),
        value_max: Some(effects.value_max(tier.sed_max_j_per_m3)),
    });
    Ok(Terms {
        tier: index,
        budget_us,
        version: hello.version,
        sample_type: hello.sample_type,
        answer_sample_type: hello.answer_sample_type.unwrap_or(hello.sample_type),
        pressure_scale_pa: hello.pressure_scale_pa,
        takes_more: hello.out_of_range == Some(OutOfRange::Flag),
        stale_after_us: hello.stale_after_us,
        effects: effects.map(|effects| Arc::new(Mutex::new(effects))),
        info,
        _permit: Permit::take(tier),
    })
}

fn ready(app: &App, number: u64, terms: &Terms) -> Ready {
    let catalogue = app.catalogue();
    let tier = &catalogue.tiers[terms.tier];
    let predicted_latency_us = catalogue
        .predicted_latency_us(terms.tier)
        .saturating_add(catalogue.runtime.cost_us(&terms.info.names));
    let is_new = terms.version > 1;
    let value_max = terms.info.value_max.unwrap_or(tier.sed_max_j_per_m3);
    let bare_map = || {
        let output = Output::Samples(terms.answer_sample_type);
        let (offset, bytes) = (HEADER_LEN_V2 as u32, output.size_hint() as u32);
        vec![Section { name: SectionName::Map, offset, bytes }]
    };
    let sections = || match &terms.effects {
        Some(_) => terms.info.sections.clone(),
        None => bare_map(),
    };
    Ready {
        version: terms.version,
        session: number,
        tier: tier.name.clone(),
        effects: tier.effects.clone(),
        atlas_hash: tier.atlas_hash.clone(),
        predicted_latency_us,
        budget_us: terms.budget_us,
        meets_budget: terms.budget_us.map(|us| predicted_latency_us <= u64::from(us)),
        width: MAP_SIDE_PX as u32,
        height: MAP_SIDE_PX as u32,
        sample_type: terms.sample_type,
        pressure_max_pa: tier.pressure_max_pa,
        sed_scale_j_per_m3: scale_of(Output::Samples(terms.answer_sample_type), value_max),
        tier_number: is_new.then(|| tier_number(terms.tier)),
        answer_sample_type: is_new.then_some(terms.answer_sample_type),
        session_effects: is_new.then(|| terms.info.names.clone()),
        sections: is_new.then(sections),
    }
}
