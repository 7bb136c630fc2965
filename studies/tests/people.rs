//! The comparison from end to end.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use papilla_fingertip::mesh::fingertip::Density;
use papilla_studies::people::measured::Measured;
use papilla_studies::people::report::Verdict;
use papilla_studies::people::study::{self, Materials, Options};
use std::path::Path;

fn options(only: &[&str]) -> Options {
    let only = only.iter().map(|o| (*o).to_owned()).collect();
    Options { materials: Materials::NeoHookean, finger: None, density: Density::Coarse, only }
}

fn measured(folder: &Path, figures: &str, force_n: f64) -> Measured {
    let file = folder.join("measured.toml");
    let sa1 = format!(
        "[sa1]\nsource = \"nobody\"\ncurvature_per_m = [694.0, 521.0, 340.0]\nforce_n = [{force_n}]\n\
         rate_per_s = [[80.0, 60.0, 40.0]]\n"
    );
    std::fs::write(&file, format!("{figures}\n{sa1}")).unwrap();
    Measured::read(&file).unwrap()
}

#[test]
fn a_plate_is_pressed_once_and_compared_again() {
    let folder = tempfile::tempdir().unwrap();
    let figures = "[[figure]]\nquantity = { of = \"stiffness\", force_n = 0.01, pitch_deg = 0.0 }\n\
                   value = 0.1\nsource = \"nobody\"\n\
                   [[figure]]\nquantity = { of = \"volume_lost\", to_n = 0.01, pitch_deg = 0.0 }\n\
                   at_most = 5.0\nsource = \"nobody\"\n\
                   [[figure]]\nquantity = { of = \"relaxation_time\", rank = 1 }\n\
                   value = 0.2136\nsource = \"nobody\"\n";
    let measured = measured(folder.path(), figures, 0.01);
    let out = folder.path().join("out");
    let options = options(&["plates", "relaxation"]);
    let report = study::run(&measured, &options, &out, &mut |_, _, _| ()).unwrap();
    let [stiffness, volume, time] = &report.rows[..] else { panic!("{:?}", report.rows) };
    // A finger under a hundredth of a newton is soft, and loses next to nothing of its volume.
    assert!((0.01..1.0).contains(&stiffness.here.unwrap()), "{stiffness:?}");
    assert!((0.0..0.1).contains(&volume.here.unwrap()), "{volume:?}");
    assert_eq!(volume.verdict, Verdict::Ok);
    assert_eq!(time.verdict, Verdict::TimesPeople(1.0));
    let [plate] = &report.plates[..] else { panic!("{:?}", report.plates) };
    let rises = |v: &[f64]| v.windows(2).all(|w| w[0] < w[1]);
    assert!(rises(&plate.path.force_n) && rises(&plate.area_mm2), "{plate:?}");
    // Skin that touches carries the force: the mean pressure is a part of its modulus.
    let mean_mpa = plate.path.deepest().0 / plate.area_mm2.last().unwrap();
    assert!((1e-4..0.05).contains(&mean_mpa), "{mean_mpa} MPa");
    // Nothing is solved again: the processor time of the first run comes back.
    let again = study::run(&measured, &options, &out, &mut |_, _, _| ()).unwrap();
    assert_eq!(again.plates[0].solve_s.to_bits(), plate.solve_s.to_bits());
    assert!(out.join("human.md").exists() && out.join("force.svg").exists());
}
