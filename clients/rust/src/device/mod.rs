//! What haptic devices take of a session: intensities from 0 to 1, at the device's own rate, and 0
//! when answers stop. The guide is `docs/guides/devices.md`.

use std::time::{Duration, Instant};

use papilla_proto::spikes::{PlacedUnit, UnitClass};

use crate::{Answer, PapillaError};

#[cfg(test)]
mod tests;

/// Reads the intensities of an answer, from 0 to 1; None: the answer says nothing about them.
///
/// A reader of your own fails with [`PapillaError::NotCarried`] if the answer lacks what it reads.
pub type Read = Box<dyn FnMut(&Answer) -> Result<Option<Vec<f32>>, PapillaError> + Send>;

/// Why there is no such device, or why it does not take an answer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// A setting is impossible.
    #[error("{name} is {value}; it has to be a number above {least}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it has to be above.
        least: f64,
    },
    /// No unit is of the classes that the device follows.
    #[error(
        "none of the session's {units} units is of the classes {classes:?}: name the effect \
         'spikes' in the hello, and classes that its units have"
    )]
    NoUnits {
        /// How many units there are.
        units: usize,
        /// The classes.
        classes: Vec<UnitClass>,
    },
    /// The answer is of a finger that the device does not have.
    #[error("finger {finger} is none of the device, which has {fingers}, numbered from 0")]
    Finger {
        /// The answer's.
        finger: u8,
        /// How many the device has.
        fingers: usize,
    },
    /// The answer does not carry what the device follows.
    #[error(transparent)]
    Answer(#[from] PapillaError),
}

/// One intensity: the size of the force on the finger, 0 at `threshold_n` and 1 from `full_n` on.
/// Of pressure maps the effect `summary` has the force.
///
/// # Errors
/// `full_n` is not above `threshold_n`.
pub fn force(full_n: f64, threshold_n: f64) -> Result<Read, DeviceError> {
    let span_n = above("full_n", full_n, threshold_n)?;
    Ok(Box::new(move |answer| {
        let found_n = match (&answer.touch, &answer.summary) {
            (Some(touch), _) => {
                touch.force_n.map(|n| f64::from(n).powi(2)).iter().sum::<f64>().sqrt()
            }
            (None, Some(summary)) => f64::from(summary.force_n),
            (None, None) if answer.no_contact => 0.0,
            (None, None) => {
                let advice = "send objects or gaps, or name the effect 'summary' in the hello";
                return Err(PapillaError::NotCarried { member: "force", advice });
            }
        };
        Ok(Some(vec![((found_n - threshold_n) / span_n) as f32]))
    }))
}

/// An intensity for each actuator of the effect `actuators`; `full` is its `max`.
///
/// # Errors
/// `full` is not above 0.
pub fn actuators(full: f64) -> Result<Read, DeviceError> {
    above("full", full, 0.0)?;
    Ok(Box::new(move |answer| {
        if answer.actuators.is_empty() {
            let advice = "name the effect 'actuators' in the hello";
            return Err(PapillaError::NotCarried { member: "actuators", advice });
        }
        let share = |&value: &f32| (f64::from(value) / full) as f32;
        Ok(Some(answer.actuators.iter().map(share).collect()))
    }))
}

/// After a longer pause the service computes its last 50 ms.
const SPIKES_US_MAX: u64 = 50_000;

/// One intensity of the effect `spikes`: the mean firing rate of the units of some classes, 1 from
/// `full_hz` on. Most units lie outside of a contact: a few Hz are much. Rapidly adapting and
/// Pacinian units fire at changes, as a motor should. `units` are those of the session's ready. It
/// remembers the frame before: make one for each finger.
///
/// # Errors
/// `full_hz` is not above 0, or no unit is of these classes.
pub fn spike_rate(
    units: &[PlacedUnit],
    full_hz: f64,
    classes: &[UnitClass],
) -> Result<Read, DeviceError> {
    above("full_hz", full_hz, 0.0)?;
    let mine: Vec<bool> = units.iter().map(|unit| classes.contains(&unit.class)).collect();
    let count = mine.iter().filter(|&&is_mine| is_mine).count();
    if count == 0 {
        return Err(DeviceError::NoUnits { units: units.len(), classes: classes.to_vec() });
    }
    let mut last_us = None;
    Ok(Box::new(move |answer| {
        let advice = "name the effect 'spikes' in the hello";
        let fired =
            answer.fired.as_ref().ok_or(PapillaError::NotCarried { member: "spikes", advice })?;
        let now_us = answer.client_time_us;
        let passed_us = last_us.replace(now_us).map_or(0, |last: u64| now_us.saturating_sub(last));
        if passed_us == 0 {
            return Ok(None);
        }
        let seconds = 1e-6 * passed_us.min(SPIKES_US_MAX) as f64;
        let is_mine = |unit: u16| mine.get(usize::from(unit)).is_some_and(|&is_mine| is_mine);
        let fired = fired.spikes.iter().filter(|spike| is_mine(spike.unit)).count();
        Ok(Some(vec![(fired as f64 / (count as f64 * seconds * full_hz)) as f32]))
    }))
}

