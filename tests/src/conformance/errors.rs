//! How wrong an answer is likely to be, by the laws beside the models (docs/reference/models.md).

use std::path::Path;

use papilla_engine::error_law::{ErrorLaws, Facts, Way};
use papilla_proto::{LikelyError, Look, contact::ContactMethod, map::PeakAndSum};
use serde_json::{Value, json};

use super::{ConformanceError, Tier, contact::Pressed, pair, read};

/// What a stated error may be off, relative, where the client sent the pressure.
const GIVEN_TOLERANCE: f64 = 2e-3;
/// The same where contact found it. Medians and bounds are further apart.
const CONTACT_TOLERANCE: f64 = 1e-2;

/// The laws of a folder of models.
pub(super) struct Errors(ErrorLaws);

impl Errors {
    /// # Errors
    /// The folder has no laws, or none of this format.
    pub(super) fn read(folder: &Path) -> Result<Self, ConformanceError> {
        let text = String::from_utf8_lossy(&read(folder.join("errors.json"))?).into_owned();
        Ok(Self(ErrorLaws::from_json(&text)?))
    }

    /// The four numbers for a map that a client sent.
    pub(super) fn of_map(&self, tier: &mut Tier, map_pa: &[f32]) -> Result<Value, String> {
        let sed = self.sed(tier, Way::Given, map_pa)?;
        Ok(four(sed, LikelyError::UNKNOWN, GIVEN_TOLERANCE))
    }

    /// The four numbers for what contact on pixels found, with a contact model of this hash.
    pub(super) fn of_contact(
        &self,
        tier: &mut Tier,
        model_sha256: &str,
        found: &Pressed<'_>,
    ) -> Result<Value, String> {
        let way = Way::Contact(ContactMethod::Pixels, model_sha256);
        let sed = self.sed(tier, way, found.map_pa)?;
        let facts = Facts::of_force(found.force_n as f32, found.centre_mm.map(|at| at as f32));
        let force = self.0.force(way).map_or(LikelyError::UNKNOWN, |law| law.at(&facts));
        Ok(four(sed, force, CONTACT_TOLERANCE))
    }

    fn sed(&self, tier: &mut Tier, way: Way<'_>, map_pa: &[f32]) -> Result<LikelyError, String> {
        let law = self.0.sed(&tier.onnx_sha256, way);
        let (Some(law), Some(trained)) = (law, tier.pressed) else {
            return Ok(LikelyError::UNKNOWN);
        };
        let sum = PeakAndSum::of(&tier.render(map_pa)?).sum;
        let peak_pa = map_pa.iter().copied().fold(0.0, f32::max);
        Ok(law.at(&Facts::of_sed(&Look::of(map_pa), peak_pa, sum, trained)))
    }
}

/// What an answer says of which nothing is known.
pub(super) fn not_stated() -> Value {
    json!([null, null, null, null])
}

/// As the file has them; what is not stated is infinite, which JSON has no number for.
fn four(sed: LikelyError, force: LikelyError, tolerance: f64) -> Value {
    let of = |number: f32| match number.is_finite() {
        true => pair((&f64::from(number), (tolerance, 0.0))),
        false => Value::Null,
    };
    [sed.median, sed.p90, force.median, force.p90].map(of).into_iter().collect()
}
