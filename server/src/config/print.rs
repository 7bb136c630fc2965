//! Puts the settings of flags, environment and file together, and prints the result.

use std::{ffi::OsString, fmt::Write};

use toml::Value;

use super::{
    Cli, Config, ConfigError,
    file::{self, Layers, Origin},
};

impl Cli {
    /// Reads the settings from `args` (the program's name first), the environment and the
    /// file that either names.
    ///
    /// # Errors
    /// The command line, a variable or a field of the file is unknown or has a value that is
    /// not allowed; the error names it. Asking for help or the version is an error of kind
    /// [`ConfigError::Usage`].
    pub fn read(args: impl IntoIterator<Item = OsString>) -> Result<Self, ConfigError> {
        Ok(Self::layers(args)?.cli)
    }

    /// As [`read`](Self::read), and the settings as a file that reads back, each with where
    /// it is from.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_and_print(
        args: impl IntoIterator<Item = OsString>,
    ) -> Result<(Self, String), ConfigError> {
        let Layers { cli, origins } = Self::layers(args)?;
        let text = print(&cli.settings, &origins);
        Ok((cli, text))
    }

    fn layers(args: impl IntoIterator<Item = OsString>) -> Result<Layers, ConfigError> {
        file::read(args.into_iter().collect())
    }
}

fn print(settings: &Config, origins: &[(String, Origin)]) -> String {
    let Ok(Value::Table(table)) = Value::try_from(settings) else { return String::new() };
    let mut text = String::from("# Settings of papilla-server; see docs/reference/settings.md.\n");
    for (field, origin) in origins {
        let from = match origin {
            Origin::Default => "default",
            Origin::File => "file",
            Origin::Environment => "environment",
            Origin::CommandLine => "command line",
        };
        // Err: writing to a String does not fail.
        let _ = match table.get(field) {
            Some(value) => writeln!(text, "{field} = {value} # {from}"),
            None => writeln!(text, "# {field} is not set"),
        };
    }
    text
}
