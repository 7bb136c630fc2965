//! What a fit moves, between which bounds.

use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::materials::MaterialSpec;
use papilla_fingertip::scene::{MaterialSet, TissueTable};
use serde::Serialize;

/// One constant and its bounds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Parameter {
    /// What the command line calls it.
    pub key: &'static str,
    /// Its name, with its unit.
    pub name: &'static str,
    /// Least value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Where the search begins.
    pub start: f64,
    /// Whether the search takes it by its logarithm.
    pub log: bool,
    /// Who prints `low`.
    pub low_source: &'static str,
    /// Who prints `high`.
    pub high_source: &'static str,
}

/// Poisson's ratio at rest. With .48 a fat that stiffens is squeezed together rather than aside: the
/// bulk modulus does not stiffen with it.
const POISSONS_RATIO: f64 = 0.495;
/// Exponent of dermis: human skin (Shergold & Fleck 2005; second hand).
const DERMIS_ALPHA: f64 = 9.0;
/// Least pulp between bone and skin at the base, mm.
const BASE_PULP_MM: f64 = 0.6;
/// Place of the skin's tension among [`PARAMETERS`].
const TENSION: usize = 9;
/// A bound that no print was found for.
const ASSUMED: &str = "assumed";

/// Constants that need a simulation: of the tissues, then of the shape, then the tension of the skin.
/// A search begins with the set `people`, the default shape and slack skin.
pub const PARAMETERS: [Parameter; 10] = [
    Parameter {
        key: "fat",
        name: "shear modulus of fat, MPa",
        low: 0.001_084,
        high: 0.0165,
        start: 0.009_451,
        log: true,
        low_source: "Chokhandre, Halloran, van den Bogert & Erdemir 2012 (heel pad; abstract)",
        high_source: "Erdemir, Viveiros, Ulbrecht & Cavanagh 2006 (heel pads; second hand)",
    },
    Parameter {
        key: "exponent",
        name: "exponent of fat",
        low: 2.0,
        high: 9.78,
        start: 9.78,
        log: true,
        low_source: "neo-Hooke, as the set `papers`",
        high_source: "Chokhandre, Halloran, van den Bogert & Erdemir 2012 (abstract)",
    },
    Parameter {
        key: "dermis",
        name: "shear modulus of dermis, MPa",
        low: 0.027,
        high: 0.11,
        start: 0.027,
        log: true,
        low_source: "Maeno, Kobayashi & Yamazaki 1998 (E = .080 MPa)",
        high_source: "Shergold & Fleck 2005 (human skin; second hand)",
    },
    Parameter {
        key: "epidermis",
        name: "Young's modulus of epidermis, MPa",
        low: 0.136,
        high: 2.0,
        start: 0.6,
        log: true,
        low_source: "Maeno, Kobayashi & Yamazaki 1998; Chen, Shuai & Zhu",
        high_source: "Geerligs et al. 2011 (1 to 2 MPa; abstract)",
    },
    Parameter {
        key: "pulp",
        name: "pulp between skin and bone, mm",
        low: 3.5,
        high: 7.5,
        start: 6.78,
        log: false,
        low_source: ASSUMED,
        high_source: "the default finger (6.78 mm) and a tenth more: assumed",
    },
    Parameter {
        key: "bone",
        name: "size of the bone over the default's",
        low: 0.75,
        high: 1.25,
        start: 1.0,
        log: false,
        low_source: "tuft 7 mm wide, shaft 3 mm (Mintalucci et al. 2014, Wang et al. 2015; second hand): .9 and .55 of the default's",
        high_source: ASSUMED,
    },
    Parameter {
        key: "crease",
        name: "rise of the palmar side from pad to crease, share of the greatest possible",
        low: 0.1,
        high: 0.9,
        start: 0.534,
        log: false,
        low_source: ASSUMED,
        high_source: ASSUMED,
    },
    Parameter {
        key: "thickness",
        name: "thickness of dermis, mm",
        low: 0.6,
        high: 1.6,
        start: 1.0,
        log: false,
        low_source: ASSUMED,
        high_source: ASSUMED,
    },
    Parameter {
        key: "nail",
        name: "width of the nail, mm",
        low: 9.0,
        high: 14.0,
        start: 11.0,
        log: false,
        low_source: ASSUMED,
        high_source: ASSUMED,
    },
    Parameter {
        key: "tension",
        name: "tension of the skin at rest, N/mm",
        low: 0.0,
        high: 0.0162,
        start: 0.0,
        log: false,
        low_source: "none, as the sets",
        high_source: "Diridollou et al. 2000 (13.5 kPa in skin of the forearm; abstract), times the 1.2 mm of skin of the default finger",
    },
];

/// Constants of relaxation, which need none: what relaxes with a time, over what stays.
pub const RELAXATION: [Parameter; 3] =
    [relaxing(RELAXES[0]), relaxing(RELAXES[1]), relaxing(RELAXES[2])];

