//! The ladder as Markdown.

use crate::metrics::NAIL_BASE_MM;
use papilla_engine::card::Spread;
use papilla_engine::ladder::{Kind, Ladder, Percentiles, Readings, Rung, SetErrors, Traction};
use std::fmt::Write;

/// What is written by hand: what is measured and how.
const HEAD: &str = include_str!("head.md");

/// The page. `stem` is the name of the pictures without `.svg` and `-zone.svg`.
#[must_use]
pub fn markdown(ladder: &Ladder, stem: &str) -> String {
    let mut text = HEAD.to_owned();
    let quick = if ladder.quick { " A reduced set (`--quick`): figures are rough." } else { "" };
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "\nMeasured on {}.{quick}\n\n![Error against time]({stem}.svg)\n",
        ladder.machine
    );
    if let Some(floor) = &ladder.discretisation_error {
        let _ = writeln!(
            text,
            "The SED of the reference itself errs by about {} (relative L2 norm). This was estimated by {}\n\
             ([more](../concepts/accuracy.md#two-truths)). On the sets whose truth is the reference, differences between ways that\n\
             are smaller than this error mean nothing. On all others they say which way is nearer to the teacher, and not\n\
             which is nearer to the reference.\n",
            percent(floor.sed_relative_l2),
            floor.how
        );
    }
    costs(&mut text, ladder);
    overview(&mut text, ladder);
    let measured = ladder.sets.iter().find(|set| set.samples > 0).map(|set| set.name.as_str());
    if let Some(set) = ladder.pareto_set.as_deref().or(measured) {
        let _ = writeln!(text, "## All errors on {set}\n");
        errors(&mut text, ladder, set);
    }
    if let Some(found) = &ladder.readings {
        readings(&mut text, found);
    }
    if !ladder.traction.is_empty() {
        traction(&mut text, ladder);
    }
    zone(&mut text, stem);
    text
}

