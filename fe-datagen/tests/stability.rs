//! The hard cases that are quick enough for every test run: each keeps its promise, but for
//! those that are known not to.

use fe_datagen::stability::{self, CASES};

/// Case and variant of promises that are known to be broken; docs/stability.md says why.
const KNOWN: &[(&str, &str)] = &[("sharp-wedge", "block, on a row of nodes, tip 0.005 mm")];

#[test]
fn every_hard_case_keeps_its_promise() {
    let report = stability::run(false, &|_| true, &mut |case, lines| {
        for line in lines.into_iter().flatten() {
            println!("{}", line.text());
        }
        if lines.is_some_and(<[_]>::is_empty) {
            panic!("{} gave no line", case.name);
        }
    });
    let known = |l: &&stability::Line| KNOWN.contains(&(l.case, l.variant.as_str()));
    let broken: Vec<_> =
        report.lines.iter().filter(|l| !l.kept && !known(l)).map(|l| l.text()).collect();
    assert!(broken.is_empty(), "promises broken:\n{}", broken.join("\n"));
    // What has been mended comes off the list.
    assert_eq!(report.lines.iter().filter(|l| l.kept && known(l)).count(), 0);
    for case in CASES {
        assert!(report.lines.iter().any(|l| l.case == case.name), "{} is missing", case.name);
    }
}
