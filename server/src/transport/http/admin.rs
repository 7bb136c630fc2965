//! What only an administrator may ask for.

use std::sync::Arc;

use axum::{Extension, extract::State};
use papilla_proto::{ErrorCode, Problem};
use tokio::task::spawn_blocking;

use crate::{
    problem,
    transport::{
        answer::{Answer, Shared, json_answer, refuse},
        gate::Principal,
    },
};

/// Loads the models anew; answers with what has changed.
pub(crate) async fn reload(
    State(app): Shared,
    Extension(principal): Extension<Principal>,
) -> Answer {
    if !principal.is_admin {
        let message = "this asks for a token with admin = true, or, on a service without \
                       tokens, for a client on the same machine";
        return refuse(&app, Problem::new(ErrorCode::Forbidden, message));
    }
    if app.is_draining() {
        return refuse(&app, problem::shutting_down());
    }
    let turn = match app.reloader.try_begin() {
        Ok(turn) => turn,
        Err(error) => return refuse(&app, error.into()),
    };
    let reloader = Arc::clone(&app.reloader);
    match spawn_blocking(move || reloader.reload(turn)).await {
        Ok(Ok(changes)) => Ok(json_answer(&changes)),
        Ok(Err(error)) => refuse(&app, error.into()),
        Err(error) => refuse(&app, problem::internal("the reload broke off", &error)),
    }
}
