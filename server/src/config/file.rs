//! The settings file. Command line and environment take precedence over it.
//!
//! Every field of the file becomes the flag of the same name and is parsed by the same rules, so
//! that there is one definition of what a setting may be.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use clap::{
    Arg, ArgAction, ArgMatches, Command, CommandFactory, FromArgMatches, parser::ValueSource,
};
use papilla_proto::json;
use toml::Value;

use super::{Cli, ConfigError};

/// Arguments that are no settings.
const NOT_SETTINGS: [&str; 4] = ["config", "print_config", "help", "version"];

/// The command, its settings to be given before or after a subcommand.
fn command() -> Command {
    Cli::command().mut_args(|arg| arg.global(true))
}

/// The arguments that are settings.
pub(super) fn settings() -> Vec<Arg> {
    let command = command();
    command
        .get_arguments()
        .filter(|arg| !NOT_SETTINGS.contains(&arg.get_id().as_str()))
        .cloned()
        .collect()
}

/// Where a setting's value came from.
pub(super) fn source(matches: &ArgMatches, id: &str) -> ValueSource {
    matches.value_source(id).unwrap_or(ValueSource::DefaultValue)
}

/// Settings, and where each came from.
pub(super) struct Layers {
    pub(super) cli: Cli,
    pub(super) origins: Vec<(String, Origin)>,
}

/// Which layer a value is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    Default,
    File,
    Environment,
    CommandLine,
}

/// Reads command line, environment and file.
pub(super) fn read(args: Vec<OsString>) -> Result<Layers, ConfigError> {
    let mut matches = command().try_get_matches_from(&args)?;
    let mut from_file = Vec::new();
    if let Some(file) = matches.get_one::<PathBuf>("config").cloned() {
        let mut line = Vec::new();
        for (id, flags) in file_flags(&file)? {
            let source = source(&matches, &id);
            if !matches!(source, ValueSource::CommandLine | ValueSource::EnvVariable) {
                line.extend(flags);
                from_file.push(id);
            }
        }
        let mut args = args.into_iter();
        let line = args.next().into_iter().chain(line.into_iter().map(OsString::from)).chain(args);
        matches = command().try_get_matches_from(line)?;
    }
    let cli = Cli::from_arg_matches(&matches)?;
    let settings = settings();
    let origins = settings.iter().map(|arg| {
        let id = arg.get_id().to_string();
        let origin = match source(&matches, &id) {
            _ if from_file.contains(&id) => Origin::File,
            ValueSource::CommandLine => Origin::CommandLine,
            ValueSource::EnvVariable => Origin::Environment,
            _ => Origin::Default,
        };
        (id, origin)
    });
    Ok(Layers { cli, origins: origins.collect() })
}

/// The file's fields as flags, each checked by itself so that an error names it.
fn file_flags(file: &Path) -> Result<Vec<(String, Vec<String>)>, ConfigError> {
    let text = json::read_text(file)
        .map_err(|source| ConfigError::Read { file: file.to_owned(), source })?;
    let table: toml::Table =
        text.parse().map_err(|source| ConfigError::Syntax { file: file.to_owned(), source })?;
    let settings = settings();
    let mut all = Vec::with_capacity(table.len());
    for (field, value) in table {
        let Some(arg) = settings.iter().find(|arg| arg.get_id() == field.as_str()) else {
            let known: Vec<_> = settings.iter().map(|arg| arg.get_id().as_str()).collect();
            let known = known.join(", ");
            return Err(ConfigError::Unknown { file: file.to_owned(), field, known });
        };
        let bad =
            |reason| ConfigError::Value { file: file.to_owned(), field: field.clone(), reason };
        let flags = flags(arg, &value).map_err(bad)?;
        let line = std::iter::once("papilla-server").chain(flags.iter().map(String::as_str));
        command().try_get_matches_from(line).map_err(|error| bad(first_line(&error)))?;
        all.push((field, flags));
    }
    Ok(all)
}

/// One field as flags: none for a false switch, one for each member of a list.
fn flags(arg: &Arg, value: &Value) -> Result<Vec<String>, String> {
    let long = arg.get_long().unwrap_or_default();
    let one = |value: &Value| match value {
        Value::String(text) => Ok(format!("--{long}={text}")),
        Value::Integer(number) => Ok(format!("--{long}={number}")),
        Value::Float(number) => Ok(format!("--{long}={number}")),
        other => Err(format!("{} is not taken here, a text or a number is", other.type_str())),
    };
    match (arg.get_action(), value) {
        (ArgAction::SetTrue, Value::Boolean(true)) => Ok(vec![format!("--{long}")]),
        (ArgAction::SetTrue, Value::Boolean(false)) => Ok(Vec::new()),
        (ArgAction::SetTrue, other) => {
            Err(format!("{} is not taken here, true or false is", other.type_str()))
        }
        (ArgAction::Append, Value::Array(values)) => values.iter().map(one).collect(),
        (_, value) => Ok(vec![one(value)?]),
    }
}

/// What clap says, without its hints on the command line.
fn first_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let line = text.lines().next().unwrap_or_default();
    line.trim_start_matches("error: ").to_owned()
}