fn traction(text: &mut String, ladder: &Ladder) {
    text.push_str(
        "## With traction along the skin\n\n\
         The truth of this table is the teacher with a coefficient of friction of 0.5; no network was trained on friction. In\n\
         the set `friction` the indenter goes straight in. In `sliding` it is then dragged aside by up to 1.1 mm; each of its\n\
         three simulations has three states on the way in and two on the way aside. Of so few states the 95th percentile is\n\
         set by the one or two worst. *Pressure alone* is the relative L2 error of the\n\
         SED that a way answers. *With traction* is the error after the session effect `shear_energy` has added SED for the\n\
         traction along the skin ([how](../concepts/contact.md#friction)). Pressure and traction are those of FE. *Adds* is the\n\
         time of the effect.\n\n\
         | way | set | states | pressure alone | p95 | with traction | p95 | adds, ms | p95 |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    // From fast to slow, as in the other tables.
    let order: Vec<&str> = by_time(ladder).map(|rung| rung.name.as_str()).collect();
    let place = |model: &str| order.iter().position(|name| *name == model);
    let mut found: Vec<&Traction> = ladder.traction.iter().collect();
    found.sort_by_key(|of| (of.set.as_str(), place(&of.model)));
    for Traction { model, set, samples, alone, felt, added_ms } in found {
        let [alone, felt] = [alone, felt].map(|of| spread(Some(*of)));
        let _ = writeln!(
            text,
            "| {model} | {set} | {samples} | {alone} | {felt} | {:.2} | {:.2} |",
            added_ms.median, added_ms.p95
        );
    }
    text.push('\n');
}

fn readings(text: &mut String, found: &Readings) {
    let line = |text: &mut String, what: &str, of: Spread| {
        let _ = writeln!(text, "| {what} | {} |", spread(Some(of)));
    };
    let _ = write!(
        text,
        "## What a pressure map is worth\n\n\
         Each of {} states of the reference was solved on two meshes, its own and `{}`, which gives two pressure\n\
         maps of the same state. The table compares the two pressure maps, and each network's two answers.\n\
         A network can only know the map that it is given. Suppose that its answer to one of the two maps is exactly right.\n\
         Then its answer to the other map is wrong by about the difference between the two answers. Training could lessen only\n\
         the systematic part of this difference; this was not tried. Smoothing takes away half of the difference of the\n\
         pressure maps: so half of it is in detail finer than some 0.1 mm.\n\n\
         | relative L2 between the two | median | p95 |\n|---|---|---|\n",
        found.states, found.mesh
    );
    line(text, "pressure", found.pressure);
    line(
        text,
        "pressure, both maps smoothed by a Gaussian of 0.1 mm standard deviation",
        found.averaged,
    );
    for (name, apart) in &found.answers {
        line(text, &format!("SED that `{name}` answers"), *apart);
    }
    text.push('\n');
}

fn costs(text: &mut String, ladder: &Ladder) {
    text.push_str(
        "## Time and size\n\nFrom fast to slow, a way is in bold if it is more accurate than all ways in bold before it",
    );
    if let Some(set) = &ladder.pareto_set {
        let _ = write!(text, " (median relative L2 on {set}");
        let apart = ladder.told_apart(set);
        if apart > 0.0 {
            let _ = write!(
                text,
                "; better by at least {:.1} percentage points, which is the error of the reference itself",
                100.0 * apart
            );
        }
        text.push(')');
    }
    text.push_str(
        ".\n\nThe first two columns of times are of the service's backend. The JSON files call it *tract*. It evaluates the\n\
         networks of the service by rows, in code of its own; the library tract itself runs both U-Nets and `half-space`.\n\n\
         | way | kind | as the service runs it: p50, ms | p99 | ONNX Runtime p50, ms | p99 | time to load, ms | memory, MiB | file, kB |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for rung in by_time(ladder).filter(|rung| ![Kind::Fe, Kind::Floor].contains(&rung.kind)) {
        let latency = rung.latency_ms.as_ref();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            name(rung),
            kind(rung.kind),
            times(latency.map(|l| l.tract)),
            times(latency.and_then(|l| l.ort)),
            number(rung.load_ms, 0),
            number(rung.memory_mib, 1),
            number(rung.bytes.map(|bytes| bytes as f64 / 1e3), 0),
        );
    }
    if ladder.rungs.iter().any(|rung| rung.kind == Kind::Fe) {
        text.push_str("\n| FE way | s a state, median | p99 |\n|---|---|---|\n");
        for rung in by_time(ladder).filter(|rung| rung.kind == Kind::Fe) {
            let _ = writeln!(text, "| {} | {} |", name(rung), times(rung.seconds));
        }
    }
    text.push('\n');
}

/// Relative L2 on every set.
fn overview(text: &mut String, ladder: &Ladder) {
    text.push_str(
        "## Errors on all sets\n\nRelative L2 of SED, median / 95th percentile.\n\n| way | ms |",
    );
    let measured: Vec<_> = ladder.sets.iter().filter(|set| set.samples > 0).collect();
    for set in &measured {
        let _ = write!(text, " {}, {} states |", set.name, set.samples);
    }
    let _ = writeln!(text, "\n|---|---|{}", "---|".repeat(measured.len()));
    for rung in by_time(ladder) {
        let ms = rung.time_ms().map_or_else(|| "-".to_owned(), milliseconds);
        let _ = write!(text, "| {} | {ms} |", name(rung));
        for set in &measured {
            let _ = match rung.errors.get(&set.name) {
                Some(_) if rung.reference => write!(text, " the truth |"),
                Some(errors) => {
                    let l2 = errors.relative_l2;
                    write!(text, " {} / {} |", percent(l2.median), percent(l2.p95))
                }
                None => write!(text, " - |"),
            };
        }
        text.push('\n');
    }
    text.push('\n');
    for set in ladder.sets.iter().filter(|set| set.samples == 0) {
        let _ = writeln!(text, "`{}`: {}.\n", set.name, set.about);
    }
}

