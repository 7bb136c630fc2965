//! The page of a fit.

use super::judged::near;
use super::{Fit, Fitted, Identified};
use crate::people::PeopleError;
use papilla_output::{OutputError, atomic};
use std::fmt::Write as _;
use std::path::Path;

/// What the page says before its tables.
const HEAD: &str = include_str!("head.md");
/// What it says after them.
const TAIL: &str = include_str!("set/head.md");
/// Folder of the plots, beside the page.
const PICTURES: &str = "pictures/fit";

impl Fit {
    /// Writes `fit.json`, `fit.md` with its plot, and `finger.toml`.
    pub(super) fn write(&self, folder: &Path) -> Result<(), PeopleError> {
        atomic::write_json(&folder.join("fit.json"), self)?;
        self.write_page(&folder.join("fit.md"))?;
        Ok(atomic::write(&folder.join("finger.toml"), self.finger.to_toml().as_bytes())?)
    }

    /// Writes the page, its plot into [`PICTURES`] beside it.
    ///
    /// # Errors
    /// [`OutputError`] if it cannot be written.
    pub fn write_page(&self, page: &Path) -> Result<(), OutputError> {
        let folder = page.parent().unwrap_or_else(|| Path::new("")).join(PICTURES);
        atomic::create_folder(&folder)?;
        self.write_charts(&folder)?;
        atomic::write(page, self.markdown().as_bytes())
    }

    /// The page.
    fn markdown(&self) -> String {
        let head = HEAD.replace("VERDICT", &self.verdict());
        let mut text = format!("{head}\n{}.", self.made);
        if !self.records.is_empty() {
            let _ = write!(text, " **Fitted to records: {}.**", self.records.join(", "));
        }
        if !self.left_out.is_empty() {
            let _ = write!(text, " **Left out of this run: {}.**", self.left_out.join(", "));
        }
        self.constants(&mut text);
        self.fitted(&mut text);
        self.halves(&mut text);
        self.relaxation(&mut text);
        self.judged(&mut text);
        text.push_str(TAIL);
        text
    }

    /// What the rows say, in a sentence each.
    fn verdict(&self) -> String {
        let met = self.rows.iter().filter(|r| r.met).count();
        let named = |word: &str| {
            let of = self.constants.iter().filter(|c| c.told.word() == word);
            let names: Vec<&str> = of.map(|c| c.parameter.name).collect();
            if names.is_empty() { "none".to_owned() } else { names.join("; ") }
        };
        let mut text = format!(
            "{met} of {} fitted rows lie within their range. The rows tell these constants: {}. They do \
             not tell these: {}.",
            self.rows.len(),
            named("told"),
            named("not told")
        );
        if !self.judged.is_empty() {
            let near = self.judged.iter().filter(|r| near(&r.verdict)).count();
            let bar = if 4 * near >= 3 * self.judged.len() { "reached" } else { "not reached" };
            let _ = write!(
                text,
                " Of all rows, {near} of {} lie within people's range or within a third of a single \
                 figure. Three in four were asked before a finger of this kind is shipped: {bar}.",
                self.judged.len()
            );
        }
        text
    }

    fn constants(&self, text: &mut String) {
        text.push_str(
            "\n\n## Constants\n\n| constant | fitted value | lower bound | upper bound | as good from | as good to | share of the bounds | do the rows tell it? | source of the lower bound | source of the upper bound |\n\
             |---|---|---|---|---|---|---|---|---|---|\n",
        );
        for c in &self.constants {
            let (p, t) = (&c.parameter, &c.told);
            let _ = writeln!(
                text,
                "| {} | {}{} | {} | {} | {} | {} | {:.0} % | {} | {} | {} |",
                p.name,
                c.value,
                if c.at_bound { " (at its bound)" } else { "" },
                p.low,
                p.high,
                digits(t.low),
                digits(t.high),
                100.0 * t.share,
                t.word(),
                p.low_source,
                p.high_source
            );
        }
        if !self.held.is_empty() {
            let held = |p: &super::Parameter| format!("{} ({})", p.name, p.start);
            let held: Vec<String> = self.held.iter().map(held).collect();
            let _ = write!(text, "\nNot moved: {}.\n", held.join("; "));
        }
        let graded = match self.graded {
            0 => "none on the graded mesh".to_owned(),
            count => format!("{count} on the graded mesh in {:.0} s", self.solve_s[1]),
        };
        let _ = write!(
            text,
            "\n![How far each constant can be moved]({PICTURES}/profiles.svg)\n\nHalf the sum of the \
             squared residuals falls from {:.3} to {:.3}. {} fingers were simulated on the even mesh in \
             {:.0} s of processor time, and {graded}.\n",
            self.cost[0],
            self.cost[1],
            self.evaluated.len(),
            self.solve_s[0]
        );
    }

