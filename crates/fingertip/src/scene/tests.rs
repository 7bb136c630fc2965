use super::*;

const FINGER: &str = "[geometry]\nkind = \"fingertip\"\ndensity = \"coarse\"\n[motion]\ndepth_mm = 1.0\nincrements = 4\n";
const BLOCK: &str = "[geometry]\nkind = \"block\"\nsize_mm = [4.0, 4.0]\nelements = [4, 4]\n\
    layers = [\n  { tissue = \"dermis\", thickness_mm = 1.0, elements = 1 },\n\
    \x20 { tissue = \"subcutaneous\", thickness_mm = 2.0, elements = 2 },\n]\n[motion]\ndepth_mm = 0.5\n";

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(Path::new("bad.toml"), text.into())
}

#[test]
fn a_minimal_scene_takes_the_defaults() {
    let scene = parse(FINGER).unwrap();
    assert_eq!(scene.effects, effects::usual());
    assert_eq!(scene.materials, TissueTable::default());
    assert_eq!(scene.indenter, IndenterSpec::default());
    let plan = scene.plan().unwrap();
    assert!(!plan.relaxes && plan.friction == 0.0 && !plan.plane_strain);
}

#[test]
fn a_set_gives_what_no_table_does() {
    let people = MaterialSet::People.table();
    let scene = parse(&format!("{FINGER}[materials]\nset = \"people\"\n")).unwrap();
    assert_eq!(scene.materials, people);
    assert_ne!(people, TissueTable::default());
    let own = "[materials]\nset = \"people\"\n[materials.dermis]\nyoungs_modulus_mpa = 0.1\n\
               poissons_ratio = 0.4\n";
    let scene = parse(&format!("{FINGER}{own}")).unwrap();
    assert_eq!(scene.materials.dermis, crate::materials::MaterialSpec::elastic(0.1, 0.4));
    assert_eq!(scene.materials.subcutaneous, people.subcutaneous);
    // What a program writes has the constants, and is read as the same.
    let written = toml::to_string(&people).unwrap();
    assert!(!written.contains("set"), "{written}");
    assert_eq!(toml::from_str::<TissueTable>(&written).unwrap(), people);
    let unknown = format!("{FINGER}[materials]\nset = \"pigs\"\n");
    assert_refused(&[(unknown, 8, &["pigs", "papers", "people"])]);
}

/// Constants that were fitted with an effect mean another finger without it.
#[test]
fn effects_with_which_tissues_were_fitted_are_taken_or_asked_for() {
    let people = "[materials]\nset = \"people\"\n";
    let names = |scene: &Scene| scene.effects.iter().map(EffectName::as_str).collect::<Vec<_>>();
    let scene = parse(&format!("{FINGER}{people}")).unwrap();
    assert_eq!(names(&scene), ["finite_strain", "layers", "hyperelastic"]);
    assert_eq!(scene.plan().unwrap().law, effects::Law::Ogden);
    // Whoever says that he wants the constants without it gets them.
    let own = "effects = [\"finite_strain\", \"layers\"]\n";
    let scene = parse(&format!("{own}{FINGER}{people}needs = []\n")).unwrap();
    assert_eq!(scene.plan().unwrap().law, effects::Law::NeoHookean);
    let needs = "[materials]\nneeds = [\"hyperelastic\"]\n";
    assert_refused(&[
        (format!("{own}{FINGER}{people}"), 1, &["'hyperelastic' is missing", "`needs`"]),
        (format!("{own}{FINGER}{needs}"), 1, &["'hyperelastic' is missing"]),
        (
            format!("{FINGER}[materials]\nneeds = [\"elastic\"]\n"),
            8,
            &["needs = \"elastic\" is no effect"],
        ),
    ]);
}

