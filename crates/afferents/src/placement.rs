//! Where units lie: so many per cm2 of the interface, drawn with a seed.

use crate::{class::Class, neuron::Neuron, random::mixed};

/// Most units of a finger: the wire numbers them with 16 bits, and a frame has its time.
pub const UNITS_MAX: usize = 4096;

/// A unit of a finger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// What it is.
    pub class: Class,
    /// Which of its class' model neurons it has.
    pub model: u8,
    /// The pixel of the interface under which it lies.
    pub pixel: u32,
}

/// Units per cm2 of interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Densities {
    /// Of each class, in the order of [`Class::ALL`].
    pub per_cm2: [f64; 3],
}

impl Default for Densities {
    fn default() -> Self {
        Self { per_cm2: Class::ALL.map(Class::per_cm2) }
    }
}

/// Why there are no units.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlacementError {
    /// A density that cannot be.
    #[error("a density of {per_cm2} {class} units per cm2; name 0 or more")]
    Density {
        /// Of these units.
        class: Class,
        /// The density.
        per_cm2: f64,
    },
    /// Nothing was drawn.
    #[error(
        "seed {seed} draws no unit on {area_cm2:.3} cm2 at densities of {per_cm2:?}; name greater \
         densities or another seed"
    )]
    NoUnit {
        /// The seed.
        seed: u32,
        /// Area of the interface.
        area_cm2: f64,
        /// Densities of SA1, RA and PC.
        per_cm2: [f64; 3],
    },
    /// More than can be served.
    #[error("the densities give {units} units; {UNITS_MAX} at most are served")]
    TooMany {
        /// Units that were due.
        units: f64,
    },
}

/// Draws units on an interface, given its pixels with the area each shows, mm2.
///
/// Of each class there are `density x area`, whose fraction is one more unit with that
/// probability. Places are independent and uniform in area, models uniform in number.
///
/// # Errors
/// A density is none, or there are no units, or too many.
pub fn place(
    pixels: &[(u32, f32)],
    densities: Densities,
    seed: u32,
) -> Result<Vec<Unit>, PlacementError> {
    let mut sum_mm2 = 0.0;
    let upto_mm2: Vec<f64> = pixels
        .iter()
        .map(|&(_, mm2)| {
            sum_mm2 += f64::from(mm2);
            sum_mm2
        })
        .collect();
    let area_cm2 = 0.01 * sum_mm2;
    let per_cm2 = densities.per_cm2;
    for (class, per_cm2) in Class::ALL.into_iter().zip(per_cm2) {
        if !(per_cm2.is_finite() && per_cm2 >= 0.0) {
            return Err(PlacementError::Density { class, per_cm2 });
        }
    }
    let due: f64 = per_cm2.iter().map(|per_cm2| per_cm2 * area_cm2).sum();
    if due > UNITS_MAX as f64 - Class::ALL.len() as f64 {
        return Err(PlacementError::TooMany { units: due.ceil() });
    }
    let mut units = Vec::with_capacity(UNITS_MAX.min(due as usize + Class::ALL.len()));
    for (class, per_cm2) in Class::ALL.into_iter().zip(per_cm2) {
        let uniform = |number: u64, what: u64| mixed([u64::from(seed), class as u64, number, what]);
        let fraction = |number, what| uniform(number, what) as f64 / 2_f64.powi(64);
        let count = (per_cm2 * area_cm2 + fraction(u64::MAX, 0)).floor() as u64;
        for number in 0..count {
            let at_mm2 = fraction(number, 0) * sum_mm2;
            let found = upto_mm2.partition_point(|&upto| upto <= at_mm2);
            let Some(&(pixel, _)) = pixels.get(found.min(pixels.len().saturating_sub(1))) else {
                break;
            };
            let model = (uniform(number, 1) % Neuron::models(class) as u64) as u8;
            units.push(Unit { class, model, pixel });
        }
    }
    if units.is_empty() {
        return Err(PlacementError::NoUnit { seed, area_cm2, per_cm2 });
    }
    Ok(units)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 x 20 mm, of which the right half has pixels of three times the area.
    fn square() -> Vec<(u32, f32)> {
        (0..400).map(|i| (i, if i % 20 < 10 { 0.5 } else { 1.5 })).collect()
    }

    #[test]
    fn counts_follow_densities_and_places_follow_areas() {
        let units = place(&square(), Densities::default(), 7).unwrap();
        for class in Class::ALL {
            let count = units.iter().filter(|unit| unit.class == class).count() as f64;
            assert!((count - 4.0 * class.per_cm2()).abs() <= 1.0, "{count} {class}");
        }
        let right = units.iter().filter(|unit| unit.pixel % 20 >= 10).count() as f64;
        let (due, all) = (0.75, units.len() as f64);
        // Five standard deviations of a fair draw.
        assert!((right / all - due).abs() < 5.0 * (due * (1.0 - due) / all).sqrt(), "{right}");
    }

    #[test]
    fn a_seed_is_a_finger() {
        let of = |seed| place(&square(), Densities::default(), seed).unwrap();
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }

    #[test]
    fn a_fraction_of_a_unit_is_there_with_some_seeds() {
        // 0.3 units of one class.
        let densities = Densities { per_cm2: [0.075, 0.0, 0.0] };
        let drawn = (0..1000).map(|seed| place(&square(), densities, seed));
        let found = drawn.clone().filter(Result::is_ok).count();
        assert!((230..370).contains(&found), "{found} of 1000 seeds");
        let error = drawn.into_iter().find_map(Result::err).unwrap();
        assert!(matches!(error, PlacementError::NoUnit { .. }), "{error}");
    }

    #[test]
    fn densities_that_cannot_be_are_refused() {
        let of = |per_cm2| place(&square(), Densities { per_cm2 }, 1).unwrap_err();
        for none in [f64::NAN, -1.0, f64::INFINITY] {
            assert!(matches!(
                of([70.0, none, 0.0]),
                PlacementError::Density { class: Class::Ra, .. }
            ));
        }
        assert!(matches!(of([1e4, 0.0, 0.0]), PlacementError::TooMany { .. }));
        assert!(matches!(of([0.0; 3]), PlacementError::NoUnit { .. }));
        assert!(matches!(place(&[], Densities::default(), 1), Err(PlacementError::NoUnit { .. })));
    }
}
