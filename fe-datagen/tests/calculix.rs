#![cfg(any())]
//! Decks for CalculiX from scenes, and the comparison where CalculiX is installed.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use fe_datagen::export::{Ccx, witness};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn export(scene: &Path, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fe-datagen"))
        .args(["export", "--format", "inp", "--out"])
        .args([out, scene])
        .output()
        .unwrap()
}

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name)
}

/// Lines between a keyword line that starts with `keyword` and the next one.
fn data<'a>(deck: &'a str, keyword: &str) -> Vec<&'a str> {
    let lines = deck.lines().skip_while(|l| !l.starts_with(keyword)).skip(1);
    lines.take_while(|l| !l.starts_with('*')).collect()
}

#[test]
fn a_scene_becomes_a_whole_deck() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("block.inp");
    let done = export(&shipped("layered-block.toml"), &out);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let deck = std::fs::read_to_string(&out).unwrap();
    assert_eq!(data(&deck, "*NODE, NSET=NBODY").len(), 25 * 25 * 10);
    let elements: usize = ["EEPIDERMIS", "EDERMIS", "ESUBCUTANEOUS"]
        .iter()
        .map(|set| data(&deck, &format!("*ELEMENT, TYPE=C3D8, ELSET={set}")).len())
        .sum();
    assert_eq!(elements, 24 * 24 * 9);
    assert_eq!(data(&deck, "*SURFACE, NAME=TOUCHED").len(), 24 * 24);
    assert!(data(&deck, "*SURFACE, NAME=TOUCHED")[0].ends_with(",S1"), "bricks' lower faces");
    // mu/2 and 2/K of the epidermis.
    let constants: Vec<f64> =
        data(&deck, "*HYPERELASTIC")[0].split(',').map(|v| v.parse().unwrap()).collect();
    assert!((constants[0] - 0.136 / 2.96 / 2.0).abs() < 1e-12);
    assert!((constants[1] - 2.0 * 0.12 / 0.136).abs() < 1e-11);
    // Five stored depths; the plate goes up by the last.
    assert_eq!(data(&deck, "*TIME POINTS").len(), 5);
    let travel = deck.lines().find(|l| l.starts_with("NINDENTER,3,3,")).unwrap();
    assert_eq!(travel.rsplit(',').next().unwrap().parse(), Ok(0.5));
}

#[test]
fn a_bad_scene_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, out) = (folder.path().join("bad.toml"), folder.path().join("bad.inp"));
    std::fs::write(&scene, "effects = [\"viscoelastic\"]\n").unwrap();
    let done = export(&scene, &out);
    assert_eq!(done.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&done.stderr).contains("viscoelastic"));
    assert!(!out.exists());
}

#[test]
fn the_witness_says_when_there_is_none() {
    let done = Command::new(env!("CARGO_BIN_EXE_fe-datagen"))
        .arg("witness")
        .env("PATH", "")
        .output()
        .unwrap();
    assert!(done.status.success());
    assert!(String::from_utf8_lossy(&done.stdout).contains("not run: ccx not installed"));
}

#[test]
fn calculix_agrees_where_it_is_installed() {
    let Some(ccx) = Ccx::find(None) else {
        println!("not run: ccx not installed");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let report = witness::run(&ccx, folder.path(), true, &|_| true, &mut |_, rows| {
        for row in rows.into_iter().flatten() {
            println!("{}", row.line());
        }
    });
    let failed: Vec<_> = report.rows.iter().filter(|r| !r.check.pass).map(|r| r.line()).collect();
    assert!(report.passed(), "past tolerance:\n{}", failed.join("\n"));
}
