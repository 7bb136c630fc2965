//! What a session asks for: the protocol's hello, as far as it has a meaning without a service.

use std::sync::Arc;

use papilla_proto::{
    ClientMessage, ErrorCode, Hello, Problem, RuntimeEffect, contact::DEFAULT_FINGER,
    error::shortened, unknown_effect,
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

/// What a network or a queue is asked for has no meaning here.
pub(crate) fn check_form(hello: &Hello) -> Result<(), Problem> {
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
        if finger.name() != DEFAULT_FINGER {
            let name = shortened(finger.name());
            let message = format!(
                "no finger '{name}': the library has the one finger whose folder was loaded; load \
                 that of '{name}', and leave 'name' out"
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