/// People's relaxation times, s (Pawluk & Howe 1999a; abstract).
pub const RELAXATION_TIMES_S: [f64; 3] = [0.004, 0.070, 1.4];
const RELAXES: [&str; 3] = [
    "what relaxes with 4 ms over what stays",
    "what relaxes with 70 ms over what stays",
    "what relaxes with 1.4 s over what stays",
];

const fn relaxing(name: &'static str) -> Parameter {
    let (low_source, high_source) = (ASSUMED, ASSUMED);
    let key = "relaxation";
    Parameter { key, name, low: 0.01, high: 40.0, start: 0.3, log: true, low_source, high_source }
}

impl Parameter {
    /// The value at a place between 0 (`low`) and 1 (`high`).
    #[must_use]
    pub fn value(&self, at: f64) -> f64 {
        match self.log {
            true => self.low * (at * (self.high / self.low).ln()).exp(),
            false => self.low + at * (self.high - self.low),
        }
    }

    /// The place of a value.
    #[must_use]
    pub fn place(&self, value: f64) -> f64 {
        match self.log {
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        }
    }
}

/// Some of [`PARAMETERS`], of which the others stay where a search begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moved(Vec<usize>);

impl Moved {
    /// The parameters with these keys; of none, all.
    #[must_use]
    pub fn named(keys: &[String]) -> Self {
        let wanted = |k: &usize| keys.is_empty() || keys.iter().any(|n| n == PARAMETERS[*k].key);
        Self((0..PARAMETERS.len()).filter(wanted).collect())
    }

    /// Those that are moved.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        self.0.iter().map(|&k| PARAMETERS[k]).collect()
    }

    /// Those that are not.
    #[must_use]
    pub fn held(&self) -> Vec<Parameter> {
        (0..PARAMETERS.len()).filter(|k| !self.0.contains(k)).map(|k| PARAMETERS[k]).collect()
    }

    /// Values of all parameters at a point of the moved ones.
    #[must_use]
    pub fn all_values(&self, at: &[f64]) -> Vec<f64> {
        let mut whole = start(&PARAMETERS);
        self.0.iter().zip(at).for_each(|(&k, x)| whole[k] = *x);
        values(&PARAMETERS, &whole)
    }
}

/// Where a search begins.
#[must_use]
pub fn start(parameters: &[Parameter]) -> Vec<f64> {
    parameters.iter().map(|p| p.place(p.start)).collect()
}

/// Values at a point of a search, to four digits: files of one press are named by what it was solved
/// from.
#[must_use]
pub fn values(parameters: &[Parameter], at: &[f64]) -> Vec<f64> {
    parameters.iter().zip(at).map(|(p, x)| four_digits(p.value(*x))).collect()
}

fn four_digits(v: f64) -> f64 {
    // By decimal digits: a product with a power of ten would not be the nearest number to them.
    format!("{v:.3e}").parse().unwrap_or(v)
}

/// The tissues with values of [`PARAMETERS`], nail and bone as ever.
#[must_use]
pub fn table(values: &[f64]) -> TissueTable {
    let term = |mu, alpha| MaterialSpec::one_term(mu, alpha, POISSONS_RATIO);
    TissueTable {
        // Slack skin has no tension: a press is stored under the same hash as before there was one.
        skin_tension_n_per_mm: values.get(TENSION).copied().filter(|t| *t != 0.0),
        epidermis: MaterialSpec::elastic(values[3], POISSONS_RATIO),
        dermis: term(values[2], DERMIS_ALPHA),
        subcutaneous: term(values[0], values[1]),
        ..MaterialSet::Papers.table()
    }
}

