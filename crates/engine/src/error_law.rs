//! How wrong one answer is likely to be, from what it shows.
//!
//! A [`Law`] states the error of an answer as two quantiles: half of such answers err less than the
//! first, nine of ten less than the second. The logarithm of each is linear in the [`Facts`] of the
//! answer. Most facts are logarithms of numbers that pressure, contact and SED show. `model-export
//! calibrate` fits the laws to finite-element simulations that no training saw, and writes
//! `errors.json` beside the models. Nothing is stated if a fact is out of the range for which the law
//! was calibrated, or if the network, or the method that found its pressure, was not calibrated.
//!
//! ```
//! use papilla_engine::error_law::{Fact, Facts, Law, Term};
//!
//! let term = Term { fact: Fact::Load, least: -2.0, most: 4.0, median: 0.5, bound: 0.0 };
//! let law = Law { median: -2.0, bound: 0.7, terms: vec![term] };
//! let mut facts = Facts::default();
//! assert!(!law.at(&facts).is_stated(), "the load is not known");
//! facts.set(Fact::Load, 0.0);
//! let found = law.at(&facts);
//! assert!((found.median - (-2.0f32).exp()).abs() < 1e-6);
//! assert!((found.p90 / found.median - 0.7f32.exp()).abs() < 1e-5);
//! facts.set(Fact::Load, 5.0);
//! assert!(!law.at(&facts).is_stated(), "no simulation was pressed as hard");
//! ```

use crate::{EngineError, MODEL_FORMAT};
use papilla_proto::contact::ContactMethod;
use papilla_proto::input_statistics::PressedCells;
use papilla_proto::{LikelyError, Look, MAP_SIDE_PX, json};
use serde::{Deserialize, Serialize};

/// A number that an answer shows and on which its error depends: a logarithm, share or count,
/// without unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fact {
    /// Logarithm of the greatest pressure, MPa.
    Peak,
    /// Logarithm of the greatest pressure over the mean pressure.
    Concentration,
    /// For SED the logarithm of the sum of the pressures, MPa px; for a force the logarithm of its
    /// size, N.
    Load,
    /// Logarithm of the standard deviation of the pressure's places along the contact's longest
    /// direction, px.
    Length,
    /// Logarithm of the map's roughness ([`papilla_proto::InputStatistics`]).
    Roughness,
    /// How many cells there are, at least, between the contact and the edge of the region that the
    /// training pressed.
    Inside,
    /// Share of the pressed cells outside of that region.
    Strange,
    /// Logarithm of the sum of SED over the sum of the squared pressures, 1/MPa.
    Energy,
    /// How far the centre of pressure lies beyond the pad's middle part towards the tip of the
    /// finger; 0 within it.
    Tip,
    /// The same towards a side.
    Side,
    /// The same towards the hand.
    Heel,
}

impl Fact {
    /// Number of facts.
    const COUNT: usize = Self::Heel as usize + 1;

    /// The facts on which the error of SED may depend.
    pub const OF_SED: [Self; 11] = [
        Self::Peak,
        Self::Concentration,
        Self::Load,
        Self::Length,
        Self::Roughness,
        Self::Inside,
        Self::Strange,
        Self::Energy,
        Self::Tip,
        Self::Side,
        Self::Heel,
    ];

    /// The facts on which the error of a force from a contact method may depend.
    pub const OF_FORCE: [Self; 4] = [Self::Load, Self::Tip, Self::Side, Self::Heel];
}

/// The facts of one answer. A fact that is not known is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facts([f32; Fact::COUNT]);

impl Default for Facts {
    fn default() -> Self {
        Self([f32::NAN; Fact::COUNT])
    }
}

/// Distances from the middle of the map at which a centre of pressure counts as far out: along the
/// finger and across it, px. The first is also the unit of the facts `Tip`, `Side` and `Heel`.
const FAR_PX: [f32; 2] = [40.0, 20.0];
/// The same in mm; a pixel is 0.137 mm wide on average.
const FAR_MM: [f32; 2] = [5.5, 2.75];
/// Distance of the middle of the map from the tip, along the finger, mm.
const MIDDLE_MM: f32 = 11.5;

