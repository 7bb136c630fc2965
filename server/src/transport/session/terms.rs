//! The terms of a session: what its hello asked for, on the tier that meets it.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use papilla_codec::{Output, scale_of};
use papilla_proto::{
    ErrorCode, HEADER_LEN, Hello, MAP_SIDE_PX, PROTOCOL_VERSION, Problem, Ready, Resumption,
    RuntimeEffect, SampleType,
    contact::{FINGERS_MAX, Input, SampleLayout},
    effects::{OutOfRange, Section, SectionName},
    error::shortened,
    spikes::PlacedUnit,
};
use papilla_session_contact::{ContactAssets, Hand, Skin};
use papilla_session_effects::Effects;
use papilla_session_state::tier_of;
use tokio::sync::OwnedSemaphorePermit;

use super::{
    budget::Budget,
    moving::{Memory, Shape},
    reply::tier_number,
};
use crate::{
    core::{
        buffers::HEADROOM,
        catalogue::{Catalogue, Tier},
        desk::Cancel,
    },
    transport::app::App,
};

/// What hello and ready agreed on.
pub(super) struct Terms {
    /// Index of the tier in the catalogue.
    pub(super) tier: usize,
    /// Deadline of frames that name none, us.
    pub(super) budget_us: Option<u32>,
    /// Who chooses the tier while the session lasts; none: it stays.
    pub(super) budget: Option<Budget>,
    /// Sample type of the client's frames.
    pub(super) sample_type: SampleType,
    /// Sample type of the answers.
    pub(super) answer_sample_type: SampleType,
    /// Pa per unit of frames whose header says 0.
    pub(super) pressure_scale_pa: Option<f32>,
    /// What becomes of pressure above what the tier was trained on.
    pub(super) out_of_range: OutOfRange,
    /// Longest delay on the way of a frame that is not stale, us.
    pub(super) stale_after_us: Option<u32>,
    /// What was asked for beside the bare map, of each finger; none of the bare map.
    pub(super) effects: Vec<Arc<Mutex<Effects>>>,
    pub(super) hand: Hand,
    /// Time that a frame's contact is expected to take, us; none if nothing is solved.
    pub(super) contact_us: Option<u64>,
    _fingers: OwnedSemaphorePermit,
    /// Of clients that follow a request to reconnect: what shapes their state.
    pub(super) follows: Option<Shape>,
    /// What became of the state that the hello brought.
    pub(super) resumption: Option<Resumption>,
    /// What the client is told of them.
    info: ReadyInfo,
    permit: Permit,
}

impl Terms {
    /// Goes on with another tier.
    pub(super) fn move_to(&mut self, place: usize, tier: &Tier) {
        self.tier = place;
        self.permit = Permit::take(tier);
    }

    /// Whether the network is asked.
    pub(super) fn shows_sed(&self) -> bool {
        self.info.shows_sed
    }

    /// What answers depend on of the frames before.
    pub(super) fn memory(&self) -> Memory {
        Memory { effects: self.effects.clone(), fingers: self.hand.fingers().to_vec() }
    }

