//! Which equilibria are good enough for a dataset.

use crate::record::{Checks, Sample};

/// Largest relative difference that force and energy may show (plate against support reaction,
/// energy against work), and the largest share of the contact beyond the recorded skin.
pub const BALANCE_RELATIVE_MAX: f64 = 5e-3;
/// Largest relative out-of-balance force of a converged equilibrium.
pub const RESIDUAL_RELATIVE_MAX: f64 = 1e-5;
/// Deepest penetration of the skin into the plate, mm: 0.5 % of the deepest
/// indentation, a twentieth of the epidermis.
pub const PENETRATION_MM_MAX: f64 = 0.01;

/// Why a record must not enter a dataset of `vertex_count` vertices; `None`
/// when it is fit. Every limit is written so that a NaN fails it.
pub fn fault(record: &Sample, vertex_count: usize) -> Option<String> {
    let c = &record.checks;
    let at_most = [
        ("residual_relative", c.residual_relative, RESIDUAL_RELATIVE_MAX),
        (
            "contact_force_vs_pressure_integral",
            c.contact_force_vs_pressure_integral,
            BALANCE_RELATIVE_MAX,
        ),
        ("plate_vs_support_reaction", c.plate_vs_support_reaction, BALANCE_RELATIVE_MAX),
        ("energy_vs_work", c.energy_vs_work, BALANCE_RELATIVE_MAX),
        ("penetration_mm_max", c.penetration_mm_max, PENETRATION_MM_MAX),
    ];
    for (name, value, limit) in at_most {
        if !(value.is_finite() && value.abs() <= limit) {
            return Some(format!("{name} is {value:.3e}, at most {limit:.0e} is accepted"));
        }
    }
    if !(c.j_min.is_finite() && c.j_min > 0.0) {
        return Some(format!("j_min is {:.3e}, it has to be above 0", c.j_min));
    }
    if !(record.depth_mm.is_finite() && record.depth_mm >= 0.0) {
        return Some(format!("depth_mm is {}", record.depth_mm));
    }
    if let Some(force) = record.force_n.iter().find(|f| !f.is_finite()) {
        return Some(format!("a component of force_n is {force}"));
    }
    let values_due = record.cells.as_ref().map_or(vertex_count, |c| c.node_count());
    let fields = [
        ("pressure_mpa", &record.pressure_mpa),
        ("sed_dermis_mpa", &record.sed_dermis_mpa),
        ("sed_epidermis_mpa", &record.sed_epidermis_mpa),
    ];
    for (name, values) in fields {
        if values.len() != values_due {
            return Some(format!("{name} has {} values, not {values_due}", values.len()));
        }
        let bad = values.iter().position(|v| !(v.is_finite() && *v >= 0.0));
        if let Some(vertex) = bad {
            return Some(format!(
                "{name} is {} at vertex {vertex}, it has to be finite and not negative",
                values[vertex]
            ));
        }
    }
    let shear = record.shear_mpa.as_flattened();
    if !shear.is_empty() && shear.len() != 3 * values_due {
        let found = record.shear_mpa.len();
        return Some(format!("shear_mpa has {found} values, not {values_due}"));
    }
    if let Some(vertex) = shear.iter().position(|v| !v.is_finite()) {
        return Some(format!("shear_mpa is {} at vertex {}", shear[vertex], vertex / 3));
    }
    None
}

/// The worst value of each check: the smallest `j_min`, the largest of every
/// other (counts too). `None` without any checks.
pub fn worst_checks<'a>(all: impl IntoIterator<Item = &'a Checks>) -> Option<Checks> {
    // f64::max would drop a NaN, the one value that must not go unseen.
    let worse = |a: f64, b: f64| if a.is_nan() || a.abs() >= b.abs() { a } else { b };
    all.into_iter().copied().reduce(|a, b| Checks {
        residual_relative: worse(a.residual_relative, b.residual_relative),
        contact_force_vs_pressure_integral: worse(
            a.contact_force_vs_pressure_integral,
            b.contact_force_vs_pressure_integral,
        ),
        plate_vs_support_reaction: worse(a.plate_vs_support_reaction, b.plate_vs_support_reaction),
        energy_vs_work: worse(a.energy_vs_work, b.energy_vs_work),
        j_min: if a.j_min.is_nan() || a.j_min <= b.j_min { a.j_min } else { b.j_min },
        penetration_mm_max: worse(a.penetration_mm_max, b.penetration_mm_max),
        newton_iterations: a.newton_iterations.max(b.newton_iterations),
        step_cuts: a.step_cuts.max(b.step_cuts),
        augmentations: a.augmentations.max(b.augmentations),
        factorizations: a.factorizations.max(b.factorizations),
        cg_iterations: a.cg_iterations.max(b.cg_iterations),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::record;

    #[test]
    fn each_limit_bites() {
        assert_eq!(fault(&record(1.0, 4), 4), None);
        type Spoil = fn(&mut Sample);
        let cases: [(Spoil, &str); 11] = [
            (|r| r.checks.residual_relative = 1e-3, "residual_relative"),
            (|r| r.checks.contact_force_vs_pressure_integral = 6e-3, "pressure_integral"),
            (|r| r.checks.plate_vs_support_reaction = f64::NAN, "support_reaction"),
            (|r| r.checks.energy_vs_work = -6e-3, "energy_vs_work"),
            (|r| r.checks.j_min = 0.0, "j_min"),
            (|r| r.checks.penetration_mm_max = 0.1, "penetration"),
            (|r| r.pressure_mpa[2] = -1e-9, "vertex 2"),
            (|r| r.sed_dermis_mpa[0] = f64::INFINITY, "sed_dermis"),
            (|r| r.sed_epidermis_mpa.push(0.0), "has 5 values"),
            (|r| r.shear_mpa = vec![[0.0; 3]; 3], "shear_mpa has 3 values"),
            (|r| r.shear_mpa = vec![[0.0, f64::NAN, 0.0]; 4], "shear_mpa is NaN at vertex 0"),
        ];
        for (spoil, word) in cases {
            let mut bad = record(1.0, 4);
            spoil(&mut bad);
            let text = fault(&bad, 4).unwrap();
            assert!(text.contains(word), "{text} should name {word}");
        }
    }

    #[test]
    fn the_worst_is_kept_and_a_nan_is_not_lost() {
        let good =
            Checks { j_min: 0.9, energy_vs_work: 1e-3, newton_iterations: 4, ..Checks::default() };
        let odd = Checks { j_min: 0.5, energy_vs_work: f64::NAN, newton_iterations: 9, ..good };
        for pair in [[&good, &odd], [&odd, &good]] {
            let worst = worst_checks(pair).unwrap();
            assert!(worst.energy_vs_work.is_nan());
            assert_eq!((worst.j_min.to_bits(), worst.newton_iterations), (0.5f64.to_bits(), 9));
        }
    }
}