impl Facts {
    /// The facts of a pressure map (`look` and its greatest pressure) and of the SED under it
    /// (`sed_sum`, the sum over the map, J/m3). `trained` are the cells that the training pressed.
    #[must_use]
    pub fn of_sed(look: &Look, peak_pa: f32, sed_sum: f32, trained: PressedCells) -> Self {
        let mut facts = Self::default();
        let of = &look.statistics;
        let squares = of.load_mpa_px * of.load_mpa_px / of.area_px;
        let middle = (MAP_SIDE_PX as f32 - 1.0) / 2.0;
        let from_middle = look.centre_px.map(|at| at - middle);
        facts.set(Fact::Peak, (1e-6 * peak_pa).ln());
        facts.set(Fact::Concentration, (1e-6 * peak_pa * of.area_px / of.load_mpa_px).ln());
        facts.set(Fact::Load, of.load_mpa_px.ln());
        facts.set(Fact::Length, look.spread_px[0].ln());
        facts.set(Fact::Roughness, of.roughness.ln());
        facts.set(Fact::Inside, of.cells.depth_in(trained) as f32);
        facts.set(Fact::Strange, of.cells.share_beyond(trained));
        facts.set(Fact::Energy, (1e-6 * sed_sum / squares).ln());
        facts.place(from_middle[1] / FAR_PX[0], from_middle[0] / FAR_PX[0], FAR_PX);
        facts
    }

    /// The facts of a force on a finger of reference width and stiffness, from its size and the
    /// centre of pressure in the finger's frame.
    #[must_use]
    pub fn of_force(force_n: f32, centre_mm: [f32; 3]) -> Self {
        let mut facts = Self::default();
        facts.set(Fact::Load, force_n.ln());
        let along = (centre_mm[0] - MIDDLE_MM) / FAR_MM[0];
        facts.place(along, centre_mm[1] / FAR_MM[0], FAR_MM);
        facts
    }

    /// Sets the facts about the centre of pressure. `along` and `aside` are its distances from the
    /// middle, in units of `far[0]`.
    fn place(&mut self, along: f32, aside: f32, far: [f32; 2]) {
        self.set(Fact::Tip, (-along - 1.0).max(0.0));
        self.set(Fact::Heel, (along - 1.0).max(0.0));
        self.set(Fact::Side, (aside.abs() - far[1] / far[0]).max(0.0));
    }

    /// One fact; NaN if it is not known.
    #[must_use]
    pub fn get(&self, fact: Fact) -> f32 {
        self.0[fact as usize]
    }

    /// Sets one fact.
    pub fn set(&mut self, fact: Fact, value: f32) {
        self.0[fact as usize] = value;
    }
}

/// What one fact adds to the logarithm of the error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// The fact.
    pub fact: Fact,
    /// Least value for which the law holds: that of the calibration, with a margin.
    pub least: f32,
    /// Greatest value for which the law holds.
    pub most: f32,
    /// Coefficient in the logarithm of the median.
    pub median: f32,
    /// Coefficient in the logarithm of the bound over the median.
    pub bound: f32,
}

/// The law of one kind of error; see the [module](self).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Logarithm of the median if all facts are 0.
    pub median: f32,
    /// Logarithm of the bound over the median if all facts are 0.
    pub bound: f32,
    /// What each fact adds.
    pub terms: Vec<Term>,
}

/// Least logarithm of a bound over its median: a bound is at least 5 % above the median.
pub const BOUND_LEAST: f32 = 0.05;

impl Law {
    /// The error of an answer with these facts; unknown if the law [does not hold](Self::is_beyond)
    /// for them.
    #[must_use]
    pub fn at(&self, facts: &Facts) -> LikelyError {
        if self.is_beyond(facts) {
            return LikelyError::UNKNOWN;
        }
        let add = |start: f32, of: fn(&Term) -> f32| {
            self.terms.iter().fold(start, |sum, term| sum + of(term) * facts.get(term.fact))
        };
        let median = add(self.median, |term| term.median);
        let bound = median + add(self.bound, |term| term.bound).max(BOUND_LEAST);
        LikelyError { median: median.exp(), p90: bound.exp() }
    }

    /// Whether the centre of pressure lies further out than in any simulation of the calibration. There
    /// nothing has checked the network, and what it answers under a narrow object is often wrong.
    #[must_use]
    pub fn is_beyond_place(&self, facts: &Facts) -> bool {
        let places = [Fact::Tip, Fact::Side, Fact::Heel];
        let mut terms = self.terms.iter().filter(|term| places.contains(&term.fact));
        terms.any(|term| facts.get(term.fact) > term.most)
    }

    /// Whether a fact is not known, or lies outside the range of the calibration.
    #[must_use]
    pub fn is_beyond(&self, facts: &Facts) -> bool {
        // A fact that is NaN is in no range.
        !self.terms.iter().all(|term| (term.least..=term.most).contains(&facts.get(term.fact)))
    }
}

