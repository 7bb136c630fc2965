//! The report's part on SA1 rates, and the tables of it beside the page.

use super::PICTURES;
use crate::people::afferents::{Afferents, Fit, Peak};
use crate::people::mesh_error::MeshError;
use crate::people::receptors::{Stimulus, depth_name};
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
        "\n## SA1 rates\n\nThe rate of a fibre is predicted as `gain (felt - threshold)`, or as 0 where this is negative. \
         Gain and threshold are fitted only to the rates at the smallest force. The prediction is tested \
         on the rates at the other forces, and on the *profiles*: the rates at several distances from the \
         sphere's middle. The threshold is not allowed to be negative, since SA1 fibres do not fire at \
         rest. One column shows what happens if this is allowed (*threshold of either sign*). R2 is the coefficient of determination: 1 is \
         a perfect prediction, and a negative R2 says that the mean rate would be a better one. *Growth* \
         is the stimulus under the most curved sphere, divided by that under the least curved one, at the \
         smallest force; the measured rate grows {people:.1} times. *Peaks* are the distances from the \
         sphere's middle at which the two profiles are greatest, with those of the measured profiles in \
         brackets. The force of each state is within {:.1} % of the force of the \
         experiment, and the stimulus is interpolated to it. Energy and work differ by {:.2} % at most. All spheres took {:.0} s of processor time.\n\n",
        100.0 * found.force_missed_max,
        100.0 * found.energy_vs_work_max,
        found.solve_s
    );
    explained(text, found);
    text.push_str(
        "The table holds SED at the interface. It holds every other stimulus only at one depth: that at \
         which its R2 of the rates that were not fitted is greatest. So the depth was chosen by the rates on which it is \
         judged, which makes these stimuli look better than they are. All depths are in [human-felt.csv](human-felt.csv), and measured and predicted rates in \
         [human-rates.csv](human-rates.csv).\n\n",
    );
    text.push_str(
        "| stimulus and its unit | gain, impulses/s for each unit | threshold, in this unit | growth | R2 of the fitted rates | **R2 of the rates not fitted** | the same, threshold of either sign | R2 of the profiles | peaks, mm (measured) |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for fit in shown(&found.fits) {
        let _ = writeln!(text, "| {} |", cells(fit).join(" | "));
    }
    let best = &found.fits[found.best];
    let _ = write!(
        text,
        "\n![Rates]({PICTURES}/rates.svg)\n\n![Profiles]({PICTURES}/profiles.svg)\n\nIn the plots 'best' is {}.\n",
        best.name()
    );
}

/// SED at the interface, and the best depth of every stimulus, at a point and over a disc.
fn shown(fits: &[Fit]) -> Vec<&Fit> {
    let mut kept: Vec<&Fit> = fits.iter().take(1).collect();
    for pooled in [false, true] {
        for stimulus in Stimulus::ALL {
            let of =
                fits.iter().filter(|f| f.stimulus == stimulus && (f.pooled_mm > 0.0) == pooled);
            kept.extend(of.max_by(|a, b| a.r2_others.total_cmp(&b.r2_others)));
        }
    }
    kept
}

/// What a table says of a fit.
fn cells(f: &Fit) -> [String; 9] {
    let (gain, threshold) =
        f.law.map_or_else(Default::default, |l| (digits(l.gain), digits(l.threshold)));
    [
        format!("{}, {}", f.name(), f.stimulus.unit()),
        gain,
        threshold,
        format!("{:.1}", f.growth),
        format!("{:.3}", f.r2_fitted),
        format!("{:.3}", f.r2_others),
        format!("{:.3}", f.r2_others_free),
        format!("{:.3}", f.r2_profiles),
        peaks(f),
    ]
}

/// A line of comma-separated values whose texts hold no quotes.
fn csv_line(text: &mut String, cells: &[String]) {
    let quoted =
        |cell: &String| if cell.contains(',') { format!("\"{cell}\"") } else { cell.clone() };
    let _ = writeln!(text, "{}", cells.iter().map(quoted).collect::<Vec<_>>().join(","));
}

/// Every stimulus at every depth.
pub(super) fn fits_csv(found: &Afferents) -> String {
    let mut text = String::from(
        "felt,\"gain, impulses/s\",threshold,growth,R2 of the fit,R2 of the others,R2 of the others with a threshold of \
         either sign,R2 of the profiles,\"peaks, mm (people's)\"\n",
    );
    found.fits.iter().for_each(|fit| csv_line(&mut text, &cells(fit)));
    text
}

/// Measured rates, and those of SED at the interface and of the best fit.
pub(super) fn rates_csv(found: &Afferents) -> String {
    let mut text = String::from(
        "\"force, N\",\"curvature, 1/m\",\"distance, mm\",\"measured, impulses/s\",\"SED at the interface, \
         impulses/s\",\"best, impulses/s\"\n",
    );
    for (sed, best) in found.of_sed.iter().zip(&found.of_best) {
        for k in 0..sed.measured_per_s.len() {
            let _ = writeln!(
                text,
                "{},{},{},{:.1},{:.1},{:.1}",
                sed.force_n,
                sed.curvature_per_m[k],
                sed.distance_mm[k],
                sed.measured_per_s[k],
                sed.here_per_s[k],
                best.here_per_s[k]
            );
        }
    }
    text
}

/// What SED at the interface explains, and what explains more.
fn explained(text: &mut String, found: &Afferents) {
    let sed = &found.fits[0];
    let _ = writeln!(
        text,
        "- **SED at the interface.** R2 of the rates that were not fitted is {:.2} ({:.2} with a threshold of either \
         sign), and R2 of the profiles is {:.2}. SED grows {:.1} times from the least curved sphere to the most \
         curved one.",
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
                "- **{what}.** The rates are explained best by {} (R2 of the rates {:.2}, of the profiles {:.2}). The \
                 profiles are explained best by {} (R2 of the profiles {:.2}, of the rates {:.2}).",
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

/// How far what is felt moves on a finer mesh: the worst of all depths.
pub(super) fn mesh_errors(text: &mut String, errors: &[MeshError]) {
    text.push_str(
        "\n## The mesh's own error\n\nEach stimulus under the sphere's middle is compared with that on the next finer graded mesh. For each \
         stimulus the table has the force, depth and sphere with the greatest difference. All of them are in \
         [human-mesh.csv](human-mesh.csv).\n\n| stimulus | curvature of the sphere, 1/m | difference |\n|---|---|---|\n",
    );
    for stimulus in Stimulus::ALL {
        let of = errors.iter().filter(|e| e.stimulus == stimulus);
        if let Some(e) = of.max_by(|a, b| a.relative.total_cmp(&b.relative)) {
            let _ = writeln!(text, "| {} |", mesh_cells(e).join(" | "));
        }
    }
}

fn mesh_cells(e: &MeshError) -> [String; 3] {
    [
        format!("{} at {}", e.stimulus.name(), depth_name(e.depth)),
        e.curvature_per_m.to_string(),
        format!("{:.1} %", 100.0 * e.relative),
    ]
}

/// Every stimulus at every depth.
pub(super) fn mesh_csv(errors: &[MeshError]) -> String {
    let mut text = String::from("felt,\"curvature of the sphere, 1/m\",difference\n");
    errors.iter().for_each(|e| csv_line(&mut text, &mesh_cells(e)));
    text
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
