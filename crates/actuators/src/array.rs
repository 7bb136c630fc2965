//! An array of pins on a finger: how they press, and the strain that each gives.

use papilla_atlas::{Atlas, MAP_LEN, MAP_SIDE_PX, Patch, Pixel, Raster};
use thiserror::Error;

use crate::half_space::{HalfSpace, Profile};

/// Most pins of an array: the fit of a frame grows with their square.
const PINS_MAX: usize = 256;
/// Reach of a pin, mm: the least is some four pixels across, the greatest a third of a fingertip.
const REACH_MM: [f32; 2] = [0.25, 2.5];
/// Most different reaches: each takes some ten milliseconds to prepare.
const REACHES_MAX: usize = 8;
/// How far beyond a pin's reach it is felt, mm: SED has fallen below a hundredth there.
const BEYOND_MM: f32 = 1.5;
/// SED is fitted at one pixel of so many either way: .27 mm on the shipped atlas, as deep as the
/// interface lies.
const STRIDE: usize = 2;

/// One pin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pin {
    /// Pixel of the interface, `224 row + column`; the pin stands on the skin over it.
    pub pixel: u32,
    /// Radius of its contact, chord on the undeformed skin, mm.
    pub reach_mm: f32,
    /// Greatest drive, Pa.
    pub max_pa: f32,
}

/// Why an array is refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ArrayError {
    /// None, or too many.
    #[error("{found} pins; name 1 to {PINS_MAX}")]
    Count {
        /// How many.
        found: usize,
    },
    /// A pin off the interface.
    #[error("pin {pin} is at pixel {pixel}, off the interface")]
    Pixel {
        /// Its number.
        pin: usize,
        /// Where it is.
        pixel: u32,
    },
    /// A reach that no map can hold.
    #[error("'radius_mm' of pin {pin} is {found}; {} to {} mm are due", REACH_MM[0], REACH_MM[1])]
    Reach {
        /// Its number.
        pin: usize,
        /// Its reach.
        found: f32,
    },
    /// More kinds of pins than an array has.
    #[error("'radius_mm' has {found} different values; name at most {REACHES_MAX}")]
    Reaches {
        /// How many.
        found: usize,
    },
    /// No drive is possible.
    #[error("the greatest drive of pin {pin} is {found} Pa; it has to be above 0")]
    Max {
        /// Its number.
        pin: usize,
        /// Its greatest drive.
        found: f32,
    },
}

/// What one pin gives at one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tap {
    pub(crate) pin: u32,
    /// Squares sum to SED; sqrt(J/m3) a Pa.
    pub(crate) strain: [f32; 6],
}

/// An array of pins.
#[derive(Debug)]
pub struct Array {
    pub(crate) max_pa: Vec<f64>,
    /// Pixels of the interface at which SED is fitted, and where the taps of each end.
    pub(crate) samples: Vec<(u32, u32)>,
    pub(crate) taps: Vec<Tap>,
    /// Pixels of the skin under each pin with the pressure of a unit drive, and where each ends.
    footprint: Vec<(u32, f32)>,
    ends: Vec<usize>,
}

/// A pixel of a patch: where its point of the skin is on the finger and in the map.
struct Place {
    index: u32,
    at_mm: [f32; 3],
    at_px: [f32; 2],
}

impl Array {
    /// Some ten milliseconds for a hundred pins. `rasters` are skin and interface of the atlas.
    ///
    /// # Errors
    /// The first pin that cannot be, or too many.
    pub fn new(
        atlas: &Atlas,
        [skin, interface]: [&Raster; 2],
        pins: &[Pin],
        space: HalfSpace,
    ) -> Result<Self, ArrayError> {
        if pins.is_empty() || pins.len() > PINS_MAX {
            return Err(ArrayError::Count { found: pins.len() });
        }
        let centres = centres(atlas, interface, pins)?;
        let (profiles, of_pin) = profiles(pins, space)?;
        let (mut footprint, mut ends) = (Vec::new(), Vec::with_capacity(pins.len()));
        let skin_places = places(atlas, skin, 1);
        for (pin, centre) in pins.iter().zip(&centres) {
            let begin = footprint.len();
            for place in &skin_places {
                let part = distance_mm(place, centre) / pin.reach_mm;
                if part < 1.0 {
                    footprint.push((place.index, (1.0 - part * part).sqrt()));
                }
            }
            debug_assert!(footprint.len() > begin, "a reach of pixels holds some");
            ends.push(footprint.len());
        }
        let (mut samples, mut taps) = (Vec::new(), Vec::new());
        for place in places(atlas, interface, STRIDE) {
            let begin = taps.len();
            for (number, (centre, profile)) in centres.iter().zip(&of_pin).enumerate() {
                let [du, dv] = [0, 1].map(|k| f64::from(place.at_px[k] - centre.at_px[k]));
                let off_px = du.hypot(dv);
                let towards = if off_px > 0.0 { [du / off_px, dv / off_px] } else { [1.0, 0.0] };
                let off_mm = f64::from(distance_mm(&place, centre));
                if let Some(strain) = profiles[*profile].strain(off_mm, towards) {
                    taps.push(Tap { pin: number as u32, strain });
                }
            }
            if taps.len() > begin {
                samples.push((place.index, taps.len() as u32));
            }
        }
        let max_pa = pins.iter().map(|pin| f64::from(pin.max_pa)).collect();
        Ok(Self { max_pa, samples, taps, footprint, ends })
    }

