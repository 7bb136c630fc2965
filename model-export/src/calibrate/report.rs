//! The calibration as Markdown.

use super::{Cost, FOLDS, Fitted, Outcome, Row, SETS, Tried};
use crate::metrics::quantile;
use std::fmt::Write;

/// What is written by hand: what is stated, how it is fitted, what it means.
const HEAD: &str = include_str!("head.md");

/// The page. `stem` is the name of the picture without `.svg`.
#[must_use]
pub fn markdown(outcome: &Outcome, stem: &str) -> String {
    let mut text = HEAD.replace("FOLDS", &FOLDS.to_string());
    // Writing to a String cannot fail.
    let _ = writeln!(text, "\n![True error against stated bound]({stem}.svg)\n");
    sets(&mut text);
    text.push_str("## Set by set\n\n");
    text.push_str(include_str!("tables.md"));
    for fitted in outcome.shown() {
        let _ = writeln!(text, "\n**{}**\n", capital(&fitted.series.name()));
        rows(&mut text, &fitted.rows);
    }
    text.push_str("\n## Without the set\n\n");
    text.push_str(include_str!("without.md"));
    for fitted in outcome.shown().into_iter().take(2) {
        let _ = writeln!(text, "\n**{}**\n", capital(&fitted.series.name()));
        rows(&mut text, &fitted.without_its_set);
    }
    text.push_str("\n## All errors\n\n");
    text.push_str(
        "One row for each error that is stated, over all sets that are not set aside. Each simulation is\n\
         checked by laws that were fitted to other simulations. The last columns are the share of true errors\n\
         below the bound in the sets set aside, and the least share that a group of sets reaches.\n\n\
         | error | answers | stated | true median, % | bound, median, % | bound over median | below the median, % | \
         below the bound, % | set aside: below the bound, % | least of a group, % |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for fitted in &outcome.fitted {
        all(&mut text, fitted);
    }
    tried(&mut text, &outcome.tried);
    if let Some(cost) = &outcome.cost {
        costs(&mut text, cost);
    }
    text
}

