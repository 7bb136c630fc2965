//! The verification rows that are quick enough for every test run.

use papilla_validation::verify::{self, CASES};

#[test]
fn every_quick_row_is_within_tolerance() {
    let report = verify::run(true, &|_| true, &mut |case, rows| {
        for row in rows.into_iter().flatten() {
            println!("{}", row.line());
        }
        if rows.is_some_and(<[_]>::is_empty) {
            panic!("{} gave no row", case.name);
        }
    });
    let failed: Vec<_> = report.rows.iter().filter(|r| !r.check.pass).map(|r| r.line()).collect();
    assert!(report.passed(), "past tolerance:\n{}", failed.join("\n"));
    for case in CASES.iter().filter(|c| c.quick) {
        assert!(report.rows.iter().any(|r| r.case == case.name), "{} is missing", case.name);
    }
}
