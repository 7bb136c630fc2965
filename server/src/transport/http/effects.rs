//! `GET /v1/effects`: what a session can ask for, and what that costs here.

use papilla_proto::RuntimeEffect;
use papilla_session_contact::ContactAssets;
use serde_json::{Value, json};

use crate::{
    core::fingers::Loaded,
    transport::{
        answer::{Answer, json_answer},
        http::finger::Asked,
    },
};

pub(crate) async fn list(Asked(Loaded { catalogue, contact }): Asked) -> Answer {
    let costs = catalogue.runtime.costs();
    // It is of the contact model, and timed with it.
    let shear_us = contact.as_deref().and_then(ContactAssets::shear_us);
    let of_traction =
        |effect| shear_us.filter(|_| effect == RuntimeEffect::ShearEnergy).map(|us| us as f64);
    let of_sessions = RuntimeEffect::ALL.into_iter().map(|effect| {
        let cost = costs.and_then(|costs| costs.iter().find(|cost| cost.effect == effect));
        json!({
            "name": effect,
            "of": "session",
            "what": effect.what(),
            "cost_us": cost.map(|cost| cost.us).or(of_traction(effect)),
        })
    });
    let mut names: Vec<&String> = catalogue.tiers.iter().flat_map(|tier| &tier.effects).collect();
    names.sort_unstable();
    names.dedup();
    let of_tiers = names.into_iter().map(|name| {
        let renders = catalogue.tiers.iter().filter(|tier| tier.effects.contains(name));
        let tiers: Vec<&String> = renders.map(|tier| &tier.name).collect();
        json!({"name": name, "of": "tier", "tiers": tiers})
    });
    let effects: Vec<Value> = of_sessions.chain(of_tiers).collect();
    Ok(json_answer(&json!({"effects": effects})))
}