#[test]
fn skin_is_slack_unless_a_scene_says_its_tension() {
    let with = |tension: &str| format!("{FINGER}[materials]\nskin_tension_n_per_mm = {tension}\n");
    let scene = parse(&with("0.01")).unwrap();
    assert_eq!(scene.materials.skin_tension_n_per_mm, Some(0.01));
    let written = toml::to_string(&scene.materials).unwrap();
    assert_eq!(toml::from_str::<TissueTable>(&written).unwrap(), scene.materials);
    // None is the same as no word of it, to the bit of what is hashed.
    let none = parse(&with("0.0")).unwrap();
    assert_eq!(none.materials, TissueTable::default());
    assert!(!toml::to_string(&none.materials).unwrap().contains("tension"));
    let field = "materials.skin_tension_n_per_mm";
    let fluid = "[materials.dermis]\nyoungs_modulus_mpa = 0.1\npoissons_ratio = 0.4\nbiphasic = \
                 { permeability_mm4_per_n_s = 1e-3, drained_poissons_ratio = 0.2 }\n";
    let biphasic = with("0.01")
        .replace("depth_mm = 1.0", "path = [{ time_s = 1.0, depth_mm = 1.0 }]")
        .replace("density", "order = \"quadratic\"\ndensity");
    assert_refused(&[
        (with("-0.01"), 8, &[field, "= -0.01", "0 to 1 N/mm"]),
        (with("11.4"), 8, &[field, "= 11.4", "10 N/m"]),
        (with("inf"), 8, &[field, "= inf"]),
        (with("nan"), 8, &[field, "= NaN"]),
        (
            format!("{BLOCK}[materials]\nskin_tension_n_per_mm = 0.01\n"),
            12,
            &[field, "block has no skin"],
        ),
        (format!("effects = [\"biphasic\"]\n{biphasic}{fluid}"), 10, &[field, "\"biphasic\""]),
    ]);
}

/// Every set makes laws, stable at rest, with and without its effects; the neo-Hookean law of a
/// tissue has the modulus that its Ogden law has at rest.
#[test]
fn the_set_people_makes_laws_of_one_modulus_at_rest() {
    let table = MaterialSet::People.table();
    table.validate().unwrap();
    let plan = |law| Plan { law, ..Plan::usual() };
    let [neo, ogden] = [effects::Law::NeoHookean, effects::Law::Ogden]
        .map(|law| crate::simulation::laws::solids(&table, &plan(law)).unwrap());
    for tissue in crate::tissue::Tissue::ALL {
        let [a, b] = [&neo, &ogden].map(|m| m[tissue.region()].shear_modulus_mpa());
        assert!((a / b - 1.0).abs() < 1e-12, "{}: {a} {b}", tissue.name());
    }
}

#[test]
fn outputs_are_what_is_named_or_all_that_the_geometry_has() {
    let of = |text: &str| {
        let scene = parse(text).unwrap();
        Output::ALL.into_iter().filter(|&o| scene.writes(o)).collect::<Vec<_>>()
    };
    assert_eq!(of(FINGER), Output::ALL);
    assert_eq!(of(BLOCK), [Output::Fields]);
    assert_eq!(of(&format!("outputs = [\"maps\"]\n{FINGER}")), [Output::Maps]);
    assert_eq!(of(&format!("outputs = []\n{FINGER}")), []);
    assert_refused(&[
        (format!("outputs = [\"maps\", \"maps\"]\n{FINGER}"), 1, &["outputs[1]", "twice"]),
        (format!("outputs = [\"pictures\"]\n{BLOCK}"), 1, &["outputs[0]", "atlas"]),
        (format!("outputs = [\"movie\"]\n{FINGER}"), 1, &["movie", "fields", "maps", "pictures"]),
    ]);
}