    /// Most bytes of an answer, its heads included.
    pub(super) fn answer_len_max(&self) -> usize {
        let plain = HEADER_LEN + Output::Samples(self.answer_sample_type).size_hint();
        let effects = self.effects.first();
        HEADROOM
            + self.hand.sections_len()
            + effects.map_or(plain, |effects| {
                effects.lock().unwrap_or_else(PoisonError::into_inner).size_hint()
            })
    }
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
struct ReadyInfo {
    names: Vec<RuntimeEffect>,
    /// Units of the effect `spikes`.
    units: Option<Vec<PlacedUnit>>,
    sections: Vec<Section>,
    /// Whether the network is asked.
    shows_sed: bool,
}

impl Default for ReadyInfo {
    /// The bare map.
    fn default() -> Self {
        Self { names: Vec::new(), units: None, sections: Vec::new(), shows_sed: true }
    }
}

/// Fingers of a hello that take a place: a session that sends maps of pressure has the memory of
/// one by itself.
fn places(hello: &Hello) -> usize {
    let fingers = hello.fingers.as_ref().map_or(1, Vec::len).min(FINGERS_MAX);
    let sends_maps = hello.input.unwrap_or_default() == Input::Pressure
        && hello.input_layout.unwrap_or_default() == SampleLayout::Map;
    fingers.saturating_sub(usize::from(sends_maps))
}

/// The fingers of a hello, and their places.
fn hand(
    app: &App,
    catalogue: &Catalogue,
    hello: &Hello,
    cancel: &Cancel,
) -> Result<(Hand, OwnedSemaphorePermit), Problem> {
    let places = app.admit_fingers(places(hello))?;
    let contact = app.contact();
    let skin = Skin {
        atlas: &catalogue.atlas,
        raster: &catalogue.skin,
        model: contact.map(|contact| &contact.model),
        pixels: contact.and_then(|contact| contact.pixels.as_ref()),
        interface: contact.and_then(|contact| contact.interface.as_ref()),
        errors: contact.and_then(|contact| contact.errors.as_ref()),
    };
    Ok((Hand::of_until(hello, skin, &|| !cancel.is_set())?, places))
}

/// The effects of the session that a hello names; all others are the tier's.
fn runtime_effect(name: &str) -> Option<RuntimeEffect> {
    name.parse().ok()
}

/// The terms of a session that sends this hello, going on from a sealed state if there is one.
///
/// # Errors
/// It cannot be met; the problem names the member.
pub(super) fn meet(
    app: &App,
    hello: &Hello,
    sealed: Option<&[u8]>,
    cancel: &Cancel,
) -> Result<Terms, Problem> {
    let mut terms = agree(app, hello, sealed.and_then(tier_of), cancel)?;
    let Some(sealed) = sealed else { return Ok(terms) };
    let shape = Shape::of(hello);
    let for_terms = shape.on(&app.catalogue().tiers[terms.tier]);
    let resumption = terms.memory().resume(app, &for_terms, sealed);
    if !matches!(resumption, Resumption::Resumed | Resumption::Nothing) {
        // Nothing of it stays, not even the tier that it named.
        drop(terms);
        terms = agree(app, hello, None, cancel)?;
    }
    terms.resumption = Some(resumption);
    Ok(terms)
}

/// Nobody hears of it.
fn still_asked(cancel: &Cancel) -> Result<(), Problem> {
    let gone = || Problem::new(ErrorCode::Overloaded, "the client has left");
    if cancel.is_set() { Err(gone()) } else { Ok(()) }
}

/// The same without a state, which may have named the tier it came from.
fn agree(
    app: &App,
    hello: &Hello,
    before: Option<&str>,
    cancel: &Cancel,
) -> Result<Terms, Problem> {
    hello.check_version()?;
    let is_of_tier = |name: &&String| runtime_effect(name).is_none();
    let wanted: Vec<String> = hello.effects.iter().filter(is_of_tier).cloned().collect();
    let budget_us = hello.budget_us.filter(|&us| us > 0);
    let catalogue = app.catalogue();
    let index = match &hello.tier {
        Some(name) => catalogue.tier_named(name)?,
        None => before
            .and_then(|name| catalogue.tier_named(name).ok())
            .filter(|&index| {
                let tier = &catalogue.tiers[index];
                !tier.retired
                    && tier.is_loaded()
                    && wanted.iter().all(|effect| tier.effects.contains(effect))
            })
            .or_else(|| catalogue.choose(budget_us, &wanted))
            .unwrap_or(catalogue.default),
    };
    let tier = &catalogue.tiers[index];
    if !tier.is_loaded() {
        // Its first use came to nothing, or a reload came between.
        let message = format!("tier {} is not loaded; try again in a moment", tier.name);
        return Err(Problem::new(ErrorCode::Overloaded, message).at("tier"));
    }
    if let Some(effect) = wanted.iter().find(|effect| !tier.effects.contains(effect)) {
        let (effect, rendered) = (shortened(effect), tier.effects.join(", "));
        let message = format!("tier {} renders {rendered}, but not '{effect}'", tier.name);
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
    let (hand, fingers) = hand(app, &catalogue, hello, cancel)?;
    let contact_us = app.contact().and_then(|contact| contact.us_of(&hand));
    let mut effects = Vec::new();
    for _ in hand.fingers() {
        still_asked(cancel)?;
        effects.extend(Effects::of(hello, catalogue.finger())?);
    }
    let info = effects.first().map_or_else(ReadyInfo::default, |effects| ReadyInfo {
        names: effects.names().to_vec(),
        units: effects.units().map(<[_]>::to_vec),
        sections: effects.sections().to_vec(),
        shows_sed: effects.shows_sed(),
    });
    let by_budget = budget_us.filter(|_| hello.tier.is_none());
    Ok(Terms {
        tier: index,
        budget_us,
        budget: by_budget.map(|us| Budget::new(us, wanted)),
        sample_type: hello.sample_type,
        answer_sample_type: hello.answer_sample_type.unwrap_or(hello.sample_type),
        pressure_scale_pa: hello.pressure_scale_pa,
        out_of_range: hello.out_of_range.unwrap_or(OutOfRange::Clamp),
        stale_after_us: hello.stale_after_us,
        effects: effects.into_iter().map(|effects| Arc::new(Mutex::new(effects))).collect(),
        hand,
        contact_us,
        _fingers: fingers,
        follows: (hello.reconnect == Some(true)).then(|| Shape::of(hello)),
        resumption: None,
        info,
        permit: Permit::take(tier),
    })
}

/// What the client is told of its terms.
pub(super) fn ready(app: &App, number: u64, terms: &Terms) -> Ready {
    let catalogue = app.catalogue();
    let tier = &catalogue.tiers[terms.tier];
    let contact_us = terms.contact_us;
    let of_tier = if terms.info.shows_sed {
        catalogue.predicted_latency_us(terms.tier)
    } else {
        catalogue.overhead.us()
    };
    let shear_us = app.contact().and_then(ContactAssets::shear_us);
    let feels_shear = terms.info.names.contains(&RuntimeEffect::ShearEnergy);
    let predicted_latency_us = of_tier
        .saturating_add(contact_us.unwrap_or(0))
        .saturating_add(shear_us.filter(|_| feels_shear).unwrap_or(0))
        .saturating_add(catalogue.runtime.cost_us(&terms.info.names));
    let value_max = tier.sed_max_j_per_m3;
    let bare_map = || {
        let output = Output::Samples(terms.answer_sample_type);
        let (offset, bytes) = (HEADER_LEN as u32, output.size_hint() as u32);
        vec![Section { name: SectionName::Map, offset, bytes }]
    };
    let hand = &terms.hand;
    let sections = || {
        let rest = match terms.effects.first() {
            Some(_) => terms.info.sections.clone(),
            None => bare_map(),
        };
        let behind = hand.sections_len() as u32;
        let moved = rest.into_iter().map(|s| Section { offset: s.offset + behind, ..s });
        hand.sections().iter().copied().chain(moved).collect()
    };
    let method = hand.method();
    let errors = app.contact().and_then(|contact| contact.errors.as_ref());
    Ready {
        version: PROTOCOL_VERSION.into(),
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
        tier_number: tier_number(terms.tier),
        tier_names: terms
            .budget
            .as_ref()
            .map(|_| catalogue.tiers.iter().map(|tier| tier.name.clone()).collect()),
        answer_sample_type: terms.answer_sample_type,
        session_effects: terms.info.names.clone(),
        sections: sections(),
        units: terms.info.units.clone(),
        state: terms.resumption,
        vertices: catalogue.atlas.vertex_count() as u32,
        fingers: hand.fingers().len() as u32,
        contact_us,
        method,
        expected_error: errors.zip(method).and_then(|(errors, of)| errors.of(of)).cloned(),
        warnings: hand.warnings().to_vec(),
    }
}