impl Outcome {
    /// The errors of which each set has a row on the page.
    #[must_use]
    pub fn shown(&self) -> Vec<&Fitted> {
        let is_shown = |fitted: &&Fitted| {
            let of_network = fitted.series.network.as_deref().is_none_or(|of| of == super::SHOWN);
            let method = fitted.series.method;
            of_network
                && method.is_none_or(|of| of == papilla_proto::contact::ContactMethod::Pixels)
        };
        self.fitted.iter().filter(is_shown).collect()
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn percent(value: f64) -> String {
    match 100.0 * value {
        value if !value.is_finite() => "-".to_owned(),
        value if value < 9.95 => format!("{value:.1}"),
        value => format!("{value:.0}"),
    }
}

fn sets(text: &mut String) {
    text.push_str("## Sets\n\nWords in italics are the names of these sets on [other pages](../concepts/accuracy.md#test-sets).\nThe page on the [dataset](../reference/dataset.md#which-data-there-are) says more of shapes.\n\n| set | what it holds | group |\n|---|---|---|\n");
    for set in SETS {
        let _ = writeln!(text, "| `{}` | {} | {} |", set.folder, set.about, set.group);
    }
    text.push('\n');
}

fn rows(text: &mut String, rows: &[Row]) {
    text.push_str(
        "| set | answers | stated | true error: median, % | 90th percentile, % | stated: median, % | bound, % | \
         bound over median | below the median, % | below the bound, % | worst error / its bound |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let set = row.set.map_or("**all not set aside**".to_owned(), |set| format!("`{set}`"));
        let _ = writeln!(
            text,
            "| {set} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            row.states,
            row.stated,
            percent(row.true_median),
            percent(row.true_p90),
            percent(row.stated_median),
            percent(row.stated_p90),
            number(row.bound_over_median, 2),
            number(100.0 * row.below_median, 0),
            number(100.0 * row.below_p90, 0),
            number(row.worst, 1),
        );
    }
}

/// With so many decimals; a dash where nothing is stated.
fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { format!("{value:.decimals$}") } else { "-".to_owned() }
}

/// Share of the true errors of a group below their bounds; none without any.
fn of_group(fitted: &Fitted, group: &str) -> Option<f64> {
    let points = fitted.points.iter().filter(|(of, ..)| *of == group);
    let below: Vec<f64> =
        points.map(|(_, [_, p90], error)| f64::from(u8::from(error <= p90))).collect();
    (!below.is_empty()).then(|| below.iter().sum::<f64>() / below.len() as f64)
}

fn all(text: &mut String, fitted: &Fitted) {
    let Some(row) = fitted.row(None) else { return };
    let aside = of_group(fitted, "set aside");
    let groups = super::GROUPS.iter().filter(|group| **group != "set aside");
    let least = groups.filter_map(|group| of_group(fitted, group)).reduce(f64::min);
    let whole = |share: Option<f64>| {
        share.map_or_else(|| "-".to_owned(), |share| format!("{:.0}", 100.0 * share))
    };
    let _ = writeln!(
        text,
        "| {} | {} | {} | {} | {} | {:.2} | {:.0} | {:.0} | {} | {} |",
        fitted.series.name(),
        row.states,
        row.stated,
        percent(row.true_median),
        percent(row.stated_p90),
        row.bound_over_median,
        100.0 * row.below_median,
        100.0 * row.below_p90,
        whole(aside),
        whole(least),
    );
}

fn tried(text: &mut String, found: &[Tried]) {
    text.push_str("\n## Tried\n\n");
    text.push_str(include_str!("tried.md"));
    text.push_str(
        "\n| error | facts | how many | loss of the median | loss of the bound | bound over median | below the bound, % |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for Tried { series, facts, count, loss_median, loss_p90, row } in found {
        let _ = writeln!(
            text,
            "| {} | {facts} | {count} | {loss_median:.3} | {loss_p90:.3} | {:.2} | {:.0} |",
            series.name(),
            row.bound_over_median,
            100.0 * row.below_p90,
        );
    }
}

fn costs(text: &mut String, cost: &Cost) {
    let Cost { network, peak_us, peak_and_sum_us, look_us, laws_us, network_us } = cost;
    let _ = write!(
        text,
        "\n## Cost\n\n\
         Each part was run {runs} times in turn in one process, on a machine that was busy with other work. The\n\
         least time counts. An error estimate adds the sum of SED and the laws: {share:.1} % of the time of `{network}`.\n\
         The pass over the pressure is made in any case, to recognise unfamiliar maps. Nothing of it allocates memory.\n\n\
         | part of a frame | time, us |\n|---|---|\n\
         | greatest SED, without an error estimate | {peak_us:.1} |\n\
         | greatest SED and the sum, in one pass | {peak_and_sum_us:.1} |\n\
         | pass over the pressure, which also recognises unfamiliar maps | {look_us:.1} |\n\
         | facts and law, of SED and of force | {laws_us:.1} |\n\
         | network `{network}` | {network_us:.0} |\n",
        runs = super::cost::RUNS,
        share = 100.0 * cost.share(),
    );
}

/// The median over rows of one number, for summaries on a terminal.
#[must_use]
pub fn summary(outcome: &Outcome) -> String {
    let rows = outcome.fitted.iter().filter_map(|fitted| Some((fitted, fitted.row(None)?)));
    let mut text = String::new();
    for (fitted, row) in rows {
        let least = fitted.rows.iter().filter(|row| row.stated >= 10).map(|row| row.below_p90);
        let _ = writeln!(
            text,
            "{}: {:.0} % below the bound, at least {:.0} % in a set of 10 and more; bound {:.2} times the median",
            fitted.series.name(),
            100.0 * row.below_p90,
            100.0 * least.fold(1.0, f64::min),
            row.bound_over_median,
        );
    }
    let ratios: Vec<f64> =
        outcome.fitted.iter().filter_map(|f| Some(f.row(None)?.bound_over_median)).collect();
    let _ = writeln!(
        text,
        "median of bound over median: {:.2}",
        quantile(&ratios, 0.5).unwrap_or(f64::NAN)
    );
    text
}
