//! What has to hold of every refusal, whatever bytes it answers.

use papilla_proto::Problem;

/// A refusal tells a client what to do: a code of its own making and words.
pub(crate) fn is_typed(problem: &Problem) -> bool {
    (400..500).contains(&problem.code.http_status()) && problem.message.len() > 10
}
