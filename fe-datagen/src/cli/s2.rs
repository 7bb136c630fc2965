//! tmp
use crate::mesh::fingertip::Density;
use crate::s2::{self, reading::Reading};
use std::path::PathBuf;
use std::process::ExitCode;
/// Tmp.
#[derive(clap::Args)]
pub(super) struct Args {
    #[arg(long)]
    out: PathBuf,
    #[arg(long, default_value = "coarse")]
    density: String,
    #[arg(long, value_enum, default_value_t = Reading::Taken)]
    reading: Reading,
}
pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let density = match args.density.as_str() { "coarse" => Density::Coarse, "medium" => Density::Medium, _ => Density::Fine };
    let o = s2::run(args.reading, density)?;
    std::fs::create_dir_all(&args.out)?;
    println!("{} unknowns {} elements setup {:.2} solve {:.2} {:?}", o.unknowns, o.elements, o.setup_s, o.solve_s, o.effort);
    for s in &o.states {
        println!("t {} force {} checks {:?}", s.time_s, s.force_n_per_mm, s.record.checks);
        let mut t = String::new();
        for p in &s.depth_line { t += &format!("{:.5},{},{:.5}\n", p.depth_mm, p.tissue.name(), p.sed_j_per_m3); }
        std::fs::write(args.out.join(format!("depth-{}.csv", s.time_s)), t)?;
        let mut t = String::new();
        for l in &s.lateral { for p in &l.points { t += &format!("{},{},{:.5},{:.5}\n", l.depth_mm, l.tissue.name(), p[0], p[1]); } }
        std::fs::write(args.out.join(format!("lateral-{}.csv", s.time_s)), t)?;
    }
    Ok(ExitCode::SUCCESS)
}
