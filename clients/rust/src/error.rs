//! The error of this client: why there is no session or no map.

use std::fmt::Display;

use papilla_proto::{ErrorCode, FrameError, Problem, atlas::AtlasError};
use tokio_tungstenite::tungstenite;

/// Why there is no session or no map.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PapillaError {
    /// Nobody listens, or the connection broke.
    #[error("{server}: {reason}; is papilla-server running there?")]
    Unreachable {
        /// Where it was looked for.
        server: String,
        /// What the system or the library says.
        reason: String,
    },
    /// What was given as the service's address is none that this client takes.
    #[error(
        "'{address}' is no address of a papilla-server: {why}; write host, host:port, \
         [IPv6]:port or http(s)://host:port/path"
    )]
    Address {
        /// As it was given.
        address: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// What was given as a token can be none.
    #[error("the token holds a blank, a line end or a character that no token has")]
    Token,
    /// The service refused.
    #[error("refused: {0}")]
    Refused(Problem),
    /// What the service said is not of the protocol.
    #[error("not of the protocol: {0}")]
    Protocol(String),
    /// A frame of the service's is damaged.
    #[error("a frame of the service's is damaged: {0}")]
    Frame(#[from] FrameError),
    /// The atlas cannot be used.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
    /// The session was closed by this program.
    #[error("the session is closed")]
    Closed,
    /// An answer was asked for what its session does not carry.
    #[error("the answer carries no {member}: {advice}")]
    NotCarried {
        /// What.
        member: &'static str,
        /// How to get it.
        advice: &'static str,
    },
}

impl PapillaError {
    /// The code of a refusal.
    #[must_use]
    pub fn code(&self) -> Option<ErrorCode> {
        match self {
            Self::Refused(problem) => Some(problem.code),
            _ => None,
        }
    }

    /// Whether it may be gone when one tries again.
    pub(crate) fn passes(&self) -> bool {
        use ErrorCode::{Overloaded, RateLimited, ShuttingDown, Timeout};
        let passing = [Overloaded, RateLimited, ShuttingDown, Timeout];
        !matches!(self, Self::Address { .. } | Self::Token)
            && self.code().is_none_or(|code| passing.contains(&code))
    }

    pub(crate) fn unreachable(server: &dyn Display, reason: &dyn Display) -> Self {
        Self::Unreachable { server: server.to_string(), reason: reason.to_string() }
    }

    pub(crate) fn of_socket(server: &dyn Display, error: &tungstenite::Error) -> Self {
        if let tungstenite::Error::Http(answer) = error {
            let body = answer.body().as_deref().unwrap_or_default();
            if let Some(mut problem) = problem_of(body) {
                if problem.code == ErrorCode::Unauthorized {
                    problem.message.push_str("; here by Address::with_token");
                }
                return Self::Refused(problem);
            }
        }
        Self::unreachable(server, error)
    }
}

/// The problem in the body of an answer over HTTP.
pub(crate) fn problem_of(body: &[u8]) -> Option<Problem> {
    let value: serde_json::Value = serde_json::from_slice(body).ok()?;
    serde_json::from_value(value.get("error")?.clone()).ok()
}
