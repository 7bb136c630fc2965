//! Hello and ready: at the start of a session, and whenever the client asks for new terms.

use std::sync::Arc;

use bytes::Bytes;
use papilla_proto::{
    ClientMessage, ErrorCode, Hello, MessageError, Problem, Ready, ServerMessage, json::JsonError,
};
use papilla_session_state::is_sealed;
use tokio::{task::spawn_blocking, time::timeout};

use super::{
    End, close,
    connection::{Connection, Event, Wait},
    drained,
    terms::{self, Terms, ready},
};
use crate::{problem, transport::app::App};

/// Refused hellos after which the session ends.
const ATTEMPTS: usize = 8;

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
    let (terms, hello) = match result.await {
        Ok(agreed) => agreed?,
        Err(_) => {
            let message = format!("no hello within {wait_max:?}");
            return Err(End::Refused(Problem::new(ErrorCode::Timeout, message), close::POLICY));
        }
    };
    let ready = ready(&connection.app, number, &terms);
    tracing::debug!(session = number, ?hello, tier = %ready.tier, "session ready");
    connection.reply.send_message(&ServerMessage::Ready(ready));
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
    match parse(&text).await {
        Ok(ClientMessage::Hello(hello)) if hello.resume == Some(true) && hello.version > 1 => {
            match state(connection).await? {
                Ok(sealed) => Ok(meet(&connection.app, hello, Some(sealed)).await),
                Err(problem) => Ok(Err(problem)),
            }
        }
        Ok(ClientMessage::Hello(hello)) => Ok(meet(&connection.app, hello, None).await),
        Ok(_) => Ok(Err(Problem::new(ErrorCode::BadJson, "a hello is due"))),
        Err(MessageError::Hello(error)) => Ok(Err(error.into())),
        Err(MessageError::Unknown(error)) => {
            let mut problem = Problem::from(error);
            problem.message.push_str("; {\"type\":\"hello\",\"version\":1,…} is due");
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

pub(super) async fn parse(text: &Bytes) -> Result<ClientMessage, MessageError> {
    if text.len() <= PARSED_INLINE_MAX {
        return ClientMessage::from_json(text);
    }
    let text = text.clone();
    let parsing = spawn_blocking(move || ClientMessage::from_json(&text));
    parsing.await.unwrap_or_else(|error| {
        let reason = format!("it cannot be read: {error}");
        Err(MessageError::Unknown(JsonError { member: None, reason, place: None }))
    })
}

/// New terms for an open session; frames that the server has accepted keep the old ones.
///
/// # Errors
/// The text is no hello, a misspelt one, or one that cannot be met; the old terms stand.
pub(super) async fn renew(
    app: &Arc<App>,
    said: Result<ClientMessage, MessageError>,
    number: u64,
) -> Result<(Terms, Ready), Problem> {
    const DUE: &str = "binary frames are due once the session is ready, or a hello for new terms";
    let hello = match said {
        Ok(ClientMessage::Hello(Hello { resume: Some(true), .. })) => {
            let message = "a state is for the first hello of a connection";
            return Err(Problem::new(ErrorCode::BadJson, message).at("resume"));
        }
        Ok(ClientMessage::Hello(hello)) => hello,
        Ok(_) => return Err(Problem::new(ErrorCode::UnexpectedText, DUE)),
        Err(MessageError::Hello(error)) => return Err(error.into()),
        Err(MessageError::Unknown(error)) => {
            let message = format!("{DUE}, and this is neither: {error}");
            return Err(Problem::new(ErrorCode::UnexpectedText, message));
        }
    };
    let (terms, _) = meet(app, hello, None).await?;
    let ready = ready(app, number, &terms);
    Ok((terms, ready))
}

/// Whether and how the hello can be met. Effects may have to place points and take some MiB: that
/// is not for a thread that moves bytes.
async fn meet(
    app: &Arc<App>,
    hello: Hello,
    sealed: Option<Bytes>,
) -> Result<(Terms, Hello), Problem> {
    if hello.version == 1 {
        return terms::meet(app, &hello, None).map(|terms| (terms, hello));
    }
    let shared = Arc::clone(app);
    let meeting = spawn_blocking(move || {
        terms::meet(&shared, &hello, sealed.as_deref()).map(|terms| (terms, hello))
    });
    match timeout(app.timeouts.io, meeting).await {
        Ok(Ok(result)) => result,
        Ok(Err(error)) => Err(problem::internal("the hello cannot be worked out", &error)),
        Err(error) => Err(problem::internal("the hello takes too long to work out", &error)),
    }
}
