//! The comparison with CalculiX, where it is installed.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use papilla_studies::calculix::{self, Ccx};
use std::process::Command;

#[test]
fn the_study_says_when_there_is_no_calculix() {
    let done = Command::new(env!("CARGO_BIN_EXE_papilla-studies"))
        .arg("calculix")
        .env("PATH", "")
        .output()
        .unwrap();
    assert!(done.status.success());
    assert!(String::from_utf8_lossy(&done.stdout).contains("not run: ccx not installed"));
}

#[test]
#[ignore = "needs CalculiX: part calculix of ./test"]
fn calculix_agrees() {
    let ccx = Ccx::find(None).expect("ccx not installed (Debian: apt-get install calculix-ccx)");
    let folder = tempfile::tempdir().unwrap();
    let report = calculix::run(&ccx, folder.path(), true, &|_| true, &mut |_, rows| {
        for row in rows.into_iter().flatten() {
            println!("{}", row.line());
        }
    });
    let failed: Vec<_> = report.rows.iter().filter(|r| !r.check.pass).map(|r| r.line()).collect();
    assert!(report.passed(), "past tolerance:\n{}", failed.join("\n"));
}
