//! The report's part on SA1 rates.

use super::PICTURES;
use crate::afferents::{Afferents, Fit, Peak};
use crate::mesh_error::MeshError;
use crate::receptors::depth_name;
use std::fmt::Write as _;

impl Fit {
    /// What is felt, and where.
    pub(super) fn name(&self) -> String {
        let pooled = match self.pooled_mm {
            0.0 => String::new(),
            r => format!(", mean within {r} mm"),
        };
        format!("{} at {}{pooled}", self.stimulus.name(), depth_name(self.depth))
    }
}

/// The fits, plots and rates.
pub(super) fn afferents(text: &mut String, found: &Afferents) {
    let people = found
        .of_sed
        .first()
        .map_or(f64::NAN, |p| p.measured_per_s.last().unwrap_or(&f64::NAN) / p.measured_per_s[0]);
    let _ = write!(
        text,
        "\n## SA1 rates\n\n`rate = gain (felt - threshold)`, not below 0; both numbers from the rates at \
         the smallest force alone. The threshold is not negative, for SA1 afferents are silent at rest; \
         *either sign* says what a line without that bound would do. *Growth*: what is felt under the \
         last sphere over that under the first, at the smallest force; the measured rate grows {people:.1} \
         times. States lie within {:.1} % of their force, and what is felt is taken to it along a line; \
         energy and work part by {:.2} % at most; {:.0} s of processor time.\n\n",
        100.0 * found.force_missed_max,
        100.0 * found.energy_vs_work_max,
        found.solve_s
    );
    explained(text, found);
    text.push_str(
        "| felt | gain, impulses/s | threshold | growth | R2 of the fit | **R2 of the others** | either \
         sign | R2 of the profiles | peaks, mm (people's) |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for f in &found.fits {
        let (gain, threshold) =
            f.law.map_or_else(Default::default, |l| (digits(l.gain), digits(l.threshold)));
        let _ = writeln!(
            text,
            "| {}, {} | {gain} | {threshold} | {:.1} | {:.3} | {:.3} | {:.3} | {:.3} | {} |",
            f.name(),
            f.stimulus.unit(),
            f.growth,
            f.r2_fitted,
            f.r2_others,
            f.r2_others_free,
            f.r2_profiles,
            peaks(f)
        );
    }
    let best = &found.fits[found.best];
    let _ = write!(
        text,
        "\n![Rates]({PICTURES}/rates.svg)\n\n![Profiles]({PICTURES}/profiles.svg)\n\nImpulses/s; \
         'best' is {}.\n\n| force, N | curvature, 1/m | distance, mm | measured | SED at the interface \
         | best |\n|---|---|---|---|---|---|\n",
        best.name()
    );
    for (sed, best) in found.of_sed.iter().zip(&found.of_best) {
        for k in 0..sed.measured_per_s.len() {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {:.1} | {:.1} | {:.1} |",
                sed.force_n,
                sed.curvature_per_m[k],
                sed.distance_mm[k],
                sed.measured_per_s[k],
                sed.here_per_s[k],
                best.here_per_s[k]
            );
        }
    }
}

/// What SED at the interface explains, and what explains more.
fn explained(text: &mut String, found: &Afferents) {
    let sed = &found.fits[0];
    let _ = writeln!(
        text,
        "- **SED at the interface** explains R2 = {:.2} of the rates that were not fitted ({:.2} with a \
         threshold of either sign) and {:.2} of the profiles. It grows {:.1} times from the first sphere \
         to the last.",
        sed.r2_others, sed.r2_others_free, sed.r2_profiles, sed.growth
    );
    let most = |pick: fn(&Fit) -> bool, of: fn(&Fit) -> f64| {
        found.fits.iter().filter(|f| pick(f)).max_by(|a, b| of(a).total_cmp(&of(b)))
    };
    for (what, pick) in [
        ("At a point", (|f: &Fit| f.pooled_mm == 0.0) as fn(&Fit) -> bool),
        ("As a mean over a disc", |f| f.pooled_mm > 0.0),
    ] {
        let (rates, profiles) = (most(pick, |f| f.r2_others), most(pick, |f| f.r2_profiles));
        if let (Some(r), Some(p)) = (rates, profiles) {
            let _ = writeln!(
                text,
                "- **{what}** the rates follow {} most (R2 = {:.2}; profiles {:.2}), the profiles {} \
                 (R2 = {:.2}; rates {:.2}).",
                r.name(),
                r.r2_others,
                r.r2_profiles,
                p.name(),
                p.r2_profiles,
                p.r2_others
            );
        }
    }
    text.push('\n');
}

/// How far what is felt moves on a finer mesh.
pub(super) fn mesh_errors(text: &mut String, errors: &[MeshError]) {
    text.push_str(
        "\n## The mesh's own error\n\nWhat is felt under the middle, against the next finer mesh: the \
         largest of all forces.\n\n| felt | curvature, 1/m | off |\n|---|---|---|\n",
    );
    for e in errors {
        let _ = writeln!(
            text,
            "| {} at {} | {} | {:.1} % |",
            e.stimulus.name(),
            depth_name(e.depth),
            e.curvature_per_m,
            100.0 * e.relative
        );
    }
}

/// The fits for people.
pub(super) fn human(text: &mut String, found: &Afferents) {
    let head = ["R2 fit", "others", "profiles"];
    let _ =
        writeln!(text, "\n{:70} {:>8} {:>8} {:>8}", "SA1 rates from", head[0], head[1], head[2]);
    for f in &found.fits {
        let (name, profiles) = (f.name(), f.r2_profiles);
        let _ = writeln!(text, "{name:70} {:8.3} {:8.3} {profiles:8.3}", f.r2_fitted, f.r2_others);
    }
}

fn peaks(fit: &Fit) -> String {
    let peak = |p: &Peak| format!("{:.1} ({})", p.here_mm, p.people_mm);
    fit.peaks.iter().map(peak).collect::<Vec<_>>().join(", ")
}

/// Three digits.
fn digits(v: f64) -> String {
    if v != 0.0 && !(1e-2..1e4).contains(&v.abs()) { format!("{v:.2e}") } else { format!("{v:.3}") }
}
