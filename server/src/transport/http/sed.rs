//! `POST /v1/sed`: one pressure map in, one SED map out.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::{
    body::Body,
    extract::{Extension, State},
    http::{HeaderMap, HeaderValue, Uri},
    response::Response,
};
use papilla_codec::Output;
use papilla_metrics::Transport;
use papilla_proto::{
    Problem,
    contact::{DEFAULT_FINGER, Input},
};

use crate::{
    core::scheduler::{Job, JobOptions},
    transport::{
        answer::{
            Answer, Shared, answer, body, refuse,
            render::{Rendered, count, through_pool},
        },
        app::App,
        first_use,
        gate::Principal,
        http::finger,
        negotiate::{self, Query},
    },
};

pub(crate) async fn post(
    State(app): Shared,
    Extension(principal): Extension<Principal>,
    uri: Uri,
    headers: HeaderMap,
    body: Body,
) -> Answer {
    let result = render(&app, &principal, &uri, &headers, body).await;
    count(&app, Transport::Http, &result);
    result.or_else(|problem| refuse(&app, problem))
}

async fn render(
    app: &Arc<App>,
    principal: &Principal,
    uri: &Uri,
    headers: &HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    // The body first: a client that is still sending would not read our answer.
    let payload = body::read(headers, body, app.body_max, app.timeouts.io).await?;
    let received = Instant::now();
    body::require_plain(headers)?;
    let query = Query::parse(uri.query().unwrap_or_default())?;
    let input = negotiate::input(headers, &query, &payload)?;
    let output = negotiate::output(headers)?;
    let name = query.finger.as_deref().unwrap_or(DEFAULT_FINGER);
    let catalogue = finger::called(app, principal, name).await?.catalogue;
    let place = match &query.tier {
        Some(name) => catalogue.tier_named(name)?,
        None => {
            let chosen = catalogue.choose(query.budget(), &[], Input::Pressure);
            chosen.unwrap_or(catalogue.default_for_pressure)
        }
    };
    let tier = catalogue.tier_number(place);
    first_use::wait(app, tier, principal.client.as_ref(), app.timeouts.io).await?;
    let deadline = query.budget().map(|us| received + Duration::from_micros(us.into()));
    let job =
        Job { tier, payload, input, output, received, deadline, options: JobOptions::default() };
    // Held until the answer is there: it bounds the queue.
    let _place = app.admit_request()?;
    let rendered = through_pool(app, job, Transport::Http, principal.client.as_ref()).await?;
    let Rendered { bytes, scale, timings } = rendered;
    let mut response = answer(output.content_type(), bytes.freeze());
    let headers = response.headers_mut();
    timings.label(headers, &catalogue.tiers[place].name);
    if let (Output::Png, Ok(white)) = (output, HeaderValue::from_str(&scale.to_string())) {
        headers.insert("x-sed-max-j-per-m3", white);
    }
    Ok(response)
}
