//! The terms of a session: hello and ready, at its start and whenever the client asks anew.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use axum::extract::ws::Message;
use papilla_proto::{
    ClientMessage, ErrorCode, Hello, MAP_SIDE_PX, PROTOCOL_VERSION, Problem, Ready, SampleType,
    ServerMessage,
};
use tokio::time::timeout;

use super::{End, Event, Line, close, drained};
use crate::{
    app::App,
    codec::{Output, scale_of},
    models::Tier,
};

/// Refused hellos after which the session ends.
const ATTEMPTS: usize = 8;

/// What hello and ready agreed on.
pub(super) struct Terms {
    /// Index of the tier in the catalogue.
    pub(super) tier: usize,
    /// Deadline of frames that name none, us.
    pub(super) budget_us: Option<u32>,
    /// Sample type of frames both ways.
    pub(super) sample_type: SampleType,
    /// Pa per unit of frames whose header says 0.
    pub(super) pressure_scale_pa: Option<f32>,
    _seat: Seat,
}

/// Waits for a hello that can be met, and answers ready.
pub(super) async fn agree(line: &mut Line, number: u64) -> Result<Terms, End> {
    let patience = line.app.timeouts.io;
    let result = timeout(patience, async {
        for _ in 0..ATTEMPTS {
            match attempt(line).await? {
                Ok(agreed) => return Ok(agreed),
                Err(problem) => line.complain(problem, None).await?,
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
    let ready = ready(&line.app, number, &terms);
    tracing::debug!(session = number, ?hello, tier = %ready.tier, "session ready");
    line.say(&ServerMessage::Ready(ready)).await?;
    Ok(terms)
}

/// One message; a problem is one the session survives.
async fn attempt(line: &mut Line) -> Result<Result<(Terms, Hello), Problem>, End> {
    loop {
        let text = match line.next(None, false).await? {
            Event::Draining => return Err(drained()),
            Event::Message(Message::Text(text), _) => text,
            Event::Message(Message::Binary(_), _) => {
                let message = "the first message is the JSON hello, in text";
                return Ok(Err(Problem::new(ErrorCode::UnexpectedBinary, message)));
            }
            Event::Message(..) | Event::Answer(_) => continue,
        };
        let hello = match serde_json::from_str(&text) {
            Ok(ClientMessage::Hello(hello)) => hello,
            Ok(_) => return Ok(Err(Problem::new(ErrorCode::BadJson, "a hello is due"))),
            Err(error) => {
                let message = format!("{error}; {{\"type\":\"hello\",\"version\":1,…}} is due");
                return Ok(Err(Problem::new(ErrorCode::BadJson, message)));
            }
        };
        return Ok(meet(&line.app, &hello).map(|terms| (terms, hello)));
    }
}

/// New terms for an open session; frames that the server has accepted keep the old ones.
///
/// # Errors
/// The text is no hello, or one that cannot be met; the old terms stand.
pub(super) fn renew(app: &App, text: &str, number: u64) -> Result<(Terms, Ready), Problem> {
    let Ok(ClientMessage::Hello(hello)) = serde_json::from_str(text) else {
        let message = "binary frames are due once the session is ready, or a hello for new terms";
        return Err(Problem::new(ErrorCode::UnexpectedText, message));
    };
    let terms = meet(app, &hello)?;
    let ready = ready(app, number, &terms);
    Ok((terms, ready))
}

/// A place in the count of a tier's sessions; given back when it is dropped.
struct Seat(Arc<AtomicUsize>);

impl Seat {
    fn take(tier: &Tier) -> Self {
        tier.sessions.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(&tier.sessions))
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Whether and how the hello can be met.
fn meet(app: &App, hello: &Hello) -> Result<Terms, Problem> {
    if hello.version != u32::from(PROTOCOL_VERSION) {
        let message =
            format!("version {} is not spoken here, {PROTOCOL_VERSION} is", hello.version);
        return Err(Problem::new(ErrorCode::UnknownVersion, message).at("version"));
    }
    let budget_us = hello.budget_us.filter(|&us| us > 0);
    let catalogue = app.catalogue();
    let index = match &hello.tier {
        Some(name) => catalogue.tier_named(name)?,
        None => catalogue.choose(budget_us, &hello.effects).unwrap_or(catalogue.default),
    };
    let tier = &catalogue.tiers[index];
    if let Some(effect) = hello.effects.iter().find(|effect| !tier.effects.contains(effect)) {
        let rendered = tier.effects.join(", ");
        let message = format!("tier {} renders {rendered}, but not '{effect}'", tier.name);
        return Err(Problem::new(ErrorCode::UnknownEffect, message).at("effects"));
    }
    if let Some(hash) = hello.atlas_hash.as_ref().filter(|&hash| *hash != tier.atlas_hash) {
        let ours = &tier.atlas_hash;
        let message = format!("the client has atlas {hash}, tier {} has {ours}", tier.name);
        return Err(Problem::new(ErrorCode::AtlasMismatch, message).at("atlas_hash"));
    }
    if let Some(scale) = hello.pressure_scale_pa.filter(|s| !(s.is_finite() && *s > 0.0)) {
        let message = format!("{scale} Pa per unit is no scale; it must be finite and above zero");
        return Err(Problem::new(ErrorCode::BadScale, message).at("pressure_scale_pa"));
    }
    Ok(Terms {
        tier: index,
        budget_us,
        sample_type: hello.sample_type,
        pressure_scale_pa: hello.pressure_scale_pa,
        _seat: Seat::take(tier),
    })
}

fn ready(app: &App, number: u64, terms: &Terms) -> Ready {
    let catalogue = app.catalogue();
    let tier = &catalogue.tiers[terms.tier];
    let meets_budget = catalogue.meets(terms.tier, terms.budget_us);
    Ready {
        version: u32::from(PROTOCOL_VERSION),
        session: number,
        tier: tier.name.clone(),
        effects: tier.effects.clone(),
        atlas_hash: tier.atlas_hash.clone(),
        predicted_latency_us: catalogue.predicted_latency_us(terms.tier),
        budget_us: terms.budget_us,
        meets_budget,
        width: MAP_SIDE_PX as u32,
        height: MAP_SIDE_PX as u32,
        sample_type: terms.sample_type,
        pressure_max_pa: tier.pressure_max_pa,
        sed_scale_j_per_m3: scale_of(Output::Samples(terms.sample_type), tier.sed_max_j_per_m3),
    }
}
