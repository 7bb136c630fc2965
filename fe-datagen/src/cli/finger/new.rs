//! `finger new`: writes a file with the numbers of the default finger.

use papilla_fingertip::scene::Finger;
use papilla_fingertip::scene::finger::{FINGER_FILE, Source};
use papilla_output::atomic;
use std::path::PathBuf;
use std::process::ExitCode;

/// Write a `finger.toml` with the default finger's numbers, each with its unit, default and range.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen finger new --out fingers/mine")]
pub(super) struct Args {
    /// Folder for finger.toml. One that is there already stays as it is.
    #[arg(long)]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let who = "the default finger: change the numbers, and say here whose it is".into();
    let finger = Finger { source: Source { who, ..Source::default() }, ..Finger::usual() };
    let path = args.out.join(FINGER_FILE);
    atomic::create_folder(&args.out)?;
    anyhow::ensure!(
        atomic::write_first(&path, finger.to_toml().as_bytes())?,
        "{} is there already: change it, or choose another --out",
        path.display()
    );
    println!("wrote {}", path.display());
    Ok(ExitCode::SUCCESS)
}