fn errors(text: &mut String, ladder: &Ladder, set: &str) {
    text.push_str(
        "| way | ms | relative L2 | p95 | far field | p95 | peak | p95 | place, mm | p95 | nail base | p95 | energy | p95 | SSIM | p5 |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for rung in by_time(ladder) {
        let Some(errors) = rung.errors.get(set) else { continue };
        let ms = rung.time_ms().map_or_else(|| "-".to_owned(), milliseconds);
        if rung.reference {
            let _ = writeln!(text, "| {} | {ms} | the truth {}|", name(rung), "| ".repeat(13));
            continue;
        }
        let _ = writeln!(text, "| {} | {ms} | {} |", name(rung), row(errors));
    }
    text.push('\n');
}

fn row(errors: &SetErrors) -> String {
    let place = errors.peak_distance_mm.map_or_else(
        || "- | -".to_owned(),
        |spread| format!("{:.2} | {:.2}", spread.median, spread.p95),
    );
    [
        spread(Some(errors.relative_l2)),
        spread(errors.far_field_relative_l2),
        spread(Some(errors.peak_error)),
        place,
        spread(errors.nail_base_error),
        spread(Some(errors.total_energy_error)),
        format!("{:.4} | {:.4}", errors.ssim.median, errors.ssim.p5),
    ]
    .join(" | ")
}

fn zone(text: &mut String, stem: &str) {
    let _ = write!(
        text,
        "## The zone toward the nail base\n\n![The zone on the atlas]({stem}-zone.svg)\n\n\
         The zone is the interface from {:.0} to {:.0} mm behind the tip (x in the undeformed finger's frame). The nail plate\n\
         of the default fingertip ends at 14 mm, so the zone reaches 2 mm to either side of that edge. It holds the nail's\n\
         matrix and fold. An object that presses the pad rarely touches the skin here, but it loads this zone through the\n\
         tissue. The U-Net paper reports that its network misses the SED there. A network has to miss it if each pixel of\n\
         its answer depends only on the pressure within 2 to 3 mm.\n",
        NAIL_BASE_MM.start, NAIL_BASE_MM.end
    );
}

/// The rungs from fast to slow.
fn by_time(ladder: &Ladder) -> impl Iterator<Item = &Rung> {
    let mut rungs: Vec<&Rung> = ladder.rungs.iter().collect();
    let time = |rung: &Rung| rung.time_ms().unwrap_or(f64::INFINITY);
    rungs.sort_by(|a, b| time(a).total_cmp(&time(b)));
    rungs.into_iter()
}

fn name(rung: &Rung) -> String {
    if rung.pareto { format!("**{}**", rung.name) } else { rung.name.clone() }
}

/// The kind in words.
pub(super) fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::ClosedForm => "closed form",
        Kind::Operator => "operator",
        Kind::Network => "network",
        Kind::PublishedUNet => "rebuilt U-Net",
        Kind::Fe => "finite elements",
        Kind::Floor => "floor",
    }
}

fn milliseconds(ms: f64) -> String {
    match ms {
        _ if ms < 10.0 => format!("{ms:.2}"),
        _ if ms < 1000.0 => format!("{ms:.0}"),
        _ => format!("{:.1} s", ms / 1e3),
    }
}

fn times(times: Option<Percentiles>) -> String {
    times.map_or_else(|| "- | -".to_owned(), |t| format!("{:.2} | {:.2}", t.p50, t.p99))
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

fn percent(value: f64) -> String {
    let value = 100.0 * value;
    if value < 10.0 { format!("{value:.1} %") } else { format!("{value:.0} %") }
}

fn spread(spread: Option<Spread>) -> String {
    spread.map_or_else(
        || "- | -".to_owned(),
        |s| format!("{} | {}", percent(s.median), percent(s.p95)),
    )
}
