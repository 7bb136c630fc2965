//! The terms of a session: what its hello asked for, with the tier that serves it.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use papilla_codec::{Output, scale_of};
use papilla_engine::card;
use papilla_proto::{
    ErrorCode, FingerTerms, HEADER_LEN, Hello, MAP_SIDE_PX, PROTOCOL_VERSION, Problem, Ready,
    Resumption, RuntimeEffect, SampleType, Warning,
    contact::{DEFAULT_FINGER, FINGERS_MAX, Input, MethodError, SampleLayout},
    effects::{OutOfRange, Section, SectionName},
    error::shortened,
    spikes::PlacedUnit,
    unknown_effect,
};
use papilla_session_contact::{ContactAssets, Hand, Skin, of_finger};
use papilla_session_effects::{Effects, check_alike};
use papilla_session_state::{SealedFor, tier_of};
use tokio::sync::OwnedSemaphorePermit;

use super::{
    budget::Budget,
    moving::{Memory, Shape},
    reply::tier_number,
};
use crate::{
    core::{
        buffers::HEADROOM,
        catalogue::{Catalogue, Tier, places},
        desk::Cancel,
        fingers::Loaded,
    },
    transport::app::App,
};

/// What client and service agreed on by `hello` and `ready`.
pub(super) struct Terms {
    /// What the fingers are rendered with: one part for each name of a finger in the hello.
    parts: Vec<Part>,
    /// Index into `parts` of each finger of the session.
    part_of: Vec<usize>,
    /// Whether the hello gives a name to any finger.
    has_names: bool,
    /// Budget of frames whose header gives none, us; None: such frames have no deadline.
    pub(super) budget_us: Option<u32>,
    /// Sample type of the client's frames.
    pub(super) sample_type: SampleType,
    /// Sample type of the answers.
    pub(super) answer_sample_type: SampleType,
    /// Pa per unit for frames whose header has the scale 0.
    pub(super) pressure_scale_pa: Option<f32>,
    /// What is done with pressure above that of the tier's training.
    pub(super) out_of_range: OutOfRange,
    /// Longest delay of a frame that is not stale, us; None: no delay makes a frame stale.
    pub(super) stale_after_us: Option<u32>,
    /// The effects of each finger; empty if only the bare map was asked for.
    pub(super) effects: Vec<Arc<Mutex<Effects>>>,
    pub(super) hand: Hand,
    _fingers: OwnedSemaphorePermit,
    /// What the form of the state depends on. None: the client does not follow a request to
    /// reconnect.
    pub(super) follows: Option<Shape>,
    /// What became of the sealed state that came with the hello; None if there was none.
    pub(super) resumption: Option<Resumption>,
    /// What frames hold.
    input: Input,
    /// What `ready` says of the effects.
    info: ReadyInfo,
    /// The fingers as they were when the terms were agreed on. `ready` takes them, so that a
    /// session does not keep models alive that a reload replaces.
    agreed: Vec<Loaded>,
}

/// What all fingers of one name are rendered with.
pub(super) struct Part {
    /// Place of the finger among those of the service.
    pub(super) finger: usize,
    /// Number of the tier.
    pub(super) tier: usize,
    /// Changes the tier during the session to keep the budget. None: the tier stays.
    pub(super) budget: Option<Budget>,
    /// Expected time of a frame's contact, us; None if no contact is solved.
    pub(super) contact_us: Option<u64>,
    atlas_hash: String,
    /// Number of the first finger of the session that has this part.
    first: usize,
    permit: Permit,
}

impl Part {
    /// Changes to the tier at this place of the catalogue.
    pub(super) fn move_to(&mut self, catalogue: &Catalogue, place: usize) {
        self.tier = catalogue.tier_number(place);
        self.permit = Permit::take(&catalogue.tiers[place]);
    }

    /// The tier. `of` must hold the catalogue in which it was chosen.
    fn tier<'a>(&self, of: &'a Loaded) -> &'a Tier {
        &of.catalogue.tiers[places(self.tier).1]
    }
}

