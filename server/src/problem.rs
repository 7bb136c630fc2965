//! The errors that the service tells its clients, whatever protocol carries them: typed, with
//! messages of bounded length.

use papilla_proto::{ErrorCode, FrameError, Problem, error::shortened};

/// Most characters of a message.
const MESSAGE_MAX: usize = 1000;

/// The problem with a message and a field of bounded length: what parsers say of input repeats it.
pub(crate) fn bounded(mut problem: Problem) -> Problem {
    let words: Vec<_> = problem.message.split(' ').map(shortened).collect();
    problem.message = words.join(" ");
    if let Some((end, _)) = problem.message.char_indices().nth(MESSAGE_MAX) {
        problem.message.truncate(end);
        problem.message.push('…');
    }
    problem.field = problem.field.map(|field| shortened(&field));
    problem
}

/// The problem a frame header makes.
pub(crate) fn of_frame(error: FrameError) -> Problem {
    let problem = Problem::new(error.code(), error.to_string());
    match error.field() {
        Some(field) => problem.at(field),
        None => problem,
    }
}

/// A fault of our own: the details go to the log, not to the client.
pub(crate) fn internal(what: &str, error: &dyn std::fmt::Display) -> Problem {
    tracing::error!(%error, "{what}");
    Problem::new(ErrorCode::Internal, format!("{what}; the server's log says more"))
}

/// The answer to work that comes while the server drains.
pub(crate) fn shutting_down() -> Problem {
    Problem::new(ErrorCode::ShuttingDown, "the server is draining; connect again in a moment")
}

/// The answer to work that missed its deadline.
pub(crate) fn late() -> Problem {
    Problem::new(ErrorCode::Late, "the deadline passed before the map was done; it was dropped")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_repeated_is_cut() {
        let problem = |message: &str| Problem::new(ErrorCode::BadJson, message);
        let whole = problem(
            "a message of some words, each short, that goes on for longer than an \
                             excerpt may, stays as it is",
        );
        assert_eq!(bounded(whole.clone()), whole);
        let long =
            bounded(problem(&format!("no '{}' here", "x".repeat(5000))).at("y".repeat(5000)));
        assert_eq!(long.message, format!("no '{}… here", "x".repeat(99)));
        assert_eq!(long.field.unwrap().chars().count(), 101);
        assert_eq!(bounded(problem(&"a ".repeat(5000))).message.chars().count(), 1001);
    }
}
