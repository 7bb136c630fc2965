//! When sessions are asked to move to another connection, and the keys that seal what they take
//! along.

use std::{path::Path, time::Duration};

use papilla_proto::json;
use papilla_session_state::Keys;

use crate::{SettingError, config::Config};

/// Share of the drain's time for which sessions that move are still answered.
const GRACE: f64 = 2.0 / 3.0;

/// The shortest time until a session is asked to move, and what may be added, over the setting.
const SHORTEST: f64 = 2.0 / 3.0;
const SPREAD: f64 = 2.0 / 3.0;

/// What the settings say of moving.
pub(crate) struct Moves {
    pub(crate) keys: Keys,
    /// Mean time until a session is asked to move; zero: never.
    after: Duration,
    /// How long a draining server still answers sessions that move.
    pub(crate) grace: Duration,
}

impl Moves {
    /// Reads the keys, or makes one for this process alone.
    ///
    /// # Errors
    /// The file cannot be read, or holds what is no key.
    pub(crate) fn new(config: &Config) -> Result<Self, SettingError> {
        let refuse = |reason| SettingError { field: "state_keys", reason };
        let keys = match &config.state_keys {
            Some(file) => read(file),
            None => Keys::fresh().map_err(|error| error.to_string()),
        };
        Ok(Self {
            keys: keys.map_err(refuse)?,
            after: Duration::from_secs(config.reconnect_after_s),
            grace: config.drain_timeout().mul_f64(GRACE),
        })
    }

    /// How long the next session stays before it is asked to move; none: for good.
    ///
    /// At random, so that sessions that came together do not leave together.
    pub(crate) fn stay(&self) -> Option<Duration> {
        let share = SHORTEST + SPREAD * fastrand::f64();
        Some(self.after.mul_f64(share)).filter(|stay| !stay.is_zero())
    }
}

fn read(file: &Path) -> Result<Keys, String> {
    let named = |error: &dyn std::fmt::Display| format!("{}: {error}", file.display());
    let text = json::read_text(file).map_err(|error| named(&error))?;
    Keys::read(&text).map_err(|error| named(&error))
}
