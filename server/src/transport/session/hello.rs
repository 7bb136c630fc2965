//! Hello and ready: at the start of a session, and each time the client asks for new terms.

use std::{sync::Arc, time::Instant};

use bytes::Bytes;
use papilla_metrics::Shed;
use papilla_proto::{
    ClientMessage, ErrorCode, Hello, MessageError, Problem, Ready, ServerMessage,
    contact::{DEFAULT_FINGER, FINGERS_MAX, Input},
};
use papilla_session_contact::of_finger;
use papilla_session_state::is_sealed;
use tokio::time::timeout;

use super::{
    End, close,
    connection::{Connection, Event, Wait},
    drained,
    terms::{self, Terms, ready},
};
use crate::{
    core::{
        catalogue::Catalogue,
        desk::{Cancel, NoResult},
    },
    problem,
    transport::first_use,
};

/// Refused hellos after which the session ends.
const ATTEMPTS: usize = 8;

/// A text message, or why it cannot be understood.
pub(super) type Said = Result<ClientMessage, MessageError>;

/// Waits for a hello that can be met, and answers it with `ready`.
pub(super) async fn agree(connection: &mut Connection, number: u64) -> Result<Terms, End> {
    let wait_max = connection.app.timeouts.io;
    let result = timeout(wait_max, async {
        for _ in 0..ATTEMPTS {
            match attempt(connection).await? {
                Ok(agreed) => return Ok(agreed),
                Err(problem) => connection.reply.send_error(problem, None),
            }
        }
        let message = format!("{ATTEMPTS} messages and no hello that can be met");
        Err(End::Refused(Problem::new(ErrorCode::BadJson, message), close::POLICY))
    });
    let (mut terms, hello) = match result.await {
        Ok(agreed) => agreed?,
        Err(_) => {
            let message = format!("no hello within {wait_max:?}");
            return Err(End::Refused(Problem::new(ErrorCode::Timeout, message), close::POLICY));
        }
    };
    let ready = ready(&connection.app, number, &mut terms);
    tracing::debug!(session = number, ?hello, tier = %ready.tier, "session ready");
    connection.reply.send_message(&ServerMessage::Ready(Box::new(ready)));
    Ok(terms)
}

/// Handles one message. After a [`Problem`] the session goes on; an [`End`] ends it.
async fn attempt(connection: &mut Connection) -> Result<Result<(Terms, Hello), Problem>, End> {
    let text = match connection.next(Wait::FOR_DRAIN).await? {
        Event::Draining => return Err(drained()),
        Event::Text(text) => text,
        Event::Binary(..) | Event::Due | Event::Settled => {
            let message = "the first message is the JSON hello, in text";
            return Ok(Err(Problem::new(ErrorCode::UnexpectedBinary, message)));
        }
    };
    let said = match parse(connection, &text).await? {
        Ok(said) => said,
        Err(problem) => return Ok(Err(problem)),
    };
    match said {
        Ok(ClientMessage::Hello(hello)) if hello.resume == Some(true) => {
            match state(connection).await? {
                Ok(sealed) => meet(connection, hello, Some(sealed)).await,
                Err(problem) => Ok(Err(problem)),
            }
        }
        Ok(ClientMessage::Hello(hello)) => meet(connection, hello, None).await,
        Ok(_) => Ok(Err(Problem::new(ErrorCode::BadJson, "a hello is due"))),
        Err(MessageError::Hello(error)) => Ok(Err(error.into())),
        Err(MessageError::Unknown(error)) => {
            let mut problem = Problem::from(error);
            problem.message.push_str("; {\"type\":\"hello\",…} is due");
            Ok(Err(problem))
        }
    }
}

/// Waits for the sealed state that a hello with `resume` has announced.
async fn state(connection: &mut Connection) -> Result<Result<Bytes, Problem>, End> {
    match connection.next(Wait::FOR_DRAIN).await? {
        Event::Draining => Err(drained()),
        Event::Binary(sealed, _) if is_sealed(&sealed) => Ok(Ok(sealed)),
        _ => {
            let message = "after a hello with 'resume' the sealed state is due, in binary";
            Ok(Err(Problem::new(ErrorCode::BadJson, message).at("resume")))
        }
    }
}

