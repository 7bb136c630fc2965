//! What a session asks for: the protocol's hello, as far as it has a meaning without a service.

use papilla_proto::{
    ClientMessage, ErrorCode, Hello, Problem, RuntimeEffect, SampleType, contact::DEFAULT_FINGER,
    error::shortened,
};

use crate::Model;

/// Reads the text of a hello and holds it against the model.
pub(crate) fn read(text: &str, model: &Model) -> Result<Hello, Problem> {
    let message = ClientMessage::from_json(text.as_bytes());
    let message = message.map_err(|error| Problem::from(error.json().clone()))?;
    let ClientMessage::Hello(hello) = message else {
        return Err(Problem::new(ErrorCode::BadJson, "a hello is due").at("type"));
    };
    check_form(&hello)?;
    check_model(&hello, model)?;
    Ok(hello)
}

/// Samples are C's floats, and what a network or a queue is asked for has no meaning here.
fn check_form(hello: &Hello) -> Result<(), Problem> {
    hello.check_version()?;
    let other = |sample_type: Option<SampleType>| sample_type.is_some_and(|t| t != SampleType::F32);
    for (is_other, member) in [
        (other(Some(hello.sample_type)), "sample_type"),
        (other(hello.answer_sample_type), "answer_sample_type"),
    ] {
        if is_other {
            return Err(Problem::new(ErrorCode::WrongType, "samples are f32 here").at(member));
        }
    }
    for (is_there, member) in [
        (hello.budget_us.is_some(), "budget_us"),
        (hello.pressure_scale_pa.is_some(), "pressure_scale_pa"),
        (hello.stale_after_us.is_some(), "stale_after_us"),
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
    if hello.shear == Some(true) {
        let message = "the library answers no shear at vertices; a touch has its force";
        return Err(Problem::new(ErrorCode::BadContact, message).at("shear"));
    }
    Ok(())
}

fn check_model(hello: &Hello, model: &Model) -> Result<(), Problem> {
    let info = model.network.info();
    let name = &info.name;
    if let Some(tier) = hello.tier.as_ref().filter(|&tier| tier != name) {
        let message = format!("no tier '{}'; '{name}' was loaded", shortened(tier));
        return Err(Problem::new(ErrorCode::UnknownTier, message).at("tier"));
    }
    // An answer of the library is lists of f32, which spikes are not.
    let is_own = |e: &String| e.parse::<RuntimeEffect>().is_ok_and(|e| e != RuntimeEffect::Spikes);
    let is_foreign = |e: &&String| !is_own(e) && !info.effects.contains(e);
    if let Some(effect) = hello.effects.iter().find(is_foreign) {
        let (effect, rendered) = (shortened(effect), info.effects.join(", "));
        let message = format!("tier {name} renders {rendered}, but not '{effect}'");
        return Err(Problem::new(ErrorCode::UnknownEffect, message).at("effects"));
    }
    if let Some(hash) = hello.atlas_hash.as_ref().filter(|&hash| *hash != info.atlas_hash) {
        let (hash, ours) = (shortened(hash), &info.atlas_hash);
        let message = format!("the program has atlas {hash}, tier {name} has {ours}");
        return Err(Problem::new(ErrorCode::AtlasMismatch, message).at("atlas_hash"));
    }
    Ok(())
}
