//! What a session asks for: the protocol's hello, as far as it has a meaning without a service.

use std::sync::Arc;

use papilla_proto::{
    ClientMessage, ErrorCode, Hello, Problem, RuntimeEffect,
    contact::{DEFAULT_FINGER, FINGERS_MAX},
    error::shortened,
    unknown_effect,
};

use crate::{Model, Network};

/// Reads the text of a hello.
///
/// # Errors
/// The text is none.
pub fn read_hello(text: &str) -> Result<Hello, Problem> {
    let message = ClientMessage::from_json(text.as_bytes());
    let message = message.map_err(|error| Problem::from(error.json().clone()))?;
    let ClientMessage::Hello(hello) = message else {
        return Err(Problem::new(ErrorCode::BadJson, "a hello is due").at("type"));
    };
    Ok(hello)
}

/// What a network or a queue is asked for has no meaning here, and fingers have the names of models.
pub(crate) fn check_form(hello: &Hello, named: &[(String, Arc<Model>)]) -> Result<(), Problem> {
    hello.check_version()?;
    for (is_there, member) in [
        (hello.budget_us.is_some(), "budget_us"),
        (hello.stale_after_us.is_some(), "stale_after_us"),
        (hello.resume == Some(true), "resume"),
    ] {
        if is_there {
            let message = format!("'{member}' is of a service; nothing waits or travels here");
            return Err(Problem::new(ErrorCode::BadJson, message).at(member));
        }
    }
    for (number, finger) in hello.fingers.iter().flatten().enumerate() {
        let is_there = |name: &str| named.iter().any(|(known, _)| known == name);
        if finger.name() != DEFAULT_FINGER && !is_there(finger.name()) {
            let known = named.iter().map(|(known, _)| known.as_str());
            let known: Vec<&str> = std::iter::once(DEFAULT_FINGER).chain(known).collect();
            let message = format!(
                "no finger '{}' was loaded, only {}",
                shortened(finger.name()),
                known.join(", ")
            );
            let field = format!("fingers[{number}].name");
            return Err(Problem::new(ErrorCode::BadContact, message).at(field));
        }
    }
    if let Some(scale) = hello.pressure_scale_pa.filter(|s| !(s.is_finite() && *s > 0.0)) {
        let message = format!("{scale} Pa per unit is no scale; it must be finite and above zero");
        return Err(Problem::new(ErrorCode::BadScale, message).at("pressure_scale_pa"));
    }
    Ok(())
}

/// The model of each finger of a hello, at least of one.
pub(crate) fn models<'a>(
    hello: &Hello,
    default: &'a Arc<Model>,
    named: &'a [(String, Arc<Model>)],
) -> Vec<&'a Arc<Model>> {
    let announced = hello.fingers.iter().flatten().take(FINGERS_MAX);
    let of_name = |name: &str| named.iter().find(|(known, _)| known == name).map(|(_, of)| of);
    let models: Vec<_> = announced.map(|one| of_name(one.name()).unwrap_or(default)).collect();
    if models.is_empty() { vec![default] } else { models }
}

/// Holds a hello against the networks that were loaded; the one that it gets.
pub(crate) fn choose(hello: &Hello, model: &Model) -> Result<Arc<Network>, Problem> {
    let input = hello.input.unwrap_or_default();
    let Some(network) = model.chosen(hello.tier.as_deref(), input) else {
        let tier = shortened(hello.tier.as_deref().unwrap_or_default());
        let names: Vec<String> = model.networks().map(|of| format!("'{}'", of.card.name)).collect();
        let were = if names.len() == 1 { "was" } else { "were" };
        let message = format!("no tier '{tier}'; {} {were} loaded", names.join(" and "));
        return Err(Problem::new(ErrorCode::UnknownTier, message).at("tier"));
    };
    let info = network.model.info();
    let name = &info.name;
    let is_foreign = |e: &&String| e.parse::<RuntimeEffect>().is_err() && !info.effects.contains(e);
    if let Some(effect) = hello.effects.iter().find(is_foreign) {
        return Err(unknown_effect(effect, Some((name, &info.effects))));
    }
    if let Some(hash) = hello.atlas_hash.as_ref().filter(|&hash| *hash != info.atlas_hash) {
        let (hash, ours) = (shortened(hash), &info.atlas_hash);
        let message = format!("the program has atlas {hash}, tier {name} has {ours}");
        return Err(Problem::new(ErrorCode::AtlasMismatch, message).at("atlas_hash"));
    }
    Ok(Arc::clone(network))
}