impl Terms {
    /// The part of a finger of the session, by the finger's number.
    pub(super) fn part(&self, finger: usize) -> &Part {
        &self.parts[self.part_of.get(finger).copied().unwrap_or_default()]
    }

    pub(super) fn parts_mut(&mut self) -> &mut [Part] {
        &mut self.parts
    }

    /// What a state of this shape is bound to when it is sealed.
    pub(super) fn sealed_for<'a>(&'a self, app: &App, shape: &'a Shape) -> SealedFor {
        let atlases = self.parts.iter().map(|part| part.atlas_hash.as_str());
        shape.on(&app.tier_name(self.part(0).tier), atlases)
    }

    /// Whether answers show SED, so that the network has to run.
    pub(super) fn shows_sed(&self) -> bool {
        self.info.shows_sed
    }

    /// The state that answers depend on, left by earlier frames.
    pub(super) fn memory(&self) -> Memory {
        Memory { effects: self.effects.clone(), fingers: self.hand.fingers().to_vec() }
    }

    /// The most bytes of an answer, with its headers.
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

/// Counts one session of a tier as long as it exists.
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
    /// Units of the effect `spikes`, of each finger.
    units: Vec<Option<Vec<PlacedUnit>>>,
    sections: Vec<Section>,
    /// Whether answers show SED, so that the network has to run.
    shows_sed: bool,
}

impl Default for ReadyInfo {
    /// The bare map.
    fn default() -> Self {
        Self { names: Vec::new(), units: Vec::new(), sections: Vec::new(), shows_sed: true }
    }
}

/// Number of fingers of a hello that count against the limit for fingers. A session that sends
/// pressure maps has one finger free, since each session has the memory of one in any case.
fn places_of(hello: &Hello) -> usize {
    let fingers = hello.fingers.as_ref().map_or(1, Vec::len).min(FINGERS_MAX);
    let sends_maps = hello.input.unwrap_or_default() == Input::Pressure
        && hello.input_layout.unwrap_or_default() == SampleLayout::Map;
    fingers.saturating_sub(usize::from(sends_maps))
}

/// Makes the fingers of a hello on these skins, with the permit for the places that they take.
fn hand(
    app: &App,
    loaded: &[Loaded],
    hello: &Hello,
    cancel: &Cancel,
) -> Result<(Hand, OwnedSemaphorePermit), Problem> {
    let places = app.admit_fingers(places_of(hello))?;
    let skins: Vec<Skin<'_>> = loaded.iter().map(skin).collect();
    Ok((Hand::of_each(hello, skins[0], &skins, &|| !cancel.is_set())?, places))
}

/// The skin of a finger.
fn skin(Loaded { catalogue, contact }: &Loaded) -> Skin<'_> {
    let contact = contact.as_deref();
    Skin {
        atlas: &catalogue.atlas,
        raster: &catalogue.skin,
        model: contact.map(|contact| &contact.model),
        pixels: contact.and_then(|contact| contact.pixels.as_ref()),
        interface: contact.and_then(|contact| contact.interface.as_ref()),
        errors: contact.and_then(|contact| contact.errors.as_ref()),
        model_sha256: contact.map(|contact| contact.sha256.as_str()),
    }
}

/// The finger of the service behind each finger of a hello, by its number; at least one. A hello
/// with too many fingers is refused later.
fn loaded(app: &App, hello: &Hello) -> Result<Vec<Loaded>, Problem> {
    let announced = hello.fingers.iter().flatten().take(FINGERS_MAX).enumerate();
    let named = announced.map(|(number, finger)| {
        app.finger(finger.name()).map_err(|problem| problem.at(format!("fingers[{number}].name")))
    });
    let loaded = named.collect::<Result<Vec<_>, _>>()?;
    if loaded.is_empty() { Ok(vec![app.finger(DEFAULT_FINGER)?]) } else { Ok(loaded) }
}

/// The session effect of this name. None: the name is that of an effect of the tier.
fn runtime_effect(name: &str) -> Option<RuntimeEffect> {
    name.parse().ok()
}

