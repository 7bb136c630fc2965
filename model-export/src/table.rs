//! A Markdown table of accuracy against time from several cards.

use papilla_engine::Card;
use papilla_engine::card::Spread;
use std::fmt::Write;

/// One row per card, in the order given.
#[must_use]
pub fn markdown(cards: &[Card]) -> String {
    let mut text = String::from(
        "| model | kB | relative L2, median | p95 | far field, median | p95 | peak, median | p95 | energy, median | p95 | SSIM, median | p5 | ms, p50 | p99 | engine | samples |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for card in cards {
        let m = &card.metrics;
        let far = m.far_field_relative_l2.map_or_else(|| "- | -".to_owned(), percent);
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "| {} | {:.0} | {} | {far} | {} | {} | {:.4} | {:.4} | {:.1} | {:.1} | {} | {} {} |",
            card.name,
            card.bytes as f64 / 1e3,
            percent(m.relative_l2),
            percent(m.peak_error),
            percent(m.total_energy_error),
            m.ssim.median,
            m.ssim.p5,
            card.latency_ms.p50,
            card.latency_ms.p99,
            card.latency_ms.backend,
            m.samples,
            m.split,
        );
    }
    text
}

fn percent(spread: Spread) -> String {
    format!("{:.2} % | {:.2} %", 100.0 * spread.median, 100.0 * spread.p95)
}
