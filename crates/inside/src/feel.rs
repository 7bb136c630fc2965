//! Effects on SED that is known: firing rates, spikes, actuators, summaries; no network.

use std::sync::Arc;

use bytes::BytesMut;
use papilla_proto::{
    ErrorCode, HEADER_LEN, Hello, MAP_LEN, Problem, RuntimeEffect, SampleType,
    atlas::{Patch, Raster},
    effects::{Drive, Section},
    flags,
    spikes::PlacedUnit,
    unknown_effect,
};
use papilla_session_effects as effects;
use papilla_session_effects::{Effects, Written};

use crate::{Bundle, hello};

/// What one finger feels of maps of SED, and what its effects remember.
pub struct Feel {
    bundle: Arc<Bundle>,
    effects: Effects,
    sample_type: SampleType,
    bytes: BytesMut,
    /// Whether the last answer holds less than a value, which its sample type cannot hold.
    is_clipped: bool,
}

impl std::fmt::Debug for Feel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Feel").field("bundle", &self.bundle).finish_non_exhaustive()
    }
}

fn refused(effect: &str, why: &str) -> Problem {
    Problem::new(ErrorCode::BadEffect, why).at(effect)
}

impl Feel {
    /// Takes all memory that the effects of this hello need.
    ///
    /// # Errors
    /// A member is unusable, or an effect needs a network; the problem names it.
    pub fn open(bundle: &Arc<Bundle>, hello: &Hello) -> Result<Self, Problem> {
        hello::check_form(hello, &[])?;
        if let Some(name) = hello.effects.iter().find(|name| name.parse::<RuntimeEffect>().is_err())
        {
            return Err(unknown_effect(name, None));
        }
        let needs = "it changes pressure or SED beside the network: a session has it";
        for effect in [RuntimeEffect::Relaxation, RuntimeEffect::ShearEnergy] {
            if hello.effects.iter().any(|named| named == effect.as_str()) {
                return Err(refused(effect.as_str(), needs));
            }
        }
        if hello.actuators.as_ref().is_some_and(|layout| layout.drive == Drive::Corrected) {
            let why = "the drive 'corrected' asks the network; name 'fitted', or open a session";
            return Err(refused("actuators", why));
        }
        let Bundle { atlas, raster, .. } = &**bundle;
        let (interface, shared) =
            (Raster::new(atlas, Patch::Interface), effects::Shared::default());
        let finger =
            effects::Finger { atlas, skin: raster, interface: &interface, shared: &shared };
        let effects = Effects::of(hello, finger)?
            .ok_or_else(|| refused("effects", "none is named, so that nothing is felt"))?;
        let sample_type = hello.answer_sample_type.unwrap_or(hello.sample_type);
        let mut bytes = BytesMut::new();
        bytes.reserve(effects.size_hint());
        Ok(Self { bundle: Arc::clone(bundle), effects, sample_type, bytes, is_clipped: false })
    }

    /// The sections of an answer, each with its place behind the header.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        self.effects.sections()
    }

    /// The units of the effect `spikes`; none without it.
    #[must_use]
    pub fn units(&self) -> Option<&[PlacedUnit]> {
        self.effects.units()
    }

    /// Type of the samples of maps.
    #[must_use]
    pub fn sample_type(&self) -> SampleType {
        self.sample_type
    }

    /// Bits of [`papilla_proto::flags`] of the last answer: of the clock, and of values that its sample
    /// type cannot hold.
    #[must_use]
    pub fn flags(&self) -> u8 {
        self.effects.clock_flags() | if self.is_clipped { flags::OUT_OF_RANGE } else { 0 }
    }

    /// Room for a header, and the sections of the last answer behind it.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Feels a map of SED (J/m3) under pressure (Pa), each 224 x 224, at a time of the caller's clock.
    ///
    /// # Errors
    /// A value that is negative or not finite; what is remembered stays as it was.
    pub fn frame(
        &mut self,
        sed_j_per_m3: &[f32],
        pressure_pa: &[f32],
        time_us: u64,
    ) -> Result<Written, Problem> {
        for (name, map) in [("sed_j_per_m3", sed_j_per_m3), ("pressure_pa", pressure_pa)] {
            if map.len() != MAP_LEN {
                let message = format!("{} values, {MAP_LEN} are due", map.len());
                return Err(Problem::new(ErrorCode::WrongLength, message).at(name));
            }
            if let Some(at) = map.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
                let message = format!("{} at row {}, column {}", map[at], at / 224, at % 224);
                return Err(Problem::new(ErrorCode::NotFinite, message).at(name));
            }
        }
        self.bytes.clear();
        self.is_clipped = false;
        let time_us = self.effects.time_us(time_us);
        let network = |_: &[f32], _: &mut [f32]| Err(refused("actuators", "it asks the network"));
        self.effects.fit(sed_j_per_m3, network)?;
        self.bytes.resize(HEADER_LEN, 0);
        let written = self.effects.write(pressure_pa, sed_j_per_m3, time_us, &mut self.bytes);
        let written = written.map_err(|error| {
            Problem::new(ErrorCode::Internal, format!("the answer cannot be written: {error}"))
        })?;
        self.is_clipped = written.is_clipped;
        Ok(written)
    }
}
