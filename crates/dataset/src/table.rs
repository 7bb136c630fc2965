//! The report of `dataset stats` as a table for people.

use super::stats::{Range, StatsReport};
use super::{BALANCE_RELATIVE_MAX, PENETRATION_MM_MAX, RESIDUAL_RELATIVE_MAX};
use std::fmt;

impl fmt::Display for StatsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = |hash: &str| hash.chars().take(12).collect::<String>();
        writeln!(f, "dataset   {} ({})", self.folder.display(), self.software)?;
        writeln!(
            f,
            "          {} indentations, {} samples ({} train, {} test), {} vertices, {:.1} MB of shards",
            self.presses,
            self.samples,
            self.samples_train,
            self.samples_test,
            self.vertex_count,
            self.shard_bytes as f64 / 1e6
        )?;
        writeln!(
            f,
            "hashes    dataset {}, atlas {}",
            short(&self.dataset_sha256),
            short(&self.atlas_hash)
        )?;
        let indenters: Vec<_> = self.indenters.iter().map(|(n, c)| format!("{n} {c}")).collect();
        writeln!(f, "indenters {}", indenters.join(", "))?;
        let pose = [("pitch", self.pitch_deg), ("roll", self.roll_deg), ("yaw", self.yaw_deg)];
        write!(f, "poses    ")?;
        for (name, range) in pose {
            write!(f, " {name} {:.1} to {:.1} deg", range.min, range.max)?;
        }
        writeln!(
            f,
            "\nmaxima    pressure {:.0} Pa, SED (dermis) {:.1} J/m3",
            self.pressure_max_pa, self.sed_max_j_per_m3
        )?;
        self.write_depths(f)?;
        self.write_checks(f)?;
        for press in &self.failed {
            writeln!(f, "FAILED    indentation {}: {}", press.id, press.error)?;
        }
        for sample in &self.dropped {
            let depth = sample.depth_mm.unwrap_or(f64::NAN);
            writeln!(f, "DROPPED   indentation {} at {depth} mm: {}", sample.press, sample.reason)?;
        }
        match &self.contact_sheet {
            Some(path) => writeln!(f, "\nwrote     {}", path.display()),
            None => Ok(()),
        }
    }
}

impl StatsReport {
    fn write_depths(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nper depth: smallest / median / largest over the indentations")?;
        writeln!(
            f,
            "{:>9} {:>7} {:>22} {:>27} {:>27} {:>24}",
            "depth mm",
            "samples",
            "force N",
            "peak pressure Pa",
            "peak SED dermis J/m3",
            "contact mm2"
        )?;
        for d in &self.depths {
            let three = |r: Range, digits: usize| {
                format!("{:.digits$} / {:.digits$} / {:.digits$}", r.min, r.median, r.max)
            };
            writeln!(
                f,
                "{:>9.3} {:>7} {:>22} {:>27} {:>27} {:>24}",
                d.depth_mm,
                d.samples,
                three(d.force_n, 3),
                three(d.pressure_peak_pa, 0),
                three(d.sed_dermis_peak_j_per_m3, 1),
                three(d.contact_area_mm2, 1)
            )?;
        }
        Ok(())
    }

    fn write_checks(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let c = &self.worst_checks;
        writeln!(f, "\nworst of the checks{:>44} {:>10}", "value", "limit")?;
        let rows = [
            ("residual / reference", c.residual_relative, RESIDUAL_RELATIVE_MAX),
            (
                "contact beyond the recorded skin",
                c.contact_force_vs_pressure_integral,
                BALANCE_RELATIVE_MAX,
            ),
            ("plate against support", c.plate_vs_support_reaction, BALANCE_RELATIVE_MAX),
            ("energy against work", c.energy_vs_work, BALANCE_RELATIVE_MAX),
            ("penetration, mm", c.penetration_mm_max, PENETRATION_MM_MAX),
        ];
        for (name, value, limit) in rows {
            writeln!(f, "  {name:<45} {value:>15.2e} {limit:>10.0e}")?;
        }
        writeln!(f, "  {:<45} {:>15.4} {:>10}", "smallest volume ratio J", c.j_min, "> 0")?;
        writeln!(
            f,
            "  most Newton iterations {}, step cuts {}, augmentations {}, factorizations {}, CG iterations {}",
            c.newton_iterations, c.step_cuts, c.augmentations, c.factorizations, c.cg_iterations
        )
    }
}
