//! The replay: a few states of FE simulations that are shipped with the models, so that a visitor
//! of the page sees the error of the networks.

use papilla_proto::json;
use serde::Deserialize;
use serde_json::Value;

/// One state: how an indenter pressed, and what the FE solver found.
#[derive(Debug, Deserialize)]
pub(crate) struct State {
    /// Name that the page shows.
    pub(crate) name: String,
    /// Angles of the indenter, as the dataset's manifest has them.
    #[serde(default)]
    pub(crate) pose: Value,
    /// Indentation depth, mm.
    pub(crate) depth_mm: f32,
    /// Pressure at each pixel of the skin, in the order of the raster's indices, Pa.
    pub(crate) pressure_pa: Vec<f32>,
    /// FE strain energy density at each pixel of the interface likewise, J/m3.
    pub(crate) sed_j_per_m3: Vec<f32>,
}

/// `models/replay.json`.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct Replay {
    /// Hash of the atlas that the states are drawn on; files that were written by hand may lack it.
    #[serde(default)]
    atlas_hash: Option<String>,
    #[serde(rename = "presses")]
    pub(crate) states: Vec<State>,
}

impl Replay {
    /// Reads and checks the file. `pixels` are the numbers of pixels of skin and of interface on
    /// the atlas with the hash `atlas_hash`.
    ///
    /// # Errors
    /// The JSON is not of the expected form, a value is negative or not finite, or the states are of
    /// another atlas or do not fit this one.
    pub(crate) fn parse(text: &[u8], pixels: [usize; 2], atlas_hash: &str) -> Result<Self, String> {
        let replay: Self = json::read(text).map_err(|e| e.to_string())?;
        if let Some(other) = replay.atlas_hash.as_ref().filter(|hash| *hash != atlas_hash) {
            return Err(format!(
                "its presses are of the atlas {other}, and atlas.json is {atlas_hash}: make it anew \
                 with `fe-datagen dataset replay`, or take it away"
            ));
        }
        for (index, state) in replay.states.iter().enumerate() {
            for (what, values, due) in [
                ("pressure_pa", &state.pressure_pa, pixels[0]),
                ("sed_j_per_m3", &state.sed_j_per_m3, pixels[1]),
            ] {
                let found = values.len();
                if found != due {
                    return Err(format!(
                        "press {index} has {found} values of {what}, the atlas {due} pixels"
                    ));
                }
                if !values.iter().all(|v| v.is_finite() && *v >= 0.0) {
                    return Err(format!(
                        "press {index} has a {what} that is negative or not finite"
                    ));
                }
            }
        }
        Ok(replay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(pressure: &str, sed: &str) -> Result<Replay, String> {
        let json = format!(
            r#"{{"presses": [{{"name": "flat", "pose": {{"pitch_deg": 0}}, "depth_mm": 1,
                "pressure_pa": {pressure}, "sed_j_per_m3": {sed}}}]}}"#
        );
        Replay::parse(json.as_bytes(), [2, 2], "own")
    }

    #[test]
    fn a_state_must_fit_the_atlas() {
        assert_eq!(parse("[1, 2]", "[0, 3]").unwrap().states.len(), 1);
        assert!(parse("[1]", "[0, 3]").unwrap_err().contains("pressure_pa"));
        assert!(parse("[1, 2]", "[0, 3, 4]").unwrap_err().contains("sed_j_per_m3"));
        assert!(parse("[1, -2]", "[0, 3]").unwrap_err().contains("negative"));
        assert!(parse("[1, 1e39]", "[0, 3]").is_err());
        assert!(Replay::parse(b"{", [2, 2], "own").is_err());
        let of = |hash: &str| {
            let text = format!(r#"{{"atlas_hash": "{hash}", "presses": []}}"#);
            Replay::parse(text.as_bytes(), [2, 2], "own")
        };
        assert!(of("own").unwrap().states.is_empty());
        assert!(of("other").unwrap_err().contains("atlas other"));
    }
}