/// Agrees on the terms for a hello, and restores a sealed state if it brought one.
///
/// # Errors
/// The hello cannot be met; the problem names the member.
pub(super) fn meet(
    app: &App,
    hello: &Hello,
    sealed: Option<&[u8]>,
    cancel: &Cancel,
) -> Result<Terms, Problem> {
    let mut terms = agree(app, hello, sealed.and_then(tier_of), cancel)?;
    let Some(sealed) = sealed else { return Ok(terms) };
    let shape = Shape::of(hello);
    let for_terms = terms.sealed_for(app, &shape);
    let resumption = terms.memory().resume(app, &for_terms, sealed);
    if !matches!(resumption, Resumption::Resumed | Resumption::Nothing) {
        // The state may be restored in part, and may have chosen the tier: agree again without it.
        drop(terms);
        terms = agree(app, hello, None, cancel)?;
    }
    terms.resumption = Some(resumption);
    Ok(terms)
}

/// Ends the work if the client has left; nobody receives this problem.
fn still_asked(cancel: &Cancel) -> Result<(), Problem> {
    let gone = || Problem::new(ErrorCode::Overloaded, "the client has left");
    if cancel.is_set() { Err(gone()) } else { Ok(()) }
}

/// Agrees on the terms for a hello. `before` is the tier that a sealed state names, if there is
/// one.
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
    let by_budget = budget_us.filter(|_| hello.tier.is_none());
    let input = hello.input.unwrap_or_default();
    let loaded = loaded(app, hello)?;
    let mut parts: Vec<Part> = Vec::new();
    let mut part_of = Vec::with_capacity(loaded.len());
    for (number, of) in loaded.iter().enumerate() {
        let catalogue = &of.catalogue;
        if let Some(part) = parts.iter().position(|part| part.finger == catalogue.place) {
            part_of.push(part);
            continue;
        }
        // A sealed state names only the tier of the first finger.
        let before = before.filter(|_| number == 0);
        let place = choose(catalogue, hello, &wanted, before)
            .map_err(|problem| of_finger(hello, number, problem))?;
        part_of.push(parts.len());
        parts.push(Part {
            finger: catalogue.place,
            tier: catalogue.tier_number(place),
            budget: by_budget.map(|us| Budget::new(us, wanted.clone(), input)),
            contact_us: None,
            atlas_hash: catalogue.atlas.hash().to_owned(),
            first: number,
            permit: Permit::take(&catalogue.tiers[place]),
        });
    }
    if let Some(scale) = hello.pressure_scale_pa.filter(|s| !(s.is_finite() && *s > 0.0)) {
        let message = format!("{scale} Pa per unit is no scale; it must be finite and above zero");
        return Err(Problem::new(ErrorCode::BadScale, message).at("pressure_scale_pa"));
    }
    let (hand, fingers) = hand(app, &loaded, hello, cancel)?;
    for part in &mut parts {
        let contact = loaded[part.first].contact.as_ref().zip(hand.method_of(part.first));
        part.contact_us = contact.and_then(|(contact, method)| contact.us_by(method));
    }
    let mut effects: Vec<Effects> = Vec::new();
    for (number, of) in loaded.iter().enumerate() {
        still_asked(cancel)?;
        let its_own = Effects::of(hello, of.catalogue.finger());
        effects.extend(its_own.map_err(|problem| of_finger(hello, number, problem))?);
        check_alike(&effects).map_err(|problem| of_finger(hello, number, problem))?;
    }
    let info = effects.first().map_or_else(ReadyInfo::default, |first| ReadyInfo {
        names: first.names().to_vec(),
        units: effects.iter().map(|of| of.units().map(<[_]>::to_vec)).collect(),
        sections: first.sections().to_vec(),
        shows_sed: first.shows_sed(),
    });
    Ok(Terms {
        parts,
        part_of,
        has_names: hello.fingers.iter().flatten().any(|finger| finger.name.is_some()),
        budget_us,
        sample_type: hello.sample_type,
        answer_sample_type: hello.answer_sample_type.unwrap_or(hello.sample_type),
        pressure_scale_pa: hello.pressure_scale_pa,
        out_of_range: hello.out_of_range.unwrap_or(OutOfRange::Clamp),
        stale_after_us: hello.stale_after_us,
        effects: effects.into_iter().map(|effects| Arc::new(Mutex::new(effects))).collect(),
        hand,
        _fingers: fingers,
        follows: (hello.reconnect == Some(true)).then(|| Shape::of(hello)),
        resumption: None,
        input,
        info,
        agreed: loaded,
    })
}

