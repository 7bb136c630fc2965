//! `dataset`: look at, check and draw a dataset.

use super::campaign_file::CampaignFile;
use super::{CHECKS_FAILED, print};
use papilla_dataset as dataset;
use papilla_dataset::ImageOptions;
use papilla_output::map_image::Bits;
use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// How often `status --watch` looks.
const WATCH_EVERY: Duration = Duration::from_secs(5);
/// Empties a terminal and goes to its first place.
const CLEAR: &str = "\x1b[2J\x1b[H";

/// Look at, check and draw a dataset.
#[derive(clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Ranges, checks and forces by depth; a contact sheet of samples.
    Stats {
        /// The dataset's folder.
        folder: PathBuf,
        /// Write a contact sheet PNG here.
        #[arg(long)]
        sheet: Option<PathBuf>,
        /// Print the report as JSON.
        #[arg(long)]
        json: bool,
    },
    /// 224 x 224 gray PNG pairs, white at the dataset's greatest pixel or value.
    Images {
        /// The dataset's folder.
        folder: PathBuf,
        /// Folder for the images.
        #[arg(long)]
        out: PathBuf,
        /// 8 bits a pixel, as the published U-Net took, instead of 16.
        #[arg(long)]
        eight_bit: bool,
        /// Print the index as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Maps of all states as NumPy arrays.
    Maps {
        /// The dataset's folder.
        folder: PathBuf,
        /// Folder to make for the arrays.
        #[arg(long)]
        out: PathBuf,
        /// Print the report as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Held-out samples with their FE truth, for the service's page.
    Replay {
        /// The dataset's folder.
        folder: PathBuf,
        /// Folder for replay.json.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Number of samples.
        #[arg(long, default_value_t = 6)]
        count: usize,
        /// Print the names as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Make the dataset of a campaign whose slices are solved.
    #[command(
        after_help = "Exit codes: 0 whole; 1 something is missing, and is named; 3 made, but \
                            indentations or samples failed."
    )]
    Merge {
        #[command(flatten)]
        campaign: CampaignFile,
        /// Folder that they share.
        #[arg(long)]
        out: PathBuf,
        /// Print the report as JSON.
        #[arg(long)]
        json: bool,
    },
    /// What of a campaign is solved, running and failed, and the hours left.
    Status {
        #[command(flatten)]
        campaign: CampaignFile,
        /// Folder that they share.
        #[arg(long)]
        out: PathBuf,
        /// Draw it again every few seconds until nothing is left.
        #[arg(long, conflicts_with = "json")]
        watch: bool,
        /// Print it as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Check every hash, shape and value of a dataset.
    Verify {
        /// The dataset's folder.
        folder: PathBuf,
        /// Print the report as JSON.
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    match &args.command {
        Command::Stats { folder, sheet, json } => {
            let report = dataset::stats(folder, sheet.as_deref())?;
            print(&report, *json, || report.to_string())?;
        }
        Command::Images { folder, out, eight_bit, json } => {
            let bits = if *eight_bit { Bits::Eight } else { Bits::Sixteen };
            let report = dataset::images(folder, out, &ImageOptions { bits })?;
            print(&report, *json, || {
                format!("{} pairs written to {}", report.samples.len(), report.folder.display())
            })?;
        }
        Command::Maps { folder, out, json } => {
            let report = dataset::arrays(folder, out)?;
            print(&report, *json, || {
                format!("maps of {} states written to {}", report.states, report.folder.display())
            })?;
        }
        Command::Replay { folder, out, count, json } => {
            let names = dataset::replay(folder, *count, &out.join("replay.json"))?;
            print(&names, *json, || names.join("\n"))?;
        }
        Command::Merge { campaign, out, json } => {
            let report = papilla_campaign::merge(&campaign.read()?, out)?;
            print(&report, *json, || report.to_string())?;
            if !report.is_complete() {
                return Ok(ExitCode::from(CHECKS_FAILED));
            }
        }
        Command::Status { campaign, out, watch, json } => {
            let mut reader = papilla_campaign::StatusReader::new(&campaign.read()?, out)?;
            loop {
                let status = reader.read()?;
                let clear = if *watch && std::io::stdout().is_terminal() { CLEAR } else { "" };
                print(&status, *json, || format!("{clear}{status}"))?;
                if !watch || status.is_over() {
                    break;
                }
                std::thread::sleep(WATCH_EVERY);
            }
        }
        Command::Verify { folder, json } => {
            let report = dataset::verify(folder)?;
            print(&report, *json, || {
                format!(
                    "{} shards, {} samples: all hashes and values are good (sha256 {})",
                    report.shards, report.samples, report.dataset_sha256
                )
            })?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