    fn fitted(&self, text: &mut String) {
        text.push_str(
            "\n## Rows\n\n| quantity | people | at the start, even mesh | fitted, even mesh | fitted, graded mesh | weighted residual | within the range? | what the interpolation misses, % |\n|---|---|---|---|---|---|---|---|\n",
        );
        for r in &self.rows {
            let [start, even] = [r.start, r.even].map(digits);
            let _ = writeln!(
                text,
                "| {} | {} | {start} | {even} | {} | {:.2} | {} | {:.1} |",
                r.name,
                r.people,
                r.graded.map_or_else(String::new, digits),
                r.residual,
                yes(r.met),
                r.surrogate_percent
            );
        }
    }

    fn halves(&self, text: &mut String) {
        let [first, second] = &self.halves[..] else { return };
        let _ = write!(
            text,
            "\n## What one half predicts of the other\n\n| half | fitted rows within the range | predicted rows within the range |\n|---|---|---|\n"
        );
        for (name, half) in [("first", first), ("second", second)] {
            let ([a, b], [c, d]) = (half.met(true), half.met(false));
            let _ = writeln!(text, "| {name} | {a} of {b} | {c} of {d} |");
        }
        text.push_str(
            "\n| quantity | people | first half fitted | is | second half fitted | is |\n|---|---|---|---|---|---|\n",
        );
        let is = |r: &super::halves::HalfRow| {
            let what = if r.fitted { "fitted" } else { "predicted" };
            format!("{what}, {}", if r.met { "within" } else { "outside" })
        };
        for (a, b) in first.rows.iter().zip(&second.rows) {
            let [x, y] = [a.here, b.here].map(digits);
            let _ =
                writeln!(text, "| {} | {} | {x} | {} | {y} | {} |", a.name, a.people, is(a), is(b));
        }
        text.push_str("\n| constant | first half fitted | second half fitted |\n|---|---|---|\n");
        let constants = self.constants.iter().zip(&first.constants).zip(&second.constants);
        for ((c, a), b) in constants {
            let _ = writeln!(text, "| {} | {a} | {b} |", c.parameter.name);
        }
    }

    fn relaxation(&self, text: &mut String) {
        let Some(s) = &self.shares else { return };
        text.push_str(
            "\n## Relaxation\n\n| share of the first time | energy lost, % | largest force, N | \
             processor time, s |\n|---|---|---|---|\n",
        );
        for t in &s.taps {
            let _ = writeln!(
                text,
                "| {} | {:.1} | {:.2} | {:.0} |",
                t.first_share, t.lost_percent, t.force_n_max, t.solve_s
            );
        }
        let stays = 1.0 - s.share.iter().sum::<f64>();
        let _ = write!(
            text,
            "\nPeople: {} %. The relaxation times are {:?} s and their shares {:?}. A share of {:.3} does not relax, so the \
         modulus against a sudden strain is {:.0} times that against a held strain.\n",
            s.people_percent,
            s.time_s,
            s.share.iter().map(|g| (1e4 * g).round() / 1e4).collect::<Vec<_>>(),
            stays,
            1.0 / stays
        );
    }

    fn judged(&self, text: &mut String) {
        if self.judged.is_empty() {
            return;
        }
        let met = self.judged.iter().filter(|r| near(&r.verdict)).count();
        let _ = write!(
            text,
            "\n## Every row\n\n{met} of {} rows lie within people's range, or within a third of a single figure.\n\n\
             | quantity | people | fitted finger | verdict | within a third or the range? |\n|---|---|---|---|---|\n",
            self.judged.len()
        );
        for r in &self.judged {
            let (here, near) = (r.here_text(), yes(near(&r.verdict)));
            let _ = writeln!(
                text,
                "| {} | {} | {here} | {} | {near} |",
                r.quantity,
                r.people,
                r.verdict.text()
            );
        }
    }

    /// A table for people.
    #[must_use]
    pub fn human(&self) -> String {
        let mut text = String::new();
        let line = |c: &Identified| {
            let bound = if c.at_bound { " (at its bound)" } else { "" };
            let Identified { parameter, value, told, .. } = c;
            format!("{:44} {value:>10}{bound}, {}\n", parameter.name, told.word())
        };
        text.extend(self.constants.iter().map(line));
        let _ = writeln!(text, "\n{:64} {:>12} {:>8} {:>8}", "row", "people", "start", "end");
        for r in &self.rows {
            let Fitted { name, people, start, even, graded, .. } = r;
            let [start, end] = [*start, graded.unwrap_or(*even)].map(digits);
            let _ = writeln!(text, "{name:64} {people:>12} {start:>8} {end:>8}");
        }
        let _ = writeln!(text, "\ncost {:.3} -> {:.3}", self.cost[0], self.cost[1]);
        self.halves(&mut text);
        self.relaxation(&mut text);
        self.judged(&mut text);
        text
    }
}

fn yes(v: bool) -> &'static str {
    if v { "yes" } else { "no" }
}

/// Three or four digits.
fn digits(v: f64) -> String {
    match v.abs() {
        a if a < 0.1 => format!("{v:.5}"),
        a if a < 1.0 => format!("{v:.4}"),
        _ => format!("{v:.3}"),
    }
}