    /// Number of pins.
    #[must_use]
    pub fn pins(&self) -> usize {
        self.max_pa.len()
    }

    /// The pressure of a drive on the skin, Pa, 224 x 224; all of it is overwritten.
    ///
    /// # Panics
    /// If `pressure_pa` is no map, or there are fewer drives than pins.
    pub fn pressure(&self, drive_pa: &[f32], pressure_pa: &mut [f32]) {
        pressure_pa.fill(0.0);
        let mut begin = 0;
        for (pin, &end) in self.ends.iter().enumerate() {
            for &(index, part) in &self.footprint[begin..end] {
                pressure_pa[index as usize] += drive_pa[pin] * part;
            }
            begin = end;
        }
    }

    /// SED of a drive on the half-space, J/m3, at every second pixel either way that a pin reaches:
    /// there the fit looks. Other pixels of the map are left as they are.
    ///
    /// # Panics
    /// If `sed_j_per_m3` is no map, or there are fewer drives than pins.
    pub fn sed(&self, drive_pa: &[f32], sed_j_per_m3: &mut [f32]) {
        let mut begin = 0;
        for &(index, end) in &self.samples {
            let mut sum = [0.0; 6];
            for tap in &self.taps[begin..end as usize] {
                for (sum, strain) in sum.iter_mut().zip(tap.strain) {
                    *sum += drive_pa[tap.pin as usize] * strain;
                }
            }
            sed_j_per_m3[index as usize] = sum.iter().map(|s| s * s).sum();
            begin = end as usize;
        }
    }
}

/// Where each pin stands on the skin.
fn centres(atlas: &Atlas, interface: &Raster, pins: &[Pin]) -> Result<Vec<Place>, ArrayError> {
    let of = |(number, pin): (usize, &Pin)| {
        let Pin { pixel, reach_mm, max_pa } = *pin;
        if !(REACH_MM[0]..=REACH_MM[1]).contains(&reach_mm) {
            return Err(ArrayError::Reach { pin: number, found: reach_mm });
        }
        if !(max_pa.is_finite() && max_pa > 0.0) {
            return Err(ArrayError::Max { pin: number, found: max_pa });
        }
        let at = (pixel as usize) < MAP_LEN;
        let (row, column) = (pixel as usize / MAP_SIDE_PX, pixel as usize % MAP_SIDE_PX);
        let found = at.then(|| interface.at(row, column)).flatten();
        let found = found.ok_or(ArrayError::Pixel { pin: number, pixel })?;
        Ok(place(atlas, pixel, found))
    };
    pins.iter().enumerate().map(of).collect()
}

/// One profile a reach, and which each pin has.
fn profiles(pins: &[Pin], space: HalfSpace) -> Result<(Vec<Profile>, Vec<usize>), ArrayError> {
    let mut reaches: Vec<f32> = pins.iter().map(|pin| pin.reach_mm).collect();
    reaches.sort_by(f32::total_cmp);
    reaches.dedup();
    if reaches.len() > REACHES_MAX {
        return Err(ArrayError::Reaches { found: reaches.len() });
    }
    let profile = |&mm: &f32| space.profile(f64::from(mm), f64::from(mm + BEYOND_MM));
    let of = |pin: &Pin| reaches.partition_point(|mm| *mm < pin.reach_mm);
    Ok((reaches.iter().map(profile).collect(), pins.iter().map(of).collect()))
}

/// Every pixel of a patch, or one of `stride` either way.
fn places(atlas: &Atlas, raster: &Raster, stride: usize) -> Vec<Place> {
    let on_grid = |index: u32| {
        let index = index as usize;
        (index / MAP_SIDE_PX).is_multiple_of(stride) && (index % MAP_SIDE_PX).is_multiple_of(stride)
    };
    let all = raster.indices().iter().zip(raster.pixels());
    all.filter(|(index, _)| on_grid(**index)).map(|(i, pixel)| place(atlas, *i, pixel)).collect()
}

/// Vertices of the interface lie under those of the skin, so what a pixel of either shows has a
/// point of the skin over it.
fn place(atlas: &Atlas, index: u32, pixel: &Pixel) -> Place {
    let skin = atlas.patch(Patch::Skin);
    let (mut at_mm, mut at_px) = ([0.0; 3], [0.0; 2]);
    for (vertex, weight) in pixel.vertices.iter().zip(pixel.weights) {
        let vertex = *vertex as usize;
        for (at, corner) in at_mm.iter_mut().zip(skin.positions_mm[vertex]) {
            *at += weight * corner;
        }
        for (at, corner) in at_px.iter_mut().zip(skin.uv_px[vertex]) {
            *at += weight * corner;
        }
    }
    Place { index, at_mm, at_px }
}

fn distance_mm(a: &Place, b: &Place) -> f32 {
    let squares = a.at_mm.iter().zip(b.at_mm).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f32>().sqrt()
}
