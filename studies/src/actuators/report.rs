//! The page of the study of pins: tables of the errors and times of drives.

use super::{Row, Table};
use papilla_model_export::ladder::machine;
use std::fmt::Write;

/// A figure of a drive: its name, and how it is shown.
type Figure = (&'static str, fn(&Row) -> String);

/// What a table of the page holds of a drive.
const FIGURES: [Figure; 4] = [
    ("Error of means over the pins", |row| percent(row.means)),
    ("Error of SED", |row| percent(row.relative_l2)),
    ("Error of the greatest SED", |row| percent(row.peak)),
    ("Time of a frame, us", |row| row.us.map_or_else(String::new, us)),
];

/// The page of these tables, each with its picture.
#[must_use]
pub fn markdown(tables: &[(Table, String)]) -> String {
    let mut text = include_str!("head.md").to_owned();
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "\nMeasured on {}.\n\n| array | states | judge | time of `small`, us |\n|---|---|---|---|",
        machine()
    );
    for (table, _) in tables {
        let (judge, network) = (percent(table.judge), us(table.network_us));
        let _ = writeln!(text, "| {} | {} | {judge} | {network} |", array(table), table.states);
    }
    let arrays: Vec<_> = tables.iter().map(|(table, _)| array(table)).collect();
    for (title, cell) in FIGURES {
        let _ = writeln!(
            text,
            "\n## {title}\n\n| drive | {} |\n|---|{}",
            arrays.join(" | "),
            "---|".repeat(arrays.len())
        );
        let rows = tables.first().map_or(&[][..], |(table, _)| &table.rows[..]);
        for (k, row) in rows.iter().enumerate() {
            let _ = write!(text, "| {} |", row.way.name());
            for (table, _) in tables {
                let _ = write!(text, " {} |", table.rows.get(k).map_or_else(String::new, cell));
            }
            text.push('\n');
        }
    }
    text.push_str(
        "\n## Pictures\n\nThe median state of each array: simulation, drives and pins.\n",
    );
    for (table, picture) in tables {
        let _ = writeln!(text, "\n![{}]({picture})", array(table));
    }
    text
}

fn array(table: &Table) -> String {
    format!("{}, {} pins, {} mm apart", table.set, table.pins, table.pitch_mm)
}

fn percent([median, p95]: [f64; 2]) -> String {
    format!("{:.1} / {:.1} %", 100.0 * median, 100.0 * p95)
}

fn us([median, p95]: [f64; 2]) -> String {
    format!("{median:.0} / {p95:.0}")
}