/// Chooses the tier of a finger: the one that the hello names, or else `before` if it still serves,
/// or else the one that [`Catalogue::choose`] picks. Returns its place.
fn choose(
    catalogue: &Catalogue,
    hello: &Hello,
    wanted: &[String],
    before: Option<&str>,
) -> Result<usize, Problem> {
    let input = hello.input.unwrap_or_default();
    let place = match &hello.tier {
        Some(name) => catalogue.tier_named(name)?,
        None => before
            .and_then(|name| catalogue.tier_named(name).ok())
            .filter(|&place| {
                let tier = &catalogue.tiers[place];
                !tier.retired
                    && tier.is_loaded()
                    && wanted.iter().all(|effect| tier.effects.contains(effect))
            })
            .or_else(|| catalogue.choose(hello.budget_us.filter(|&us| us > 0), wanted, input))
            .unwrap_or_else(|| catalogue.default_for(input)),
    };
    let tier = &catalogue.tiers[place];
    if !tier.is_loaded() {
        // It could not be loaded, or a reload came in between.
        let message = format!("tier {} is not loaded; try again in a moment", tier.name);
        return Err(Problem::new(ErrorCode::Overloaded, message).at("tier"));
    }
    if let Some(effect) = wanted.iter().find(|effect| !tier.effects.contains(effect)) {
        return Err(unknown_effect(effect, Some((&tier.name, &tier.effects))));
    }
    if let Some(hash) = hello.atlas_hash.as_ref().filter(|&hash| *hash != tier.atlas_hash) {
        let (hash, ours) = (shortened(hash), &tier.atlas_hash);
        let message = format!("the client has atlas {hash}, tier {} has {ours}", tier.name);
        return Err(Problem::new(ErrorCode::AtlasMismatch, message).at("atlas_hash"));
    }
    Ok(place)
}

/// Makes the `ready` message. Called once for these terms, since it takes `agreed`.
pub(super) fn ready(app: &App, number: u64, terms: &mut Terms) -> Ready {
    let agreed = std::mem::take(&mut terms.agreed);
    let terms = &*terms;
    let (first, of_first) = (terms.part(0), &agreed[0]);
    let tier = first.tier(of_first);
    let predicted = agreed.iter().enumerate().map(|(finger, of)| predicted_us(terms, finger, of));
    let predicted_latency_us = predicted.max().unwrap_or_default();
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
    let fingers = || agreed.iter().enumerate();
    let finger_terms = || fingers().map(|(finger, of)| finger_terms(terms, finger, of)).collect();
    let borrowed = fingers().filter_map(|(finger, of)| borrowed(terms, finger, of));
    let unlearnt = unlearnt(terms.input, tier, &of_first.catalogue);
    let unlearnt = unlearnt.filter(|_| terms.info.shows_sed);
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
        sed_scale_j_per_m3: sed_scale(terms, tier),
        tier_number: tier_number(first.tier),
        tier_names: tier_names(app, terms),
        answer_sample_type: terms.answer_sample_type,
        session_effects: terms.info.names.clone(),
        sections: sections(),
        units: terms.info.units.first().cloned().flatten(),
        state: terms.resumption,
        vertices: of_first.catalogue.atlas.vertex_count() as u32,
        fingers: hand.fingers().len() as u32,
        finger_terms: terms.has_names.then(finger_terms),
        contact_us: terms.parts.iter().filter_map(|part| part.contact_us).max(),
        method: hand.method(),
        expected_error: expected_error(terms, 0, of_first),
        warnings: hand.warnings().iter().cloned().chain(borrowed).chain(unlearnt).collect(),
    }
}