/// Longest text that is parsed on a worker thread of tokio, bytes: some 50 us of work.
const PARSED_INLINE_MAX: usize = 16 * 1024;

/// Parses a text, a long one at the desk. A problem: the desk could not do it in time.
pub(super) async fn parse(
    connection: &mut Connection,
    text: &Bytes,
) -> Result<Result<Said, Problem>, End> {
    if text.len() <= PARSED_INLINE_MAX {
        return Ok(Ok(ClientMessage::from_json(text)));
    }
    let text = text.clone();
    at_desk(connection, move |_| ClientMessage::from_json(&text)).await
}

/// Agrees on new terms for an open session. Frames that were accepted before keep the old terms. On
/// a problem the old terms stand: the text is no hello, is misspelt, or cannot be met.
pub(super) async fn renew(
    connection: &mut Connection,
    said: Said,
    number: u64,
) -> Result<Result<(Terms, Ready), Problem>, End> {
    let hello = match hello_of(said) {
        Ok(hello) => hello,
        Err(problem) => return Ok(Err(problem)),
    };
    let met = meet(connection, hello, None).await?;
    Ok(met.map(|(mut terms, _)| {
        let ready = ready(&connection.app, number, &mut terms);
        (terms, ready)
    }))
}

/// The hello in a message of an open session.
fn hello_of(said: Said) -> Result<Hello, Problem> {
    const DUE: &str = "binary frames are due once the session is ready, or a hello for new terms";
    match said {
        Ok(ClientMessage::Hello(Hello { resume: Some(true), .. })) => {
            let message = "a state is for the first hello of a connection";
            Err(Problem::new(ErrorCode::BadJson, message).at("resume"))
        }
        Ok(ClientMessage::Hello(hello)) => Ok(hello),
        Ok(_) => Err(Problem::new(ErrorCode::UnexpectedText, DUE)),
        Err(MessageError::Hello(error)) => Err(error.into()),
        Err(MessageError::Unknown(error)) => {
            let message = format!("{DUE}, and this is neither: {error}");
            Err(Problem::new(ErrorCode::UnexpectedText, message))
        }
    }
}

/// Agrees on the terms that a hello asks for, or says why not. This runs at the desk, since placing
/// points and checking shapes may take too long for a worker thread of tokio.
async fn meet(
    connection: &mut Connection,
    hello: Hello,
    sealed: Option<Bytes>,
) -> Result<Result<(Terms, Hello), Problem>, End> {
    if let Err(problem) = first_use(connection, &hello).await? {
        return Ok(Err(problem));
    }
    let app = Arc::clone(&connection.app);
    let work = move |cancel: &Cancel| {
        terms::meet(&app, &hello, sealed.as_deref(), cancel).map(|terms| (terms, hello))
    };
    Ok(at_desk(connection, work).await?.and_then(|met| met))
}