/// The law of an error under contact by one method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodLaw {
    /// The method.
    pub method: ContactMethod,
    /// Its law.
    pub law: Law,
}

/// The laws of one network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkLaws {
    /// Its name.
    pub name: String,
    /// SHA-256 of its file. The laws are not used for another file.
    pub onnx_sha256: String,
    /// The error of SED from a given pressure map, such as one from FE.
    pub given: Law,
    /// The error of SED from pressure that a contact method has found, method by method.
    pub contact: Vec<MethodLaw>,
}

/// The errors of answers: the file `errors.json` of a folder of models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorLaws {
    /// Version of this layout.
    pub format: u32,
    /// Hash of the atlas on which all of it was calibrated.
    pub atlas_hash: String,
    /// SHA-256 of the contact model's file. The laws under contact are not used with another file.
    pub contact_sha256: String,
    /// The laws of SED, network by network.
    pub networks: Vec<NetworkLaws>,
    /// The laws of the size of the force, method by method.
    pub force: Vec<MethodLaw>,
}

/// Where the pressure came from that a network turns into SED.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way<'a> {
    /// The client gave it as a map.
    Given,
    /// This contact method found it, with the contact model whose file has this SHA-256.
    Contact(ContactMethod, &'a str),
}

impl ErrorLaws {
    /// Reads the file.
    ///
    /// # Errors
    /// [`EngineError::BadErrors`] if it is not JSON of this shape, [`EngineError::UnsupportedFormat`].
    pub fn from_json(text: &str) -> Result<Self, EngineError> {
        let laws: Self = json::read(text.as_bytes())
            .map_err(|error| EngineError::BadErrors { reason: error.to_string() })?;
        if laws.format == MODEL_FORMAT {
            return Ok(laws);
        }
        Err(EngineError::UnsupportedFormat { file: "errors.json", found: laws.format })
    }

    /// The law of SED for the network whose file has this SHA-256. None: it was not calibrated this
    /// way.
    #[must_use]
    pub fn sed(&self, onnx_sha256: &str, way: Way<'_>) -> Option<&Law> {
        let network = self.networks.iter().find(|laws| laws.onnx_sha256 == onnx_sha256)?;
        match way {
            Way::Given => Some(&network.given),
            Way::Contact(method, model) => self.by(&network.contact, method, model),
        }
    }

    /// The law of the size of a force. None: it was not calibrated, or the pressure was given.
    #[must_use]
    pub fn force(&self, way: Way<'_>) -> Option<&Law> {
        match way {
            Way::Given => None,
            Way::Contact(method, model) => self.by(&self.force, method, model),
        }
    }