/// Text of a bad scene, the line to blame, words that its message has.
type Bad<'a> = (String, usize, &'a [&'a str]);

fn assert_refused(cases: &[Bad<'_>]) {
    for (text, line, words) in cases {
        let error = parse(text).unwrap_err().to_string();
        let at = format!("bad.toml:{line}:");
        assert!(error.starts_with(&at), "{error}\nshould start with {at} in\n{text}");
        for word in *words {
            assert!(error.contains(word), "{error}\nshould name {word}");
        }
    }
}

#[test]
fn bad_values_name_line_field_and_cure() {
    let finger = |from: &str, to: &str| FINGER.replace(from, to);
    let block = |from: &str, to: &str| BLOCK.replace(from, to);
    let with = |tail: &str| format!("{FINGER}{tail}");
    assert_refused(&[
        (finger("depth_mm = 1.0", "depth_mm = -1.0"), 5, &["motion.depth_mm = -1.0", "above 0"]),
        (finger("depth_mm = 1.0", "depth_mm = 2000.0"), 5, &["at most 100 mm"]),
        (finger("depth_mm = 1.0", ""), 4, &["exactly one of depth_mm"]),
        (finger("increments = 4", "increments = 0"), 6, &["motion.increments"]),
        (
            block("thickness_mm = 2.0", "thickness_mm = -2.0"),
            7,
            &["geometry.layers[1].thickness_mm"],
        ),
        (block("[4.0, 4.0]", "[4.0, 4e6]"), 3, &["geometry.size_mm", "at most 1000 mm"]),
        (
            with("[geometry.shape]\nepidermis_mm = 200.0\n"),
            8,
            &["geometry.shape.epidermis_mm = 200 mm", "at most 100"],
        ),
        (with("[geometry.shape]\ncap_length_mm = 30.0\n"), 8, &["below length_mm"]),
        (with("[geometry.shape]\nnail_mm = [11.0, -12.0]\n"), 8, &["nail_mm[1] = -12"]),
        (
            with("[materials.dermis]\nyoungs_modulus_mpa = 0.08\npoissons_ratio = 0.5\n"),
            9,
            &["materials.dermis: Poisson's ratio 0.5", "0.49"],
        ),
        (
            with("[materials.dermis]\nyoungs_modulus_mpa = 8e4\npoissons_ratio = 0.4\n"),
            8,
            &["was Pa meant"],
        ),
        (
            with("[materials.bone]\nyoungs_modulus_mpa = 1.7e10\npoissons_ratio = 0.3\n"),
            8,
            &["was Pa meant"],
        ),
        (
            with("[[motion.path]]\ntime_s = 0.0\ndepth_mm = 1.0\n")
                .replace("depth_mm = 1.0\nincr", "incr"),
            8,
            &["motion.path[0].depth_mm", "inside the finger", "time_s"],
        ),
    ]);
}

#[test]
fn bad_effects_name_line_and_cure() {
    let with = |effects: &str| format!("effects = {effects}\n{FINGER}");
    assert_refused(&[
        (
            with("[\"layers\",\n  \"sound\"]"),
            2,
            &["effects[1]", "unknown effect 'sound'; there are: finite_strain"],
        ),
        (
            with("[\"layers\",\n  \"frictoin\"]"),
            2,
            &[
                "unknown effect 'frictoin' (was 'friction' meant?); there are: finite_strain",
                "biphasic",
            ],
        ),
        (with("[\"layers\",\n  \"hyperelastic\"]"), 2, &["needs 'finite_strain'"]),
        (with("[\"viscoelastic\"]"), 1, &["motion.path"]),
        (with("[\"plane_strain\"]"), 1, &["section"]),
        (with("[\"friction\"]"), 1, &["friction.coefficient"]),
        (with("[\"layers\", \"layers\"]"), 1, &["effects[1]", "twice"]),
    ]);
}

#[test]
fn what_is_no_scene_names_line_and_cure() {
    let finger = |from: &str, to: &str| FINGER.replace(from, to);
    assert_refused(&[
        (finger("coarse", "huge"), 3, &["geometry.density", "`medium`"]),
        (finger("coarse", "corse"), 3, &["did you mean `coarse`?"]),
        (finger("density", "densty"), 3, &["geometry.densty", "did you mean `density`?"]),
        (finger("fingertip", "foot"), 2, &["geometry.kind", "`block`"]),
        (finger("depth_mm", "depth"), 5, &["motion.depth", "did you mean `depth_mm`"]),
        (finger("density", "dense"), 3, &["geometry.dense", "`density`"]),
        (BLOCK.replace("elements = [4, 4]\n", ""), 1, &["missing field `elements`", "add it"]),
        (finger("= 1.0", "= \"1 mm\""), 5, &["motion.depth_mm", "bare number"]),
        (finger("= 1.0", "= 1.0 mm"), 5, &["expected"]),
        (
            BLOCK.replace("thickness_mm = 2.0", "thickness = 2.0"),
            7,
            &["did you mean `thickness_mm`"],
        ),
        (BLOCK.replace("[4.0, 4.0]", "[4.0]"), 3, &["geometry.size_mm", "length 2"]),
        (
            BLOCK.replace("size_mm = [4.0, 4.0]", "order = \"graded\"\nsize_mm = [4.0, 4.0]"),
            3,
            &["geometry.order", "fingertip"],
        ),
    ]);
    let error = parse("[motion]\ndepth_mm = 1.0\n").unwrap_err().to_string();
    assert!(error.starts_with("bad.toml: missing field `geometry`: add it"), "{error}");
}

#[test]
fn fluid_that_cannot_flow_names_line_field_and_cure() {
    let scene = |spec: &str, skin: &str, order: &str, motion: &str| {
        format!(
            "effects = [\"finite_strain\", \"layers\", \"biphasic\"]\n[geometry]\nkind = \"fingertip\"\n\
             density = \"coarse\"\norder = \"{order}\"\n[biphasic]\nskin = \"{skin}\"\n\
             [materials.dermis]\nyoungs_modulus_mpa = 0.08\npoissons_ratio = 0.48\n{spec}\n\
             [motion]\n{motion}\n"
        )
    };
    let path = "path = [{ time_s = 1.0, depth_mm = 1.0 }]";
    let fluid = |k: &str, nu: &str| {
        format!("biphasic = {{ permeability_mm4_per_n_s = {k}, drained_poissons_ratio = {nu} }}")
    };
    let with = |spec: &str| scene(spec, "sealed", "quadratic", path);
    let wet = fluid("1e-3", "0.2");
    assert_eq!(parse(&with(&wet)).unwrap().plan().unwrap().fluid, Some(SkinFlow::Sealed));
    let k = "materials.dermis.biphasic.permeability_mm4_per_n_s";
    let shut = fluid("0.0", "0.2");
    assert!(parse(&with(&shut)).is_ok(), "undrained");
    assert_refused(&[
        (scene(&shut, "drained", "quadratic", path), 11, &[k, "above 0", "seal the skin"]),
        (with(&fluid("-1e-3", "0.2")), 11, &["dermis", "permeability -0.001", "not be negative"]),
        (with(&fluid("1e-15", "0.2")), 11, &["m4/(N s)", "1e-3 here"]),
        (with(&fluid("1e-3", "0.5")), 11, &["drained Poisson's ratio of 0.5"]),
        (scene(&wet, "wet", "quadratic", path), 7, &["sealed", "drained"]),
        (scene(&wet, "sealed", "linear", path), 1, &["'biphasic'", "geometry.order"]),
        (scene(&wet, "sealed", "graded", path), 1, &["'biphasic'", "geometry.order"]),
        (scene(&wet, "sealed", "quadratic", "depth_mm = 1.0"), 1, &["'biphasic'", "motion.path"]),
        (with(""), 1, &["'biphasic'", "no tissue has a table"]),
    ]);
}

/// The file may go once the scene was read: nothing reads it again.
#[test]
fn a_file_of_pressure_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("press.npy");
    let map = ndarray::Array2::from_shape_fn((224, 224), |(i, j)| {
        if (95..115).contains(&i) && (105..130).contains(&j) { 8e3_f32 } else { 0.0 }
    });
    ndarray_npy::write_npy(&file, &map).unwrap();
    let text = "[geometry]\nkind = \"fingertip\"\ndensity = \"coarse\"\norder = \"linear\"\n[pressure]\n\
                file = \"press.npy\"\n";
    let path = folder.path().join("scene.toml");
    let scene = Scene::parse(&path, text.into()).unwrap();
    std::fs::remove_file(&file).unwrap();
    let pressure = scene.pressure.as_ref().unwrap();
    let read = pressure.map_pa(&scene.folder).unwrap();
    assert_eq!(*read, map.iter().copied().collect::<Vec<_>>());
    assert!(!toml::to_string(&scene).unwrap().contains("map_pa"));
    let e = Scene::parse(&path, text.into()).unwrap_err().to_string();
    assert!(e.contains("press.npy") && e.contains(":6:"), "{e}");
    let e = Scene::parse_under(&path, text.into(), Some(read)).unwrap_err().to_string();
    assert!(e.contains("give one map"), "{e}");
}
