//! Edges and wedges sharper than the mesh.

use super::lab::{press, press_body, scene, solve, tight};
use super::{Line, Suite};
use crate::verify::{CaseError, Check};
use papilla_fem::solve::{Loading, Options, Problem};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::{Body, SimulationError};

/// What a wedge may end with that is sharper than its mesh can follow: what was not reached or
/// what happened there, and what to do.
const REFUSALS: [[&str; 3]; 2] = [
    ["at depth ", "no equilibrium beyond load fraction", "refine the mesh or round the indenter"],
    ["at depth ", "slipped off an edge of the indenter", "Take a finer mesh, or rounder edges"],
];

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
fn block(tip_mm: f64, aside_mm: f64, depth_mm: f64) -> String {
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
        depth_mm = {depth_mm:?}
        increments = 4
        offset_mm = [{aside_mm:?}, 0.0]",
        0.4 * tip_mm
    )
}

/// A block under the edge of a ruler 2 mm thick that lies across its faces.
fn ruler(elements: [u32; 2]) -> String {
    let [across, through] = elements;
    format!(
        "[geometry]
        kind = \"block\"
        size_mm = [8.0, 8.0]
        elements = [{across}, {across}]
        layers = [{{ tissue = \"dermis\", thickness_mm = 3.0, elements = {through} }}]
        [indenter]
        shape = \"plate\"
        size_mm = [2.0, 5.0]
        edge_radius_mm = 0.9
        [motion]
        depth_mm = 1.2
        increments = 3
        pitch_deg = 10.0
        roll_deg = 5.0
        yaw_deg = 35.0"
    )
}

/// On faces 1 mm wide contact is within them from the start, on those of 0.73 mm after rows of
/// nodes have slipped off the edge. Coarse faces are stiff under an edge; slipped nodes would part
/// with energy.
fn across_faces() -> Result<Vec<Line>, CaseError> {
    let pressed = |elements| -> Result<_, CaseError> {
        Ok(press(&scene(&ruler(elements))?, Options::default())?)
    };
    let fine = pressed([20, 8])?;
    let source = "faces of 0.4 mm, contact at nodes";
    let mut lines = Vec::new();
    for (elements, width_mm) in [([8, 3], "1"), ([11, 4], "0.73")] {
        let wide = pressed(elements)?;
        let force = Check::relative("force", wide.force_n(), fine.force_n(), 0.35, source);
        lines
            .push(wide.line(format!("block, edge of 2 mm on faces of {width_mm} mm"), vec![force]));
    }
    Ok(lines)
}

/// The row of nodes under the middle of [`block`], led down as far as a wedge presses it: all that
/// so sharp a wedge can do. Its energy, mJ.
fn row_led_down(body: &Body, depth_mm: f64) -> Result<f64, CaseError> {
    let problem = &body.problem;
    let (mesh, mut fixed) = (problem.mesh.clone(), problem.fixed.clone());
    let along_x = || mesh.nodes.iter().map(|p| p[0]);
    let middle = 0.5 * (along_x().fold(f64::MAX, f64::min) + along_x().fold(f64::MIN, f64::max));
    let is_led = |p: &[f64; 3]| p[2].abs() < 1e-9 && (p[0] - middle).abs() < 1e-9;
    let row: Vec<_> = (0..mesh.nodes.len()).filter(|&n| is_led(&mesh.nodes[n])).collect();
    row.iter().for_each(|n| fixed[3 * n + 2] = true);
    let led = Problem::new(mesh, problem.materials.clone(), fixed, None)?;
    let prescribed_mm = row.iter().map(|n| (3 * n + 2, depth_mm)).collect();
    let loading = Loading { prescribed_mm, ..Loading::default() };
    Ok(solve(&led, loading, tight(), 4)?.1.stored_mj)
}

/// A wedge on the block's middle row, or a little beside it: the row led down, or refused.
fn on_a_row(variant: &str, text: &str) -> Result<Line, CaseError> {
    let Simulation { body, approach, drive, .. } = Simulation::new(&scene(text)?)?;
    Ok(match press_body(&body, &approach, &drive, tight()) {
        Ok(pressed) => {
            let due_mj = row_led_down(&body, pressed.record.depth_mm)?;
            let side = pressed.record.force_n[0] / pressed.force_n();
            let found = pressed.report.stored_mj;
            pressed.line(
                variant,
                vec![
                    Check::vanishes("sideways force / force", side, 1e-4, "symmetry"),
                    Check::relative("energy", found, due_mj, 1e-4, "the row of nodes led down"),
                ],
            )
        }
        refused => refusal(variant, refused.map(drop)),
    })
}

/// Refused in one of the ways a sharp wedge may be.
fn refusal(variant: &str, refused: Result<(), SimulationError>) -> Line {
    let text = refused.as_ref().map_or_else(ToString::to_string, |()| String::new());
    let words = REFUSALS.iter().find(|r| text.contains(r[1])).unwrap_or(&REFUSALS[0]);
    Line::refused(variant, refused, words)
}

pub(super) fn run(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = if suite.quick() { Vec::new() } else { across_faces()? };
    let density = if suite.long() { "medium" } else { "coarse" };
    let tips = if suite.quick() { &[0.005][..] } else { &[0.05, 0.005] };
    for &tip in tips {
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
            refused => refusal(&variant, refused.map(drop)),
        });
        for (place, aside_mm, depth_mm) in [
            ("on a row of nodes", 0.0, 0.6),
            ("on a row of nodes, shallow", 0.0, 0.02),
            ("just beside a row", 0.04, 0.6),
        ] {
            let variant = format!("block, {place}, tip {tip} mm");
            lines.push(on_a_row(&variant, &block(tip, aside_mm, depth_mm))?);
        }
        let between = Simulation::new(&scene(&block(tip, 0.25, 0.6))?).map(drop);
        let words = &["between the nodes", "finer mesh"];
        lines.push(Line::refused(format!("block, between nodes, tip {tip} mm"), between, words));
    }
    Ok(lines)
}
