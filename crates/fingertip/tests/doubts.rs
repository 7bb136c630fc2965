//! What a scene is asked about, and what its states are worth.

use papilla_atlas::MAP_LEN;
use papilla_fem::solve::Options;
use papilla_fingertip::run::{Explanation, Increment, doubts, press};
use papilla_fingertip::scene::Scene;
use papilla_fingertip::simulation::Simulation;
use std::path::Path;
use std::sync::Arc;

/// A coarse finger with even cells, whose nodes are some 1.4 mm apart.
const FINGER: &str = "effects = [\"layers\"]\n[geometry]\nkind = \"fingertip\"\n\
    density = \"coarse\"\norder = \"linear\"\n";

fn ball(radius_mm: f64, motion: &str) -> String {
    format!(
        "{FINGER}[indenter]\nshape = \"sphere\"\nradius_mm = {radius_mm:?}\n[motion]\n{motion}\n"
    )
}

/// A block with nodes 1.5 mm apart, one of them under the middle of the ball.
fn block(radius_mm: f64, depth_mm: f64) -> String {
    format!(
        "contact = \"nodes\"\n[geometry]\nkind = \"block\"\nsize_mm = [12.0, 12.0]\n\
         elements = [8, 8]\nlayers = [{{ tissue = \"dermis\", thickness_mm = 2.0, elements = 2 }}]\n\
         [indenter]\nshape = \"sphere\"\nradius_mm = {radius_mm:?}\n\
         [motion]\ndepth_mm = {depth_mm:?}\n"
    )
}

fn read(text: &str, map_pa: Option<Vec<f32>>) -> Result<Scene, String> {
    let map_pa = map_pa.map(Arc::new);
    Scene::parse_under(Path::new("scene.toml"), text.into(), map_pa).map_err(|e| e.to_string())
}

fn set_up(text: &str) -> Result<(Scene, Simulation), String> {
    let scene = read(text, None)?;
    let setup = Simulation::new(&scene).map_err(|e| e.to_string())?;
    Ok((scene, setup))
}

/// The last state of a scene.
fn solved(text: &str) -> Result<Increment, String> {
    let (_, setup) = set_up(text)?;
    let mut solver = setup.body.solver(Options::default()).map_err(|e| e.to_string())?;
    let (states, solved) = press(&setup, &mut solver, &mut |_, _, _| {});
    solved.map_err(|e| e.to_string())?;
    states.last().map(|state| Increment::of(state, None)).ok_or_else(|| "no state".into())
}

#[test]
fn a_contact_that_rests_on_few_nodes_is_a_fault() {
    // Whatever its radius, it pushes one node: the force is the same.
    let [one, other] = [0.8, 1.2].map(|radius_mm| solved(&block(radius_mm, 0.1)).unwrap());
    let ratio = one.force_n[2] / other.force_n[2];
    assert!(one.force_n[2] > 0.0 && (ratio - 1.0).abs() < 1e-3, "{ratio}");
    for state in [one, other] {
        let fault = state.fault.unwrap_or_default();
        assert!(fault.contains("rests on 1 node of the skin"), "{fault}");
    }
    let wide = solved(&block(30.0, 0.3)).unwrap();
    assert_eq!(wide.fault, None);
}

#[test]
fn a_depth_without_force_is_a_fault() {
    let state = solved(&ball(0.005, "depth_mm = 0.4")).unwrap();
    assert!(state.force_n.iter().all(|f| f.abs() < 1e-12), "{:?}", state.force_n);
    let fault = state.fault.unwrap_or_default();
    assert!(fault.contains("no force at a depth of 0.4 mm"), "{fault}");
}

#[test]
fn a_ball_between_nodes_is_not_the_offsets_fault() {
    let refused = |radius_mm, offset: &str| {
        let text = ball(radius_mm, &format!("depth_mm = 0.4\noffset_mm = {offset}"));
        set_up(&text).map(drop).unwrap_err()
    };
    let between = refused(0.5, "[0.8, 0.8]");
    assert!(between.contains("1.000 mm wide") && !between.contains("offset"), "{between}");
    for radius_mm in [0.5, 5.0] {
        let by = refused(radius_mm, "[0.0, 100.0]");
        assert!(by.contains("never meets the body"), "{by}");
    }
}

