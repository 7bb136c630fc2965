//! `finger`: commands for fingers of one's own.

mod build;
mod explain;
mod from_surface;
mod new;
mod teach;

use std::process::ExitCode;

/// Make a finger of your own, see what it is, and what the service needs of it.
///
/// A finger is a folder with `finger.toml`: some numbers, each with its unit, default and range.
/// Scenes and campaigns name the folder. See docs/guides/fingers.md.
#[derive(clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    New(new::Args),
    Explain(explain::Args),
    FromSurface(from_surface::Args),
    Build(build::Args),
    Teach(teach::Args),
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    match &args.command {
        Command::New(args) => new::run(args),
        Command::Explain(args) => explain::run(args),
        Command::FromSurface(args) => from_surface::run(args),
        Command::Build(args) => build::run(args),
        Command::Teach(args) => teach::run(args),
    }
}