/// Expected time of a finger's frame from receipt to answer, us.
fn predicted_us(terms: &Terms, finger: usize, Loaded { catalogue, contact }: &Loaded) -> u64 {
    let part = terms.part(finger);
    let of_tier = if terms.info.shows_sed {
        catalogue.predicted_latency_us(places(part.tier).1)
    } else {
        catalogue.overhead.us()
    };
    let shear_us = contact.as_deref().and_then(ContactAssets::shear_us);
    let feels_shear = terms.info.names.contains(&RuntimeEffect::ShearEnergy);
    of_tier
        .saturating_add(part.contact_us.unwrap_or(0))
        .saturating_add(shear_us.filter(|_| feels_shear).unwrap_or(0))
        .saturating_add(catalogue.runtime.cost_us(&terms.info.names))
}

/// J/m3 of one unit of an answer's samples.
fn sed_scale(terms: &Terms, tier: &Tier) -> f32 {
    scale_of(Output::Samples(terms.answer_sample_type), tier.sed_max_j_per_m3)
}

/// The expected errors of the contact method of a finger, if its contact model knows them.
fn expected_error(terms: &Terms, finger: usize, of: &Loaded) -> Option<MethodError> {
    let errors = of.contact.as_ref().and_then(|contact| contact.errors.as_ref());
    errors.zip(terms.hand.method_of(finger)).and_then(|(errors, of)| errors.of(of)).cloned()
}

/// The names of tiers, indexed by the number that answers give; a number that stands for no tier
/// has an empty name. None: only one tier can answer.
fn tier_names(app: &App, terms: &Terms) -> Option<Vec<String>> {
    let has_budget = terms.parts.iter().any(|part| part.budget.is_some());
    if !has_budget && terms.parts.len() == 1 {
        return None;
    }
    let mut names = Vec::new();
    for part in &terms.parts {
        // The present catalogue is used, since a tier that was added meanwhile may be chosen.
        let Some(catalogue) = app.reloader.catalogue_at(part.finger) else { continue };
        for (place, tier) in catalogue.tiers.iter().enumerate() {
            let number = catalogue.tier_number(place);
            names.resize(names.len().max(number + 1), String::new());
            names[number].clone_from(&tier.name);
        }
    }
    Some(names)
}

fn finger_terms(terms: &Terms, finger: usize, of: &Loaded) -> FingerTerms {
    let part = terms.part(finger);
    let tier = part.tier(of);
    FingerTerms {
        name: of.catalogue.name.clone(),
        tier: tier.name.clone(),
        tier_number: tier_number(part.tier),
        trained_on: tier.trained_on.as_ref().map(|lender| lender.name.clone()),
        atlas_hash: tier.atlas_hash.clone(),
        vertices: of.catalogue.atlas.vertex_count() as u32,
        pressure_max_pa: tier.pressure_max_pa,
        sed_scale_j_per_m3: sed_scale(terms, tier),
        predicted_latency_us: predicted_us(terms, finger, of),
        method: terms.hand.method_of(finger),
        expected_error: expected_error(terms, finger, of),
        units: terms.info.units.get(finger).cloned().flatten(),
    }
}

/// The warning about a tier that the hello names and that did not learn such pressure as it will get,
/// where the default did.
fn unlearnt(input: Input, tier: &Tier, catalogue: &Catalogue) -> Option<Warning> {
    let default = &catalogue.tiers[catalogue.default_for(input)];
    if tier.suits(input) || !default.suits(input) {
        return None;
    }
    Some(card::unlearnt(input, &tier.name, &default.name))
}

/// The warning about a finger whose network was trained on another finger.
fn borrowed(terms: &Terms, finger: usize, of: &Loaded) -> Option<Warning> {
    let part = terms.part(finger);
    let lender = part.tier(of).trained_on.as_ref().filter(|_| part.first == finger)?;
    let question = format!(
        "finger '{}' has no network of its own: tier {} was trained on finger '{}', so its SED is by \
         similarity alone (places on the two maps are up to {:.1} px apart), and each answer has the \
         flag 'unfamiliar'; train a network on this finger",
        of.catalogue.name,
        part.tier(of).name,
        lender.name,
        lender.apart_px,
    );
    Some(Warning { member: format!("fingers[{finger}].name"), value: None, question })
}
