//! Wedges sharper than anything on the mesh.

use super::lab::{press, scene};
use super::{Line, Suite};
use crate::press::setup::Setup;
use crate::solve::Options;
use crate::verify::{CaseError, Check};

/// What a wedge may end with that is sharper than its mesh can follow: the depth that was not
/// reached, and why.
const REFUSAL: [&str; 2] = ["at depth ", "no equilibrium beyond load fraction"];

/// Half the plane section under a wedge on its axis.
fn section(density: &str, tip_mm: f64, depth_mm: f64) -> String {
    format!(
        "effects = [\"plane_strain\", \"finite_strain\", \"layers\"]
        [geometry]
        kind = \"section\"
        density = \"{density}\"
        order = \"quadratic\"
        [indenter]
        shape = \"wedge\"
        tip_width_mm = {tip_mm:?}
        base_width_mm = 1.0
        height_mm = 2.0
        tip_radius_mm = {:?}
        [motion]
        depth_mm = {depth_mm:?}
        increments = 5",
        0.4 * tip_mm
    )
}

/// A block under a wedge along its middle row of nodes, or half an element beside it.
fn block(tip_mm: f64, aside_mm: f64) -> String {
    format!(
        "[geometry]
        kind = \"block\"
        size_mm = [8.0, 8.0]
        elements = [16, 4]
        layers = [{{ tissue = \"dermis\", thickness_mm = 3.0, elements = 4 }}]
        [indenter]
        shape = \"wedge\"
        tip_width_mm = {tip_mm:?}
        base_width_mm = 1.0
        height_mm = 2.0
        tip_radius_mm = {:?}
        [motion]
        depth_mm = 0.6
        increments = 4
        offset_mm = [{aside_mm:?}, 0.0]",
        0.4 * tip_mm
    )
}

pub(super) fn run(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    let density = if suite.long { "medium" } else { "coarse" };
    for tip in [0.05, 0.005] {
        let variant = format!("section, {density}, tip {tip} mm");
        lines.push(match press(&scene(&section(density, tip, 1.0))?, Options::default()) {
            Ok(pressed) => {
                let source = "a tip of .1 mm: both act on less than an element";
                let blunt = press(&scene(&section(density, 0.1, 1.0))?, Options::default());
                let force = blunt.map(|b| {
                    Check::relative("force", pressed.force_n(), b.force_n(), 0.15, source)
                });
                // The blunter wedge is a case of its own: it may be refused.
                pressed.line(variant, force.into_iter().collect())
            }
            refused => Line::refused(variant, refused.map(drop), &REFUSAL),
        });
        let variant = format!("block, on a row of nodes, tip {tip} mm");
        lines.push(match press(&scene(&block(tip, 0.0))?, Options::default()) {
            Ok(pressed) => {
                let side = pressed.record.force_n[0] / pressed.force_n();
                let side = Check::vanishes("sideways force / force", side, 1e-4, "symmetry");
                pressed.line(variant, vec![side])
            }
            refused => Line::refused(variant, refused.map(drop), &REFUSAL),
        });
        let between = Setup::new(&scene(&block(tip, 0.25))?).map(drop);
        let words = &["between the nodes", "finer mesh"];
        lines.push(Line::refused(format!("block, between nodes, tip {tip} mm"), between, words));
    }
    Ok(lines)
}
