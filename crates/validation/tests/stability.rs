//! The hard cases that are quick enough for every test run: each keeps its promise.

use papilla_validation::stability::{self, CASES, Extent};

fn assert_kept(extent: Extent) {
    let report = stability::run(extent, &|_| true, &mut |case, lines| {
        for line in lines.into_iter().flatten() {
            println!("{}", line.text());
        }
        if lines.is_some_and(<[_]>::is_empty) {
            panic!("{} gave no line", case.name);
        }
    });
    let broken: Vec<_> = report.lines.iter().filter(|l| !l.kept).map(|l| l.text()).collect();
    assert!(broken.is_empty(), "promises broken:\n{}", broken.join("\n"));
    for case in CASES {
        assert!(report.lines.iter().any(|l| l.case == case.name), "{} is missing", case.name);
    }
}

#[test]
fn every_hard_case_keeps_its_promise() {
    assert_kept(Extent::Quick);
}

#[test]
#[ignore = "long: ./test --all"]
fn every_variant_of_every_hard_case_keeps_its_promise() {
    assert_kept(Extent::Usual);
}