/// How a device is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Commands a second that the device takes.
    pub max_hz: f64,
    /// What an answer said is held for so long, s,
    pub hold_s: f64,
    /// and then fades to 0 within this time, s.
    pub fade_s: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_hz: 90.0, hold_s: 0.05, fade_s: 0.05 }
    }
}

/// What to send to a device now.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// Intensity of each actuator, 0 to 1, finger by finger.
    pub levels: Vec<Vec<f32>>,
    /// How long the device may hold it, s: until it would have faded if no other follows.
    pub duration_s: f64,
}

impl Command {
    /// The greatest intensity: for a device with one motor, such as a controller.
    #[must_use]
    pub fn amplitude(&self) -> f32 {
        self.levels.iter().flatten().copied().fold(0.0, f32::max)
    }
}

/// A device with one or more fingers. It falls silent when answers stop, whatever the reason.
pub struct Device {
    fingers: Vec<Finger>,
    options: Options,
    next: Option<Instant>,
    is_silent: bool,
}

struct Finger {
    read: Read,
    levels: Vec<f32>,
    /// When they were read; None: nothing is to be felt.
    at: Option<Instant>,
}

impl Device {
    /// A device with a reader for each of its fingers, such as [`force`].
    ///
    /// # Errors
    /// An option is not above 0.
    pub fn new(readers: Vec<Read>, options: Options) -> Result<Self, DeviceError> {
        above("max_hz", options.max_hz, 0.0)?;
        above("hold_s", options.hold_s, 0.0)?;
        above("fade_s", options.fade_s, 0.0)?;
        let finger = |read| Finger { read, levels: vec![0.0], at: None };
        let fingers = readers.into_iter().map(finger).collect();
        Ok(Self { fingers, options, next: None, is_silent: true })
    }

    /// Takes the next answer, of any finger. One without a value (late, lost, refused) counts as
    /// none.
    ///
    /// # Errors
    /// The answer is of another finger, or does not carry what the device follows.
    pub fn feed(&mut self, answer: &Answer, now: Instant) -> Result<(), DeviceError> {
        let fingers = self.fingers.len();
        let none = DeviceError::Finger { finger: answer.finger, fingers };
        let finger = self.fingers.get_mut(usize::from(answer.finger)).ok_or(none)?;
        if !answer.is_ok() {
            return Ok(());
        }
        if answer.not_tracked {
            finger.at = None;
            return Ok(());
        }
        // What is no number drives no motor: the finger fades as without an answer.
        if let Some(levels) = (finger.read)(answer)?
            && levels.iter().all(|level| level.is_finite())
        {
            finger.levels = levels.iter().map(|level| level.clamp(0.0, 1.0)).collect();
            finger.at = Some(now);
        }
        Ok(())
    }

    /// What is due; None before the device takes another command, or as long as it is silent
    /// anyway.
    pub fn poll(&mut self, now: Instant) -> Option<Command> {
        if self.next.is_some_and(|next| now < next) {
            return None;
        }
        let command = self.command(now, self.options.hold_s + self.options.fade_s);
        let is_silent = !(command.amplitude() > 0.0);
        if is_silent && self.is_silent {
            return None;
        }
        self.is_silent = is_silent;
        let pause = Duration::try_from_secs_f64(1.0 / self.options.max_hz).ok();
        self.next = pause.and_then(|pause| now.checked_add(pause));
        Some(command)
    }

    /// All at 0 from now on, whatever the rate: for the end of a program, or a lost device.
    pub fn stop(&mut self) -> Command {
        self.fingers.iter_mut().for_each(|finger| finger.at = None);
        self.is_silent = true;
        self.command(Instant::now(), 0.0)
    }

    fn command(&self, now: Instant, duration_s: f64) -> Command {
        let Options { hold_s, fade_s, .. } = self.options;
        let levels = self.fingers.iter().map(|Finger { levels, at, .. }| {
            let age_s = at.map(|at| now.saturating_duration_since(at).as_secs_f64());
            let left = age_s.map_or(0.0, |age_s| (1.0 - (age_s - hold_s) / fade_s).clamp(0.0, 1.0));
            levels.iter().map(|&level| (f64::from(level) * left) as f32).collect()
        });
        Command { levels: levels.collect(), duration_s }
    }
}

/// The difference, where it is above 0.
fn above(name: &'static str, value: f64, least: f64) -> Result<f64, DeviceError> {
    if value.is_finite() && value > least {
        return Ok(value - least);
    }
    Err(DeviceError::Setting { name, value, least })
}
