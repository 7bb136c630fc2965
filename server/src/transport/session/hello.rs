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

/// What a text message says, if it can be understood.
pub(super) type Said = Result<ClientMessage, MessageError>;

/// Waits for a hello that can be met, and answers ready.
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

/// One message; a problem is one the session survives.
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

/// The sealed state that a hello has announced.
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

/// Longest text parsed by a thread that moves bytes, bytes: some 50 us of work.
const PARSED_INLINE_MAX: usize = 16 * 1024;

/// What a text says; a problem if too much waits to be read.
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

/// New terms for an open session; frames that the server has accepted keep the old ones. A problem
/// if the text is no hello, a misspelt one, or one that cannot be met; the old terms stand.
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

/// The hello for new terms in what a client says.
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

/// Whether and how the hello can be met. Effects may have to place points, shapes to be checked:
/// that is not for a thread that moves bytes.
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

/// Waits until what a hello needs is loaded, as long as its client is there: the fingers that it names,
/// of each the tier that it names, or those that its budget may choose from, and the contact model if
/// it may ask for that. A problem if that fails or takes too long. Whether there is such a tier is
/// found later.
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

/// What is wrong with the name of a finger, as a hello is told.
fn of_hello(mut problem: Problem, number: usize) -> Problem {
    if problem.code == ErrorCode::NotFound {
        problem.code = ErrorCode::BadContact;
    }
    problem.at(format!("fingers[{number}].name"))
}

/// The fingers of a hello, each once, with the number of the first that is so called.
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

/// Numbers of the tiers of a finger that a hello needs, or may need, and that are not loaded.
fn to_load(catalogue: &Catalogue, hello: &Hello) -> Vec<usize> {
    let places: Vec<usize> = match (&hello.tier, hello.budget_us) {
        (Some(name), _) => catalogue.find(name).into_iter().collect(),
        (None, Some(1..)) => catalogue.to_come().collect(),
        (None, Some(0) | None) => Vec::new(),
    };
    let is_missing = |&place: &usize| !catalogue.tiers[place].is_loaded();
    places.into_iter().filter(is_missing).map(|place| catalogue.tier_number(place)).collect()
}

/// Does work for a hello at the desk, as long as its client is there; a problem if it is too much.
async fn at_desk<T: Send + 'static>(
    connection: &mut Connection,
    work: impl FnOnce(&Cancel) -> T + Send + 'static,
) -> Result<Result<T, Problem>, End> {
    let (app, client) = (Arc::clone(&connection.app), connection.client.clone());
    // Before the time for a hello ends: it has come, and the client is told why it has to wait.
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
