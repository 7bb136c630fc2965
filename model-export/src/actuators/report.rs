//! The page.

use super::Table;
use crate::ladder::machine;
use std::fmt::Write;

/// The page of these tables, each with its picture.
#[must_use]
pub fn markdown(tables: &[(Table, String)]) -> String {
    let mut text = include_str!("head.md").to_owned();
    // Writing to a String cannot fail.
    let _ = writeln!(text, "\nMeasured on {}.", machine());
    for (table, picture) in tables {
        let percent =
            |[median, p95]: [f64; 2]| format!("{:.1} / {:.1} %", 100.0 * median, 100.0 * p95);
        let us = |[median, p95]: [f64; 2]| format!("{median:.0} / {p95:.0}");
        let _ = writeln!(
            text,
            "\n## {}: {} pins, {} mm apart\n\n{} states; judge {}; `small` {} us.\n\n\
             | drive | SED, relative L2 | means over the pins | peak of SED | us a frame |\n|---|---|---|---|---|",
            table.set,
            table.pins,
            table.pitch_mm,
            table.states,
            percent(table.judge),
            us(table.network_us),
        );
        for row in &table.rows {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} |",
                row.way.name(),
                percent(row.relative_l2),
                percent(row.means),
                percent(row.peak),
                row.us.map_or_else(String::new, us),
            );
        }
        let _ = writeln!(text, "\n![press, drives and pins]({picture})");
    }
    text
}