#[test]
fn bone_ends_the_way() {
    let far = |depth_mm: f64| set_up(&ball(5.0, &format!("depth_mm = {depth_mm:?}")));
    let refused = far(40.0).map(drop).unwrap_err();
    assert!(refused.contains("motion.depth_mm = 40") && refused.contains("bone"), "{refused}");
    let (scene, setup) = far(1.0).unwrap();
    let indenter = setup.body.indenter(&setup.approach, &setup.drive).unwrap();
    // From the pad to the bone of the default finger.
    let room_mm = setup.body.room_mm(&indenter).unwrap();
    assert!((3.0..8.0).contains(&room_mm), "{room_mm}");
    assert_eq!(doubts(&scene, &setup).unwrap(), Vec::<String>::new());
    let (scene, setup) = far(0.9 * room_mm).unwrap();
    let asked = doubts(&scene, &setup).unwrap();
    assert!(asked.len() == 1 && asked[0].contains("to the bone"), "{asked:?}");
    let deep = Explanation::of(&scene).unwrap();
    assert!(deep.human().contains("\ndoubt          motion.depth_mm"), "{}", deep.human());
    // An elastic bone gives way.
    let elastic = ball(5.0, "depth_mm = 1.0").replace("\"layers\"", "\"layers\", \"elastic_bone\"");
    let (_, setup) = set_up(&elastic).unwrap();
    let indenter = setup.body.indenter(&setup.approach, &setup.drive).unwrap();
    assert_eq!(setup.body.room_mm(&indenter), None);
}

#[test]
fn an_indenter_narrower_than_nodes_are_apart_is_asked_about() {
    for (radius_mm, asked) in [(0.5, 1), (1.0, 0), (5.0, 0)] {
        let (scene, setup) = set_up(&ball(radius_mm, "depth_mm = 0.4")).unwrap();
        let found = doubts(&scene, &setup).unwrap();
        assert_eq!(found.len(), asked, "{radius_mm}: {found:?}");
    }
}

#[test]
fn a_map_that_cannot_press_is_refused_where_it_is_given() {
    let under = format!("{FINGER}[pressure]\n");
    for (value, words) in [(f32::NAN, "NaN Pa"), (-1.0, "never pulled"), (0.0, "no pressure")] {
        let said = read(&under, Some(vec![value; MAP_LEN])).unwrap_err();
        assert!(said.contains(words) && !said.contains("pressure.file"), "{said}");
    }
    // A corner of the map, which shows no skin.
    let mut map_pa = vec![0.0; MAP_LEN];
    map_pa[..10].fill(8e3);
    let scene = read(&under, Some(map_pa)).unwrap();
    let said = Simulation::new(&scene).map(drop).unwrap_err().to_string();
    assert!(said.contains("none of its pressure is on the skin"), "{said}");
}

#[test]
fn pressure_in_another_unit_is_asked_about_and_has_no_indenter() {
    let under = format!("{FINGER}[pressure]\n");
    for (pa, asked) in [(8.0, 1), (8e3, 0)] {
        let scene = read(&under, Some(vec![pa; MAP_LEN])).unwrap();
        let found = doubts(&scene, &Simulation::new(&scene).unwrap()).unwrap();
        assert_eq!(found.len(), asked, "{found:?}");
        let written = serde_json::to_value(&scene).unwrap();
        assert!(written["indenter"].is_null() && written["pressure"]["increments"] == 1);
    }
    let plain = read(&ball(5.0, "depth_mm = 1.0"), None).unwrap();
    let written = serde_json::to_value(&plain).unwrap();
    assert!(written["indenter"]["radius_mm"] == 5.0 && written["pressure"].is_null());
}