    fn by<'a>(&self, laws: &'a [MethodLaw], method: ContactMethod, model: &str) -> Option<&'a Law> {
        let laws = if model == self.contact_sha256 { laws } else { &[] };
        laws.iter().find(|of| of.method == method).map(|of| &of.law)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_proto::MAP_LEN;

    fn ball(peak_pa: f32, [column, row]: [f32; 2], radius_px: f32) -> Vec<f32> {
        (0..MAP_LEN)
            .map(|i| {
                let (y, x) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
                let off = (y - row).hypot(x - column) / radius_px;
                peak_pa * (1.0 - off * off).max(0.0).sqrt()
            })
            .collect()
    }

    /// A pressure as Hertz has it: its mean is two thirds of its peak, and the mean weighted by
    /// itself is greater.
    #[test]
    fn facts_of_a_ball_are_those_of_the_formulas() {
        let known = Look::of(&ball(1e4, [111.5, 111.5], 90.0)).statistics.cells;
        let look = Look::of(&ball(2e4, [111.5, 111.5], 20.0));
        let facts = Facts::of_sed(&look, 2e4, 1e6, known);
        let radius = 20.0f32;
        let volume = 2.0 / 3.0 * std::f32::consts::PI * radius * radius;
        let squares = 0.5 * std::f32::consts::PI * radius * radius;
        for (fact, due) in [
            (Fact::Peak, 0.02f32.ln()),
            (Fact::Load, (0.02 * volume).ln()),
            // p0 / (sum p^2 / sum p)
            (Fact::Concentration, (volume / squares).ln()),
            (Fact::Energy, (1.0 / (0.02 * 0.02 * squares)).ln()),
            (Fact::Tip, 0.0),
            (Fact::Side, 0.0),
            (Fact::Heel, 0.0),
            (Fact::Strange, 0.0),
        ] {
            let found = facts.get(fact);
            assert!((found - due).abs() < 0.02, "{fact:?}: {found}, {due} is due");
        }
        assert!(facts.get(Fact::Inside) >= 5.0);
    }

    #[test]
    fn places_far_out_are_told_by_the_map_and_by_the_frame_alike() {
        for (row, column, tip, heel, side) in [
            (31.5, 111.5, 1.0, 0.0, 0.0),
            (191.5, 111.5, 0.0, 1.0, 0.0),
            (111.5, 51.5, 0.0, 0.0, 1.0),
        ] {
            let look = Look::of(&ball(1e4, [column, row], 10.0));
            let map = Facts::of_sed(&look, 1e4, 1.0, PressedCells::default());
            let mm = [(row - 111.5) * 0.1375 + MIDDLE_MM, (column - 111.5) * 0.1375, -6.0];
            let frame = Facts::of_force(0.1, mm);
            for (fact, due) in [(Fact::Tip, tip), (Fact::Heel, heel), (Fact::Side, side)] {
                assert!((map.get(fact) - due).abs() < 0.01, "{fact:?} {}", map.get(fact));
                assert!((frame.get(fact) - due).abs() < 0.01, "{fact:?} {}", frame.get(fact));
            }
        }
    }

    #[test]
    fn only_a_place_beyond_the_calibration_makes_an_answer_unfamiliar() {
        let term = |fact, most| Term { fact, least: -0.1, most, median: 0.0, bound: 0.0 };
        let terms = vec![term(Fact::Load, 1.0), term(Fact::Heel, 0.2), term(Fact::Side, 0.1)];
        let law = Law { median: -2.0, bound: 0.1, terms };
        let known = Look::of(&ball(1e4, [111.5, 111.5], 90.0)).statistics.cells;
        let at = |peak_pa: f32, place| {
            let look = Look::of(&ball(peak_pa, place, 10.0));
            law.is_beyond_place(&Facts::of_sed(&look, peak_pa, 1e5, known))
        };
        // 1.2 times 40 px towards the hand are within the calibration, and so are .6 times to a side.
        for (place, due) in [
            ([111.5, 111.5], false),
            ([111.5, 158.0], false),
            ([111.5, 161.0], true),
            ([135.0, 111.5], false),
            ([138.0, 111.5], true),
            ([85.0, 111.5], true),
            // Nothing is calibrated towards the tip.
            ([111.5, 30.0], false),
        ] {
            // However light or hard the touch is.
            for peak_pa in [200.0, 2e4, 2e6] {
                assert_eq!(at(peak_pa, place), due, "{peak_pa} Pa at {place:?}");
            }
        }
        assert!(!law.is_beyond_place(&Facts::default()), "a place that is not known is no reason");
    }

    #[test]
    fn what_was_not_calibrated_has_no_law() {
        let term = |fact| Term { fact, least: -10.0, most: 10.0, median: 0.0, bound: 0.0 };
        let law = Law { median: -2.0, bound: 0.0, terms: vec![term(Fact::Load)] };
        let method = ContactMethod::Pixels;
        let by = || vec![MethodLaw { method, law: law.clone() }];
        let laws = ErrorLaws {
            format: MODEL_FORMAT,
            atlas_hash: "a".into(),
            contact_sha256: "c".into(),
            networks: vec![NetworkLaws {
                name: "small".into(),
                onnx_sha256: "n".into(),
                given: law.clone(),
                contact: by(),
            }],
            force: by(),
        };
        let read = ErrorLaws::from_json(&serde_json::to_string(&laws).unwrap()).unwrap();
        assert_eq!(read, laws);
        assert!(laws.sed("n", Way::Given).is_some() && laws.force(Way::Given).is_none());
        assert!(laws.sed("n", Way::Contact(method, "c")).is_some());
        assert!(laws.force(Way::Contact(method, "c")).is_some());
        for (network, way) in [
            ("other", Way::Given),
            ("n", Way::Contact(method, "other")),
            ("n", Way::Contact(ContactMethod::Springs, "c")),
        ] {
            assert!(laws.sed(network, way).is_none(), "{network} {way:?}");
        }
        // A bound is above its median, whatever has been fitted.
        let mut facts = Facts::default();
        facts.set(Fact::Load, 1.0);
        let found = law.at(&facts);
        assert!(found.p90 > 1.05 * found.median);
        let newer = serde_json::to_string(&ErrorLaws { format: 9, ..laws }).unwrap();
        assert!(matches!(
            ErrorLaws::from_json(&newer),
            Err(EngineError::UnsupportedFormat { file: "errors.json", found: 9 })
        ));
    }
}
