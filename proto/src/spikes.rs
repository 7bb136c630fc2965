//! What the effect `spikes` is asked for, and its section: who fired, and when.
//!
//! | at | type | |
//! |---|---|---|
//! | 0 | u32 | spikes of the finger since the hello, those too that no answer carried; wraps |
//! | 4 | u32 | spikes of this answer, n |
//! | 8 | n x (u16, u16) | number of the unit, and how long before the frame's client time, us |
//!
//! Spikes are in the order of time. What follows, up to the section's end, is 0.

use serde::{Deserialize, Serialize};

use crate::effects::Place;

/// Most spikes that an answer can be asked to carry.
pub const SPIKES_MAX: u16 = 16_384;

/// Bytes before the spikes.
pub const SPIKES_HEAD_LEN: usize = 8;

/// Bytes of a spike.
pub const SPIKE_LEN: usize = 4;

/// Class of a touch unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnitClass {
    /// Slowly adapting type 1.
    Sa1,
    /// Rapidly adapting type 1.
    Ra,
    /// Pacinian.
    Pc,
}

/// A unit that a hello places.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Unit {
    /// Its class. Due.
    pub class: UnitClass,
    /// Where it lies. Due.
    pub at: Place,
    /// Which of the model neurons of its class it has, from 0.
    #[serde(default)]
    pub model: u8,
}

/// Parameters of [`RuntimeEffect::Spikes`](crate::RuntimeEffect::Spikes).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Spikes {
    /// Seed of places, models and noise.
    pub seed: u32,
    /// Slowly adapting units per cm2 of interface.
    pub sa1_per_cm2: f64,
    /// Rapidly adapting units per cm2.
    pub ra_per_cm2: f64,
    /// Pacinian units per cm2.
    pub pc_per_cm2: f64,
    /// These units in place of drawn ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<Vec<Unit>>,
    /// Modulus that turns SED into a stress, kPa.
    pub e_ref_kpa: f32,
    /// Whether membranes are noisy.
    pub noise: bool,
    /// Most spikes of an answer.
    pub spikes_max: u16,
}

impl Default for Spikes {
    fn default() -> Self {
        Self {
            seed: 1,
            sa1_per_cm2: 70.0,
            ra_per_cm2: 140.0,
            pc_per_cm2: 21.0,
            units: None,
            e_ref_kpa: 80.0,
            noise: false,
            spikes_max: 1024,
        }
    }
}

/// A unit of a session, as `ready` lists them by number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlacedUnit {
    /// Its class.
    pub class: UnitClass,
    /// Which of the model neurons of its class it has.
    pub model: u8,
    /// Where it lies in the map, `[u, v]`.
    pub px: [f32; 2],
}

/// One spike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spike {
    /// Number of the unit.
    pub unit: u16,
    /// When, by the client's clock, us.
    pub time_us: u64,
}

impl Spike {
    /// The bytes on the wire, in an answer to a frame of this client time.
    #[must_use]
    pub fn encode(self, client_time_us: u64) -> [u8; SPIKE_LEN] {
        let before_us = client_time_us.saturating_sub(self.time_us).min(u16::MAX.into()) as u16;
        let ([a, b], [c, d]) = (self.unit.to_le_bytes(), before_us.to_le_bytes());
        [a, b, c, d]
    }
}

/// What a section holds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Fired {
    /// Spikes of the finger since the hello, those too that no answer carried; wraps.
    pub total: u32,
    /// Those of this answer.
    pub spikes: Vec<Spike>,
}

impl Fired {
    /// Reads a section; none if it is too short for what it says.
    #[must_use]
    pub fn decode(bytes: &[u8], client_time_us: u64) -> Option<Self> {
        let (total, rest) = bytes.split_first_chunk()?;
        let (count, rest) = rest.split_first_chunk()?;
        let count = usize::try_from(u32::from_le_bytes(*count)).ok()?;
        let spikes = rest.as_chunks::<SPIKE_LEN>().0.get(..count)?;
        let spike = |&[a, b, c, d]: &[u8; SPIKE_LEN]| Spike {
            unit: u16::from_le_bytes([a, b]),
            time_us: client_time_us.saturating_sub(u16::from_le_bytes([c, d]).into()),
        };
        Some(Self { total: u32::from_le_bytes(*total), spikes: spikes.iter().map(spike).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_reads_back_and_a_short_one_is_none() {
        let time_us = 5_000_000;
        let spikes = vec![
            Spike { unit: 3, time_us: time_us - 50_000 },
            Spike { unit: 65_535, time_us: time_us - 200 },
            Spike { unit: 0, time_us },
        ];
        let mut bytes = [7_u32.to_le_bytes(), 3_u32.to_le_bytes()].concat();
        spikes.iter().for_each(|spike| bytes.extend(spike.encode(time_us)));
        assert!(Fired::decode(&bytes[..bytes.len() - 1], time_us).is_none());
        bytes.extend([0; 9]);
        assert_eq!(Fired::decode(&bytes, time_us), Some(Fired { total: 7, spikes }));
        assert!(Fired::decode(&bytes[..7], time_us).is_none());
        bytes[4..8].fill(0xff);
        assert!(Fired::decode(&bytes, time_us).is_none());
    }

    #[test]
    fn members_left_out_have_their_default_and_misspelt_ones_are_refused() {
        let of = serde_json::from_str::<Spikes>;
        assert_eq!(of("{}").unwrap(), Spikes::default());
        let placed = of(r#"{"units": [{"class": "pc", "at": {"px": [1.5, 2.5]}}]}"#).unwrap();
        let unit = Unit { class: UnitClass::Pc, at: Place::Px([1.5, 2.5]), model: 0 };
        assert_eq!(placed.units, Some(vec![unit]));
        for wrong in [r#"{"density": 70}"#, r#"{"seed": -1}"#, r#"{"units": [{"class": "sa2"}]}"#] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
