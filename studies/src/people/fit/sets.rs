//! Every row and the maps, with the default set and with the fitted one.

use crate::people::PeopleError;
use crate::people::maps::{self, MapChange};
use crate::people::measured::Measured;
use crate::people::pad;
use crate::people::press::Tissues;
use crate::people::report::{Row, Verdict};
use crate::people::study::{plates, row};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// Both sets on one mesh.
#[derive(Clone, Debug, Serialize)]
pub struct Sets {
    /// Rows with the default set.
    pub papers: Vec<Row>,
    /// Rows with the fitted set.
    pub people: Vec<Row>,
    /// What the fitted set does to maps.
    pub maps: Vec<MapChange>,
}

impl Sets {
    pub(super) fn new(
        measured: &Measured,
        [papers, people]: [&Tissues; 2],
        [relaxes, maps]: [bool; 2],
        folder: &Path,
        told: &mut dyn FnMut(&str),
    ) -> Result<Self, PeopleError> {
        let mut rows = |tissues: &Tissues| {
            told("plates with both sets");
            let presses = pad::pressed_together(&plates(measured), tissues, folder)?;
            let row = |figure| row(figure, &presses, tissues, folder);
            let known = measured.figures.iter().filter(|f| relaxes || f.quantity.plate().is_some());
            known.map(row).collect::<Result<Vec<_>, PeopleError>>()
        };
        let (first, second) = (rows(papers)?, rows(people)?);
        let maps = match maps {
            true => maps::changes([papers, people], folder, told)?,
            false => Vec::new(),
        };
        Ok(Self { papers: first, people: second, maps })
    }

    /// The tables of the page.
    pub(super) fn page(&self, text: &mut String) {
        text.push_str(
            "\n## What it does to every row\n\nBoth sets were computed on the even coarse mesh. The [comparison](human.md#rows) has the default \
         set on the graded mesh. Where its figures differ from those here, this is the error of the \
         coarse mesh.\n\n| quantity | people \
             | default set | verdict | fitted set | verdict | what would bring the fitted set nearer \
             |\n|---|---|---|---|---|---|---|\n",
        );
        for (a, b) in self.papers.iter().zip(&self.people) {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} |",
                a.quantity,
                a.people,
                a.here_text(),
                a.verdict.text(),
                b.here_text(),
                b.verdict.text(),
                if near(&b.verdict) { "" } else { mends(&b.quantity) }
            );
        }
        if self.maps.is_empty() {
            return;
        }
        text.push_str(
            "\n## What it does to maps\n\nMaps with the fitted set are compared with maps with the default set, at the same force and on \
         the even coarse mesh. L2 is the relative L2 norm of the difference over the vertices, and a \
         *peak* is the change of the greatest value. SED is the strain energy density. *Depths* are those \
         of the default finger and of the fitted one.\n\n| indenter | force, N | depths, mm | pressure, L2 | peak of \
             pressure | SED at the interface, L2 | peak of SED |\n|---|---|---|---|---|---|---|\n",
        );
        for c in &self.maps {
            let [from, to] = c.depth_mm;
            let percent = [c.pressure_l2, c.pressure_peak, c.sed_l2, c.sed_peak].map(|v| 100.0 * v);
            let [p, p_peak, s, s_peak] = percent;
            let _ = writeln!(
                text,
                "| {} | {} | {from:.2} and {to:.2} | {p:.0} % | {p_peak:+.0} % | {s:.0} % | {s_peak:+.0} % |",
                c.indenter, c.force_n,
            );
        }
    }
}

/// Within the spread, or as near to the one figure as people are likely to be to each other.
fn near(verdict: &Verdict) -> bool {
    match verdict {
        Verdict::Ok => true,
        Verdict::TimesPeople(t) => (0.8..=1.25).contains(t),
        Verdict::Failed | Verdict::NotReached(_) => false,
    }
}

/// What is left when the tissues stiffen.
fn mends(quantity: &str) -> &'static str {
    let of = |what: &str| quantity.contains(what);
    if of("stiffness") || of("contact area") {
        "skin under tension around a soft pulp (Serina et al. 1998), or another bone"
    } else if of("Hertz") {
        "a softer rise, which the stiffness under the flat plate rules out"
    } else if of("peak over mean") {
        "a finer mesh at small force"
    } else if of("energy") {
        "another share of the first time"
    } else {
        ""
    }
}
