//! Writes the man pages and shell completions of `papilla-server`, from its flags, into a folder:
//! `cargo run -p papilla-server --example manual -- FOLDER`.

use std::{env, error::Error, fs, path::PathBuf};

use clap::CommandFactory;
use clap_complete::Shell;
use papilla_server::Cli;

const USAGE: &str = "manual FOLDER: writes man pages and shell completions there";

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(env::args_os().nth(1).ok_or(USAGE)?);
    fs::create_dir_all(&folder)?;
    let mut command = Cli::command();
    clap_mangen::generate_to(command.clone(), &folder)?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        clap_complete::generate_to(shell, &mut command, "papilla-server", &folder)?;
    }
    Ok(())
}
