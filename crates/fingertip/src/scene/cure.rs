//! What errors of scenes and of fingers' files say alike: the cure, and the field to blame.

use super::materials::TissueError;
use super::origin::{Origin, Place};
use crate::materials::MaterialError;

/// What a parser's error says of the file at `origin`, with the cure, and the place to blame if there
/// is one; `page` tells of the fields.
pub(super) fn parsed(
    origin: &Origin,
    error: &toml::de::Error,
    page: &str,
) -> (String, Option<Place>) {
    let said = error.message();
    let cure = cure(said, page);
    match origin.blamed(error.span(), said) {
        Some((field, place)) => {
            let colon = if field.is_empty() { "" } else { ": " };
            (format!("{field}{colon}{said}{cure}"), Some(place))
        }
        None => (format!("{said}{cure}"), None),
    }
}

/// What to do about a parser's message, where it does not say so itself.
fn cure(message: &str, page: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    if let (Some(missing), true) = (quoted.first(), message.starts_with("missing field")) {
        return format!(": add it ({page} has `{missing}` with its unit)");
    }
    if message.starts_with("unknown field") {
        let meant =
            |known: &&&str| known.strip_prefix(quoted[0]).is_some_and(|r| r.starts_with('_'));
        if let Some(meant) = quoted.iter().skip(1).find(meant) {
            return format!("; did you mean `{meant}`? Units stand in the names of fields");
        }
    }
    if message.starts_with("unknown field") || message.starts_with("unknown variant") {
        let near = papilla_json::nearest(quoted[0], quoted.iter().skip(1).copied());
        return near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    }
    if message.starts_with("invalid type: string") && message.ends_with("expected f64") {
        return ": write a bare number, its unit stands in the name of the field".into();
    }
    String::new()
}

/// The field that a material's error is about.
pub(crate) fn material_field(error: &TissueError) -> String {
    let (tissue, source) = match error {
        TissueError::Material { tissue, source } => (tissue, source),
        TissueError::Tension(_) => return "materials.skin_tension_n_per_mm".into(),
    };
    let field = match source {
        MaterialError::YoungsModulus(_) | MaterialError::Units { .. } => ".youngs_modulus_mpa",
        MaterialError::PoissonsRatio(_) => ".poissons_ratio",
        MaterialError::OgdenTerms { .. }
        | MaterialError::OgdenUnstable(_)
        | MaterialError::OgdenUnits(_) => ".ogden.mu_mpa",
        MaterialError::OgdenExponent(_) => ".ogden.alpha",
        MaterialError::Calibrated(..) => ".ogden.calibrated_stretch",
        MaterialError::PronyTerms { .. } | MaterialError::PronyShare(_) => ".prony.share",
        MaterialError::PronyTime(_) => ".prony.time_s",
        MaterialError::Biphasic(e) => {
            return format!("materials.{tissue}.biphasic.{}", e.field());
        }
    };
    format!("materials.{tissue}{field}")
}