/// Waits until what a hello needs is loaded, as long as its client is there: the fingers that it
/// names, of each finger the tier that it names or the tiers that its budget may choose from, and
/// the contact model if it may need that. A problem: loading failed or took too long. A tier that
/// does not exist is not noticed here but when terms are agreed on.
async fn first_use(connection: &mut Connection, hello: &Hello) -> Result<Result<(), Problem>, End> {
    let (app, client) = (Arc::clone(&connection.app), connection.client.clone());
    let names = names(hello);
    let is_loaded = names
        .iter()
        .all(|(_, name)| app.finger(name).is_ok_and(|of| to_load(&of.catalogue, hello).is_empty()));
    let needs_contact =
        hello.input.unwrap_or_default() != Input::Pressure || !hello.effects.is_empty();
    if is_loaded && (app.knows_contact() || !needs_contact) {
        return Ok(Ok(()));
    }
    let wait_max = app.timeouts.io * 4 / 5;
    let last = Instant::now() + wait_max;
    let loading = async {
        if needs_contact && timeout(wait_max, app.wait_for_contact()).await.is_err() {
            app.metrics.shed(Shed::Hellos);
            let message = format!(
                "the contact model is being loaded, which takes longer than {wait_max:?}; try \
                 again in a moment"
            );
            return Err(Problem::new(ErrorCode::Overloaded, message));
        }
        for (number, name) in &names {
            let left = || last.saturating_duration_since(Instant::now());
            first_use::wait_for_finger(&app, name, client.as_ref(), left())
                .await
                .map_err(|problem| of_hello(problem, *number))?;
            let Ok(of) = app.finger(name) else { continue };
            for tier in to_load(&of.catalogue, hello) {
                let waited = first_use::wait(&app, tier, client.as_ref(), left()).await;
                waited.map_err(|problem| of_finger(hello, *number, problem))?;
            }
        }
        Ok(())
    };
    connection.while_there(loading).await
}

/// Turns a problem with a finger's name into one that names the member of the hello.
fn of_hello(mut problem: Problem, number: usize) -> Problem {
    if problem.code == ErrorCode::NotFound {
        problem.code = ErrorCode::BadContact;
    }
    problem.at(format!("fingers[{number}].name"))
}

/// The names of the fingers in a hello, each once, with the number of the first finger of that
/// name.
fn names(hello: &Hello) -> Vec<(usize, &str)> {
    let mut names: Vec<(usize, &str)> = Vec::new();
    for (number, finger) in hello.fingers.iter().flatten().take(FINGERS_MAX).enumerate() {
        if names.iter().all(|(_, name)| *name != finger.name()) {
            names.push((number, finger.name()));
        }
    }
    if names.is_empty() {
        names.push((0, DEFAULT_FINGER));
    }
    names
}

/// Numbers of the tiers of a finger that a hello needs or may need, and that are not loaded.
fn to_load(catalogue: &Catalogue, hello: &Hello) -> Vec<usize> {
    let places: Vec<usize> = match (&hello.tier, hello.budget_us) {
        (Some(name), _) => catalogue.find(name).into_iter().collect(),
        (None, Some(1..)) => catalogue.to_come().collect(),
        (None, Some(0) | None) => Vec::new(),
    };
    let is_missing = |&place: &usize| !catalogue.tiers[place].is_loaded();
    places.into_iter().filter(is_missing).map(|place| catalogue.tier_number(place)).collect()
}

/// Does work for a hello at the desk, as long as its client is there. A problem: the desk is too
/// busy, the work took too long, or it panicked.
async fn at_desk<T: Send + 'static>(
    connection: &mut Connection,
    work: impl FnOnce(&Cancel) -> T + Send + 'static,
) -> Result<Result<T, Problem>, End> {
    let (app, client) = (Arc::clone(&connection.app), connection.client.clone());
    // Shorter than the time limit for a hello, so that the client is told why it has to wait.
    let wait_max = app.timeouts.io * 4 / 5;
    let working = timeout(wait_max, app.desk.work(client, work));
    let busy = |message: String| {
        app.metrics.shed(Shed::Hellos);
        Problem::new(ErrorCode::Overloaded, message)
    };
    let done = connection.while_there(working).await.inspect_err(|_| {
        app.metrics.hellos_left.inc();
    })?;
    Ok(match done {
        Ok(Ok(result)) => Ok(result),
        Ok(Err(NoResult::Busy)) => {
            Err(busy("too many hellos wait to be worked out; try again in a moment".to_owned()))
        }
        Ok(Err(NoResult::Broken)) => {
            Err(problem::internal("the hello cannot be worked out", &"the work broke off"))
        }
        Err(_) => Err(busy(format!(
            "the hello was not worked out within {wait_max:?}; say less, or try again in a moment"
        ))),
    })
}
