//! The list of fingers over HTTP, and which finger a request is about.

use std::{sync::Arc, sync::atomic::Ordering};

use axum::{
    extract::{FromRequestParts, State},
    http::{Uri, request::Parts},
};
use papilla_proto::{ErrorCode, Problem, contact::DEFAULT_FINGER};
use serde_json::{Value, json};
use tokio::task::spawn_blocking;

use crate::{
    core::{
        catalogue::Catalogue,
        fingers::{self, Loaded, Memory},
    },
    problem,
    transport::{
        answer::{Answer, HttpProblem, Shared, json_answer, refuse},
        app::App,
        first_use,
        gate::Principal,
    },
};

/// Every finger: the default one, those that are loaded, and those that can be.
pub(crate) async fn list(State(app): Shared) -> Answer {
    let folder = app.fingers.folder.clone();
    let names = match folder {
        // A drive that does not answer holds up nobody else.
        Some(folder) => match spawn_blocking(move || fingers::names(&folder)).await {
            Ok(Ok(names)) => names,
            Ok(Err(error)) => {
                return refuse(&app, Problem::new(ErrorCode::BadModel, error.to_string()));
            }
            Err(error) => return refuse(&app, problem::internal("no list of fingers", &error)),
        },
        None => Vec::new(),
    };
    let named = app.reloader.named();
    let default = Loaded { catalogue: app.catalogue(), contact: app.contact().cloned() };
    let mut list = vec![loaded(&default, None)];
    let on_offer = || named.iter().filter(|named| !named.retired);
    list.extend(on_offer().map(|named| loaded(&named.loaded, Some(named.memory))));
    let is_loaded = |name: &str| on_offer().any(|named| named.loaded.catalogue.name == name);
    let waiting = names.iter().filter(|name| !is_loaded(name));
    list.extend(waiting.map(|name| json!({"name": name, "loaded": false})));
    Ok(json_answer(&json!({"fingers": list, "max_loaded": app.fingers.most})))
}

fn loaded(Loaded { catalogue, contact }: &Loaded, memory: Option<Memory>) -> Value {
    let Catalogue { name, atlas, tiers, default, default_for_pressure, .. } = &**catalogue;
    let of_tiers = catalogue.offered().map(|(_, tier)| {
        json!({
            "name": tier.name,
            "loaded": tier.is_loaded(),
            "trained_on": tier.trained_on.as_ref().map(|lender| &lender.name),
            "sessions": tier.sessions.load(Ordering::Relaxed),
        })
    });
    json!({
        "name": name,
        "loaded": true,
        "atlas_hash": atlas.hash(),
        "vertices": atlas.vertex_count(),
        "contact": contact.is_some(),
        "default_tier": tiers[*default].name,
        "default_tier_for_pressure": tiers[*default_for_pressure].name,
        "tiers": of_tiers.collect::<Vec<Value>>(),
        "files_bytes": memory.map(|memory| memory.files_bytes),
        "grown_bytes": memory.and_then(|memory| memory.grown_bytes),
    })
}

/// What a handler takes to answer for the finger that its request [asks about](asked).
pub(crate) struct Asked(pub(crate) Loaded);

impl FromRequestParts<Arc<App>> for Asked {
    type Rejection = HttpProblem;

    async fn from_request_parts(parts: &mut Parts, app: &Arc<App>) -> Result<Self, HttpProblem> {
        let finger = match parts.extensions.get::<Principal>() {
            Some(caller) => asked(app, caller, &parts.uri).await,
            None => Err(problem::internal("nobody is known to ask", &"no gate in front")),
        };
        finger.map(Self).or_else(|problem| refuse(app, problem))
    }
}

/// The finger that a request asks about with the parameter `finger`; without, the default one. One
/// that is not loaded is loaded now.
///
/// # Errors
/// There is none of this name, it cannot be loaded, or the parameter is given twice.
pub(crate) async fn asked(
    app: &Arc<App>,
    principal: &Principal,
    uri: &Uri,
) -> Result<Loaded, Problem> {
    let mut names = form_urlencoded::parse(uri.query().unwrap_or_default().as_bytes())
        .filter_map(|(name, value)| (name == "finger").then(|| value.into_owned()));
    match (names.next(), names.next()) {
        (None, _) => app.finger(DEFAULT_FINGER),
        (Some(name), None) => called(app, principal, &name).await,
        (Some(_), Some(_)) => {
            let message = "'finger' is given twice";
            Err(Problem::new(ErrorCode::BadQuery, message).at("finger"))
        }
    }
}

/// The finger of this name; one that is not loaded is loaded now.
///
/// # Errors
/// There is none, or it cannot be loaded.
pub(crate) async fn called(
    app: &Arc<App>,
    principal: &Principal,
    name: &str,
) -> Result<Loaded, Problem> {
    let client = principal.client.as_ref();
    let waited = first_use::wait_for_finger(app, name, client, app.timeouts.io).await;
    waited.and_then(|()| app.finger(name)).map_err(|problem| problem.at("finger"))
}
