//! Thin layers, elastic bone, and bodies that nothing holds.

use super::lab::{press, scene, tight};
use super::{Hardness, Line, Suite};
use crate::verify::bodies::uniform;
use crate::verify::{CaseError, Check};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::lattice::cube;
use papilla_fem::mesh::supports::hold;
use papilla_fem::mesh::{Block, Mesh};
use papilla_fem::solve::{Options, Problem, Solver};
use papilla_fingertip::simulation::body::Body;

/// A block with an epidermis of .02 mm, `cells` elements of 1 mm across.
fn coated(order: &str) -> String {
    format!(
        "[geometry]
        kind = \"block\"
        order = \"{order}\"
        size_mm = [10.0, 10.0]
        elements = [10, 10]
        layers = [
          {{ tissue = \"epidermis\", thickness_mm = 0.02, elements = 1 }},
          {{ tissue = \"dermis\", thickness_mm = 1.0, elements = 2 }},
          {{ tissue = \"subcutaneous\", thickness_mm = 3.0, elements = 2 }},
        ]
        [indenter]
        shape = \"sphere\"
        radius_mm = 12.0
        [motion]
        depth_mm = 1.0
        increments = 2"
    )
}

pub(super) fn thin_layer(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let [linear, quadratic] = ["linear", "quadratic"].map(|order| -> Result<_, CaseError> {
        Ok(press(&scene(&coated(order))?, Options::default())?)
    });
    let (linear, quadratic) = (linear?, quadratic?);
    let source = "Hex27 of the same size";
    let force = Check::relative("force", linear.force_n(), quadratic.force_n(), 0.04, source);
    let lines =
        vec![linear.line("50:1, Hex8", vec![force]), quadratic.line("50:1, Hex27", Vec::new())];
    Ok(lines)
}

/// Fat on 2 mm of bone that is `ratio` times as stiff; on a rigid one without.
fn on_bone(ratio: Option<f64>) -> String {
    let fat_mpa = 0.034;
    let bone = ratio.map_or("", |_| "{ tissue = \"bone\", thickness_mm = 2.0, elements = 2 },");
    let e = fat_mpa * ratio.unwrap_or(1e6);
    format!(
        "[geometry]
        kind = \"block\"
        size_mm = [8.0, 8.0]
        elements = [8, 8]
        layers = [{{ tissue = \"subcutaneous\", thickness_mm = 3.0, elements = 3 }}, {bone}]
        [materials.bone]
        youngs_modulus_mpa = {e:?}
        poissons_ratio = 0.3
        [indenter]
        shape = \"sphere\"
        radius_mm = 10.0
        [motion]
        depth_mm = 1.0
        increments = 2"
    )
}

pub(super) fn elastic_bone(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let rigid = press(&scene(&on_bone(None))?, tight())?.force_n();
    let (mut lines, mut first) = (Vec::new(), None);
    for ratio in [5e5, 1e6, 5e6] {
        let pressed = press(&scene(&on_bone(Some(ratio)))?, tight())?;
        let missing = 1.0 - pressed.force_n() / rigid;
        let scaled = missing * ratio;
        let first = *first.get_or_insert(scaled);
        let checks = vec![
            Check::within(
                "share of force missing to a rigid bone's",
                missing,
                [0.0, 1e-4],
                "what gives way carries less",
            ),
            Check::relative(
                "missing x stiffness ratio",
                scaled,
                first,
                0.05,
                "deflection goes with 1 / E",
            ),
        ];
        lines.push(pressed.line(format!("E bone / E fat = {ratio:.0e}"), checks));
    }
    Ok(lines)
}

/// Two cubes that do not know of each other: apart, or touching with doubled nodes.
fn two_cubes(apart_mm: f64) -> Mesh {
    let mut mesh = cube(ElementKind::Hex8, 2, |p| p);
    let other = cube(ElementKind::Hex8, 2, |[x, y, z]| [x, y, z + 1.0 + apart_mm]);
    let offset = mesh.nodes.len() as u32;
    mesh.nodes.extend(&other.nodes);
    for Block { kind, connectivity, region } in other.blocks {
        let connectivity = connectivity.into_iter().map(|n| n + offset).collect();
        mesh.blocks.push(Block { kind, connectivity, region });
    }
    mesh
}

pub(super) fn free_modes(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let refused = |variant: &str, mesh: Mesh, fixed: Vec<bool>, words: &[&str]| {
        let problem = Problem::new(mesh, uniform(0.1, 0.45)?, fixed, None)?;
        let solver = Solver::new(&problem, Options::default()).map(drop);
        Ok::<_, CaseError>(Line::refused(variant, solver, words))
    };
    let mut lines = Vec::new();
    let [x, y, z] = [[true, false, false], [false, true, false], [false, false, true]];
    for (variant, sets, words) in [
        (
            "nothing held",
            vec![],
            &["the body can move freely", "moving along x", "turning about z"][..],
        ),
        ("on ice", vec![("z_min", z)], &["moving along x", "moving along y", "turning about z"]),
        (
            "two symmetry planes",
            vec![("x_min", x), ("y_min", y)],
            &["keeps it from moving along z"],
        ),
    ] {
        for kind in [ElementKind::Hex8, ElementKind::Tet10] {
            let mesh = cube(kind, 2, |p| p);
            let fixed = hold(&mesh, &sets);
            lines.push(refused(&format!("{variant}, {kind:?}"), mesh, fixed, words)?);
        }
    }
    let mesh = cube(ElementKind::Quad4, 2, |p| p);
    let fixed = hold(&mesh, &[("x_min", x)]);
    lines.push(refused("section held along x", mesh, fixed, &["keeps it from moving along y. "])?);
    let mesh = two_cubes(0.5);
    let mut fixed = vec![false; 3 * mesh.nodes.len()];
    for n in (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n][2] == 0.0) {
        fixed[3 * n..3 * n + 3].fill(true);
    }
    let words = &["a part of 8 of the 16 elements", "connected to nothing else"];
    lines.push(refused("two parts, one held", mesh, fixed.clone(), words)?);
    let words = &["9 of its nodes lie on nodes of another part", "Coherence Mesh"];
    lines.push(refused("doubled nodes", two_cubes(0.0), fixed, words)?);
    lines.extend(held()?);
    Ok(lines)
}

/// What is held well enough, if barely, is solved.
fn held() -> Result<Vec<Line>, CaseError> {
    let mesh = cube(ElementKind::Hex8, 2, |p| p);
    let body = Body::from_mesh(mesh, uniform(0.1, 0.45)?, &[], "z_max");
    let refused = body.and_then(|b| b.solver(Options::default()).map(drop));
    let mut lines =
        vec![Line::refused("a scene that holds nothing", refused, &["can move freely"])];
    // Three planes of symmetry: the least that holds.
    let mesh = cube(ElementKind::Hex8, 2, |p| p);
    let [x, y, z] = [[true, false, false], [false, true, false], [false, false, true]];
    let fixed = hold(&mesh, &[("x_min", x), ("y_min", y), ("z_min", z)]);
    let top = mesh.node_sets["z_max"].clone();
    let problem = Problem::new(mesh, uniform(0.1, 0.45)?, fixed, None)?;
    let mut loading = papilla_fem::solve::Loading {
        dead_n: vec![[0.0; 3]; problem.mesh.nodes.len()],
        ..Default::default()
    };
    for &n in &top {
        loading.dead_n[n as usize][2] = 1e-9;
    }
    let (solver, report) = super::lab::solve(&problem, loading, tight(), 1)?;
    let support: f64 = solver.balance().support_force_n[2];
    let due = -1e-9 * top.len() as f64;
    let balance = Check::relative("support force", support, due, 1e-6, "equilibrium");
    lines.push(Line::converged("three symmetry planes", Hardness::from(&report), vec![balance]));
    Ok(lines)
}
