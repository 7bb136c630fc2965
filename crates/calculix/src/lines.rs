//! Lines of a deck: nodes, elements, sets.

use super::number;
use std::fmt::Write;

/// A node and where it is, mm.
pub(super) fn write_node(out: &mut String, id: usize, p: [f64; 3]) {
    let _ = writeln!(out, "{id},{},{},{}", number(p[0]), number(p[1]), number(p[2]));
}

/// An element line holds at most 16 numbers and goes on after a comma.
pub(super) fn write_element(out: &mut String, id: usize, nodes: impl Iterator<Item = usize>) {
    let mut line: Vec<usize> = vec![id];
    line.extend(nodes);
    write_lines(out, &line, 16);
}

/// A set of nodes.
pub(super) fn write_set(out: &mut String, name: &str, nodes: &[usize]) {
    let _ = writeln!(out, "*NSET, NSET={name}");
    for line in nodes.chunks(16) {
        write_lines(out, line, 16);
    }
}

fn write_lines(out: &mut String, numbers: &[usize], per_line: usize) {
    for (i, n) in numbers.iter().enumerate() {
        let end = i + 1 == numbers.len();
        let separator = match (end, (i + 1) % per_line == 0) {
            (true, _) => "\n",
            (false, true) => ",\n",
            (false, false) => ",",
        };
        let _ = write!(out, "{n}{separator}");
    }
}