/// The shape with values of [`PARAMETERS`].
///
/// What lies between bone and back stays as it is at the base, so that the finger is as high as pulp
/// and bone make it.
#[must_use]
pub fn shape(values: &[f64]) -> FingertipShape {
    let usual = FingertipShape::default();
    let (pulp_mm, size) = (values[4], values[5]);
    // Of the thickest section the bone has about the mean of its heights at tuft and waist.
    let below_axis_mm = 0.25 * size * (usual.bone_tuft_mm[1] + usual.bone_waist_mm[1]);
    let base_mm = 0.5 * usual.bone_base_mm[1];
    let back_mm = 0.5 * usual.height_mm - usual.bone_offset_mm - base_mm;
    let height_mm = pulp_mm + below_axis_mm + base_mm * size + back_mm;
    // Pulp between bone and skin at the base, if the pad did not rise, less what has to stay.
    let room_mm = pulp_mm + below_axis_mm - base_mm * size - BASE_PULP_MM;
    let scaled = |part: [f64; 2]| part.map(|v| four_digits(size * v));
    FingertipShape {
        height_mm: four_digits(height_mm),
        bone_offset_mm: four_digits(0.5 * height_mm - back_mm - base_mm * size),
        bone_tuft_mm: scaled(usual.bone_tuft_mm),
        bone_waist_mm: scaled(usual.bone_waist_mm),
        bone_base_mm: scaled(usual.bone_base_mm),
        crease_depth_mm: four_digits(values[6] * room_mm),
        dermis_mm: values[7],
        nail_mm: [values[8], usual.nail_mm[1]],
        ..usual
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fingertip::geometry::fingertip::SurfaceParameter;
    use papilla_fingertip::scene::Finger;

    #[test]
    fn a_search_begins_within_its_bounds() {
        for p in PARAMETERS.iter().chain(&RELAXATION) {
            let at = p.place(p.start);
            assert!((0.0..=1.0).contains(&at), "{}: {at}", p.name);
            let same = |a: f64, b: f64| a == b || (a / b - 1.0).abs() < 1e-12;
            assert!(same(p.value(at), p.start), "{}: {}", p.name, p.value(at));
            assert!(same(p.value(0.0), p.low) && p.place(p.high) == 1.0, "{}", p.name);
        }
    }

    #[test]
    fn what_is_not_moved_stays_where_the_search_begins() {
        let moved = Moved::named(&["pulp".into(), "fat".into()]);
        let values = moved.all_values(&[0.0, 1.0]);
        for (k, p) in PARAMETERS.iter().enumerate() {
            let due = [p.low, p.start, p.high][[0, 1, 1, 1, 2, 1, 1, 1, 1, 1][k]];
            let same = values[k] == due || (values[k] / due - 1.0).abs() < 1e-3;
            assert!(same, "{}: {}", p.name, values[k]);
        }
        assert_eq!((moved.parameters().len(), moved.held().len()), (2, PARAMETERS.len() - 2));
        assert_eq!(Moved::named(&[]).parameters().len(), PARAMETERS.len());
    }

    #[test]
    fn values_have_four_digits() {
        assert!((four_digits(0.012_345_6) / 0.012_35 - 1.0).abs() < 1e-12);
        assert!((four_digits(9.780_04) / 9.78 - 1.0).abs() < 1e-12);
        assert_eq!(four_digits(0.027_000_000_000_000_003).to_string(), "0.027");
    }

    /// Every corner of the bounds is a finger, with the pulp that was asked for.
    #[test]
    fn every_corner_is_a_finger() {
        for corner in 0..1 << PARAMETERS.len() {
            let side = |k: usize| f64::from(u8::from(corner >> k & 1 == 1));
            let at: Vec<f64> = (0..PARAMETERS.len()).map(side).collect();
            let values = values(&PARAMETERS, &at);
            let shape = shape(&values);
            let finger = Finger { shape, tissue: table(&values), ..Finger::usual() };
            finger.validate().unwrap_or_else(|e| panic!("{values:?}: {e}"));
            let pad = SurfaceParameter::Body([0.0, -1.0], 0.0);
            let (skin, bone) = (finger.shape.skin(pad), finger.shape.bone(pad));
            // The bone's side towards the pad is curved along the finger.
            assert!((bone[2] - skin[2] - values[4]).abs() < 0.5, "{values:?}: {skin:?} {bone:?}");
        }
    }

    #[test]
    fn the_default_shape_is_among_them() {
        let usual = FingertipShape::default();
        let found = shape(&[0.01, 9.0, 0.03, 0.6, 6.78, 1.0, 0.534, 1.0, 11.0, 0.0]);
        assert!((found.height_mm - usual.height_mm).abs() < 0.06, "{}", found.height_mm);
        assert!((found.bone_offset_mm - usual.bone_offset_mm).abs() < 0.04);
        assert!((found.crease_depth_mm - usual.crease_depth_mm).abs() < 0.01, "{found:?}");
        assert_eq!(found.bone_base_mm, usual.bone_base_mm);
    }

    /// Where a search begins there is no tension, so that fingers of earlier fits are the same.
    #[test]
    fn skin_is_slack_where_a_search_begins() {
        let first = table(&Moved::named(&["fat".into()]).all_values(&[0.3]));
        assert_eq!(first.skin_tension_n_per_mm, None);
        assert!(!toml::to_string(&first).unwrap().contains("tension"));
        assert_eq!(PARAMETERS[TENSION].key, "tension");
        let last = table(&Moved::named(&["tension".into()]).all_values(&[1.0]));
        assert_eq!(last.skin_tension_n_per_mm, Some(PARAMETERS[TENSION].high));
    }

    /// The set `people` was fitted within the bounds of the tissues, with the default shape.
    #[test]
    fn the_set_people_lies_within_the_bounds() {
        let set = MaterialSet::People.table();
        let term = |spec: &MaterialSpec| {
            let ogden = spec.ogden.clone().unwrap();
            (ogden.mu_mpa[0], ogden.alpha[0])
        };
        let ((fat, exponent), (dermis, _)) = (term(&set.subcutaneous), term(&set.dermis));
        let values = [fat, exponent, dermis, set.epidermis.youngs_modulus_mpa];
        for (p, v) in PARAMETERS.iter().zip(values) {
            assert!((p.low..=p.high).contains(&v), "{}: {v}", p.name);
        }
        let same = table(&values);
        for (a, b) in [(&set.dermis, &same.dermis), (&set.subcutaneous, &same.subcutaneous)] {
            assert_eq!((&a.ogden, a.poissons_ratio), (&b.ogden, b.poissons_ratio));
        }
        assert_eq!(set.dermis.prony.unwrap().time_s, RELAXATION_TIMES_S);
    }
}
